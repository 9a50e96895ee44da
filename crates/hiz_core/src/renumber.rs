//! From places to the caller's indices: what a cull of sorted instances wrote about places is written again about indices.

use crate::cull::Order;
use crate::gpu::Gpu;
use crate::instances::Instances;
use crate::layout::CULL_WORKGROUP;
use crate::pyramid::entry;
use crate::visible::Visible;

/// Records it for every piece that is not in the caller's order; the planes have been cleared.
pub(crate) fn record(
    gpu: &Gpu,
    pass: &mut wgpu::ComputePass<'_>,
    instances: &Instances,
    visible: &Visible,
    order: Order,
) {
    for (piece, output) in instances.pieces.iter().zip(&visible.pieces) {
        let Some(stored_planes) = &output.stored_planes else { continue };
        let bind_group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hiz.renumber.piece"),
            layout: &gpu.layouts().renumber,
            entries: &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, piece.indices.as_entire_binding()),
                entry(2, stored_planes.as_entire_binding()),
                entry(3, output.planes.as_entire_binding()),
                entry(4, output.list.as_entire_binding()),
                entry(5, visible.draws.as_entire_binding()),
            ],
        });
        pass.set_bind_group(0, &bind_group, &[]);
        let workgroups = piece.count().div_ceil(CULL_WORKGROUP);
        pass.set_pipeline(&gpu.renumber_pipeline("renumber_planes"));
        pass.dispatch_workgroups(workgroups, 1, 1);
        if order == Order::Any {
            pass.set_pipeline(&gpu.renumber_pipeline("renumber_list"));
            pass.dispatch_workgroups(workgroups, 1, 1);
        }
    }
}
