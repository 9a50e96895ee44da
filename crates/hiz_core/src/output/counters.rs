//! Layouts of the counters on the device.

/// Numbers of instances per verdict.
/// Twin: `shaders/cull/count.wgsl`, `Counters`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CounterRecord {
    pub(crate) outside: u32,
    pub(crate) occluded: u32,
    pub(crate) visible: u32,
    pub(crate) invalid: u32,
    pub(crate) unoccluded: u32,
}

/// Tests per level, and texels read as a 64-bit number in two halves.
/// Twin: `shaders/output/statistics.wgsl`, `Statistics`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StatisticsRecord {
    pub(crate) levels: [u32; 16],
    pub(crate) texels_low: u32,
    pub(crate) texels_high: u32,
}
