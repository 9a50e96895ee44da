//! The pass of a cull: it clears the buffers, tests, and compacts.
//!
//! [`Target`] says where the answers go, and [`Tests`] has the pipelines.
//! The two passes of a frame (`early.rs`, `late.rs`) have targets of their own.

use crate::cull::groups::{GROUPS_OF_RUN, GroupCull, NO_STATISTICS, bind_survivors, is_grouped};
use crate::cull::inputs::{CullInputs, PreparedView, check_contexts};
use crate::cull::options::{CullOptions, Order};
use crate::cull::pipelines::{CullKey, FramePass, ReportKey, VISIBLE_BINDINGS, cull_pipeline};
use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::instances::Instances;
use crate::instances::piece::{CULL_WORKGROUP, Piece};
use crate::output::compact::Compaction;
use crate::output::survivors::NO_SURVIVORS;
use crate::output::visible::{PieceOutput, Visible};

/// Where the answers of a cull go.
pub(super) struct Target<'a> {
    pub(super) visible: &'a Visible,
    pub(super) report: ReportKey,
    /// What the tests of each piece bind as their outputs.
    pub(super) pieces: Vec<PieceTarget>,
    /// What makes the ordered list, if there is one.
    pub(super) compaction: Option<Compaction>,
}

/// Where the answers about a piece go.
pub(super) struct PieceTarget {
    pub(super) members: wgpu::BindGroup,
    /// `None` if no groups are tested.
    pub(super) groups: Option<wgpu::BindGroup>,
}

/// Checks that `visible` was made for `instances`, or others of as many.
pub(super) fn check_visible(
    gpu: &Gpu,
    parameter: &str,
    instances: &Instances,
    visible: &Visible,
) -> Result<()> {
    gpu.check_context(parameter, visible.context)?;
    if visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Ok(());
    }
    Err(Error::mismatch(
        parameter,
        "expected buffers that were created for these instances, got others",
    ))
}

/// Checks that the buffers of a piece have not been destroyed.
/// A bind group does not tell that one of its buffers was.
pub(super) fn check_written(visible: &Visible, p: usize) -> Result<()> {
    let listed = visible.lists.as_ref().map(|lists| [&lists.draws, lists.pieces[p].bound()]);
    let mut written = [&visible.pieces[p].mask].into_iter().chain(listed.into_iter().flatten());
    written.try_for_each(check_alive).map_err(|error| match error {
        Error::Device(why) => Error::mismatch(
            "visible",
            format!("expected buffers that have not been destroyed, but {why}"),
        ),
        other => other,
    })
}

/// The bindings of what a cull of a piece writes, made by the first such cull.
fn bind_output<'a>(
    gpu: &Gpu,
    piece: &Piece,
    visible: &'a Visible,
    p: usize,
    statistics: bool,
) -> Result<&'a wgpu::BindGroup> {
    let lists = visible.lists.as_ref();
    let output = &visible.pieces[p];
    let bind = || {
        let list = match lists {
            Some(lists) => lists.pieces[p].bound().clone(),
            None => gpu.stand_in("hiz.no_list")?,
        };
        let draws = match lists {
            Some(lists) => lists.draws.clone(),
            None => gpu.stand_in("hiz.no_draws")?,
        };
        // If nothing is listed, any uniform can be bound.
        let capacity = lists.map_or(&piece.uniform, |lists| &lists.capacity_uniform);
        let statistics = if statistics {
            visible.statistics_or_new(gpu)?.clone()
        } else {
            gpu.stand_in(NO_STATISTICS)?
        };
        gpu.bind_group(
            "hiz.cull.visible",
            &gpu.layout("hiz.cull.visible_layout", VISIBLE_BINDINGS)?,
            &[
                entry(0, output.mask.as_entire_binding()),
                entry(1, list.as_entire_binding()),
                entry(2, draws.as_entire_binding()),
                entry(3, statistics.as_entire_binding()),
                entry(4, capacity.as_entire_binding()),
            ],
        )
    };
    check_written(visible, p)?;
    made(&output.bindings[usize::from(statistics)], bind)
}

