//! The cull in groups: first the boxes of whole groups, then the members of the surviving groups.
//!
//! In large pieces upper tiers of boxes go first, from the topmost one down.
//! Each tier's survivors are the arguments of an indirect dispatch, which tests what they hold.

use std::sync::Arc;

use crate::cull::full_mask::{FullMask, FullMaskPipelines};
use crate::cull::options::{CullOptions, Hierarchy};
use crate::cull::pipelines::{
    CullKey, FramePass, MEMBER_BINDINGS, ReportKey, accept_members_pipeline, cull_boxes_pipeline,
    cull_members_pipeline,
};
use crate::error::Result;
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::input::bounds::BoundsKind;
use crate::instances::piece::{CULL_WORKGROUP, Piece};
use crate::output::survivors::{ACCEPT_OFFSET, GroupOutput, TierOutput};

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

/// From this many instances on, boxes around 64 groups are culled before the groups.
/// The second number is that of the third tier.
///
/// With 65,536 a second tier took as long as without, and with 262,144 it took 0.8 of the time at
/// 95 % hidden (`docs/performance.md`, "Tiers of boxes").
const UPPER_TIERS_PAY_FROM: [u32; 2] = [1 << 17, 1 << 20];

/// The options of a group's test.
pub(crate) fn group_options(options: &CullOptions) -> CullOptions {
    CullOptions { descent: group_descent(options.descent), ..options.clone() }
}

/// The key of the pipeline of a group's test.
pub(super) fn group_key(key: CullKey) -> CullKey {
    CullKey { kind: BoundsKind::Box, descent: true, by_rows: true, ..key }
}

/// How many tiers of boxes are culled before the instances of a piece: 0 for none, 1 for groups.
pub(crate) fn tiers_of(piece: &Piece, options: &CullOptions) -> usize {
    let wanted = match options.hierarchy {
        Hierarchy::Never => 0,
        Hierarchy::Always => 1,
        Hierarchy::Tiers(tiers) => tiers as usize,
        Hierarchy::Auto if piece.count() < GROUPS_PAY_FROM => 0,
        Hierarchy::Auto => {
            1 + UPPER_TIERS_PAY_FROM.iter().filter(|from| piece.count() >= **from).count()
        }
    };
    if piece.count() == 0 { 0 } else { wanted.min(piece.tiers()) }
}

/// Whether the groups of a piece are culled before its instances.
pub(crate) fn is_grouped(piece: &Piece, options: &CullOptions) -> bool {
    tiers_of(piece, options) > 0
}

/// The pipelines of culls in groups.
#[derive(Debug, Clone)]
struct GroupPipelines {
    /// The tests of the boxes of each tier, the topmost one last.
    boxes: Vec<wgpu::ComputePipeline>,
    /// The test of the members of the surviving groups.
    members: wgpu::ComputePipeline,
    /// What keeps the members of accepted groups; `None` where no group can be accepted.
    accept: Option<wgpu::ComputePipeline>,
    /// In place of `accept`, where a mask may begin full.
    full: Option<FullMaskPipelines>,
}

impl GroupPipelines {
    fn new(gpu: &Gpu, (key, report): (&CullKey, &ReportKey), tiers: usize) -> Result<Self> {
        let boxes = |tier: usize| {
            // Upper tiers do not ask which instances are wanted.
            let key = CullKey { among: key.among && tier == 0, ..group_key(*key) };
            cull_boxes_pipeline(gpu, &key, report, (tier as u32, tier + 1 == tiers))
        };
        let flips = report.flips();
        let accepts = key.nearest && !key.sample_coverage && !flips;
        Ok(Self {
            boxes: (0..tiers).map(boxes).collect::<Result<_>>()?,
            members: cull_members_pipeline(gpu, &key.of_instances(report), report)?,
            accept: accepts.then(|| accept_members_pipeline(gpu, key, report)).transpose()?,
            full: flips.then(|| FullMaskPipelines::new(gpu, key, report)).transpose()?,
        })
    }
}

/// The pipelines and bindings of the cull of a piece in groups.
pub(super) struct GroupCull<'a> {
    /// The tests of the boxes of each tier, the topmost one last.
    tiers: Vec<TierCull<'a>>,
    pipelines: Arc<GroupPipelines>,
    /// The passes of a mask that may begin full.
    full: Option<FullMask>,
}

