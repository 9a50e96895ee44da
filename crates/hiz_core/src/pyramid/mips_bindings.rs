//! What the passes of a mip texture bind, except for the depth image.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::pyramid::levels::{Level, MAX_LEVELS};
use crate::pyramid::mips_plan::{MipBand, MipPlan, MipStep};

/// Twin of `Mips` in `shaders/pyramid/mips.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct MipsUniform {
    pub(crate) levels: [Level; MAX_LEVELS],
    pub(crate) origin: [u32; 2],
    pub(crate) padding: [u32; 2],
}

const _: () = assert!(size_of::<MipsUniform>() == 272);

/// Twin of `MipStep` in `shaders/pyramid/mips.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct MipStepUniform {
    pub(crate) source: u32,
    pub(crate) last: u32,
    pub(crate) first: u32,
    pub(crate) rows: u32,
}

const _: () = assert!(size_of::<MipStepUniform>() == 16);

/// The binding of a step or a band.
pub(super) const STEP_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Uniform)];

/// The list of texels, the layout, and a bind group for each step and each band.
#[derive(Debug)]
pub(super) struct MipBindings {
    pub(super) list: wgpu::Buffer,
    pub(super) uniform: wgpu::Buffer,
    pub(super) steps: Vec<wgpu::BindGroup>,
    pub(super) bands: Vec<wgpu::BindGroup>,
}

impl MipBindings {
    pub(super) fn new(gpu: &Gpu, plan: &MipPlan) -> Result<Self> {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let mut levels = [Level { offset: 0, stride: 0, width: 0, height: 0 }; MAX_LEVELS];
        levels[..plan.levels.len()].copy_from_slice(&plan.levels);
        let contents = MipsUniform { levels, origin: [0; 2], padding: [0; 2] };
        let uniform_usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let contents = bytemuck::bytes_of(&contents);
        let layout = gpu.layout("hiz.mips.step_layout", STEP_BINDINGS)?;
        let bind = |numbers: MipStepUniform| {
            let uniform = gpu.uniform("hiz.mips.step", &numbers)?;
            gpu.bind_group("hiz.mips.step", &layout, &[entry(0, uniform.as_entire_binding())])
        };
        let step =
            |s: &MipStep| MipStepUniform { source: s.source, last: s.last, first: 0, rows: 0 };
        let band =
            |b: &MipBand| MipStepUniform { source: 0, last: 0, first: b.first, rows: b.rows };
        Ok(Self {
            list: gpu.empty("hiz.mips.list", plan.bytes.max(256), usage)?,
            uniform: gpu.filled("hiz.mips.layout", contents, uniform_usage)?,
            steps: plan.steps.iter().map(|s| bind(step(s))).collect::<Result<_>>()?,
            bands: plan.bands.iter().map(|b| bind(band(b))).collect::<Result<_>>()?,
        })
    }
}
