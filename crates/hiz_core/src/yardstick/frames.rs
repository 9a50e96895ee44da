//! Frames of a renderer with the time of each `record_*` call, to compare the first with later
//! ones.

use std::time::Instant;

use crate::cull::options::CullOptions;
use crate::cull::warm_up::{WarmUp, WarmUpMore};
use crate::error::Result;
use crate::headless::{Engine, readback};
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::occluders::device_raster::OCCLUDER_DEPTH_FORMAT;
use crate::occluders::drawing::DrawOptions;
use crate::occluders::uploaded::Occluders;
use crate::output::outputs::Outputs;
use crate::pyramid::PyramidOptions;

/// Milliseconds of one frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameTimes {
    /// `record_occluders`.
    pub occluders: f64,
    /// `record_reduce`.
    pub reduce: f64,
    /// `record_cull`.
    pub cull: f64,
    /// From the submit to the end of its work.
    pub device: f64,
}

/// Runs a frame for each camera, all of one image size and depth convention.
/// Returns their times, and before them the milliseconds of the warm-up: 0 without it.
///
/// # Errors
/// Those of the calls of a frame, and [`Error::DeviceLost`](crate::Error::DeviceLost).
pub fn frames(
    engine: &Engine,
    instances: &Instances,
    occluders: &Occluders,
    cameras: &[Camera],
    options: &CullOptions,
    is_warmed: bool,
) -> Result<(f64, Vec<FrameTimes>)> {
    let (context, gpu) = (engine.context(), &engine.context().gpu);
    let Some(camera) = cameras.first() else { return Ok((0.0, Vec::new())) };
    let size = (camera.size().width, camera.size().height);
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
        | wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_SRC;
    let texture = gpu.texture("hiz.yardstick.depth", size, OCCLUDER_DEPTH_FORMAT, usage)?;
    let depth = gpu.view(&texture)?;
    let pyramid = context.create_pyramid(camera.size(), &PyramidOptions::default())?;
    let outputs = Outputs { mask: true, indices: true, draws: true, ..Outputs::NONE };
    let visible = context.create_visible(instances, &outputs)?;
    readback::wait(engine.device(), None)?;
    let submitted = |encoder: wgpu::CommandEncoder| {
        let start = Instant::now();
        let submission = engine.queue().submit([encoder.finish()]);
        readback::wait(engine.device(), Some(submission))?;
        Ok(ms(start))
    };
    let encoder =
        || engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut warm_up = 0.0;
    if is_warmed {
        let frame = WarmUp {
            occluders: Some(occluders),
            depth: &depth,
            camera,
            pyramid: &pyramid,
            instances,
            visible: &visible,
            options,
            updates: true,
            more: WarmUpMore::default(),
        };
        let (start, mut encoder) = (Instant::now(), encoder());
        context.record_warm_up(&mut encoder, &frame)?;
        submitted(encoder)?;
        warm_up = ms(start);
    }
    let frame = |camera: &Camera| {
        let mut encoder = encoder();
        let start = Instant::now();
        context.record_occluders(
            &mut encoder,
            occluders,
            camera,
            &depth,
            &DrawOptions::default(),
        )?;
        let (of_occluders, start) = (ms(start), Instant::now());
        context.record_reduce(&mut encoder, &depth, camera, &pyramid)?;
        let (of_reduce, start) = (ms(start), Instant::now());
        context.record_cull(&mut encoder, instances, camera, &pyramid, &visible, options)?;
        Ok(FrameTimes {
            occluders: of_occluders,
            reduce: of_reduce,
            cull: ms(start),
            device: submitted(encoder)?,
        })
    };
    Ok((warm_up, cameras.iter().map(frame).collect::<Result<_>>()?))
}

fn ms(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
