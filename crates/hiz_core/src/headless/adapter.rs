//! The adapters of this machine, and how one is chosen.

use crate::error::Error;

/// The environment variable that chooses an adapter: an index, or part of a name, driver or
/// graphics API.
pub const ADAPTER_VARIABLE: &str = "HIZVK_ADAPTER";

/// How to get a driver: the advice if there is no adapter at all.
pub const INSTALL_HINT: &str = if cfg!(all(feature = "vulkan", target_os = "linux")) {
    "A software Vulkan driver: apt install libvulkan1 mesa-vulkan-drivers"
} else if cfg!(all(feature = "metal", target_vendor = "apple")) {
    "Metal is part of macOS; use a session that may use the GPU"
} else if cfg!(all(feature = "dx12", windows)) {
    "Install the driver of the GPU, which brings Vulkan and Direct3D 12"
} else {
    "Install the driver of a GPU"
};

/// An adapter, described as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its index in [`adapters`].
    pub index: usize,
    /// The name of the GPU.
    pub name: String,
    /// The driver's name.
    pub driver: String,
    /// The driver's version.
    pub driver_info: String,
    /// The graphics API.
    pub backend: String,
    /// `discrete_gpu`, `integrated_gpu`, `virtual_gpu`, `cpu` or `other`.
    pub device_type: String,
}

impl AdapterSummary {
    fn new(index: usize, info: &wgpu::AdapterInfo) -> Self {
        let device_type = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete_gpu",
            wgpu::DeviceType::IntegratedGpu => "integrated_gpu",
            wgpu::DeviceType::VirtualGpu => "virtual_gpu",
            wgpu::DeviceType::Cpu => "cpu",
            wgpu::DeviceType::Other => "other",
        };
        Self {
            index,
            name: info.name.clone(),
            driver: info.driver.clone(),
            driver_info: info.driver_info.clone(),
            backend: info.backend.to_string(),
            device_type: device_type.to_owned(),
        }
    }

    /// The rank of the adapter; lower is better.
    /// Real GPUs come first, and Vulkan comes before what stands in for it on the same GPU.
    pub(super) fn rank(&self) -> (usize, usize) {
        let place = |order: &[&str], of: &str| {
            order.iter().position(|known| *known == of).unwrap_or(order.len())
        };
        (
            place(&["discrete_gpu", "integrated_gpu", "virtual_gpu", "cpu"], &self.device_type),
            place(&["vulkan", "metal", "dx12"], &self.backend),
        )
    }

    pub(super) fn matches(&self, request: &str) -> bool {
        // Digits are an index and nothing else, because "1" is also part of many versions.
        if let Ok(index) = request.parse::<usize>() {
            return index == self.index;
        }
        let request = request.to_lowercase();
        [&self.name, &self.driver, &self.driver_info, &self.backend]
            .iter()
            .any(|text| text.to_lowercase().contains(&request))
    }
}

impl std::fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {} {})", self.name, self.device_type, self.driver, self.driver_info)
    }
}

/// The error of a request that no adapter fits.
/// Its hint says how to choose one of the adapters `seen`, or how to get one.
pub(super) fn no_adapter(request: String, seen: &[AdapterSummary]) -> Error {
    let hint = if seen.is_empty() {
        INSTALL_HINT.to_owned()
    } else {
        format!(
            "Choose one of these by its number, or by a part of its name or driver, as an argument \
             or in {ADAPTER_VARIABLE}; without both the best one is taken. One that is missing has \
             no driver here for the backends of this build"
        )
    };
    let seen = seen.iter().map(|summary| format!("{}: {summary}", summary.index)).collect();
    Error::NoAdapter { request, seen, hint }
}

/// The backends that this crate was built with.
/// Any other would silently take over if a driver is missing.
fn backends() -> wgpu::Backends {
    let built = [
        (cfg!(feature = "vulkan"), wgpu::Backends::VULKAN),
        (cfg!(feature = "metal"), wgpu::Backends::METAL),
        (cfg!(feature = "dx12"), wgpu::Backends::DX12),
    ];
    built.into_iter().filter_map(|(is_built, backend)| is_built.then_some(backend)).collect()
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = backends();
    // wgpu checks the arguments of an indirect dispatch by a dispatch of its own.
    // Those of a cull in groups are counted by this crate's shaders, at most one for each box of a
    // piece, which `Piece` keeps within the device's limits.
    // A debug build checks them all the same.
    let checks = wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL;
    descriptor.flags.set(checks, cfg!(debug_assertions));
    wgpu::Instance::new(descriptor)
}

pub(super) fn enumerate() -> Vec<(AdapterSummary, wgpu::Adapter)> {
    pollster::block_on(instance().enumerate_adapters(backends()))
        .into_iter()
        .enumerate()
        .map(|(i, adapter)| (AdapterSummary::new(i, &adapter.get_info()), adapter))
        .collect()
}

/// The adapters of this machine that the built backends find; an empty list without a driver.
pub fn adapters() -> Vec<AdapterSummary> {
    enumerate().into_iter().map(|(summary, _)| summary).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn adapter(index: usize, device_type: &str, backend: &str) -> AdapterSummary {
        AdapterSummary {
            index,
            name: "an adapter".to_owned(),
            driver: String::new(),
            driver_info: String::new(),
            backend: backend.to_owned(),
            device_type: device_type.to_owned(),
        }
    }

    #[test]
    fn gpus_come_before_drivers_and_vulkan_before_its_stand_ins() {
        // What a Windows machine may list: each GPU twice, and a software driver of each interface.
        let mut found = [
            adapter(0, "cpu", "vulkan"),
            adapter(1, "other", "vulkan"),
            adapter(2, "integrated_gpu", "dx12"),
            adapter(3, "cpu", "dx12"),
            adapter(4, "discrete_gpu", "dx12"),
            adapter(5, "integrated_gpu", "vulkan"),
            adapter(6, "discrete_gpu", "vulkan"),
        ];
        found.sort_by_key(|one| (one.rank(), one.index));
        assert_eq!(found.map(|one| one.index), [6, 4, 5, 2, 0, 3, 1]);
    }

    #[test]
    fn an_interface_can_be_asked_for() {
        let wanted = adapter(4, "discrete_gpu", "dx12");
        assert!(wanted.matches("dx12"));
        assert!(wanted.matches("4"));
        assert!(!wanted.matches("vulkan"));
    }

    #[test]
    fn backends_have_the_names_that_are_ranked() {
        let names = [wgpu::Backend::Vulkan, wgpu::Backend::Metal, wgpu::Backend::Dx12];
        assert_eq!(names.map(|backend| backend.to_string()), ["vulkan", "metal", "dx12"]);
    }
}
