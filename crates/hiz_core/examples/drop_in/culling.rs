//! Culling dropped into the app: a town of 900 houses, and the 100,000 crates that they hide.
//!
//! The lines with `hiz` are what it takes; `docs/jobs/renderer.md` goes through them.

use super::app::{App, Body};
use hiz_core::wgpu::{CommandBuffer, Device, Extent3d, Queue};
use hiz_core::{self as hiz, Bounds, CullOptions, DrawTemplate, Floats, Outputs, Projection};

pub(crate) const CRATES: u32 = 100_000;
pub(crate) const SIZE: hiz::ImageSize = hiz::ImageSize { width: 1024, height: 576 };
pub(crate) const HOUSES: std::ops::Range<u32> = CRATES..CRATES + 900;

/// Crates lie anywhere; the houses, which come last, stand in 30 rows with streets between them.
pub(crate) fn body(i: u32) -> Body {
    let spread = |k: f64| (600.0 * (f64::from(i) * k).fract() - 300.0) as f32;
    let row = |k: u32| k as f32 * 20.0 - 290.0;
    let (x, z, half, height) = match i.checked_sub(CRATES) {
        None => (spread(0.754_878), spread(0.569_840), 0.4, 1.0),
        Some(k) => (row(k % 30), row(k / 30), 7.0, 12.0 + 0.02 * spread(0.618_034)),
    };
    [[x - half, 0.0, z - half, 1.0], [x + half, height, z + half, 1.0]]
}

/// What makes a frame, with culling or without.
pub(crate) struct Town {
    pub(crate) app: App,
    pub(crate) visible: hiz::Visible,
    device: Device,
    pub(crate) camera: hiz::Camera,
    hiz: hiz::HizContext,
    pyramid: hiz::Pyramid,
    crates: hiz::Instances,
}

impl Town {
    pub(crate) fn new(device: &Device, queue: &Queue) -> hiz::Result<Self> {
        let (eye, target, up) = ([1.0, 15.0, 299.0], [5.0, 5.0, 260.0], [0.0, 1.0, 0.0]);
        let (fov_y, convention) = (1.0, hiz::DepthConvention::Reversed);
        let view = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
        let camera = hiz::Camera::look_at(&hiz::Pose { eye, target, up }, &view, SIZE)?;
        let boxes: Vec<Body> = (0..HOUSES.end).map(body).collect();
        let (width, height) = (SIZE.width, SIZE.height);
        let rows = camera.clip_from_world().map(|row| row.map(|v| v as f32));
        let size = Extent3d { width, height, depth_or_array_layers: 1 };
        let app = App::new(device, size, rows, &boxes);

        // A pyramid of the depth buffer, the bounds of the crates, and what a cull leaves of them.
        let mut encoder = device.create_command_encoder(&Default::default());
        let hiz = hiz::HizContext::new(device)?;
        let pyramid = hiz.create_pyramid(SIZE, &Default::default())?;
        let corners = |k: usize| boxes[..CRATES as usize].iter().flat_map(move |b| &b[k][..3]);
        let [min, max] = [0, 1].map(|k| corners(k).copied().collect::<Vec<f32>>());
        let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
        let crates = hiz.record_instances(&mut encoder, &bounds, &Default::default())?;
        let draw = DrawTemplate { index_count: 14, ..DrawTemplate::default() };
        let outputs = Outputs { indices: true, draws: true, draw, ..Outputs::NONE };
        let visible = hiz.create_visible(&crates, &outputs)?;
        queue.submit([encoder.finish()]);
        let device = device.clone();
        Ok(Self { app, visible, device, camera, hiz, pyramid, crates })
    }

    /// The houses, and then the crates: all of them, or those that the houses may not hide.
    pub(crate) fn frame(&self, culls: bool) -> hiz::Result<CommandBuffer> {
        let Self { app, visible, camera, hiz, pyramid, crates, .. } = self;
        let mut encoder = self.device.create_command_encoder(&Default::default());
        app.pass(&mut encoder, true).draw_indexed(0..14, 0, HOUSES);
        if culls {
            // The app's shader transforms in float32, which takes a little slack.
            let options = CullOptions { transform_slack: 4.0, ..CullOptions::default() };
            hiz.record_reduce(&mut encoder, &app.depth, camera, pyramid)?;
            hiz.record_cull(&mut encoder, crates, camera, pyramid, visible, &options)?;
        }
        let mut pass = app.pass(&mut encoder, false);
        if culls {
            let draws = visible.draw_arguments().expect("among the outputs");
            pass.set_vertex_buffer(0, visible.list(0).expect("among the outputs").slice(..));
            pass.draw_indexed_indirect(draws, visible.draw_offset(0));
        } else {
            pass.draw_indexed(0..14, 0, 0..CRATES);
        }
        drop(pass);
        Ok(encoder.finish())
    }
}
