//! The pass of a cull: it clears the buffers, tests, and compacts.
//!
//! [`Target`] says where the answers go, and [`Tests`] has the pipelines.
//! The two passes of a frame (`early.rs`, `late.rs`) have targets of their own.

use crate::cull::among::Among;
use crate::cull::groups::{GROUPS_OF_RUN, GroupCull, NO_STATISTICS, bind_survivors, tiers_of};
use crate::cull::inputs::{CullInputs, PreparedView, check_contexts};
use crate::cull::lod::LodRule;
use crate::cull::options::{CullOptions, Order};
use crate::cull::pipelines::{
    BINNED_BINDINGS, BinKey, CullKey, EmitKey, FramePass, ReportKey, VISIBLE_BINDINGS,
    cull_pipeline,
};
use crate::cull::pixels::PixelPass;
use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::stage_times::StagePasses;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::bins::{Arrangement, Bins};
use crate::output::compact::Compaction;
use crate::output::cut::Cut;
use crate::output::emit_passes::Emission;
use crate::output::lists::Copied;
use crate::output::survivors::NO_SURVIVORS;
use crate::output::visible::{PieceOutput, Visible};

/// Where the answers of a cull go.
pub(super) struct Target<'a> {
    pub(super) visible: &'a Visible,
    pub(super) report: ReportKey,
    pub(super) pieces: Vec<PieceTarget>,
    compaction: Option<Compaction>,
    emission: Option<Emission>,
}

/// What the tests of a piece bind.
pub(super) struct PieceTarget {
    records: wgpu::BindGroup,
    /// The outputs of tests of instances.
    outputs: wgpu::BindGroup,
    /// The records of the boxes of each tier that is tested, and the outputs of their tests.
    /// None if no groups are tested.
    boxes: Vec<wgpu::BindGroup>,
    groups: Vec<wgpu::BindGroup>,
}

/// What tests of a piece's instances bind as their outputs, and tests of the boxes of each tier.
pub(super) type Bound = (wgpu::BindGroup, Vec<wgpu::BindGroup>);

/// Checks that `visible` was made for these instances, or others of as many.
pub(super) fn check_visible(
    gpu: &Gpu,
    parameter: &str,
    instances: &Instances,
    visible: &Visible,
) -> Result<()> {
    gpu.check_context(parameter, visible.context)?;
    if !visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch(
            parameter,
            "expected buffers that were created for these instances, got others",
        ));
    }
    if visible.bins.as_ref().is_some_and(|bins| bins.instances != instances.id) {
        return Err(Error::mismatch(
            parameter,
            "expected buffers that were created for these instances, got others: bins belong to \
             the mesh ids of their instances",
        ));
    }
    Ok(())
}

