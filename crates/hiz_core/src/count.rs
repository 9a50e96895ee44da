//! The count of verdicts: how many instances met which end.

use crate::error::Result;
use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::pyramid::entry;
use crate::visible::Visible;

/// Places that one workgroup counts; `shaders/count.wgsl`.
const COUNT_WORKGROUP: u32 = 64 * 16;

/// Adds the verdicts in `visible`, each place's own (`cull::Refinement`), to `counters`, a
/// `CounterRecord` of zeros.
pub(crate) fn record(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    instances: &Instances,
    visible: &Visible,
    counters: &wgpu::Buffer,
) -> Result<()> {
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let bind_group = gpu.bind_group(
            "hiz.count.piece",
            &gpu.layouts().count,
            &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, output.mask.as_entire_binding()),
                entry(2, counters.as_entire_binding()),
            ],
        )?;
        pass.set_pipeline(&gpu.count_pipeline()?);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(piece.count().div_ceil(COUNT_WORKGROUP), 1, 1);
    }
    Ok(())
}
