//! The cull pass: one camera, one pyramid, one set of instances.

mod explain;
mod options;
mod refine;
mod view_uniform;

pub(crate) use explain::{
    BEHIND, CLEAR, ExplanationRecord, LEVEL_MASK, Reading, TEXELS_TOLD, record_explain,
};
pub use options::{Coverage, CullOptions, Fit, Footprint, Hierarchy, Order};
pub(crate) use refine::{Refinement, VERDICT_MASK};
pub(crate) use view_uniform::ViewUniform;

use crate::bounds::BoundsKind;
use crate::camera::Camera;
use crate::compact::Compaction;
use crate::error::{Error, Result};
use crate::gpu::{CullKey, Gpu, ReportKey, StandIn};
use crate::instances::{Instances, Piece};
use crate::layout::CULL_WORKGROUP;
use crate::pyramid::{Built, Pyramid, entry};
use crate::shader::DepthStore;
use crate::visible::{GroupOutput, PieceOutput, Visible};

/// What a cull reads.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CullInputs<'a> {
    pub(crate) instances: &'a Instances,
    pub(crate) camera: &'a Camera,
    pub(crate) pyramid: &'a Pyramid,
    pub(crate) options: &'a CullOptions,
    /// False: the yardstick, for boxes and the flat cull alone.
    pub(crate) certified: bool,
    /// All dispatches are of no workgroups: nothing is culled, but a driver that compiles at the
    /// first dispatch does it.
    pub(crate) idle: bool,
}

fn check_contexts(gpu: &Gpu, inputs: &CullInputs<'_>) -> Result<()> {
    gpu.check_context("instances", inputs.instances.context)?;
    gpu.check_context("pyramid", inputs.pyramid.context)
}

/// What the shader knows of camera and pyramid, and the pipeline that asks for it.
#[derive(Debug)]
struct Seen {
    built: Built,
    /// All levels in one texture, where that pays.
    atlas: Option<wgpu::TextureView>,
    view: ViewUniform,
    key: CullKey,
}

impl Seen {
    /// For `encoder`, which takes the copies into an atlas where one is needed; without it there is
    /// none.
    fn new(
        gpu: &Gpu,
        inputs: &CullInputs<'_>,
        encoder: Option<&mut wgpu::CommandEncoder>,
    ) -> Result<Self> {
        let CullInputs { instances, camera, pyramid, options, .. } = *inputs;
        check_contexts(gpu, inputs)?;
        let built = pyramid.built_for(camera)?;
        // Refused before anything is recorded.
        let view = ViewUniform::new(camera, built.reduction, options, built.tolerance)?;
        Pyramid::check_source(gpu, &built)?;
        let atlas = match encoder.filter(|_| pyramid.wants_atlas(gpu, &built, instances.len())) {
            Some(encoder) => pyramid.record_atlas(gpu, encoder, &built)?,
            None => None,
        };
        let key = CullKey {
            store: if atlas.is_some() {
                DepthStore::Atlas
            } else {
                DepthStore::Apart(built.source_kind)
            },
            kind: instances.kind,
            reversed: camera.convention().is_reversed(),
            chunks: if atlas.is_some() { 1 } else { pyramid.chunks.len() },
            sample_coverage: options.coverage == Coverage::Sample,
            footprint_log2: options.footprint.log2(),
            descent: options.descent > 0,
            fit_volume: options.fit == Fit::Volume,
        };
        Ok(Self { built, atlas, view, key })
    }

    /// The bindings for a test of instances; those of the last cull, if it asked for the same.
    fn bind(&self, gpu: &Gpu, pyramid: &Pyramid) -> Result<wgpu::BindGroup> {
        self.bind_view(gpu, pyramid, self.view)
    }

    /// Those for a test of groups.
    fn bind_for_groups(&self, gpu: &Gpu, pyramid: &Pyramid) -> Result<wgpu::BindGroup> {
        let descent_budget = self.view.descent_budget.max(GROUP_DESCENT);
        self.bind_view(gpu, pyramid, ViewUniform { descent_budget, ..self.view })
    }

    fn bind_view(
        &self,
        gpu: &Gpu,
        pyramid: &Pyramid,
        view: ViewUniform,
    ) -> Result<wgpu::BindGroup> {
        pyramid
            .bindings((self.key.store, bytemuck::cast(view)), || self.create(gpu, pyramid, &view))
    }

