//! The device of the viewer, and how buffers, textures and readbacks are made.

use std::sync::Arc;

use hiz_core::headless::INSTALL_HINT;
use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{HizContext, ImageSize};

use crate::Failure;

/// A device with its queue, and what it can do.
#[derive(Debug)]
pub(crate) struct Gpu {
    pub(crate) adapter: wgpu::AdapterInfo,
    /// For what a window can show.
    pub(crate) adapter_handle: wgpu::Adapter,
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
}

/// Whether wgpu checks the arguments of indirect draws by a compute pass of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum IndirectChecks {
    /// As wgpu has it by default.
    On,
    /// Left out: the arguments come from `hiz_core`, and are right.
    Off,
}

/// wgpu's entry point, for Vulkan alone.
pub(crate) fn instance(checks: IndirectChecks) -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    descriptor
        .flags
        .set(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL, checks == IndirectChecks::On);
    wgpu::Instance::new(descriptor)
}

impl Gpu {
    /// Opens a Vulkan device, one that can show `surface` if there is one.
    ///
    /// `$HIZVK_ADAPTER` chooses the adapter by its index or by a part of its description.
    /// Without it a GPU comes before a software driver.
    ///
    /// # Errors
    /// If no adapter fits, with the adapters that were seen.
    pub(crate) fn open(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
    ) -> Result<Arc<Self>, Failure> {
        // Packed lists need the first, and the second saves records without a draw.
        // The third is for the times of stages.
        let useful = wgpu::Features::INDIRECT_FIRST_INSTANCE
            | wgpu::Features::MULTI_DRAW_INDIRECT_COUNT
            | wgpu::Features::TIMESTAMP_QUERY;
        Self::with_features(instance, surface, useful)
    }

    /// [`Gpu::open`] with those of the features that the adapter has.
    pub(crate) fn with_features(
        instance: &wgpu::Instance,
        surface: Option<&wgpu::Surface<'_>>,
        useful: wgpu::Features,
    ) -> Result<Arc<Self>, Failure> {
        let wanted = std::env::var("HIZVK_ADAPTER").unwrap_or_default().to_lowercase();
        let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
        let seen: Vec<_> = adapters.iter().map(|a| a.get_info().name).collect();
        let is_wanted = |i: usize, adapter: &wgpu::Adapter| match wanted.parse::<usize>() {
            Ok(index) => i == index,
            Err(_) => format!("{:?}", adapter.get_info()).to_lowercase().contains(&wanted),
        };
        let rank = |adapter: &wgpu::Adapter| match adapter.get_info().device_type {
            wgpu::DeviceType::DiscreteGpu => 0,
            wgpu::DeviceType::IntegratedGpu => 1,
            wgpu::DeviceType::VirtualGpu => 2,
            _ => 3,
        };
        let adapter = adapters
            .into_iter()
            .enumerate()
            .filter(|(i, a)| is_wanted(*i, a) && surface.is_none_or(|s| a.is_surface_supported(s)))
            .map(|(_, adapter)| adapter)
            .min_by_key(rank)
            .ok_or_else(|| {
                format!("no Vulkan adapter fits ({}); {INSTALL_HINT}", seen.join(", "))
            })?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("viewer.device"),
            required_features: HizContext::required_features() | (adapter.features() & useful),
            required_limits: wgpu::Limits {
                // The vertices of the castle are more than 128 MiB in no scene, but close to it.
                max_buffer_size: adapter.limits().max_buffer_size,
                ..HizContext::required_limits()
            },
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|error| format!("{}: {error}", adapter.get_info().name))?;
        Ok(Arc::new(Self { adapter: adapter.get_info(), adapter_handle: adapter, device, queue }))
    }

    /// The adapter and its driver, in words.
    pub(crate) fn words(&self) -> String {
        let wgpu::AdapterInfo { name, driver, driver_info, .. } = &self.adapter;
        format!("{name} ({driver} {driver_info})")
    }

    pub(crate) fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    pub(crate) fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.queue.submit([encoder.finish()]);
    }

    /// Submits and waits until the device is idle.
    pub(crate) fn submit_and_wait(&self, encoder: wgpu::CommandEncoder) -> Result<(), Failure> {
        self.submit(encoder);
        self.wait()
    }

    pub(crate) fn wait(&self) -> Result<(), Failure> {
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    pub(crate) fn buffer<T: bytemuck::NoUninit>(
        &self,
        label: &str,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> wgpu::Buffer {
        let contents = bytemuck::cast_slice(contents);
        // wgpu binds no empty buffers.
        let contents = if contents.is_empty() { &[0; 32] } else { contents };
        let label = Some(label);
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    }

    pub(crate) fn empty(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    pub(crate) fn texture(
        &self,
        label: &str,
        size: ImageSize,
        samples: u32,
        format: wgpu::TextureFormat,
    ) -> wgpu::Texture {
        let mut usage =
            wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
        if samples == 1 {
            usage |= wgpu::TextureUsages::COPY_SRC;
        }
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width: size.width,
                height: size.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// A bind group of `layout` that binds `resources` from binding 0 on.
    pub(crate) fn bind_group(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = resources
            .iter()
            .zip(0..)
            .map(|(resource, binding)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let label = Some(label);
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label,
            layout,
            entries: &entries,
        })
    }

    /// The bytes of a buffer with the usage `COPY_SRC`.
    pub(crate) fn read_buffer(&self, source: &wgpu::Buffer) -> Result<Vec<u8>, Failure> {
        self.read(source.size(), |encoder, staging| {
            encoder.copy_buffer_to_buffer(source, 0, staging, 0, source.size());
        })
    }

    /// The bytes of a texture with one sample per texel, without padding.
    pub(crate) fn read_texture(&self, texture: &wgpu::Texture) -> Result<Vec<u8>, Failure> {
        let texel = texture
            .format()
            .block_copy_size(Some(wgpu::TextureAspect::All))
            .ok_or("a texture that cannot be copied")?;
        let row = texel * texture.width();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let size = u64::from(padded) * u64::from(texture.height());
        let bytes = self.read(size, |encoder, staging| {
            let layout = wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            };
            let target = wgpu::TexelCopyBufferInfo { buffer: staging, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        })?;
        let rows = bytes.chunks_exact(padded as usize);
        Ok(rows.flat_map(|line| &line[..row as usize]).copied().collect())
    }

    /// Copies into a staging buffer, waits, and maps the buffer.
    fn read(
        &self,
        size: u64,
        copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
    ) -> Result<Vec<u8>, Failure> {
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let staging = self.empty("viewer.staging", size, usage);
        let mut encoder = self.encoder("viewer.read");
        copy(&mut encoder, &staging);
        self.submit(encoder);
        let (told, answer) = std::sync::mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |mapped| drop(told.send(mapped)));
        self.wait()?;
        answer.recv()??;
        Ok(staging.get_mapped_range(..)?.to_vec())
    }
}
