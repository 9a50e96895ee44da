//! The pass of a cull: it clears the buffers, tests, and compacts.

use crate::cull::among::Among;
use crate::cull::groups::{GROUPS_OF_RUN, GroupCull, NO_STATISTICS, is_grouped};
use crate::cull::inputs::{CullInputs, PreparedView, check_contexts};
use crate::cull::lod::LodRule;
use crate::cull::options::{CullOptions, Order};
use crate::cull::pipelines::{
    BINNED_BINDINGS, BinKey, CullKey, EmitKey, ReportKey, VISIBLE_BINDINGS, cull_pipeline,
};
use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::instances::Instances;
use crate::instances::piece::{CULL_WORKGROUP, Piece};
use crate::output::bins::{Arrangement, Bins};
use crate::output::compact::Compaction;
use crate::output::emit_passes::Emission;
use crate::output::lists::Copied;
use crate::output::survivors::NO_SURVIVORS;
use crate::output::visible::Visible;

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
    // A bind group does not tell that one of its buffers was destroyed since.
    let listed = lists.map(|lists| [&lists.draws, lists.pieces[p].bound()]);
    let binned =
        bins.map(|bins| [&bins.draws, &bins.draw_counts].into_iter().chain(&bins.pieces[p].list));
    let mut written = [&output.mask]
        .into_iter()
        .chain(listed.into_iter().flatten())
        .chain(binned.into_iter().flatten())
        .chain(lists.and_then(|lists| lists.copied.as_ref()).map(Copied::buffer));
    written
        .try_for_each(check_alive)
        .and_then(|()| {
            made(&output.bindings[usize::from(report.statistics) + 2 * usize::from(appends)], bind)
        })
        .map_err(|error| match error {
            Error::Device(why) => Error::mismatch(
                "visible",
                format!("expected buffers that have not been destroyed, but {why}"),
            ),
            other => other,
        })
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
    let CullInputs { instances, pyramid, options, .. } = *inputs;
    check_contexts(gpu, inputs)?;
    gpu.check_context("visible", visible.context)?;
    if !visible.counts().iter().copied().eq(instances.pieces.iter().map(Piece::count)) {
        return Err(Error::mismatch(
            "visible",
            "expected buffers that were created for these instances, got others",
        ));
    }
    let report = report_key(instances, visible, options)?;
    let pieces = || instances.pieces.iter().zip(&visible.pieces);
    // Make everything before recording anything: an object that cannot be made would invalidate the
    // caller's encoder.
    let outputs = pieces()
        .enumerate()
        .map(|(p, (piece, _))| {
            let written = bind_output(gpu, piece, visible, p, &report)?;
            Ok((bind_records(gpu, piece, visible, p, inputs.among)?, written))
        })
        .collect::<Result<Vec<_>>>()?;
    let planes = matches!(report.emit, EmitKey::Planes { .. });
    let emission = match visible.bins.as_ref().filter(|_| planes) {
        Some(bins) => Some(Emission::new(gpu, instances, bins)?),
        None => None,
    };
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
    for (p, ((piece, (records, output)), groups)) in of_pieces.enumerate() {
        if let (Some(groups), Some(group_view)) = (groups, &view.groups) {
            pass.set_bind_group(0, group_view, &[]);
            groups.record_boxes(
                &mut pass,
                inputs.among.map_or(&piece.group_bindings, |among| among.group_records(p)),
                workgroups(piece.groups().div_ceil(CULL_WORKGROUP)),
            );
            pass.set_bind_group(0, &view.instances, &[]);
        }
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
    if let Some(emission) = emission {
        emission.record(&mut pass, inputs.idle);
    }
    Ok(())
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
        if bins.instances != instances.id {
            return Err(Error::mismatch(
                "visible",
                "expected buffers that were created for these instances, got others: bins belong \
                 to the mesh ids of their instances",
            ));
        }
        let has_lods = bins.meshes.most_lods() > 1 && options.lod != LodRule::Finest;
        let of_bins = BinKey {
            sorted: instances.pieces.iter().any(|p| p.slots.is_some()),
            lod_rule: has_lods.then(|| options.lod.code()),
        };
        match (any_order, bins.can_append()) {
            (false, _) => EmitKey::Planes {
                by_index: bins.arrangement == Arrangement::Instances,
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
    Ok(ReportKey { mask, verdicts, emit, statistics })
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
    if let Some(bins) = &visible.bins {
        let appends = matches!(report.emit, EmitKey::Append { .. });
        bins.record_clear(encoder, appends, inputs.idle);
        if !appends {
            bins.record_clear_planes(encoder);
        }
        bins.meshes.record(encoder);
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
