//! The passes that make lists and draw arguments of bit planes; `shaders/output/emit.wgsl`.

use crate::error::Result;
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::layouts::Binding::{Read, Uniform, Write};
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{File, Source, wgsl};
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::bins::{Arrangement, BLOCK_WORDS, Bins, PieceBins, PlaneSet};

/// Invocations of a workgroup; `shaders/output/emit_prefix.wgsl`, `emit_scatter.wgsl`,
/// `emit_instances.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;
/// Meshes of an invocation of the passes over bins; `shaders/output/emit_prefix.wgsl`.
pub(crate) const MESHES: u32 = 8;

/// A pass: its label, shader, entry points and bindings.
#[derive(Debug, Clone, Copy)]
struct Pass {
    label: &'static str,
    module: fn(PlaneSet) -> Source,
    bindings: &'static [(u32, Binding)],
}

fn module(files: &[File]) -> Source {
    Source::of(&[&[wgsl!("instances/piece"), wgsl!("output/emit")], files])
}

fn planes_module(set: PlaneSet, files: &[File]) -> Source {
    let planes = match set {
        PlaneSet::One => wgsl!("output/planes_one"),
        PlaneSet::Four => wgsl!("output/planes_four"),
    };
    module(&[&[planes, wgsl!("output/emit_planes")], files].concat())
}

/// The shader that counts bits.
pub(crate) fn scan_module(set: PlaneSet) -> Source {
    planes_module(set, &[wgsl!("output/emit_prefix"), wgsl!("output/emit_scan")])
}

/// The shader that finds the bins.
pub(crate) fn bins_module(set: PlaneSet) -> Source {
    let files =
        [wgsl!("output/emit_prefix"), wgsl!("output/emit_record"), wgsl!("output/emit_bins")];
    planes_module(set, &files)
}

/// The shader that writes the draws of bins that are not empty; planes do not matter to it.
pub(crate) fn draws_module(_: PlaneSet) -> Source {
    let files =
        [wgsl!("output/emit_prefix"), wgsl!("output/emit_record"), wgsl!("output/emit_draws")];
    module(&files)
}

/// The shader that writes the indices of bins.
pub(crate) fn scatter_module(set: PlaneSet) -> Source {
    planes_module(set, &[wgsl!("output/emit_scatter")])
}

/// The shader that writes an index and a draw for each instance.
pub(crate) fn instances_module(set: PlaneSet) -> Source {
    planes_module(set, &[wgsl!("output/emit_record"), wgsl!("output/emit_instances")])
}

/// The shader that cuts the mask to what is listed.
pub(crate) fn cut_module(set: PlaneSet) -> Source {
    planes_module(set, &[wgsl!("output/emit_cut")])
}

const SCAN: Pass = Pass {
    label: "hiz.emit.scan",
    module: scan_module,
    bindings: &[(0, Uniform), (1, Read), (2, Write), (3, Write), (4, Write), (5, Write)],
};

const BINS: Pass = Pass {
    label: "hiz.emit.bins",
    module: bins_module,
    bindings: &[
        (0, Uniform),
        (1, Read),
        (2, Read),
        (3, Read),
        (4, Read),
        (5, Read),
        (6, Write),
        (7, Read),
        (8, Write),
    ],
};

const DRAWS: Pass = Pass {
    label: "hiz.emit.draws",
    module: draws_module,
    bindings: &[(0, Uniform), (1, Read), (2, Read), (3, Write), (4, Write)],
};

const SCATTER: Pass = Pass {
    label: "hiz.emit.scatter",
    module: scatter_module,
    bindings: &[
        (0, Uniform),
        (1, Read),
        (2, Read),
        (3, Read),
        (4, Read),
        (5, Read),
        (6, Read),
        (7, Read),
        (8, Write),
    ],
};

const INSTANCES: Pass = Pass {
    label: "hiz.emit.instances",
    module: instances_module,
    bindings: &[
        (0, Uniform),
        (1, Read),
        (2, Read),
        (3, Read),
        (4, Read),
        (5, Read),
        (6, Read),
        (7, Write),
        (8, Write),
    ],
};

impl Pass {
    fn pipeline(
        &self,
        gpu: &Gpu,
        bins: &Bins,
        entry_point: &'static str,
        constants: &[(&'static str, f64)],
    ) -> Result<wgpu::ComputePipeline> {
        gpu.compute_pipeline(&Compute {
            label: self.label,
            source: (self.module)(bins.plane_set()),
            entry_point,
            layouts: &[gpu.layout(self.label, self.bindings)?],
            constants,
        })
    }

    /// Binds the buffers from binding 1 on, and the piece's uniform at binding 0.
    fn bind(
        &self,
        gpu: &Gpu,
        uniform: &wgpu::Buffer,
        buffers: &[&wgpu::Buffer],
    ) -> Result<wgpu::BindGroup> {
        let all = [uniform].into_iter().chain(buffers.iter().copied());
        let entries: Vec<_> =
            (0..).zip(all).map(|(i, buffer)| entry(i, buffer.as_entire_binding())).collect();
        gpu.bind_group(self.label, &gpu.layout(self.label, self.bindings)?, &entries)
    }
}

/// A dispatch of one piece.
#[derive(Debug)]
struct Step {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    workgroups: [u32; 2],
}

/// The dispatches that make the lists and draws of all pieces.
#[derive(Debug)]
pub(crate) struct Emission {
    steps: Vec<Step>,
}

impl Emission {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, bins: &Bins) -> Result<Self> {
        let mut steps = Vec::new();
        for (piece, output) in instances.pieces.iter().zip(&bins.pieces) {
            add_scan(gpu, bins, output, &mut steps)?;
            match bins.arrangement {
                Arrangement::Packed | Arrangement::Reserved => {
                    add_bins(gpu, bins, piece, output, &mut steps)?;
                }
                Arrangement::Instances => add_instances(gpu, bins, piece, output, &mut steps)?,
            }
        }
        Ok(Self { steps })
    }

    /// Records all dispatches; pieces go in order, since each needs what earlier ones have written.
    /// `idle`: as `CullInputs::idle`.
    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass<'_>, idle: bool) {
        for step in &self.steps {
            pass.set_pipeline(&step.pipeline);
            pass.set_bind_group(0, &step.bindings, &[]);
            let [x, y] = step.workgroups;
            pass.dispatch_workgroups(if idle { 0 } else { x }, y, 1);
        }
    }
}

