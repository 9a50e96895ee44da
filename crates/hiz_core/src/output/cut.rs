//! The cut: it clears the bits of a mask that exceed the capacity of the ordered list.
//!
//! The mask of an early pass says what was drawn, and what the list has no room for is not drawn.

use std::sync::OnceLock;

use crate::error::Result;
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::bins::{Arrangement, Bins};
use crate::output::emit_passes;
use crate::output::lists::Lists;
use crate::output::visible::{PieceOutput, Visible};

/// Words that one workgroup cuts, of the mask or of planes; `shaders/output/cut.wgsl`,
/// `shaders/output/emit_cut.wgsl`.
pub(crate) const CUT_WORKGROUP: u32 = 64;

const OF_LIST: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::Write), (2, Binding::Read), (3, Binding::Read)];

const OF_BINS: &[(u32, Binding)] = &[
    (0, Binding::Uniform),
    (1, Binding::Read),
    (2, Binding::Read),
    (3, Binding::Read),
    (4, Binding::Read),
    (5, Binding::Read),
    (6, Binding::Write),
];

/// The shader of the cut of one list.
pub(crate) fn cut_module() -> Source {
    Source::of(&[&[wgsl!("instances/piece"), wgsl!("output/cut")]])
}

/// The dispatches that cut the masks of all pieces.
pub(crate) struct Cut {
    pipeline: wgpu::ComputePipeline,
    /// The bindings of each piece, its words, and its sets of planes.
    pieces: Vec<(wgpu::BindGroup, [u32; 2])>,
}

impl Cut {
    /// `None` if the lists have room for everything.
    /// `bindings` are those of earlier cuts, one per piece.
    pub(crate) fn new<'a>(
        gpu: &Gpu,
        instances: &Instances,
        visible: &Visible,
        bindings: impl Iterator<Item = &'a OnceLock<wgpu::BindGroup>>,
    ) -> Result<Option<Self>> {
        if !visible.is_capped() {
            return Ok(None);
        }
        let pieces = instances.pieces.iter().zip(&visible.pieces).zip(bindings).enumerate();
        let (pipeline, pieces) = if let Some(bins) = &visible.bins {
            let cut =
                |(p, ((piece, output), bound)): (usize, ((&Piece, &PieceOutput), &OnceLock<_>))| {
                    let bound = made(bound, || bind_bins(gpu, piece, output, (bins, p)))?;
                    let sets = if is_by_index(bins) { 1 } else { bins.sets() };
                    Ok((bound.clone(), [piece.words(), sets]))
                };
            let is_sorted = instances.pieces.iter().any(|piece| piece.slots.is_some());
            (bins_pipeline(gpu, bins, is_sorted)?, pieces.map(cut).collect::<Result<_>>()?)
        } else if let Some(lists) = &visible.lists {
            let cut =
                |(p, ((piece, output), bound)): (usize, ((&Piece, &PieceOutput), &OnceLock<_>))| {
                    let bound = made(bound, || bind_list(gpu, piece, output, (lists, p)))?;
                    Ok((bound.clone(), [piece.words(), 1]))
                };
            (list_pipeline(gpu)?, pieces.map(cut).collect::<Result<_>>()?)
        } else {
            return Ok(None);
        };
        Ok(Some(Self { pipeline, pieces }))
    }

    /// Records the cut, behind what has counted the bits.
    pub(crate) fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_pipeline(&self.pipeline);
        for (bindings, [words, sets]) in &self.pieces {
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(words.div_ceil(CUT_WORKGROUP), *sets, 1);
        }
    }
}

fn is_by_index(bins: &Bins) -> bool {
    bins.arrangement == Arrangement::Instances
}

fn list_pipeline(gpu: &Gpu) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.cut.pipeline",
        source: cut_module(),
        entry_point: "cut",
        layouts: &[gpu.layout("hiz.cut.layout", OF_LIST)?],
        constants: &[],
    })
}

fn bins_pipeline(gpu: &Gpu, bins: &Bins, is_sorted: bool) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.cut_bins.pipeline",
        source: emit_passes::cut_module(bins.plane_set()),
        entry_point: "emit_cut",
        layouts: &[gpu.layout("hiz.cut_bins.layout", OF_BINS)?],
        constants: &[("BY_INDEX", flag(is_by_index(bins))), ("SORTED", flag(is_sorted))],
    })
}

fn bind_list(
    gpu: &Gpu,
    piece: &Piece,
    output: &PieceOutput,
    (lists, p): (&Lists, usize),
) -> Result<wgpu::BindGroup> {
    gpu.bind_group(
        "hiz.cut.piece",
        &gpu.layout("hiz.cut.layout", OF_LIST)?,
        &[
            entry(0, piece.uniform.as_entire_binding()),
            entry(1, output.mask.as_entire_binding()),
            entry(2, lists.draws.as_entire_binding()),
            entry(3, lists.pieces[p].before.as_entire_binding()),
        ],
    )
}

fn bind_bins(
    gpu: &Gpu,
    piece: &Piece,
    output: &PieceOutput,
    (bins, p): (&Bins, usize),
) -> Result<wgpu::BindGroup> {
    let index_of = match &piece.slots {
        Some(slots) => slots.index_of.clone(),
        None => gpu.stand_in("hiz.no_slots")?,
    };
    let of_piece = &bins.pieces[p];
    gpu.bind_group(
        "hiz.cut_bins.piece",
        &gpu.layout("hiz.cut_bins.layout", OF_BINS)?,
        &[
            entry(0, of_piece.uniform.as_entire_binding()),
            entry(1, of_piece.planes.as_entire_binding()),
            entry(2, of_piece.before.as_entire_binding()),
            entry(3, of_piece.blocks.as_entire_binding()),
            entry(4, bins.totals.as_entire_binding()),
            entry(5, index_of.as_entire_binding()),
            entry(6, output.mask.as_entire_binding()),
        ],
    )
}