/// The tests of the boxes of a tier.
struct TierCull<'a> {
    output: &'a TierOutput,
    pipeline: wgpu::ComputePipeline,
    outputs: wgpu::BindGroup,
    /// What reads the survivors.
    list: wgpu::BindGroup,
}

/// What the cull of a tier's boxes binds as its outputs: those of every cull, and `more`.
pub(super) fn bind_survivors(
    gpu: &Gpu,
    (output, tier): (&GroupOutput, usize),
    statistics: Option<&wgpu::Buffer>,
    pass: FramePass,
    more: &[wgpu::BindGroupEntry<'_>],
) -> Result<wgpu::BindGroup> {
    let counted = match statistics {
        Some(statistics) => statistics.clone(),
        None => gpu.stand_in(NO_STATISTICS)?,
    };
    let of_tier = &output.tiers[tier];
    let mut entries = vec![
        entry(0, of_tier.survivors.as_entire_binding()),
        entry(1, output.verdicts.as_entire_binding()),
        entry(2, wgpu::BindingResource::TextureView(&of_tier.survivor_list)),
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
    /// `survivors`: what [`bind_survivors`] has made for it, for each tier.
    pub(super) fn new(
        gpu: &Gpu,
        (key, report): (CullKey, ReportKey),
        output: &'a GroupOutput,
        survivors: &[wgpu::BindGroup],
    ) -> Result<Self> {
        let tiers = survivors.len();
        let pipelines = gpu.known.get((key, report, tiers), || {
            GroupPipelines::new(gpu, (&key, &report), tiers).map(Arc::new)
        })?;
        let boxes = output.tiers.iter().zip(survivors).zip(&pipelines.boxes);
        let boxes = boxes.map(|((output, bound), pipeline)| {
            let list = made(&output.list_bindings, || {
                gpu.bind_group(
                    "hiz.cull.survivors",
                    &gpu.layout("hiz.cull_members.layout", MEMBER_BINDINGS)?,
                    &[
                        entry(0, output.survivors.as_entire_binding()),
                        entry(1, wgpu::BindingResource::TextureView(&output.survivor_list)),
                    ],
                )
            })?;
            let (outputs, list) = (bound.clone(), list.clone());
            Ok(TierCull { output, pipeline: pipeline.clone(), outputs, list })
        });
        let tiers = boxes.collect::<Result<_>>()?;
        let full = pipelines.full.clone();
        Ok(Self {
            tiers,
            full: full.map(|pipelines| FullMask::new(gpu, pipelines, output)).transpose()?,
            pipelines,
        })
    }

    /// Records the tests of the boxes of all tiers, from the topmost one down.
    ///
    /// `records`: what these bind, the topmost tier last.
    /// `boxes`: how many there are in the topmost tier.
    pub(super) fn record_boxes(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        records: &[wgpu::BindGroup],
        boxes: u32,
    ) {
        let mut above: Option<&TierCull<'_>> = None;
        for (tier, records) in self.tiers.iter().zip(records).rev() {
            pass.set_pipeline(&tier.pipeline);
            pass.set_bind_group(1, records, &[]);
            pass.set_bind_group(2, &tier.outputs, &[]);
            match above {
                None => pass.dispatch_workgroups(boxes.div_ceil(CULL_WORKGROUP), 1, 1),
                Some(above) => {
                    pass.set_bind_group(3, &above.list, &[]);
                    pass.dispatch_workgroups_indirect(&above.output.survivors, 0);
                }
            }
            above = Some(tier);
        }
    }

    /// Records the tests of members.
    ///
    /// The piece's records and outputs are bound; `view`: what tests of instances bind besides.
    /// `words`: those of the piece's mask, or 0 if nothing is to run.
    pub(super) fn record_members(
        &self,
        pass: &mut wgpu::ComputePass<'_>,
        view: &wgpu::BindGroup,
        words: u32,
    ) {
        let groups = &self.tiers[0];
        if let Some(full) = &self.full {
            full.record_begin(pass, words);
        }
        pass.set_bind_group(0, view, &[]);
        pass.set_bind_group(3, &groups.list, &[]);
        pass.set_pipeline(&self.pipelines.members);
        pass.dispatch_workgroups_indirect(&groups.output.survivors, 0);
        if let Some(accept) = &self.pipelines.accept {
            pass.set_pipeline(accept);
        } else if let Some(full) = &self.full {
            full.set_settle(pass);
        } else {
            return;
        }
        pass.dispatch_workgroups_indirect(&groups.output.survivors, ACCEPT_OFFSET);
    }
}