/// Checks that what a cull writes about a piece has not been destroyed.
/// A bind group does not tell that one of its buffers was.
pub(super) fn check_written(visible: &Visible, p: usize) -> Result<()> {
    let (lists, bins) = (visible.lists.as_ref(), visible.bins.as_ref());
    let listed = lists.map(|lists| [&lists.draws, lists.pieces[p].bound()]);
    let binned =
        bins.map(|bins| [&bins.draws, &bins.draw_counts].into_iter().chain(&bins.pieces[p].list));
    let mut written = [&visible.pieces[p].mask]
        .into_iter()
        .chain(listed.into_iter().flatten())
        .chain(binned.into_iter().flatten())
        .chain(lists.and_then(|lists| lists.copied.as_ref()).map(Copied::buffer));
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
    report: &ReportKey,
) -> Result<&'a wgpu::BindGroup> {
    let (lists, bins) = (visible.lists.as_ref(), visible.bins.as_ref());
    let appends = matches!(report.emit, EmitKey::Append { .. });
    let output = &visible.pieces[p];
    let bind = || {
        let list = match (lists, bins) {
            (Some(lists), _) => lists.pieces[p].bound().clone(),
            (None, Some(bins)) if !appends => bins.pieces[p].planes.clone(),
            (None, Some(Bins { pieces, .. })) if pieces[p].list.is_some() => {
                pieces[p].list.clone().expect("it is there")
            }
            _ => gpu.stand_in("hiz.no_list")?,
        };
        let draws = match (lists, bins) {
            (Some(lists), _) => lists.draws.clone(),
            (None, Some(bins)) if appends => bins.draws.clone(),
            _ => gpu.stand_in("hiz.no_draws")?,
        };
        // If nothing is listed, any uniform can be bound.
        let capacity = match (lists, bins) {
            (Some(lists), _) => &lists.capacity_uniform,
            (None, Some(bins)) => &bins.pieces[p].uniform,
            (None, None) => &piece.uniform,
        };
        let statistics = if report.statistics {
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
    made(&output.bindings[usize::from(report.statistics) + 2 * usize::from(appends)], bind)
}

/// The bindings of a piece's records, with slots and mesh table for a cull that emits bins.
fn bind_records(
    gpu: &Gpu,
    piece: &Piece,
    visible: &Visible,
    p: usize,
    among: Option<&Among>,
) -> Result<wgpu::BindGroup> {
    let Some(bins) = &visible.bins else {
        return Ok(among.map_or(&piece.bindings, |among| among.records(p)).clone());
    };
    let bind = |asked: &wgpu::TextureView| {
        let table = bins.meshes.view();
        let slots = piece.slots.as_ref().map_or(table, |slots| &slots.of_places.view);
        gpu.bind_group(
            "hiz.cull.binned_instances",
            &gpu.layout("hiz.cull.binned_instances_layout", BINNED_BINDINGS)?,
            &[
                entry(0, piece.uniform.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&piece.records.view)),
                entry(2, wgpu::BindingResource::TextureView(slots)),
                entry(3, wgpu::BindingResource::TextureView(table)),
                entry(4, wgpu::BindingResource::TextureView(asked)),
            ],
        )
    };
    match among {
        Some(among) => bind(among.view(p)),
        None => made(&bins.pieces[p].records_bindings, || bind(gpu.no_texels()?)).cloned(),
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
    let report = report_key(instances, visible, options)?;
    // Make everything before recording anything: an object that cannot be made would invalidate the
    // caller's encoder.
    let statistics = if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
    let bind = |p: usize, piece: &Piece, output: &PieceOutput| {
        let outputs = bind_output(gpu, piece, visible, p, &report)?.clone();
        let bind_tier = |tier: usize| {
            let groups = output.groups_or_new(gpu, piece)?;
            let bind = || bind_survivors(gpu, (groups, tier), statistics, report.pass, &[]);
            let kept = &groups.tiers[tier].bindings[usize::from(report.statistics)];
            made(kept, bind).cloned()
        };
        let groups = (0..tiers_of(piece, options)).map(bind_tier).collect::<Result<_>>()?;
        Ok((outputs, groups))
    };
    let target = Target::new(gpu, (instances, options, inputs.among), visible, report, bind)?;
    let pixels = PixelPass::new(gpu, inputs, visible, None)?;
    record_against_pyramid(gpu, encoder, inputs, &target, flat, |_| ())?;
    if let Some(pixels) = pixels {
        pixels.record(encoder, inputs.pyramid);
    }
    Ok(())
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
    let is_grouped = target.pieces.iter().any(|piece| !piece.groups.is_empty());
    let mut view = seen.bind(gpu, pyramid, is_grouped)?;
    let tests = Tests::new(gpu, seen.key, target, flat)?;
    view.record(encoder, pyramid);
    before(encoder);
    let views = [&view.instances, view.groups.as_ref().unwrap_or(&view.instances)];
    tests.record(gpu, encoder, instances, views, inputs.idle, None)
}

impl<'a> Target<'a> {
    /// `bind` gives what a piece's tests of instances bind as their outputs, and its tests of
    /// groups, if there are any.
    pub(super) fn new(
        gpu: &Gpu,
        (instances, options, among): (&Instances, &CullOptions, Option<&Among>),
        visible: &'a Visible,
        report: ReportKey,
        bind: impl Fn(usize, &Piece, &PieceOutput) -> Result<Bound>,
    ) -> Result<Self> {
        let mut pieces = Vec::new();
        for (p, (piece, output)) in instances.pieces.iter().zip(&visible.pieces).enumerate() {
            let (outputs, groups) = bind(p, piece, output)?;
            let records = bind_records(gpu, piece, visible, p, among)?;
            let of_groups = among.map_or(&piece.group_bindings, |among| among.group_records(p));
            let upper = piece.upper.iter().map(|tier| &tier.bindings);
            let boxes = std::iter::once(of_groups).chain(upper).take(groups.len()).cloned();
            pieces.push(PieceTarget { records, outputs, boxes: boxes.collect(), groups });
        }
        let planes = matches!(report.emit, EmitKey::Planes { .. });
        let emission = match visible.bins.as_ref().filter(|_| planes) {
            Some(bins) => Some(Emission::new(gpu, instances, bins)?),
            None => None,
        };
        let compaction = match visible.lists.as_ref().filter(|_| options.order == Order::Stable) {
            Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
            None => None,
        };
        Ok(Self { visible, report, pieces, compaction, emission })
    }

    /// Clears whatever is counted, appended to or set bit by bit.
    fn record_clears(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        idle: bool,
    ) -> Result<()> {
        let Self { visible, report, .. } = self;
        if let Some(lists) = &visible.lists {
            lists.record_clear(encoder);
        }
        if let Some(bins) = &visible.bins {
            let appends = matches!(report.emit, EmitKey::Append { .. });
            bins.record_clear(encoder, appends, idle);
            if !appends {
                bins.record_clear_planes(encoder);
            }
            bins.meshes.record(encoder);
        }
        if report.statistics {
            encoder.clear_buffer(visible.statistics_or_new(gpu)?, 0, None);
        }
        let pieces = instances.pieces.iter().zip(&visible.pieces).zip(&self.pieces);
        for ((piece, output), target) in pieces {
            if report.mask {
                encoder.clear_buffer(&output.mask, 0, Some(4 * u64::from(piece.words().max(1))));
            }
            for tier in 0..target.groups.len() {
                let contents = bytemuck::bytes_of(&NO_SURVIVORS);
                let from =
                    gpu.constant("hiz.cull.no_survivors", contents, wgpu::BufferUsages::COPY_SRC)?;
                let to = &output.groups_or_new(gpu, piece)?.tiers[tier].survivors;
                encoder.copy_buffer_to_buffer(&from, 0, to, 0, from.size());
            }
            if report.flips() && !report.verdicts && !target.groups.is_empty() {
                encoder.clear_buffer(&output.groups_or_new(gpu, piece)?.verdicts, 0, None);
            }
        }
        Ok(())
    }
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
            .map(|(piece, output)| match (&piece.groups[..], output) {
                (survivors @ [_, ..], Some(output)) => {
                    GroupCull::new(gpu, (key, target.report), output, survivors).map(Some)
                }
                _ => Ok(None),
            })
            .collect::<Result<Vec<_>>>()?;
        let flat = if groups.iter().all(Option::is_some) {
            None
        } else {
            Some(flat(gpu, &key.of_instances(&target.report), &target.report)?)
        };
        Ok(Self { target, groups, flat })
    }

    /// Records the clears, the tests, what makes lists, and what is cut from them.
    ///
    /// `view`, `group_view`: what tests of instances bind as their view, and tests of groups.
    pub(super) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        [view, group_view]: [&wgpu::BindGroup; 2],
        idle: bool,
        cut: Option<&Cut>,
    ) -> Result<()> {
        let workgroups = |count: u32| if idle { 0 } else { count };
        self.target.record_clears(gpu, encoder, instances, idle)?;
        let mut passes = StagePasses::begin(encoder, "hiz.cull.pass");
        let pieces = instances.pieces.iter().zip(&self.target.pieces).zip(&self.groups);
        for ((piece, target), groups) in pieces {
            if let Some(groups) = groups {
                let count = workgroups(piece.boxes(target.boxes.len() - 1));
                passes.record("cull groups", |pass| {
                    pass.set_bind_group(0, group_view, &[]);
                    groups.record_boxes(pass, &target.boxes, count);
                });
            }
            let stage = if groups.is_some() { "cull members" } else { "cull" };
            passes.record(stage, |pass| {
                pass.set_bind_group(1, &target.records, &[]);
                pass.set_bind_group(2, &target.outputs, &[]);
                if let Some(groups) = groups {
                    groups.record_members(pass, view, workgroups(piece.words()));
                } else if let Some(flat) = &self.flat {
                    let count = workgroups(piece.groups().div_ceil(GROUPS_OF_RUN));
                    pass.set_bind_group(0, view, &[]);
                    pass.set_pipeline(flat);
                    pass.dispatch_workgroups(count, 1, 1);
                }
            });
        }
        if let Some(compaction) = &self.target.compaction {
            passes.record("list", |pass| compaction.record(pass, idle));
        }
        if let Some(emission) = &self.target.emission {
            passes.record("list", |pass| emission.record(pass, idle));
        }
        if let Some(cut) = cut {
            passes.record("list", |pass| cut.record(pass));
        }
        Ok(())
    }
}

