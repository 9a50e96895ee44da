//! The ordered compaction: from the mask to an ascending list and the draw's instance count.

use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::lists::Lists;
use crate::pyramid::entry;
use crate::visible::Visible;

/// Words that one workgroup of `scatter` turns into indices; `shaders/compact.wgsl`.
const SCATTER_WORKGROUP: u32 = 64;

/// Records the compaction of every piece, in order: a later one needs to know what earlier ones left of the capacity.
pub(crate) fn record(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    instances: &Instances,
    visible: &Visible,
    lists: &Lists,
    idle: bool,
) {
    // As `CullInputs::idle`.
    let workgroups = |count: u32| if idle { 0 } else { count };
    let (scan, scatter) = (gpu.compact_pipeline("scan"), gpu.compact_pipeline("scatter"));
    for ((piece, output), list) in instances.pieces.iter().zip(&visible.pieces).zip(&lists.pieces) {
        if piece.count() == 0 {
            continue;
        }
        let bind_group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hiz.compact.piece"),
            layout: &gpu.layouts().compact,
            entries: &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, output.mask.as_entire_binding()),
                entry(2, list.bound().as_entire_binding()),
                entry(3, lists.draws.as_entire_binding()),
                entry(4, list.before.as_entire_binding()),
                entry(5, lists.capacity_uniform.as_entire_binding()),
            ],
        });
        pass.set_bind_group(0, &bind_group, &[]);
        pass.set_pipeline(&scan);
        pass.dispatch_workgroups(workgroups(1), 1, 1);
        if list.indices.is_some() {
            pass.set_pipeline(&scatter);
            pass.dispatch_workgroups(workgroups(piece.words().div_ceil(SCATTER_WORKGROUP)), 1, 1);
        }
    }
}
