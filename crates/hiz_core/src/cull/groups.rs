//! The cull in groups: first the boxes of whole groups, then the members of the surviving groups.

use crate::cull::options::{CullOptions, Hierarchy};
use crate::cull::pipelines::{
    CullKey, FramePass, MEMBER_BINDINGS, ReportKey, cull_groups_pipeline, cull_members_pipeline,
};
use crate::error::Result;
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::input::bounds::BoundsKind;
use crate::instances::piece::Piece;
use crate::output::survivors::GroupOutput;

/// The label of the buffer that is bound if levels are not counted.
pub(super) const NO_STATISTICS: &str = "hiz.no_statistics";

/// Groups whose members one workgroup tests; `shaders/instances/groups.wgsl`, `RUN`.
pub(crate) const GROUPS_OF_RUN: u32 = 8;

/// The fewest texels of finer levels that a group's test may read.
/// A box around 64 instances is large, so its footprint is coarse (`docs/performance.md`).
const GROUP_DESCENT: u32 = 16;

/// The budget of a group's descent in a cull whose instances have `budget`.
pub(super) fn group_descent(budget: u32) -> u32 {
    budget.max(GROUP_DESCENT)
}

/// From this many instances on, groups are culled first.
/// Fewer are tested one by one before the dispatches for groups would have begun
/// (`docs/performance.md`).
const GROUPS_PAY_FROM: u32 = 16_384;

/// The options of a group's test.
pub(crate) fn group_options(options: &CullOptions) -> CullOptions {
    CullOptions { descent: group_descent(options.descent), ..options.clone() }
}

/// The key of the pipeline of a group's test.
pub(super) fn group_key(key: CullKey) -> CullKey {
    CullKey { kind: BoundsKind::Box, descent: true, ..key }
}

/// Whether the groups of a piece are culled before its instances.
pub(crate) fn is_grouped(piece: &Piece, options: &CullOptions) -> bool {
    match options.hierarchy {
        Hierarchy::Never => false,
        Hierarchy::Always => piece.count() > 0,
        Hierarchy::Auto => piece.count() >= GROUPS_PAY_FROM,
    }
}

/// The pipelines and bindings of the cull of a piece in groups.
pub(super) struct GroupCull<'a> {
    output: &'a GroupOutput,
    /// The test of the boxes of the groups.
    boxes: (wgpu::ComputePipeline, wgpu::BindGroup),
    /// The test of the members of the surviving groups.
    members: (wgpu::ComputePipeline, wgpu::BindGroup),
}

/// What the cull of a piece's groups binds as its outputs: those of every cull, and `more`.
pub(super) fn bind_survivors(
    gpu: &Gpu,
    output: &GroupOutput,
    statistics: Option<&wgpu::Buffer>,
    pass: FramePass,
    more: &[wgpu::BindGroupEntry<'_>],
) -> Result<wgpu::BindGroup> {
    let counted = match statistics {
        Some(statistics) => statistics.clone(),
        None => gpu.stand_in(NO_STATISTICS)?,
    };
    let mut entries = vec![
        entry(0, output.survivors.as_entire_binding()),
        entry(1, output.verdicts.as_entire_binding()),
        entry(2, wgpu::BindingResource::TextureView(&output.survivor_list)),
        entry(3, counted.as_entire_binding()),
    ];
    entries.extend_from_slice(more);
    gpu.bind_group(
        "hiz.cull.groups",
        &gpu.layout("hiz.cull_groups.layout", pass.group_bindings())?,
        &entries,
    )
}

impl<'a> GroupCull<'a> {
    /// `survivors`: what [`bind_survivors`] has made for it.
    pub(super) fn new(
        gpu: &Gpu,
        (key, report): (CullKey, ReportKey),
        output: &'a GroupOutput,
        survivors: wgpu::BindGroup,
    ) -> Result<Self> {
        let members = made(&output.member_bindings, || {
            gpu.bind_group(
                "hiz.cull.survivors",
                &gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?,
                &[
                    entry(0, output.survivors.as_entire_binding()),
                    entry(1, wgpu::BindingResource::TextureView(&output.survivor_list)),
                ],
            )
        })?;
        let of_boxes = cull_groups_pipeline(gpu, &group_key(key), &report)?;
        let of_members = cull_members_pipeline(gpu, &key, &report)?;
        Ok(Self { output, boxes: (of_boxes, survivors), members: (of_members, members.clone()) })
    }

    /// Records the test of the boxes, in so many `workgroups`.
    pub(super) fn record_boxes(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        records: &wgpu::BindGroup,
        workgroups: u32,
    ) {
        pass.set_pipeline(&self.boxes.0);
        pass.set_bind_group(1, records, &[]);
        pass.set_bind_group(2, &self.boxes.1, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
    }

    pub(super) fn record_members(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_bind_group(3, &self.members.1, &[]);
        pass.set_pipeline(&self.members.0);
        pass.dispatch_workgroups_indirect(&self.output.survivors, 0);
    }
}
