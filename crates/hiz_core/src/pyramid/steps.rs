//! The steps of a pyramid's reductions: what each of them binds.

use std::mem::offset_of;

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::{Copy, Numbers, STAGING_BYTES, UNIFORM_ALIGNMENT};
use crate::pyramid::blocks::Blocks;
use crate::pyramid::layout::Step;

/// The binding of one step.
pub(super) const STEP_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Uniform)];

/// Twin of `Step` in `shaders/pyramid/pyramid_write.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StepUniform {
    pub(crate) source: u32,
    pub(crate) last: u32,
    pub(crate) end: [u32; 2],
    pub(crate) begin: [u32; 2],
    pub(crate) origin: [u32; 2],
    pub(crate) reduction: u32,
    pub(crate) base: u32,
    pub(crate) padding: [u32; 2],
}

const UNIFORM_BYTES: usize = size_of::<StepUniform>();
const _: () = assert!(UNIFORM_BYTES == 48);

/// The most steps that a pyramid has: one for three levels each, or one for a coarse level first.
const MOST_STEPS: usize = 6;
const _: () = assert!(MOST_STEPS * UNIFORM_BYTES <= STAGING_BYTES as usize);

/// The numbers of one recording.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recording {
    /// The number of the reduction, for the header.
    pub(super) reduction: u32,
    /// The number of the reduction of which it renews a part; 0: it renews everything.
    pub(super) base: u32,
    /// Where level 0 begins in its texture.
    pub(super) origin: [u32; 2],
}

impl StepUniform {
    /// The numbers of a step that reads `blocks`, without those of a recording.
    fn of(step: &Step, blocks: &Blocks) -> Self {
        Self {
            source: step.source,
            last: step.last,
            end: blocks.end,
            begin: blocks.begin,
            origin: [0; 2],
            reduction: 0,
            base: 0,
            padding: [0; 2],
        }
    }

    /// The same for one recording; a step that reads the depth image writes the header.
    fn recorded(self, numbers: &Recording) -> Self {
        if self.source > 0 {
            return self;
        }
        let Recording { reduction, base, origin } = *numbers;
        Self { origin, reduction, base, ..self }
    }
}

/// What the steps of a pyramid's reductions bind.
#[derive(Debug)]
pub(crate) struct Steps {
    /// A [`StepUniform`] at each multiple of [`UNIFORM_ALIGNMENT`].
    uniform: wgpu::Buffer,
    pub(super) bindings: Vec<wgpu::BindGroup>,
}

impl Steps {
    pub(super) fn new(gpu: &Gpu, steps: &[Step]) -> Result<Self> {
        debug_assert!(steps.len() <= MOST_STEPS, "{} steps", steps.len());
        let stride = UNIFORM_ALIGNMENT as usize;
        let mut contents = vec![0; stride * steps.len().max(1)];
        for (place, step) in contents.chunks_exact_mut(stride).zip(steps) {
            place[..UNIFORM_BYTES]
                .copy_from_slice(bytemuck::bytes_of(&StepUniform::of(step, &Blocks::all(step))));
        }
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform = gpu.filled("hiz.reduce.steps", &contents, usage)?;
        let layout = gpu.layout("hiz.reduce.step_layout", STEP_BINDINGS)?;
        let bind = |step: usize| {
            let part = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer: &uniform,
                offset: step as u64 * UNIFORM_ALIGNMENT,
                size: wgpu::BufferSize::new(UNIFORM_BYTES as u64),
            });
            gpu.bind_group("hiz.reduce.step", &layout, &[entry(0, part)])
        };
        let bindings = (0..steps.len()).map(bind).collect::<Result<_>>()?;
        Ok(Self { uniform, bindings })
    }

    /// Stages what a reduction of everything changes: the numbers of the steps that read the image.
    pub(super) fn numbers(gpu: &Gpu, steps: &[Step], recording: &Recording) -> Result<Staged> {
        let mut staged = Staged::default();
        for (place, step) in steps.iter().enumerate().filter(|(_, step)| step.source == 0) {
            let uniform = StepUniform::of(step, &Blocks::all(step)).recorded(recording);
            staged.add(place, &uniform);
        }
        staged.write(gpu)
    }

    /// Stages all that a reduction of a part changes: the blocks of every step, too.
    pub(super) fn numbers_of_part(
        gpu: &Gpu,
        steps: &[Step],
        blocks: &[Blocks],
        recording: &Recording,
    ) -> Result<Staged> {
        let mut staged = Staged::default();
        for (place, (step, blocks)) in steps.iter().zip(blocks).enumerate() {
            staged.add(place, &StepUniform::of(step, blocks).recorded(recording));
        }
        staged.write(gpu)
    }

    /// Records the copies of a recording's numbers into the uniforms of its steps.
    ///
    /// `header`: the chunk that begins with the number of the reduction, if it renews everything.
    /// A reduction of a part writes its own header.
    pub(super) fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        staged: Staged,
        header: Option<&wgpu::Buffer>,
    ) {
        let Some(numbers) = staged.numbers else { return };
        let mut copies: Vec<_> = (0..)
            .zip(&staged.places)
            .map(|(i, place)| Copy {
                from: i * UNIFORM_BYTES as u64,
                target: &self.uniform,
                to: *place as u64 * UNIFORM_ALIGNMENT,
                size: UNIFORM_BYTES as u64,
            })
            .collect();
        // The first step reads the depth image, so its uniform has the number.
        let from = offset_of!(StepUniform, reduction) as u64;
        copies.extend(header.map(|target| Copy { from, target, to: 0, size: 4 }));
        numbers.record(encoder, &copies);
    }
}

/// The uniforms of some steps, on their way to the device.
#[derive(Debug, Default)]
pub(super) struct Staged {
    places: Vec<usize>,
    bytes: Vec<u8>,
    numbers: Option<Numbers>,
}

impl Staged {
    fn add(&mut self, place: usize, uniform: &StepUniform) {
        self.places.push(place);
        self.bytes.extend_from_slice(bytemuck::bytes_of(uniform));
    }

    fn write(self, gpu: &Gpu) -> Result<Self> {
        let numbers = Some(gpu.numbers(&self.bytes)?);
        Ok(Self { numbers, ..self })
    }
}
