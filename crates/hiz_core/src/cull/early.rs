//! The early pass of a frame: it lists what is drawn before there is a depth image.

use crate::cull::groups::{NO_STATISTICS, bind_survivors, tiers_of};
use crate::cull::history::{EarlySet, FrameUniform, Temporal};
use crate::cull::no_depth::{NO_REDUCTION, bind_view};
use crate::cull::options::{CullOptions, Order};
use crate::cull::pipelines::{Candidates, CullKey, FramePass, cull_pipeline};
use crate::cull::record::{Target, Tests, bound_planes, check_visible, check_written, pass_report};
use crate::cull::shadow::check_no_shadow;
use crate::cull::view_uniform::ViewUniform;
use crate::error::{Error, Result};
use crate::gpu::buffers::{check_alive, entry, made};
use crate::gpu::device::Gpu;
use crate::gpu::numbers::{Copy, UNIFORM_BYTES};
use crate::input::camera::Camera;
use crate::input::tolerance::DepthTolerance;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::cut::Cut;
use crate::output::visible::PieceOutput;
use crate::pyramid::PyramidUniform;

/// An early pass, as the shaders are told.
struct Chosen<'a> {
    candidates: Candidates,
    least_pixels: u32,
    given: Option<&'a wgpu::Buffer>,
}

impl<'a> Chosen<'a> {
    fn new(set: EarlySet<'a>, instances: &Instances) -> Result<Self> {
        let (candidates, least_pixels, given) = match set {
            EarlySet::LastVisible => (Candidates::History, 0, None),
            EarlySet::Largest { pixels } => (Candidates::Size, pixels, None),
            EarlySet::Given(mask) => (Candidates::Given, 0, Some(mask)),
        };
        if let Some(mask) = given {
            let least = 4 * u64::from(instances.len().div_ceil(32).max(1));
            if !mask.usage().contains(wgpu::BufferUsages::STORAGE) || mask.size() < least {
                return Err(Error::invalid(
                    "set",
                    format!(
                        "expected a buffer of at least {least} bytes with the usage STORAGE, a bit \
                         per instance, got {} bytes with {:?}",
                        mask.size(),
                        mask.usage()
                    ),
                ));
            }
            check_alive(mask).map_err(|error| match error {
                Error::Device(why) => Error::mismatch(
                    "set",
                    format!("expected a buffer that has not been destroyed, but {why}"),
                ),
                other => other,
            })?;
        }
        Ok(Self { candidates, least_pixels, given })
    }
}

/// Records an early pass of `instances` into `temporal`.
pub(crate) fn record_early(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    camera: &Camera,
    temporal: &Temporal,
    set: EarlySet<'_>,
    options: &CullOptions,
) -> Result<()> {
    gpu.check_context("temporal", temporal.context)?;
    gpu.check_context("instances", instances.context)?;
    check_visible(gpu, "temporal", instances, &temporal.early)?;
    let set = Chosen::new(temporal.set_or_largest(set, instances), instances)?;
    check_order(options)?;
    check_no_shadow(options, "an early pass")?;
    let view =
        ViewUniform::new(camera, instances.kind, NO_REDUCTION, options, DepthTolerance::NONE)?;
    let number = temporal.next_number();
    let frame = FrameUniform {
        early: number,
        least_pixels: i32::try_from(set.least_pixels).unwrap_or(i32::MAX),
        ..FrameUniform::default()
    };
    let numbers =
        |encoder: &mut wgpu::CommandEncoder| record_numbers(gpu, encoder, temporal, &view, &frame);
    record_tests(gpu, encoder, (instances, temporal), (&set, options), Some(numbers))?;
    temporal.note_early(number, instances, camera, options);
    Ok(())
}

/// Records early passes that do nothing: of the candidates that a first frame has, and of those
/// that later frames have.
pub(super) fn record_idle_early(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    instances: &Instances,
    temporal: &Temporal,
    options: &CullOptions,
) -> Result<()> {
    gpu.check_context("temporal", temporal.context)?;
    check_visible(gpu, "temporal", instances, &temporal.early)?;
    check_order(options)?;
    for candidates in [Candidates::Size, Candidates::History, Candidates::Given] {
        let set = Chosen { candidates, least_pixels: 0, given: None };
        let no_numbers = None::<fn(&mut wgpu::CommandEncoder) -> Result<()>>;
        record_tests(gpu, encoder, (instances, temporal), (&set, options), no_numbers)?;
    }
    Ok(())
}