    fn create(
        &self,
        gpu: &Gpu,
        pyramid: &Pyramid,
        uniform: &ViewUniform,
    ) -> Result<wgpu::BindGroup> {
        let view = gpu.uniform("hiz.cull.view", uniform)?;
        let mut entries =
            vec![entry(2, pyramid.uniform.as_entire_binding()), entry(6, view.as_entire_binding())];
        if let Some(atlas) = &self.atlas {
            entries.push(entry(3, wgpu::BindingResource::TextureView(atlas)));
        } else {
            entries.push(entry(0, wgpu::BindingResource::TextureView(&self.built.source)));
            entries.push(entry(1, wgpu::BindingResource::Sampler(gpu.sampler())));
            entries.extend(
                (0..3).map(|c| entry(3 + c, pyramid.chunk(gpu, c as usize).as_entire_binding())),
            );
        }
        gpu.bind_group("hiz.cull.view", gpu.layouts().cull(self.key.store), &entries)
    }
}

fn bind_output(
    gpu: &Gpu,
    piece: &Piece,
    visible: &Visible,
    p: usize,
    statistics: bool,
) -> Result<wgpu::BindGroup> {
    let lists = visible.lists.as_ref();
    let list = lists.map_or(gpu.stand_in(StandIn::List), |lists| lists.pieces[p].bound());
    let draws = lists.map_or(gpu.stand_in(StandIn::Draws), |lists| &lists.draws);
    // Any uniform will do where nothing is listed.
    let capacity = lists.map_or(&piece.uniform, |lists| &lists.capacity_uniform);
    let statistics = if statistics {
        visible.statistics_or_new(gpu)?
    } else {
        gpu.stand_in(StandIn::Statistics)
    };
    gpu.bind_group(
        "hiz.cull.visible",
        &gpu.layouts().visible,
        &[
            entry(0, visible.pieces[p].mask.as_entire_binding()),
            entry(1, list.as_entire_binding()),
            entry(2, draws.as_entire_binding()),
            entry(3, statistics.as_entire_binding()),
            entry(4, capacity.as_entire_binding()),
        ],
    )
    .map_err(|error| match error {
        Error::Device(why) => Error::mismatch(
            "visible",
            format!("expected buffers that have not been destroyed, but {why}"),
        ),
        other => other,
    })
}

pub(crate) fn record(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
) -> Result<()> {
    gpu.recorded(|| record_all(gpu, encoder, inputs, visible))
}

fn record_all(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
) -> Result<()> {
    let CullInputs { instances, pyramid, options, .. } = *inputs;
    check_contexts(gpu, inputs)?;
    gpu.check_context("visible", visible.context)?;
    if !visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch(
            "visible",
            "expected buffers that were created for these instances, got others",
        ));
    }
    let report = report_key(visible, options);
    let pieces = || instances.pieces.iter().zip(&visible.pieces);
    // Everything is there before anything is recorded: what could not be made would end the
    // caller's encoder.
    let outputs = pieces()
        .enumerate()
        .map(|(p, (piece, _))| bind_output(gpu, piece, visible, p, report.statistics))
        .collect::<Result<Vec<_>>>()?;
    let compaction = match visible.lists.as_ref().filter(|_| options.order == Order::Stable) {
        Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
        None => None,
    };
    let seen = Seen::new(gpu, inputs, Some(encoder))?;
    let key = seen.key;
    let view = seen.bind(gpu, pyramid)?;
    let grouped = instances.pieces.iter().any(|piece| is_grouped(piece, options));
    let group_view = if grouped { Some(seen.bind_for_groups(gpu, pyramid)?) } else { None };
    let statistics = if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
    let grouped = pieces()
        .map(|(piece, output)| {
            let make = || GroupCull::new(gpu, (key, report), piece, output, statistics);
            is_grouped(piece, options).then(make).transpose()
        })
        .collect::<Result<Vec<_>>>()?;
    let flat = if grouped.iter().all(Option::is_some) {
        None
    } else {
        let pipeline =
            if inputs.certified { Gpu::cull_pipeline } else { Gpu::yardstick_cull_pipeline };
        Some(pipeline(gpu, key, report)?)
    };
    let workgroups = |count: u32| if inputs.idle { 0 } else { count };
    record_clears(gpu, encoder, inputs, visible, report)?;
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some("hiz.cull.pass"),
        timestamp_writes: None,
    });
    pass.set_bind_group(0, &view, &[]);
    for ((piece, output), groups) in instances.pieces.iter().zip(&outputs).zip(&grouped) {
        if let (Some(groups), Some(group_view)) = (groups, &group_view) {
            pass.set_bind_group(0, group_view, &[]);
            groups.record(&mut pass, piece, workgroups(piece.groups().div_ceil(CULL_WORKGROUP)));
            pass.set_bind_group(0, &view, &[]);
        }
        pass.set_bind_group(1, &piece.bindings, &[]);
        pass.set_bind_group(2, output, &[]);
        if let Some(groups) = groups {
            groups.record_members(&mut pass);
        } else if let Some(flat) = &flat {
            pass.set_pipeline(flat);
            pass.dispatch_workgroups(workgroups(piece.groups().div_ceil(GROUPS_OF_RUN)), 1, 1);
        }
    }
    if let Some(compaction) = compaction {
        compaction.record(&mut pass, inputs.idle);
    }
    Ok(())
}

