//! The face of culls: of one view, of some instances, of several views.

use super::HizContext;
use crate::cull::among::{Among, AmongMask, record_among};
use crate::cull::approximate::{Approximate, record_cull_approximate};
use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::cull::views::{View, ViewsInputs, record_cull_views};
use crate::error::Result;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::output::views::{ViewsOutputs, VisibleViews};
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

#[cfg(doc)]
use crate::error::Error;

/// Culls of one view, of some instances, and of several views.
impl HizContext {
    /// Makes the buffers that take what a cull of `instances` finds.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for instances of another context.
    /// - [`Error::Invalid`] for a
    ///   [`DrawTemplate::first_instance`](crate::DrawTemplate::first_instance) other than 0 on a
    ///   device without the feature `INDIRECT_FIRST_INSTANCE`, for an
    ///   [`Emit`](crate::Emit) that needs the feature, and for mesh ids past the mesh table.
    /// - [`Error::Limit`] for lists or draws that do not fit one binding.
    /// - [`Error::OutOfMemory`].
    /// - [`Error::Device`] if the device is lost.
    pub fn create_visible(&self, instances: &Instances, outputs: &Outputs) -> Result<Visible> {
        Visible::new(&self.gpu, instances, outputs)
    }

    /// Records the cull of `instances` against `pyramid`; the buffers of `visible` take what it
    /// finds.
    ///
    /// The pyramid must have been built from a depth image of `camera`.
    /// Large culls first copy the depth image and the stored levels into one atlas texture
    /// ([`AtlasUse`](crate::AtlasUse)).
    /// This pays once instances number at least a quarter of the texels copied.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for objects that do not belong together, for a depth image that was
    ///   destroyed since its reduction and for destroyed buffers of `visible`.
    /// - [`Error::Invalid`] for unusable options or cameras.
    /// - [`Error::OutOfMemory`].
    pub fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = CullInputs::new(instances, camera, pyramid, options);
        record_cull(&self.gpu, encoder, &inputs, visible)?;
        pyramid.hold_image(encoder);
        Ok(())
    }

    /// Makes room for the instances that culls of `instances` may be restricted to; none at first.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for instances of another context.
    /// - [`Error::OutOfMemory`].
    pub fn create_among(&self, instances: &Instances) -> Result<Among> {
        Among::new(&self.gpu, instances)
    }

    /// Records a pass that fills `among` with the instances of a mask.
    ///
    /// A mask on the device never visits the host: the shadow casters of a cascade are those that
    /// the light's cull has kept and that lie in the cascade's slice.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for objects of another context or of other instances, and for a cull
    ///   without a mask.
    /// - [`Error::Invalid`] for another number of words.
    /// - [`Error::OutOfMemory`].
    pub fn record_among(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        mask: &AmongMask<'_>,
        among: &Among,
    ) -> Result<()> {
        record_among(&self.gpu, encoder, instances, mask, among)
    }

    /// [`record_cull`](Self::record_cull) of the instances `among` alone.
    ///
    /// The others are not kept, and not tested: groups without one that is asked for cost as much
    /// as hidden ones.
    ///
    /// # Errors
    /// Those of `record_cull`, and [`Error::Mismatch`] for an `among` of other instances.
    #[expect(clippy::too_many_arguments, reason = "as record_cull, and among")]
    pub fn record_cull_among(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        among: &Among,
        camera: &Camera,
        pyramid: &Pyramid,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = CullInputs::new(instances, camera, pyramid, options);
        record_cull(&self.gpu, encoder, &CullInputs { among: Some(among), ..inputs }, visible)?;
        pyramid.hold_image(encoder);
        Ok(())
    }

    /// Makes the buffers that take what culls for `views` views find, of 1..=[`MAX_VIEWS`].
    ///
    /// [`MAX_VIEWS`]: crate::MAX_VIEWS
    ///
    /// # Errors
    /// Those of [`HizContext::create_visible`], and [`Error::Invalid`] for another number of views.
    pub fn create_visible_views(
        &self,
        instances: &Instances,
        views: usize,
        outputs: &ViewsOutputs,
    ) -> Result<VisibleViews> {
        VisibleViews::new(&self.gpu, instances, views, outputs)
    }

    /// Records the culls of several views in one go, and joins what they keep.
    ///
    /// Each view has a camera and a pyramid of its own; sizes and conventions may differ.
    /// Nothing that one view hides is taken from another one.
    /// `among`: only these instances are asked for, in all views.
    ///
    /// # Errors
    /// Those of [`record_cull`](Self::record_cull), and [`Error::Mismatch`] for another number of
    /// views than the buffers are for.
    ///
    /// # Examples
    /// Two eyes, and one list for both:
    ///
    /// ```
    /// # use hiz_core::headless::Engine;
    /// # use hiz_core::{Bounds, Camera, DepthConvention, Floats, ImageSize, InstanceOptions};
    /// # use hiz_core::{Pose, Projection};
    /// use hiz_core::{CullOptions, View, ViewsOutputs, wgpu};
    /// # let engine = Engine::new(None)?;
    /// # let (device, queue, hiz) = (engine.device(), engine.queue(), engine.context());
    /// # let eye = |x| {
    /// #     let pose = Pose { eye: [x, 0.0, 0.0], target: [x, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    /// #     let (fov_y, convention) = (1.0, DepthConvention::Reversed);
    /// #     let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    /// #     Camera::look_at(&pose, &projection, ImageSize::new(64, 64))
    /// # };
    /// # let (left, right) = (eye(-0.03)?, eye(0.03)?);
    /// # let pyramid = |camera| engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], camera)?);
    /// # let (hiz_left, hiz_right) = (pyramid(&left)?, pyramid(&right)?);
    /// # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
    /// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    /// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
    /// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    /// let eyes = [
    ///     View { camera: &left, pyramid: &hiz_left },
    ///     View { camera: &right, pyramid: &hiz_right },
    /// ];
    /// let views = hiz.create_visible_views(&instances, 2, &ViewsOutputs::default())?;
    /// let options = CullOptions::default();
    /// hiz.record_cull_views(&mut encoder, &instances, &eyes, None, &views, &options)?;
    /// // Both eyes draw `views.any()`, and a shader finds the bit of each in `views.masks()`.
    /// let draws = views.any().draw_arguments().expect("asked for by default");
    /// # queue.submit([encoder.finish()]);
    /// # let (told, answer) = std::sync::mpsc::channel();
    /// # wgpu::util::DownloadBuffer::read_buffer(device, queue, &draws.slice(..), move |bytes| {
    /// #     told.send(bytes.unwrap().to_vec()).unwrap();
    /// # });
    /// # engine.wait()?;
    /// # assert_eq!(answer.recv().unwrap()[4..8], 1_u32.to_le_bytes());
    /// # Ok::<(), hiz_core::Error>(())
    /// ```
    pub fn record_cull_views(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        views: &[View<'_>],
        among: Option<&Among>,
        visible: &VisibleViews,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = ViewsInputs { instances, views, among, options, idle: false, built: None };
        record_cull_views(&self.gpu, encoder, &inputs, &visible.each(), visible.joined())?;
        views.iter().for_each(|view| view.pyramid.hold_image(encoder));
        Ok(())
    }

    /// Makes the buffers of an approximate cull; `outputs` are those of what it keeps.
    ///
    /// # Errors
    /// Those of [`create_visible`](Self::create_visible).
    pub fn create_approximate(
        &self,
        instances: &Instances,
        outputs: &Outputs,
    ) -> Result<Approximate> {
        Approximate::new(&self.gpu, instances, outputs)
    }

    /// Records a cull of what is hidden and of what can show in at most `negligible_px` pixels.
    ///
    /// Its result is not that of a certified cull: what it leaves out may show.
    /// [`Approximate::pixels`] says how much of it.
    ///
    /// # Errors
    /// Those of [`record_cull`](Self::record_cull).
    #[expect(clippy::too_many_arguments, reason = "as record_cull, and negligible_px")]
    pub fn record_cull_approximate(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        approximate: &Approximate,
        options: &CullOptions,
        negligible_px: u32,
    ) -> Result<()> {
        let inputs = CullInputs::new(instances, camera, pyramid, options);
        record_cull_approximate(&self.gpu, encoder, &inputs, approximate, negligible_px)?;
        pyramid.hold_image(encoder);
        Ok(())
    }
}
