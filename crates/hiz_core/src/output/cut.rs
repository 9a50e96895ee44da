//! The cut: it clears the bits of a mask that exceed the capacity of the ordered list.
//!
//! The mask of an early pass says what was drawn, and what the list has no room for is not drawn.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::instances::piece::Piece;
use crate::output::lists::Lists;
use crate::output::visible::PieceOutput;

/// Words of the mask that one workgroup cuts; `shaders/output/cut.wgsl`.
pub(crate) const CUT_WORKGROUP: u32 = 64;

const LAYOUT: &str = "hiz.cut.layout";

const BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::Write), (2, Binding::Read), (3, Binding::Read)];

/// The shader of the cut.
pub(crate) fn cut_module() -> Source {
    Source::of(&[&[wgsl!("instances/piece"), wgsl!("output/cut")]])
}

/// The pipeline of the cut.
pub(crate) fn cut_pipeline(gpu: &Gpu) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.cut.pipeline",
        source: cut_module(),
        entry_point: "cut",
        layouts: &[gpu.layout(LAYOUT, BINDINGS)?],
        constants: &[],
    })
}

/// What the cut of piece `p` binds.
pub(crate) fn bind_cut(
    gpu: &Gpu,
    piece: &Piece,
    output: &PieceOutput,
    (lists, p): (&Lists, usize),
) -> Result<wgpu::BindGroup> {
    gpu.bind_group(
        "hiz.cut.piece",
        &gpu.layout(LAYOUT, BINDINGS)?,
        &[
            entry(0, piece.uniform.as_entire_binding()),
            entry(1, output.mask.as_entire_binding()),
            entry(2, lists.draws.as_entire_binding()),
            entry(3, lists.pieces[p].before.as_entire_binding()),
        ],
    )
}