/// What the cull itself writes; an ordered list is made from the mask.
fn report_key(visible: &Visible, options: &CullOptions) -> ReportKey {
    let outputs = visible.outputs();
    let listed = outputs.indices || outputs.draws;
    let ordered = listed && options.order == Order::Stable;
    ReportKey {
        mask: outputs.mask || ordered,
        verdicts: outputs.verdicts,
        append: listed && !ordered,
        list: outputs.indices && !ordered,
        capped: visible.is_capped(),
        statistics: options.statistics,
    }
}

/// Whatever is counted, appended to or set bit by bit begins at nothing.
fn record_clears(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    visible: &Visible,
    report: ReportKey,
) -> Result<()> {
    if let Some(lists) = &visible.lists {
        lists.record_clear(encoder);
    }
    if report.statistics {
        encoder.clear_buffer(visible.statistics_or_new(gpu)?, 0, None);
    }
    for (piece, output) in inputs.instances.pieces.iter().zip(&visible.pieces) {
        if report.mask {
            encoder.clear_buffer(&output.mask, 0, Some(4 * u64::from(piece.words().max(1))));
        }
        if is_grouped(piece, inputs.options) {
            let (from, to) = (gpu.no_survivors()?, &output.groups_or_new(gpu, piece)?.survivors);
            encoder.copy_buffer_to_buffer(from, 0, to, 0, from.size());
        }
    }
    Ok(())
}

/// Groups whose members one workgroup tests; `shaders/shared/groups.wgsl`, `RUN`.
pub(crate) const GROUPS_OF_RUN: u32 = 8;

/// Texels of finer levels that a group's test may read: a box around 64 instances is large, so its
/// footprint is coarse (`docs/performance.md`).
const GROUP_DESCENT: u32 = 16;

/// From how many instances on groups are culled first: fewer are tested one by one before the
/// groups' own dispatches have begun (`docs/performance.md`).
const GROUPS_PAY_FROM: u32 = 16_384;

/// The options of a group's test.
pub(crate) fn group_options(options: &CullOptions) -> CullOptions {
    CullOptions { descent: options.descent.max(GROUP_DESCENT), ..options.clone() }
}

/// The pipeline of a group's test.
fn group_key(key: CullKey) -> CullKey {
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

/// What the cull of a piece in groups binds and runs.
struct GroupCull<'a> {
    output: &'a GroupOutput,
    /// The boxes of the groups, and what is left of them.
    boxes: (wgpu::ComputePipeline, wgpu::BindGroup),
    /// The members of the groups that are left.
    members: (wgpu::ComputePipeline, wgpu::BindGroup),
}

impl<'a> GroupCull<'a> {
    /// `statistics`: where levels are counted, if they are.
    fn new(
        gpu: &Gpu,
        (key, report): (CullKey, ReportKey),
        piece: &Piece,
        output: &'a PieceOutput,
        statistics: Option<&wgpu::Buffer>,
    ) -> Result<Self> {
        let output = output.groups_or_new(gpu, piece)?;
        let counted = statistics.unwrap_or_else(|| gpu.stand_in(StandIn::Statistics));
        let left = gpu.bind_group(
            "hiz.cull.groups",
            &gpu.layouts().survivors,
            &[
                entry(0, output.survivors.as_entire_binding()),
                entry(1, output.verdicts.as_entire_binding()),
                entry(2, wgpu::BindingResource::TextureView(&output.survivor_list)),
                entry(3, counted.as_entire_binding()),
            ],
        )?;
        let members = gpu.bind_group(
            "hiz.cull.survivors",
            &gpu.layouts().members,
            &[
                entry(0, output.survivors.as_entire_binding()),
                entry(1, wgpu::BindingResource::TextureView(&output.survivor_list)),
            ],
        )?;
        Ok(Self {
            output,
            boxes: (gpu.cull_groups_pipeline(group_key(key), statistics.is_some())?, left),
            members: (gpu.cull_members_pipeline(key, report)?, members),
        })
    }

    /// `workgroups`: of the tests of boxes.
    fn record(&self, pass: &mut wgpu::ComputePass<'_>, piece: &Piece, workgroups: u32) {
        pass.set_pipeline(&self.boxes.0);
        pass.set_bind_group(1, &piece.group_bindings, &[]);
        pass.set_bind_group(2, &self.boxes.1, &[]);
        pass.dispatch_workgroups(workgroups, 1, 1);
    }

    fn record_members(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_bind_group(3, &self.members.1, &[]);
        pass.set_pipeline(&self.members.0);
        pass.dispatch_workgroups_indirect(&self.output.survivors, 0);
    }
}
