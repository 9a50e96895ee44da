//! The pass of a cull: it clears the buffers, tests, and compacts.

use crate::cull::groups::{GROUPS_OF_RUN, GroupCull, NO_STATISTICS, is_grouped};
use crate::cull::inputs::{CullInputs, PreparedView, check_contexts};
use crate::cull::options::{CullOptions, Order};
use crate::cull::pipelines::{CullKey, ReportKey, VISIBLE_BINDINGS, cull_pipeline};
use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::instances::piece::{CULL_WORKGROUP, Piece};
use crate::output::compact::Compaction;
use crate::output::survivors::NO_SURVIVORS;
use crate::output::visible::Visible;

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
    // A bind group does not tell that one of its buffers was destroyed since.
    let listed = lists.map(|lists| [&lists.draws, lists.pieces[p].bound()]);
    let mut written = [&output.mask].into_iter().chain(listed.into_iter().flatten());
    written
        .try_for_each(check_alive)
        .and_then(|()| made(&output.bindings[usize::from(statistics)], bind))
        .map_err(|error| match error {
            Error::Device(why) => Error::mismatch(
                "visible",
                format!("expected buffers that have not been destroyed, but {why}"),
            ),
            other => other,
        })
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
    // Make everything before recording anything: an object that cannot be made would invalidate the
    // caller's encoder.
    let outputs = pieces()
        .enumerate()
        .map(|(p, (piece, _))| bind_output(gpu, piece, visible, p, report.statistics))
        .collect::<Result<Vec<_>>>()?;
    let compaction = match visible.lists.as_ref().filter(|_| options.order == Order::Stable) {
        Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
        None => None,
    };
    let seen = PreparedView::new(gpu, inputs, Some(encoder))?;
    let key = seen.key;
    let grouped = instances.pieces.iter().any(|piece| is_grouped(piece, options));
    let mut view = seen.bind(gpu, pyramid, grouped)?;
    let statistics = if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
    let grouped = pieces()
        .map(|(piece, output)| {
            let make = || GroupCull::new(gpu, (key, report), piece, output, statistics);
            is_grouped(piece, options).then(make).transpose()
        })
        .collect::<Result<Vec<_>>>()?;
    let flat =
        if grouped.iter().all(Option::is_some) { None } else { Some(flat(gpu, &key, &report)?) };
    let workgroups = |count: u32| if inputs.idle { 0 } else { count };
    view.record(encoder, pyramid);
    record_clears(gpu, encoder, inputs, visible, report)?;
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some("hiz.cull.pass"),
        timestamp_writes: None,
    });
    pass.set_bind_group(0, &view.instances, &[]);
    let of_pieces = instances.pieces.iter().zip(&outputs).zip(&grouped);
    for (p, ((piece, output), groups)) in of_pieces.enumerate() {
        if let (Some(groups), Some(group_view)) = (groups, &view.groups) {
            pass.set_bind_group(0, group_view, &[]);
            groups.record_boxes(
                &mut pass,
                inputs.among.map_or(&piece.group_bindings, |among| among.group_records(p)),
                workgroups(piece.groups().div_ceil(CULL_WORKGROUP)),
            );
            pass.set_bind_group(0, &view.instances, &[]);
        }
        let records = inputs.among.map_or(&piece.bindings, |among| among.records(p));
        pass.set_bind_group(1, records, &[]);
        pass.set_bind_group(2, *output, &[]);
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

/// What the cull's own pass writes.
/// An ordered list is made from the mask instead.
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

/// Clears whatever is counted, appended to or set bit by bit.
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
            let contents = bytemuck::bytes_of(&NO_SURVIVORS);
            let from =
                gpu.constant("hiz.cull.no_survivors", contents, wgpu::BufferUsages::COPY_SRC)?;
            let to = &output.groups_or_new(gpu, piece)?.survivors;
            encoder.copy_buffer_to_buffer(&from, 0, to, 0, from.size());
        }
    }
    Ok(())
}