fn is_by_index(bins: &Bins) -> bool {
    bins.arrangement == Arrangement::Instances
}

fn add_scan(gpu: &Gpu, bins: &Bins, piece: &PieceBins, steps: &mut Vec<Step>) -> Result<()> {
    let by_index = is_by_index(bins);
    let bindings = made(&piece.passes[0], || {
        let buffers =
            [&piece.planes, &piece.before, &piece.blocks, &bins.totals, &bins.draw_counts];
        SCAN.bind(gpu, &piece.uniform, &buffers)
    })?;
    let sets = if by_index { 1 } else { bins.sets() };
    let constants = [("BY_INDEX", flag(by_index))];
    let points = [("emit_block", [piece.words.div_ceil(BLOCK_WORDS), sets]), ("emit_top", [1, 1])];
    for (entry_point, workgroups) in points {
        let pipeline = SCAN.pipeline(gpu, bins, entry_point, &constants)?;
        steps.push(Step { pipeline, bindings: bindings.clone(), workgroups });
    }
    Ok(())
}

fn add_bins(
    gpu: &Gpu,
    bins: &Bins,
    piece: &Piece,
    output: &PieceBins,
    steps: &mut Vec<Step>,
) -> Result<()> {
    let PieceBins { planes, before, blocks, uniform, .. } = output;
    let of_meshes = [bins.meshes.len().div_ceil(WORKGROUP * MESHES), 1];
    let is_reserved = bins.arrangement == Arrangement::Reserved;
    let (reserved, indexed) =
        (("RESERVED", flag(is_reserved)), ("INDEXED", flag(bins.meshes.is_indexed())));
    let bindings = made(&output.passes[1], || {
        let templates = bins.meshes.templates();
        let buffers = [
            planes,
            before,
            blocks,
            &bins.totals,
            &output.starts_buffer,
            &output.bins,
            templates,
            &bins.draws,
        ];
        BINS.bind(gpu, uniform, &buffers)
    })?;
    steps.push(Step {
        pipeline: BINS.pipeline(gpu, bins, "emit_bins", &[reserved, indexed])?,
        bindings: bindings.clone(),
        workgroups: of_meshes,
    });
    if !is_reserved {
        let bindings = made(&output.passes[2], || {
            let buffers = [bins.meshes.templates(), &output.bins, &bins.draws, &bins.draw_counts];
            DRAWS.bind(gpu, uniform, &buffers)
        })?;
        steps.push(Step {
            pipeline: DRAWS.pipeline(gpu, bins, "emit_draws", &[indexed])?,
            bindings: bindings.clone(),
            workgroups: of_meshes,
        });
    }
    let Some(list) = &output.list else { return Ok(()) };
    let slots = piece.slots.as_ref();
    let bindings = made(&output.passes[3], || {
        let [index_of, mesh_of] = slot_buffers(gpu, piece)?;
        let buffers =
            [planes, before, blocks, &bins.totals, &output.bins, &index_of, &mesh_of, list];
        SCATTER.bind(gpu, uniform, &buffers)
    })?;
    let constants = [reserved, ("SORTED", flag(slots.is_some()))];
    steps.push(Step {
        pipeline: SCATTER.pipeline(gpu, bins, "emit_scatter", &constants)?,
        bindings: bindings.clone(),
        workgroups: [output.words.div_ceil(WORKGROUP), bins.sets()],
    });
    Ok(())
}

fn add_instances(
    gpu: &Gpu,
    bins: &Bins,
    piece: &Piece,
    output: &PieceBins,
    steps: &mut Vec<Step>,
) -> Result<()> {
    let PieceBins { planes, before, blocks, uniform, .. } = output;
    let bindings = made(&output.passes[3], || {
        let [_, mesh_of] = slot_buffers(gpu, piece)?;
        let no_list = gpu.stand_in("hiz.no_list")?;
        let list = output.list.as_ref().unwrap_or(&no_list);
        let templates = bins.meshes.templates();
        let buffers =
            [planes, before, blocks, &bins.totals, &mesh_of, templates, list, &bins.draws];
        INSTANCES.bind(gpu, uniform, &buffers)
    })?;
    let constants = [
        ("INDEXED", flag(bins.meshes.is_indexed())),
        ("SORTED", flag(piece.slots.is_some())),
        ("LIST", flag(output.list.is_some())),
    ];
    steps.push(Step {
        pipeline: INSTANCES.pipeline(gpu, bins, "emit_instances", &constants)?,
        bindings: bindings.clone(),
        workgroups: [output.words.div_ceil(WORKGROUP), 1],
    });
    Ok(())
}

/// What stands in each slot, and the mesh of each index; stand-ins where the slots are the indices.
fn slot_buffers(gpu: &Gpu, piece: &Piece) -> Result<[wgpu::Buffer; 2]> {
    Ok(match &piece.slots {
        Some(slots) => [slots.index_of.clone(), slots.mesh_of.clone()],
        None => [gpu.stand_in("hiz.no_slots")?, gpu.stand_in("hiz.no_meshes")?],
    })
}
