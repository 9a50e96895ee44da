//! The count of verdicts: how many instances got which verdict.
//!
//! It runs when counts are read, not in the cull, so a cull whose counts nobody reads does not pay
//! for it.
//! `cull/refine.rs` runs first, since a cull leaves the members of hidden groups without verdicts.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::Compute;
use crate::gpu::shader::{Source, wgsl};
use crate::instances::Instances;
use crate::output::visible::{VERDICT_MULTIPLE, Visible};

/// Invocations of a workgroup, and vectors of places that each of them counts;
/// `shaders/cull/count.wgsl`.
pub(crate) const LANES: u32 = 64;
pub(crate) const VECTORS: u32 = 4;
/// Places that one workgroup counts.
const COUNT_WORKGROUP: u32 = LANES * VECTORS * VERDICT_MULTIPLE;

/// The bindings of a count.
const BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::Read), (2, Binding::Write)];

/// The shader module that counts verdicts.
pub(crate) fn count_module() -> Source {
    Source::of(&[&[wgsl!("output/verdict"), wgsl!("instances/piece"), wgsl!("cull/count")]])
}

/// Adds the verdicts in `visible` to `counters`, a `CounterRecord` of zeros.
/// Every place must have a verdict of its own by then (`cull/refine.rs`).
pub(crate) fn record_count(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    instances: &Instances,
    visible: &Visible,
    counters: &wgpu::Buffer,
) -> Result<()> {
    let layout = gpu.layout("hiz.count.layout", BINDINGS)?;
    let pipeline = gpu.compute_pipeline(&Compute {
        label: "hiz.count.pipeline",
        source: count_module(),
        entry_point: "count",
        layouts: std::slice::from_ref(&layout),
        constants: &[],
    })?;
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let bind_group = gpu.bind_group(
            "hiz.count.piece",
            &layout,
            &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, output.mask.as_entire_binding()),
                entry(2, counters.as_entire_binding()),
            ],
        )?;
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(piece.count().div_ceil(COUNT_WORKGROUP), 1, 1);
    }
    Ok(())
}
