//! The late pass of a frame: it tests all instances against the depth of what the early pass drew.

use crate::cull::groups::{NO_STATISTICS, bind_survivors, is_grouped};
use crate::cull::history::{FrameUniform, Temporal};
use crate::cull::inputs::{CullInputs, check_contexts};
use crate::cull::options::{Coverage, CullOptions, Order};
use crate::cull::pipelines::{FramePass, ReportKey, cull_pipeline};
use crate::cull::record::{
    PieceTarget, Target, check_visible, check_written, record_against_pyramid,
};
use crate::error::{Error, Result};
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::numbers::Copy;
use crate::output::compact::Compaction;

/// Records the late pass of `inputs` into `temporal`.
pub(crate) fn record_late(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    temporal: &Temporal,
) -> Result<()> {
    let CullInputs { instances, camera, options, .. } = *inputs;
    gpu.check_context("temporal", temporal.context)?;
    check_contexts(gpu, inputs)?;
    check_visible(gpu, "temporal", instances, &temporal.late)?;
    check_options(options)?;
    let frame =
        FrameUniform { early: temporal.followed(instances, camera)?, ..FrameUniform::default() };
    gpu.recorded(|| {
        let target = target(gpu, inputs, temporal)?;
        let numbers = gpu.numbers(bytemuck::bytes_of(&frame))?;
        record_against_pyramid(gpu, encoder, inputs, &target, cull_pipeline, |encoder| {
            let size = size_of::<FrameUniform>() as u64;
            numbers.record(encoder, &[Copy { from: 0, target: &temporal.frame, to: 0, size }]);
        })
    })?;
    temporal.note_late(instances);
    Ok(())
}

/// Refuses what two passes cannot promise.
fn check_options(options: &CullOptions) -> Result<()> {
    if options.order == Order::Any {
        return Err(Error::invalid(
            "order",
            "expected Stable, because two passes list from their masks, got Any",
        ));
    }
    if options.coverage == Coverage::Sample && options.guard_px.is_none() {
        return Err(Error::invalid(
            "guard_px",
            "expected a number beside sample coverage in two passes, whose depth the driver draws, \
             got None; it is at least half the driver's sub-pixel step and 0.002 px more: 9/256 \
             covers every Vulkan driver (4 bits, as SwiftShader's), 1/256 those with 8 bits",
        ));
    }
    Ok(())
}

fn target<'a>(gpu: &Gpu, inputs: &CullInputs<'_>, temporal: &'a Temporal) -> Result<Target<'a>> {
    let CullInputs { instances, options, .. } = *inputs;
    let visible = &temporal.late;
    let report = ReportKey {
        pass: FramePass::Late,
        mask: true,
        verdicts: visible.outputs().verdicts,
        append: false,
        list: false,
        capped: false,
        statistics: options.statistics,
    };
    let statistics = if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
    let way = usize::from(report.statistics);
    let mut pieces = Vec::new();
    for (p, (piece, history)) in instances.pieces.iter().zip(&temporal.pieces).enumerate() {
        check_written(visible, p)?;
        check_written(&temporal.early, p)?;
        let members = made(&history.late[way], || {
            let statistics = match statistics {
                Some(statistics) => statistics.clone(),
                None => gpu.stand_in(NO_STATISTICS)?,
            };
            gpu.bind_group(
                "hiz.late.outputs",
                &gpu.layout("hiz.late.layout", report.pass.member_bindings())?,
                &[
                    entry(0, visible.pieces[p].mask.as_entire_binding()),
                    entry(1, history.words.as_entire_binding()),
                    entry(2, temporal.early.pieces[p].mask.as_entire_binding()),
                    entry(3, statistics.as_entire_binding()),
                    entry(4, temporal.frame.as_entire_binding()),
                ],
            )
        })?;
        let groups = if is_grouped(piece, options) {
            let output = visible.pieces[p].groups_or_new(gpu, piece)?;
            let more = [entry(4, history.words.as_entire_binding())];
            let bind = || bind_survivors(gpu, output, statistics, report.pass, &more);
            Some(made(&history.late_groups[way], bind)?.clone())
        } else {
            None
        };
        pieces.push(PieceTarget { members: members.clone(), groups });
    }
    let compaction = match &visible.lists {
        Some(lists) => Some(Compaction::new(gpu, instances, visible, lists)?),
        None => None,
    };
    Ok(Target { visible, report, pieces, compaction })
}