/// Records the tests of an early pass, behind its numbers.
/// Without numbers every dispatch of a test has zero workgroups.
fn record_tests(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    (instances, temporal): (&Instances, &Temporal),
    (set, options): (&Chosen<'_>, &CullOptions),
    numbers: Option<impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>>,
) -> Result<()> {
    gpu.recorded(|| {
        let target = target(gpu, instances, options, temporal, set)?;
        let decision = FramePass::Early(set.candidates).decision();
        let key = CullKey { decision, ..CullKey::without_depth(instances.kind, false) };
        let tests = Tests::new(gpu, key, &target, cull_pipeline)?;
        let bindings = temporal.pieces.iter().map(|history| &history.cut);
        let cut = Cut::new(gpu, instances, &temporal.early, bindings)?;
        let view = made(&temporal.view_bindings, || bind_early_view(gpu, temporal))?;
        let idle = numbers.is_none();
        if let Some(record) = numbers {
            record(encoder)?;
        }
        tests.record(gpu, encoder, instances, [view, view], idle, cut.as_ref())
    })
}

/// Refuses an order that masks cannot give.
pub(super) fn check_order(options: &CullOptions) -> Result<()> {
    if options.order == Order::Stable {
        return Ok(());
    }
    Err(Error::invalid("order", "expected Stable, because two passes list from masks, got Any"))
}

fn target<'a>(
    gpu: &Gpu,
    instances: &Instances,
    options: &CullOptions,
    temporal: &'a Temporal,
    set: &Chosen<'_>,
) -> Result<Target<'a>> {
    let visible = &temporal.early;
    let report = pass_report(instances, visible, options, FramePass::Early(set.candidates));
    let given = match set.given {
        Some(given) => given.clone(),
        None => gpu.stand_in("hiz.no_given")?,
    };
    let bind = |p: usize, piece: &Piece, output: &PieceOutput| {
        check_written(visible, p)?;
        let history = &temporal.pieces[p];
        let outputs = history.early.get(given.clone(), || {
            gpu.bind_group(
                "hiz.early.outputs",
                &gpu.layout("hiz.early.layout", report.pass.member_bindings())?,
                &[
                    entry(0, output.mask.as_entire_binding()),
                    entry(1, bound_planes(gpu, visible, p)?.as_entire_binding()),
                    entry(2, history.words.as_entire_binding()),
                    entry(3, gpu.stand_in(NO_STATISTICS)?.as_entire_binding()),
                    entry(4, temporal.frame.as_entire_binding()),
                    entry(5, given.as_entire_binding()),
                ],
            )
        })?;
        let bind_tier = |tier: usize| {
            let output = output.groups_or_new(gpu, piece)?;
            let more = [
                entry(4, history.words.as_entire_binding()),
                entry(5, temporal.frame.as_entire_binding()),
            ];
            let bind = || bind_survivors(gpu, (output, tier), None, report.pass, &more);
            made(&history.early_groups[tier], bind).cloned()
        };
        let groups = (0..tiers_of(piece, options)).map(bind_tier).collect::<Result<_>>()?;
        Ok((outputs, groups))
    };
    Target::new(gpu, (instances, options, None), visible, report, bind)
}

/// What an early pass binds as its view: the camera, and a pyramid that is never read.
fn bind_early_view(gpu: &Gpu, temporal: &Temporal) -> Result<wgpu::BindGroup> {
    let zeros = [0; size_of::<PyramidUniform>()];
    let pyramid = gpu.constant("hiz.no_pyramid", &zeros, wgpu::BufferUsages::UNIFORM)?;
    bind_view(gpu, "hiz.early.view", &pyramid, &temporal.view)
}

/// Records the copies of the view and of the frame.
/// The histories get the number of the pass: they have it once this pass has run.
fn record_numbers(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    temporal: &Temporal,
    view: &ViewUniform,
    frame: &FrameUniform,
) -> Result<()> {
    let (view, frame) = (bytemuck::bytes_of(view), bytemuck::bytes_of(frame));
    let behind = UNIFORM_BYTES as usize;
    let mut staged = vec![0; behind + frame.len()];
    staged[..view.len()].copy_from_slice(view);
    staged[behind..].copy_from_slice(frame);
    let of_frame = |target, size| Copy { from: UNIFORM_BYTES, target, to: 0, size };
    let mut copies = vec![
        Copy { from: 0, target: &temporal.view, to: 0, size: view.len() as u64 },
        of_frame(&temporal.frame, frame.len() as u64),
    ];
    copies.extend(temporal.pieces.iter().map(|history| of_frame(&history.words, 4)));
    gpu.numbers(&staged)?.record(encoder, &copies);
    Ok(())
}