/// What the cull's own pass writes.
/// An ordered list is made from the mask instead, and ordered bins are made from planes.
fn report_key(
    instances: &Instances,
    visible: &Visible,
    options: &CullOptions,
) -> Result<ReportKey> {
    let outputs = visible.outputs();
    let any_order = options.order == Order::Any;
    let (list, capped) = (outputs.indices, visible.is_capped());
    let mut mask = outputs.mask;
    let emit = if let Some(bins) = &visible.bins {
        let of_bins = bin_key(instances, bins, options);
        match (any_order, bins.can_append()) {
            (false, _) => EmitKey::Planes {
                by_index: bins.arrangement == Arrangement::Instances,
                set: bins.plane_set(),
                bins: of_bins,
            },
            (true, true) => EmitKey::Append {
                list,
                capped,
                record_words: (bins.record_bytes() / 4) as u32,
                bins: of_bins,
            },
            (true, false) => {
                return Err(Error::invalid(
                    "order",
                    "expected Order::Stable, got Order::Any: bins in any order are for one mesh \
                     with Placement::Reserved",
                ));
            }
        }
    } else {
        let listed = visible.lists.is_some();
        if any_order && visible.lists.as_ref().is_some_and(|lists| lists.copied.is_some()) {
            return Err(Error::invalid(
                "order",
                "expected Order::Stable for Emit::Copy, got Order::Any",
            ));
        }
        mask |= listed && !any_order;
        EmitKey::List { append: listed && any_order, list: list && any_order, capped }
    };
    let (verdicts, statistics) = (outputs.verdicts, options.statistics);
    let absent = instances.num_absent() > 0;
    Ok(ReportKey { mask, verdicts, absent, emit, statistics, pass: FramePass::Alone })
}