impl<'a> Target<'a> {
    /// The target of a cull that is not one of two passes.
    fn new(
        gpu: &Gpu,
        instances: &Instances,
        options: &CullOptions,
        visible: &'a Visible,
    ) -> Result<Self> {
        let report = report_key(visible, options);
        let statistics =
            if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
        let mut pieces = Vec::new();
        for (p, (piece, output)) in instances.pieces.iter().zip(&visible.pieces).enumerate() {
            let members = bind_output(gpu, piece, visible, p, report.statistics)?.clone();
            let groups = if is_grouped(piece, options) {
                let output = output.groups_or_new(gpu, piece)?;
                let bind = || bind_survivors(gpu, output, statistics, report.pass, &[]);
                Some(made(&output.bindings[usize::from(report.statistics)], bind)?.clone())
            } else {
                None
            };
            pieces.push(PieceTarget { members, groups });
        }
        let compaction = match visible.lists.as_ref().filter(|_| options.order == Order::Stable) {
            Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
            None => None,
        };
        Ok(Self { visible, report, pieces, compaction })
    }

    /// Whether the groups of any piece are tested.
    fn is_grouped(&self) -> bool {
        self.pieces.iter().any(|piece| piece.groups.is_some())
    }

    /// Clears whatever is counted, appended to or set bit by bit.
    fn record_clears(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
    ) -> Result<()> {
        let Self { visible, report, .. } = self;
        if let Some(lists) = &visible.lists {
            lists.record_clear(encoder);
        }
        if report.statistics {
            encoder.clear_buffer(visible.statistics_or_new(gpu)?, 0, None);
        }
        for ((piece, output), target) in
            instances.pieces.iter().zip(&visible.pieces).zip(&self.pieces)
        {
            if report.mask {
                encoder.clear_buffer(&output.mask, 0, Some(4 * u64::from(piece.words().max(1))));
            }
            if target.groups.is_some() {
                let contents = bytemuck::bytes_of(&NO_SURVIVORS);
                let from =
                    gpu.constant("hiz.cull.no_survivors", contents, wgpu::BufferUsages::COPY_SRC)?;
                let to = &output.groups_or_new(gpu, piece)?.survivors;
                encoder.copy_buffer_to_buffer(&from, 0, to, 0, from.size());
            }
        }
        Ok(())
    }
}

/// A function that makes the pipeline of the flat cull.
pub(crate) type FlatPipeline = fn(&Gpu, &CullKey, &ReportKey) -> Result<wgpu::ComputePipeline>;

/// Records the cull of `inputs` into `visible`.
pub(crate) fn record_cull(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
) -> Result<()> {
    record_cull_by(gpu, encoder, inputs, visible, cull_pipeline)
}

/// [`record_cull`] with another flat cull.
pub(crate) fn record_cull_by(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
    flat: FlatPipeline,
) -> Result<()> {
    gpu.recorded(|| record_all(gpu, encoder, inputs, visible, flat))
}

fn record_all(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
    flat: FlatPipeline,
) -> Result<()> {
    let CullInputs { instances, options, .. } = *inputs;
    check_contexts(gpu, inputs)?;
    check_visible(gpu, "visible", instances, visible)?;
    if visible.is_of_two_passes() {
        return Err(Error::mismatch(
            "visible",
            "expected buffers of `create_visible`, got those of a `Temporal`, which \
             `record_early` and `record_late` fill",
        ));
    }
    // Make everything before recording anything: an object that cannot be made would invalidate the
    // caller's encoder.
    let target = Target::new(gpu, instances, options, visible)?;
    record_against_pyramid(gpu, encoder, inputs, &target, flat, |_| ())
}

