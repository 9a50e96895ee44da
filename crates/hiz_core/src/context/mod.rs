//! The crate's face: what a renderer calls on its own device and encoder.
//!
//! Each method delegates to the room of its stage, and the files here stand in the order of the data.
//! They only add the documentation, and `limits.rs` the check of what the device offers.

mod culls;
mod frames;
mod instances;
mod limits;
mod occluders;
mod pyramids;
mod temporal;

use std::sync::Arc;

use self::limits::needed;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;

/// Everything that is made once per device.
/// Cheap to clone.
///
/// `create_*` makes buffers, and `record_*` writes commands into the caller's encoder.
/// No method submits, polls or maps.
///
/// # Errors
/// Every method returns what wgpu finds wrong as an [`Error`].
/// It never reaches the device's own error handler, which by default ends the process.
/// After an error the caller can go on with the encoder and the device, because nothing invalid was
/// recorded.
/// Commands that were recorded before the error may remain in the encoder.
///
/// Three mistakes cannot be detected here:
///
/// - An encoder of another device, or one with an open pass whose lifetime was forgotten.
///   The error appears when the encoder is finished.
///   An open pass sometimes gives an error at once: an [`Error::Invalid`] that names the encoder.
/// - An object that is destroyed between the recording and the submit.
///   The error appears at the submit.
/// - Views, encoders and buffers of another `wgpu::Instance`.
///   Every instance numbers its handles anew, so wgpu mistakes them for objects of this one.
///
/// # Examples
/// A renderer's frame: depth, pyramid, cull.
///
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{Bounds, CullOptions, Floats, HizContext, InstanceOptions, MeshData};
/// use hiz_core::{DrawOptions, OccluderOptions, Outputs, PyramidOptions, Rasteriser};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, wgpu};
/// # let engine = Engine::new(None)?;
/// # let (device, queue) = (engine.device(), engine.queue());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let corners = [-20.0, -20.0, -10.0, 20.0, -20.0, -10.0, 0.0, 40.0, -10.0];
/// # let (vertices, triangles) = (Floats::F32(&corners), &[0, 1, 2]);
/// # let wall = MeshData { vertices, triangles, transforms: None };
/// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
///
/// // Once:
/// let hiz = HizContext::new(device)?;
/// let occluders = hiz.create_occluders(&[wall], &OccluderOptions::default())?;
/// let depth = hiz.create_occluder_depth(camera.size(), Rasteriser::Auto)?;
/// let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
/// let instances = hiz.record_instances(&mut encoder, &bounds, &InstanceOptions::default())?;
/// let visible = hiz.create_visible(&instances, &Outputs::default())?;
///
/// // Each frame:
/// let all = DrawOptions::default();
/// hiz.record_occluder_depth(&mut encoder, &occluders, &camera, &depth, &all)?;
/// hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
/// let options = CullOptions::default();
/// hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)?;
/// queue.submit([encoder.finish()]);
/// # let (told, answer) = std::sync::mpsc::channel();
/// # let mask = visible.mask(0).unwrap().slice(..);
/// # wgpu::util::DownloadBuffer::read_buffer(device, queue, &mask, move |bytes| {
/// #     told.send(bytes.unwrap().to_vec()).unwrap();
/// # });
/// # engine.wait()?;
/// # // The first sphere stands before the wall, the second behind it.
/// # assert_eq!(answer.recv().unwrap()[0] & 3, 0b01);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct HizContext {
    pub(crate) gpu: Arc<Gpu>,
}

impl HizContext {
    /// Makes a context on the caller's device.
    ///
    /// Pipelines are made when they are first used.
    /// [`HizContext::record_warm_up`] makes them before the first frame.
    ///
    /// # Errors
    /// [`Error::Limit`] if the device offers less than the shaders need.
    /// [`HizContext::required_limits`] are always enough.
    pub fn new(device: &wgpu::Device) -> Result<Self> {
        Self::with_pipeline_cache(device, None)
    }

    /// [`HizContext::new`] with a cache from which pipelines are taken and into which they are
    /// compiled.
    ///
    /// The cache needs a device with the feature `PIPELINE_CACHE`, and the caller keeps its data
    /// between runs.
    /// Drivers that keep a shader cache on disk do not need one; Mesa's drivers do so.
    /// Each pipeline is made once, when it is first used.
    ///
    /// # Errors
    /// Those of [`HizContext::new`].
    pub fn with_pipeline_cache(
        device: &wgpu::Device,
        cache: Option<wgpu::PipelineCache>,
    ) -> Result<Self> {
        let have = device.limits();
        for (name, need, have) in needed(&have) {
            if have < need {
                return Err(Error::limit(name, need, have));
            }
        }
        Ok(Self { gpu: Arc::new(Gpu::new(device, cache)?) })
    }

    /// Makes a context whose shaders have pieces of text replaced, for tests.
    /// Each fault is a pair: the text and its replacement.
    /// A test suite is trusted once a planted fault makes it fail.
    ///
    /// # Errors
    /// Those of [`HizContext::new`].
    ///
    /// # Panics
    /// If no shader contains one of the texts: such a fault would never be planted, so it would
    /// prove nothing.
    #[cfg(feature = "testing")]
    pub fn with_planted_faults(device: &wgpu::Device, faults: &[(&str, &str)]) -> Result<Self> {
        Self::new(device)?;
        Ok(Self { gpu: Arc::new(Gpu::new(device, None)?.with_planted_faults(faults)) })
    }

    /// How many objects this context has made so far, for tests.
    #[cfg(feature = "testing")]
    pub fn made(&self) -> crate::gpu::made::Made {
        self.gpu.making.so_far()
    }

    /// Limits that are always enough for a device: the defaults of WebGPU.
    ///
    /// [`HizContext::new`] also accepts lower limits if the shaders, their bindings and one row of
    /// records fit.
    /// Otherwise it names the first limit that is too low.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// The features that a device needs: none.
    ///
    /// A [`DrawTemplate::first_instance`](crate::DrawTemplate::first_instance) other than 0 needs
    /// `INDIRECT_FIRST_INSTANCE`.
    pub fn required_features() -> wgpu::Features {
        wgpu::Features::empty()
    }

    /// The device on which this context makes everything.
    pub fn device(&self) -> &wgpu::Device {
        self.gpu.device()
    }
}
