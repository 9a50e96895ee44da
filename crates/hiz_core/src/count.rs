//! The count of verdicts: how many instances met which end.

use crate::cull::{CullOptions, is_grouped};
use crate::error::Result;
use crate::gpu::{Gpu, StandIn};
use crate::instances::Instances;
use crate::pyramid::entry;
use crate::visible::Visible;

/// Places that one workgroup counts; `shaders/count.wgsl`.
const COUNT_WORKGROUP: u32 = 64 * 16;

/// Adds what a cull with these options left in `visible` to `counters`, a `CounterRecord` of zeros.
pub(crate) fn record(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    instances: &Instances,
    visible: &Visible,
    options: &CullOptions,
    counters: &wgpu::Buffer,
) -> Result<()> {
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let groups = output.groups().filter(|_| is_grouped(piece, options));
        let group_verdicts = groups.map_or(gpu.stand_in(StandIn::GroupVerdicts), |groups| &groups.verdicts);
        let bind_group = gpu.bind_group(
            "hiz.count.piece",
            &gpu.layouts().count,
            &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, output.mask.as_entire_binding()),
                entry(2, group_verdicts.as_entire_binding()),
                entry(3, counters.as_entire_binding()),
            ],
        )?;
        pass.set_pipeline(&gpu.count_pipeline(groups.is_some())?);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(piece.count().div_ceil(COUNT_WORKGROUP), 1, 1);
    }
    Ok(())
}