fn bin_key(instances: &Instances, bins: &Bins, options: &CullOptions) -> BinKey {
    let has_lods = bins.meshes.most_lods() > 1 && options.lod != LodRule::Finest;
    BinKey {
        sorted: instances.pieces.iter().any(|p| p.slots.is_some()),
        lod_rule: has_lods.then(|| options.lod.code()),
    }
}

/// What one of the two passes of a frame writes.
/// Lists are made from its mask, and bins from planes.
pub(super) fn pass_report(
    instances: &Instances,
    visible: &Visible,
    options: &CullOptions,
    pass: FramePass,
) -> ReportKey {
    let statistics = options.statistics && pass == FramePass::Late;
    let emit = match &visible.bins {
        Some(bins) => EmitKey::Planes {
            by_index: bins.arrangement == Arrangement::Instances,
            set: bins.plane_set(),
            bins: bin_key(instances, bins, options),
        },
        None => EmitKey::Mask,
    };
    let verdicts = visible.outputs().verdicts;
    let absent = instances.num_absent() > 0;
    ReportKey { mask: true, verdicts, absent, emit, statistics, pass }
}

/// What a pass binds where bins have their planes.
pub(super) fn bound_planes(gpu: &Gpu, visible: &Visible, p: usize) -> Result<wgpu::Buffer> {
    match &visible.bins {
        Some(bins) => Ok(bins.pieces[p].planes.clone()),
        None => gpu.stand_in("hiz.no_list"),
    }
}
