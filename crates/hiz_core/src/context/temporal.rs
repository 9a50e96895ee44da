//! The face of the two passes of a frame.

use super::HizContext;
use crate::cull::early::record_early;
use crate::cull::history::{EarlySet, Temporal};
use crate::cull::inputs::CullInputs;
use crate::cull::late::record_late;
use crate::cull::options::CullOptions;
use crate::error::Result;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::pyramid::Pyramid;

#[cfg(doc)]
use crate::error::Error;

/// The two passes of a frame: what was visible before, then the rest.
impl HizContext {
    /// Makes the two passes of a view: the buffers that they fill, and its history.
    ///
    /// The capacity of `outputs` is that of the early pass's list.
    /// What exceeds it is not drawn early, and the late pass draws what of it is visible.
    /// The late pass's list has room for all instances.
    /// Verdicts are those of the late pass.
    ///
    /// # Errors
    /// Those of [`create_visible`](Self::create_visible), and [`Error::Invalid`] for outputs without
    /// mask, indices and draws.
    pub fn create_temporal(&self, instances: &Instances, outputs: &Outputs) -> Result<Temporal> {
        Temporal::new(&self.gpu, instances, outputs)
    }

    /// Records the early pass of a frame, which needs no depth image: [`Temporal::early`] takes
    /// what is drawn first.
    ///
    /// A frame goes on like this:
    ///
    /// 1. Draw [`Temporal::early`] into an empty depth buffer.
    /// 2. [`record_reduce`](Self::record_reduce) that depth buffer.
    /// 3. [`record_late`](Self::record_late), and draw [`Temporal::late`] into the same depth
    ///    buffer.
    ///
    /// Then the image equals that of all instances, whatever the early pass drew.
    /// `docs/accuracy.md` has the proof and its conditions.
    ///
    /// `options` are those of the late pass.
    /// Of them only the hierarchy, the rule of LODs and the errors of the transform count here.
    ///
    /// A frame whose early pass is dropped, or never recorded, draws some instances twice and loses
    /// none.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for objects of another context, for instances of other numbers than
    ///   `temporal` was made for, and for destroyed buffers.
    /// - [`Error::Invalid`] for a mask without room for all instances or without the usage
    ///   `STORAGE`, for [`Order::Any`](crate::Order::Any), for unusable options, and for a camera
    ///   that float32 cannot hold.
    /// - [`Error::OutOfMemory`].
    ///
    /// # Examples
    /// A wall that hides a ball, and slides away in the second frame:
    ///
    /// ```
    /// # use hiz_core::headless::Engine;
    /// use hiz_core::{Bounds, CullOptions, EarlySet, Floats, InstanceOptions, Outputs};
    /// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, PyramidOptions, wgpu};
    /// # let engine = Engine::new(None)?;
    /// # let (device, queue, hiz) = (engine.device(), engine.queue(), engine.context());
    /// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    /// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
    /// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    /// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
    /// # let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
    /// # let bounds = |x: f32| -> ([f32; 6], [f32; 6]) {
    /// #     ([x - 20.0, -20.0, -10.5, -0.5, -0.5, -20.5], [x + 20.0, 20.0, -10.0, 0.5, 0.5, -20.0])
    /// # };
    /// # // What the renderer draws of the two boxes: the wall's front is at z = -10.
    /// # let draw = |is_wall: bool| {
    /// #     engine.upload_depth(&[if is_wall { 0.01 } else { 0.0 }; 64 * 64], &camera)
    /// # };
    /// # let read = |visible: &hiz_core::Visible| {
    /// #     let (told, answer) = std::sync::mpsc::channel();
    /// #     let mask = visible.mask(0).unwrap().slice(..4);
    /// #     wgpu::util::DownloadBuffer::read_buffer(device, queue, &mask, move |bytes| {
    /// #         told.send(bytes.unwrap()[0]).unwrap();
    /// #     });
    /// #     engine.wait().unwrap();
    /// #     answer.recv().unwrap()
    /// # };
    /// let (min, max) = bounds(0.0);
    /// let bounds_0 = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
    /// let instances = engine.instances(&bounds_0, &InstanceOptions::default())?;
    /// let passes = hiz.create_temporal(&instances, &Outputs { mask: true, ..Outputs::NONE })?;
    /// let options = CullOptions::default();
    /// for (frame, x) in [0.0, 0.0, 100.0].into_iter().enumerate() {
    ///     let (min, max) = bounds(x);
    ///     let moved = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
    ///     engine.update(&instances, 0, &moved, false)?;
    ///
    ///     let mut encoder = device.create_command_encoder(&Default::default());
    ///     let set = EarlySet::LastVisible;
    ///     hiz.record_early(&mut encoder, &instances, &camera, &passes, set, &options)?;
    ///     # queue.submit([encoder.finish()]);
    ///     # let mut encoder = device.create_command_encoder(&Default::default());
    ///     # let early = read(passes.early());
    ///     # let depth_image = draw(early & 1 != 0 && x == 0.0)?;
    ///     # let depth = depth_image.texture().create_view(&Default::default());
    ///     // Draw passes.early() into the depth buffer.
    ///     hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
    ///     hiz.record_late(&mut encoder, &instances, &camera, &pyramid, &passes, &options)?;
    ///     // Draw passes.late() into the same depth buffer.
    ///     queue.submit([encoder.finish()]);
    ///     # let late = read(passes.late());
    ///     # // The first frame begins by size: wall and ball are both larger than 12 pixels or not.
    ///     # if frame == 1 { assert_eq!((early, late), (0b01, 0)); }
    ///     # if frame == 2 { assert_eq!((early, late), (0, 0b10)); }
    /// }
    /// # Ok::<(), hiz_core::Error>(())
    /// ```
    pub fn record_early(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        temporal: &Temporal,
        set: EarlySet<'_>,
        options: &CullOptions,
    ) -> Result<()> {
        record_early(&self.gpu, encoder, instances, camera, temporal, set, options)
    }

    /// Records the late pass of a frame: [`Temporal::late`] takes what is visible and was not drawn
    /// by the early pass.
    ///
    /// `pyramid` was built from the depth that the early pass's list left, and camera and instances
    /// are those of [`record_early`](Self::record_early).
    /// Without an early pass since the last late one, nothing counts as drawn.
    ///
    /// The depth of the early pass comes from the renderer's own rasteriser.
    /// So sample coverage needs an explicit guard here: at least half the driver's sub-pixel step,
    /// and 0.002 px more.
    /// 9/256 px covers the 4 bits that Vulkan asks for, which `SwiftShader` has; 1/256 px covers 8
    /// bits.
    ///
    /// # Errors
    /// - Those of [`record_cull`](Self::record_cull).
    /// - [`Error::Mismatch`] for another camera or rule of LODs, for other instances, or for
    ///   instances that were updated since `record_early`.
    /// - [`Error::Invalid`] for [`Order::Any`](crate::Order::Any), and for sample coverage without
    ///   a guard.
    pub fn record_late(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        temporal: &Temporal,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = CullInputs::new(instances, camera, pyramid, options);
        record_late(&self.gpu, encoder, &inputs, temporal)?;
        pyramid.hold_image(encoder);
        Ok(())
    }
}
