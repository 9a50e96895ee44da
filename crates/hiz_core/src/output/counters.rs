//! Counters on the device.

/// `shaders/cull/count.wgsl`, `Counters`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CounterRecord {
    pub(crate) outside: u32,
    pub(crate) occluded: u32,
    pub(crate) visible: u32,
    pub(crate) invalid: u32,
}

/// `shaders/output/report.wgsl`, `Statistics`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StatisticsRecord {
    pub(crate) levels: [u32; 16],
    pub(crate) texels_low: u32,
    pub(crate) texels_high: u32,
}
