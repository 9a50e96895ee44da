//! The steps of a pyramid's reductions: what each of them binds.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::{Copy, Numbers, UNIFORM_ALIGNMENT};
use crate::pyramid::layout::Step;

/// The binding of one step.
pub(super) const STEP_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Uniform)];

/// Twin of `Step` in `shaders/pyramid/pyramid_write.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StepUniform {
    pub(crate) source: u32,
    pub(crate) last: u32,
    pub(crate) reduction: u32,
    pub(crate) padding: u32,
    pub(crate) blocks: [u32; 2],
    pub(crate) padding_1: [u32; 2],
}

const _: () = assert!(size_of::<StepUniform>() == 32);

impl StepUniform {
    /// The numbers of a step, without that of a reduction.
    fn of(step: &Step) -> Self {
        Self {
            source: step.source,
            last: step.last,
            reduction: 0,
            padding: 0,
            blocks: step.blocks,
            padding_1: [0; 2],
        }
    }
}

/// What the steps of a pyramid's reductions bind.
/// Only the number of the reduction changes, and each recording copies its own.
#[derive(Debug)]
pub(crate) struct Steps {
    /// A [`StepUniform`] at each multiple of [`UNIFORM_ALIGNMENT`].
    uniform: wgpu::Buffer,
    pub(super) bindings: Vec<wgpu::BindGroup>,
}

impl Steps {
    pub(super) fn new(gpu: &Gpu, steps: &[Step]) -> Result<Self> {
        let stride = UNIFORM_ALIGNMENT as usize;
        let mut contents = vec![0; stride * steps.len().max(1)];
        for (place, step) in contents.chunks_exact_mut(stride).zip(steps) {
            place[..size_of::<StepUniform>()]
                .copy_from_slice(bytemuck::bytes_of(&StepUniform::of(step)));
        }
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform = gpu.filled("hiz.reduce.steps", &contents, usage)?;
        let layout = gpu.layout("hiz.reduce.step_layout", STEP_BINDINGS)?;
        let bind = |step: usize| {
            let part = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &uniform,
                offset: step as u64 * UNIFORM_ALIGNMENT,
                size: wgpu::BufferSize::new(size_of::<StepUniform>() as u64),
            });
            gpu.bind_group("hiz.reduce.step", &layout, &[entry(0, part)])
        };
        let bindings = (0..steps.len()).map(bind).collect::<Result<_>>()?;
        Ok(Self { uniform, bindings })
    }

    /// Records the copies of `number`, that of a reduction, to the steps that write the header.
    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        steps: &[Step],
        number: Numbers,
    ) {
        const FIELD: u64 = std::mem::offset_of!(StepUniform, reduction) as u64;
        let writes_header = steps.iter().enumerate().filter(|(_, step)| step.source == 0);
        let copies: Vec<_> = writes_header
            .map(|(step, _)| Copy {
                from: 0,
                target: &self.uniform,
                to: step as u64 * UNIFORM_ALIGNMENT + FIELD,
                size: number.len(),
            })
            .collect();
        number.record(encoder, &copies);
    }
}
