//! The late pass of a frame: it tests all instances against the depth of what the early pass drew.

use crate::cull::early::check_order;
use crate::cull::groups::{NO_STATISTICS, bind_survivors, tiers_of};
use crate::cull::history::{FrameUniform, HISTORY_BEGIN, Temporal};
use crate::cull::inputs::{CullInputs, check_contexts};
use crate::cull::options::{Coverage, CullOptions};
use crate::cull::pipelines::{FramePass, cull_pipeline};
use crate::cull::record::{
    Target, bound_planes, check_visible, check_written, pass_report, record_against_pyramid,
};
use crate::cull::shadow::check_no_shadow;
use crate::error::{Error, Result};
use crate::gpu::buffers::{entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::numbers::Copy;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::visible::{PieceOutput, early_offset};

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
    check_order(options)?;
    check_no_shadow(options, "a late pass")?;
    check_guard(options)?;
    let early = temporal.followed(instances, camera, options)?;
    let frame = FrameUniform { early, ..FrameUniform::default() };
    gpu.recorded(|| {
        let target = target(gpu, inputs, temporal)?;
        let numbers = gpu.numbers(bytemuck::bytes_of(&frame))?;
        record_against_pyramid(gpu, encoder, inputs, &target, cull_pipeline, |encoder| {
            let size = size_of::<FrameUniform>() as u64;
            numbers.record(encoder, &[Copy { from: 0, target: &temporal.frame, to: 0, size }]);
            for history in &temporal.pieces {
                encoder.clear_buffer(&history.words, 4 * u64::from(HISTORY_BEGIN), None);
            }
            record_copies(encoder, instances, temporal);
        })
    })?;
    temporal.note_late(instances);
    Ok(())
}

/// Records a late pass that does nothing; `inputs` are idle.
pub(super) fn record_idle_late(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    inputs: &CullInputs<'_>,
    temporal: &Temporal,
) -> Result<()> {
    check_visible(gpu, "temporal", inputs.instances, &temporal.late)?;
    check_guard(inputs.options)?;
    gpu.recorded(|| {
        let target = target(gpu, inputs, temporal)?;
        record_against_pyramid(gpu, encoder, inputs, &target, cull_pipeline, |_| ())
    })
}

/// Refuses sample coverage whose guard might be too small for the driver's rasteriser.
fn check_guard(options: &CullOptions) -> Result<()> {
    if options.coverage == Coverage::Area || options.guard_px.is_some() {
        return Ok(());
    }
    Err(Error::invalid(
        "guard_px",
        "expected a number beside sample coverage in two passes, whose depth a driver draws, got \
         None; take at least half of the driver's sub-pixel step and 0.002 px more: 9/256 for 4 \
         bits (every Vulkan driver, SwiftShader), 1/256 for 8 bits",
    ))
}

/// Records the copies of the early pass's masks to where the tests read them.
/// A binding of their own would be one too many for the default limits of WebGPU.
fn record_copies(encoder: &mut wgpu::CommandEncoder, instances: &Instances, temporal: &Temporal) {
    let has_verdicts = temporal.late.outputs().verdicts;
    let masks = temporal.early.pieces.iter().zip(&temporal.late.pieces);
    for (piece, (early, late)) in instances.pieces.iter().zip(masks) {
        let (to, size) = (early_offset(piece, has_verdicts), 4 * u64::from(piece.words()));
        if size > 0 {
            encoder.copy_buffer_to_buffer(&early.mask, 0, &late.mask, to, size);
        }
    }
}

fn target<'a>(gpu: &Gpu, inputs: &CullInputs<'_>, temporal: &'a Temporal) -> Result<Target<'a>> {
    let CullInputs { instances, options, .. } = *inputs;
    let visible = &temporal.late;
    let report = pass_report(instances, visible, options, FramePass::Late);
    let statistics = if report.statistics { Some(visible.statistics_or_new(gpu)?) } else { None };
    let way = usize::from(report.statistics);
    let bind = |p: usize, piece: &Piece, output: &PieceOutput| {
        check_written(visible, p)?;
        check_written(&temporal.early, p)?;
        let history = &temporal.pieces[p];
        let outputs = made(&history.late[way], || {
            let statistics = match statistics {
                Some(statistics) => statistics.clone(),
                None => gpu.stand_in(NO_STATISTICS)?,
            };
            gpu.bind_group(
                "hiz.late.outputs",
                &gpu.layout("hiz.late.layout", report.pass.member_bindings())?,
                &[
                    entry(0, output.mask.as_entire_binding()),
                    entry(1, bound_planes(gpu, visible, p)?.as_entire_binding()),
                    entry(2, history.words.as_entire_binding()),
                    entry(3, statistics.as_entire_binding()),
                    entry(4, temporal.frame.as_entire_binding()),
                ],
            )
        })?;
        let bind_tier = |tier: usize| {
            let groups = output.groups_or_new(gpu, piece)?;
            let bind = || bind_survivors(gpu, (groups, tier), statistics, report.pass, &[]);
            made(&groups.tiers[tier].bindings[way], bind).cloned()
        };
        let groups = (0..tiers_of(piece, options)).map(bind_tier).collect::<Result<_>>()?;
        Ok((outputs.clone(), groups))
    };
    Target::new(gpu, (instances, options, None), visible, report, bind)
}