/// Records the tests of `inputs` against their pyramid.
///
/// `before` records what must run before them.
pub(super) fn record_against_pyramid(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    target: &Target<'_>,
    flat: FlatPipeline,
    before: impl FnOnce(&mut wgpu::CommandEncoder),
) -> Result<()> {
    let CullInputs { instances, pyramid, .. } = *inputs;
    let seen = PreparedView::new(gpu, inputs, Some(encoder))?;
    let mut view = seen.bind(gpu, pyramid, target.is_grouped())?;
    let tests = Tests::new(gpu, seen.key, target, flat)?;
    view.record(encoder, pyramid);
    before(encoder);
    let views = [&view.instances, view.groups.as_ref().unwrap_or(&view.instances)];
    tests.record(gpu, encoder, instances, views, inputs.idle, |_| ())
}

/// The pipelines of the tests of a cull.
pub(super) struct Tests<'a> {
    target: &'a Target<'a>,
    /// One per piece; `None` if its groups are not tested.
    groups: Vec<Option<GroupCull<'a>>>,
    /// `None` if groups are tested in every piece.
    flat: Option<wgpu::ComputePipeline>,
}

impl<'a> Tests<'a> {
    pub(super) fn new(
        gpu: &Gpu,
        key: CullKey,
        target: &'a Target<'a>,
        flat: FlatPipeline,
    ) -> Result<Self> {
        let outputs = target.visible.pieces.iter().map(PieceOutput::groups);
        let groups = target
            .pieces
            .iter()
            .zip(outputs)
            .map(|(piece, output)| match (&piece.groups, output) {
                (Some(survivors), Some(output)) => {
                    GroupCull::new(gpu, (key, target.report), output, survivors.clone()).map(Some)
                }
                _ => Ok(None),
            })
            .collect::<Result<Vec<_>>>()?;
        let flat = if groups.iter().all(Option::is_some) {
            None
        } else {
            Some(flat(gpu, &key, &target.report)?)
        };
        Ok(Self { target, groups, flat })
    }

    /// Records the clears, the tests and the compaction; `after` ends the pass.
    ///
    /// `views`: what tests of instances bind as their view, and tests of groups.
    pub(super) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        [view, group_view]: [&wgpu::BindGroup; 2],
        idle: bool,
        after: impl FnOnce(&mut wgpu::ComputePass<'_>),
    ) -> Result<()> {
        let workgroups = |count: u32| if idle { 0 } else { count };
        self.target.record_clears(gpu, encoder, instances)?;
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hiz.cull.pass"),
            timestamp_writes: None,
        });
        pass.set_bind_group(0, view, &[]);
        for ((piece, target), groups) in
            instances.pieces.iter().zip(&self.target.pieces).zip(&self.groups)
        {
            if let Some(groups) = groups {
                pass.set_bind_group(0, group_view, &[]);
                groups.record_boxes(
                    &mut pass,
                    piece,
                    workgroups(piece.groups().div_ceil(CULL_WORKGROUP)),
                );
                pass.set_bind_group(0, view, &[]);
            }
            pass.set_bind_group(1, &piece.bindings, &[]);
            pass.set_bind_group(2, &target.members, &[]);
            if let Some(groups) = groups {
                groups.record_members(&mut pass);
            } else if let Some(flat) = &self.flat {
                pass.set_pipeline(flat);
                pass.dispatch_workgroups(workgroups(piece.groups().div_ceil(GROUPS_OF_RUN)), 1, 1);
            }
        }
        if let Some(compaction) = &self.target.compaction {
            compaction.record(&mut pass, idle);
        }
        after(&mut pass);
        Ok(())
    }
}

/// What the cull's own pass writes.
/// An ordered list is made from the mask instead.
fn report_key(visible: &Visible, options: &CullOptions) -> ReportKey {
    let outputs = visible.outputs();
    let listed = outputs.indices || outputs.draws;
    let ordered = listed && options.order == Order::Stable;
    ReportKey {
        pass: FramePass::Alone,
        mask: outputs.mask || ordered,
        verdicts: outputs.verdicts,
        append: listed && !ordered,
        list: outputs.indices && !ordered,
        capped: visible.is_capped(),
        statistics: options.statistics,
    }
}
