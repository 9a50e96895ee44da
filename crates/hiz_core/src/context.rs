//! The crate's face: what a renderer calls on its own device and encoder.
//!
//! Each method delegates to one of the rooms below.
//! This file only adds the documentation, and the check of what the device offers.

use std::sync::Arc;

use crate::cull::among::{Among, AmongMask, record_among};
use crate::cull::approximate::{Approximate, record_cull_approximate};
use crate::cull::early::record_early;
use crate::cull::history::{EarlySet, Temporal};
use crate::cull::inputs::CullInputs;
use crate::cull::late::record_late;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::cull::views::{View, ViewsInputs, record_cull_views};
use crate::cull::warm_up::{WarmUp, record_warm_up};
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::stage_times::{StageTimer, StageTimesInFlight, record_stage_times};
use crate::input::bounds::{Bounds, BoundsKind};
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::mesh::MeshData;
use crate::instances::from_buffer::{BoundsBuffer, record_instances_from, record_update_from};
use crate::instances::piece::CULL_WORKGROUP;
use crate::instances::update::record_update;
use crate::instances::{InstanceOptions, Instances};
use crate::occluders::depth::OccluderDepth;
use crate::occluders::device_raster::record_occluders;
use crate::occluders::drawing::OccluderOptions;
use crate::occluders::drawing::{DrawOptions, Rasteriser, Touched};
use crate::occluders::uploaded::Occluders;
use crate::output::mesh_table::{MeshLods, MeshTable};
use crate::output::outputs::Outputs;
use crate::output::readback::{AnswerInFlight, ReadbackRing, record_readback};
use crate::output::views::{ViewsOutputs, VisibleViews};
use crate::output::visible::Visible;
use crate::pyramid::mips::{MipOptions, MipTexture};
use crate::pyramid::mips_passes::record_mips;
use crate::pyramid::receiver_mask::{ReceiverMask, ReceiverMaskOptions, record_receiver_mask};
use crate::pyramid::reduce::record_reduce;
use crate::pyramid::region::record_reduce_region;
use crate::pyramid::resolve::{DepthResolve, ResolveOptions, record_resolve};
use crate::pyramid::source::DepthSource;
use crate::pyramid::{Pyramid, PyramidOptions, PyramidUniform};

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
/// hiz.record_reduce(&mut encoder, depth.view(), &camera, &pyramid)?;
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

    /// Makes an empty pyramid for depth images of `size` pixels.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0 and for options out of range.
    /// - [`Error::Limit`] for a size beyond the device's textures or bindings.
    /// - [`Error::OutOfMemory`].
    pub fn create_pyramid(&self, size: ImageSize, options: &PyramidOptions) -> Result<Pyramid> {
        Pyramid::new(&self.gpu, size, options)
    }

    /// Makes instances from bounding volumes, and records the copies that bring them to the device.
    /// Commands that are recorded later see the bounds.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for arrays whose lengths disagree and, with `strict`, for invalid
    ///   bounds.
    /// - [`Error::Limit`] for more than 2^32 - 1 instances.
    /// - [`Error::OutOfMemory`].
    pub fn record_instances(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bounds: &Bounds<'_>,
        options: &InstanceOptions<'_>,
    ) -> Result<Instances> {
        Instances::new(&self.gpu, bounds, options, true, |copies, _| {
            self.gpu.recorded(|| {
                copies(encoder);
                Ok(())
            })
        })
    }

    /// Records the replacement of instances `first..first + n` by the `n` given bounds.
    ///
    /// The bounds must be of the same kind as before.
    /// The instances keep their places in the stored order, and the boxes of their groups of 64
    /// follow.
    /// As members drift apart, group boxes grow and cull less.
    /// New [`Instances`] are faster to cull once most instances have moved farther than their
    /// spacing.
    /// With `strict`, invalid bounds are refused, and then nothing has changed.
    ///
    /// Commands that were submitted before see the old bounds; commands that are submitted later
    /// see the new ones.
    /// Submit every update of the same instances, in the order in which they were recorded.
    /// If one is dropped or overtaken, each group that a later update touches is never culled as a
    /// whole again.
    /// This costs time, but nothing visible is culled.
    /// The new records occupy device memory until the submit.
    ///
    /// This call also refines the verdicts of an [`Engine`](crate::headless::Engine)'s earlier
    /// culls from the old bounds.
    /// A cull that is submitted between this call and the submit of its commands is not among them.
    /// Read the verdicts of such a cull before you submit the update.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for another kind of bounds, for instances of another context, and for
    ///   instances whose bounds come from a buffer.
    /// - [`Error::Invalid`] for instances that do not exist, for arrays whose lengths disagree and,
    ///   with `strict`, for invalid bounds.
    /// - [`Error::OutOfMemory`].
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        record_update(&self.gpu, encoder, instances, first, bounds, strict, |encoder, range| {
            // A recorded command may never run, so the verdicts still count as unrefined.
            // Refining them twice changes nothing.
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder)?;
            watches.note(&range);
            Ok(())
        })
    }

    /// Makes a table of meshes, each with its levels of detail.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for no meshes, a mesh without a level of detail, errors that are not
    ///   finite and at least 0, a `first_instance` other than 0, and for draws of which some have
    ///   an index buffer and others have none.
    /// - [`Error::Limit`] for more than [`MAX_LODS`](crate::MAX_LODS) levels of detail of a mesh,
    ///   and for more than 65,536 meshes.
    /// - [`Error::OutOfMemory`].
    pub fn create_mesh_table(&self, meshes: &[MeshLods<'_>]) -> Result<MeshTable> {
        MeshTable::new(&self.gpu, meshes)
    }

    /// Makes `count` instances whose bounds lie in the caller's buffer, and records that they are
    /// taken from there.
    ///
    /// A shader of the caller's writes the buffer, and the bounds never visit the host.
    /// [`BoundsBuffer`] has the layout of its records.
    /// [`record_update_from`](Self::record_update_from) takes them again, for instance each frame.
    ///
    /// The device validates the bounds, by the same rules as the host.
    /// Invalid ones are kept by every cull, with [`Verdict::Invalid`](crate::Verdict::Invalid).
    /// The instances are stored in the order of the buffer, in groups of 64.
    /// So let neighbours in the buffer be neighbours in space.
    /// Submit these commands before the first cull, or with it.
    ///
    /// Instances from [`record_instances`](Self::record_instances) can take bounds from a buffer,
    /// too.
    /// They stay in the order in which their first bounds were sorted.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for [`BoundsKind::OrientedBox`] and [`BoundsKind::WidePoint`], for an
    ///   offset or a stride that is no multiple of 4, for a stride shorter than a record, and for a
    ///   buffer that is too short or lacks the usage `STORAGE`.
    /// - [`Error::Mismatch`] for a buffer of another device and for a destroyed one.
    /// - [`Error::Limit`] for a stride with which the records exceed one binding.
    /// - [`Error::OutOfMemory`].
    pub fn record_instances_from<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        source: impl Into<BoundsBuffer<'a>>,
        kind: BoundsKind,
        count: u32,
    ) -> Result<Instances> {
        record_instances_from(&self.gpu, encoder, &source.into(), kind, count)
    }

    /// Records that the bounds of all instances are taken from the caller's buffer.
    ///
    /// They are what the buffer holds when these commands run.
    /// Records and group boxes are made anew on the device.
    /// The host does nothing per instance, and from the second call with a buffer on it makes
    /// nothing.
    /// Commands that were submitted before see the old bounds.
    /// Such a recording may be dropped, or submitted in another order than it was recorded.
    ///
    /// From the first call on, the host does not know the bounds.
    /// So it refuses [`record_update`](Self::record_update) and [`Instances::invalid`].
    ///
    /// Like [`record_update`](Self::record_update), this refines the verdicts of an
    /// [`Engine`](crate::headless::Engine)'s earlier culls.
    ///
    /// # Errors
    /// - Those of [`record_instances_from`](Self::record_instances_from).
    /// - [`Error::Mismatch`] for instances of another context, and for instances of which any is
    ///   [`ABSENT`](crate::ABSENT).
    pub fn record_update_from<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        source: impl Into<BoundsBuffer<'a>>,
    ) -> Result<()> {
        record_update_from(&self.gpu, encoder, instances, &source.into(), |encoder| {
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder)?;
            watches.note(&(0..instances.len()));
            Ok(())
        })
    }

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

    /// Makes occluders from triangle meshes.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for arrays of the wrong length, indices out of range and unusable
    ///   transforms or positions.
    /// - [`Error::Limit`] for meshes larger than the device's buffers.
    /// - [`Error::OutOfMemory`].
    pub fn create_occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Occluders> {
        Occluders::new(&self.gpu, meshes, options)
    }

    /// Makes a depth image that occluders are drawn into.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn create_occluder_depth(
        &self,
        size: ImageSize,
        rasteriser: Rasteriser,
    ) -> Result<OccluderDepth> {
        OccluderDepth::new(&self.gpu, size, rasteriser)
    }

    /// Records the drawing of `occluders` into `depth`, which [`record_reduce`](Self::record_reduce)
    /// then takes.
    ///
    /// Returns the rectangle around what was drawn: columns `x0..=x1` and rows `y0..=y1` as
    /// `[x0, y0, x1, y1]`.
    /// No pixel outside of it changes, except by [`DepthLoad::Clear`](crate::DepthLoad::Clear).
    ///
    /// The rasteriser on the host draws in this call, on all cores, and records a copy alone.
    /// With [`DepthLoad::Load`](crate::DepthLoad::Load) it adds to what earlier calls have drawn,
    /// so submit every recording, in their order.
    /// After one that was dropped begin with `Clear`: otherwise rows of an older image remain.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a camera of another size or, with `Load`, of another depth
    ///   convention, and for objects of another context.
    /// - [`Error::Invalid`] for copies that do not exist, and for a camera that float32 cannot hold.
    /// - [`Error::OutOfMemory`].
    pub fn record_occluder_depth(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        depth: &OccluderDepth,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        depth.record(&self.gpu, encoder, occluders, camera, options)
    }

    /// Records the drawing of `occluders` into the caller's own `target`, by the device's
    /// rasteriser.
    ///
    /// `target` is a view of one layer of a 2D `Depth32Float` texture of the camera's size.
    /// The texture has one mip level, one sample per pixel and the usage `RENDER_ATTACHMENT`.
    /// Returns the rectangle around what was drawn, as
    /// [`record_occluder_depth`](Self::record_occluder_depth) does.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a target of another size, format or device, for a destroyed target
    ///   and for occluders of another context.
    /// - [`Error::Invalid`] for a target with other usages, samples or mip levels, for copies that
    ///   do not exist, and for a camera that float32 cannot hold.
    pub fn record_occluders(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        target: &wgpu::TextureView,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        record_occluders(&self.gpu, encoder, occluders, camera, target, options)
    }

    /// Records the reduction of a depth image of `camera` into `pyramid`.
    ///
    /// `depth` is a 2D texture with one sample per pixel, or a view of one, or a part of one as
    /// [`DepthSource`] describes it.
    /// A view does not say which part of its texture it shows, so the depth of all of it is read.
    /// So the default view of a texture with a stencil will do, and a texture of several layers or
    /// mip levels needs a [`DepthSource`].
    /// Multisampled depth goes through [`record_resolve`](Self::record_resolve) first.
    /// These formats and usages are accepted:
    ///
    /// - Any depth format, `R32Float` or `R16Float`, with `TEXTURE_BINDING`.
    /// - `Rgba32Uint` with `STORAGE_BINDING`.
    ///   Each texel holds the float bits of four neighbouring pixels of a row.
    ///   The texture is `width.div_ceil(4)` texels wide.
    ///   Pixels past the width count as depth at the end of the row, so repeat the last pixel
    ///   there.
    ///
    /// Add the usage `COPY_SRC`, and large culls read faster ([`AtlasUse`](crate::AtlasUse)).
    /// The texture must neither change nor be destroyed before the culls that use it have run.
    /// Submit the reduction before these culls or with them.
    /// A cull that runs before its reduction keeps everything.
    ///
    /// Some formats round depth, and the pyramid keeps this slack ([`Pyramid::tolerance`]).
    /// Every cull counts it in addition to the slack of its [`CullOptions`].
    /// It is one step of `Depth16Unorm`, `Depth24Plus`, `Depth24PlusStencil8` and `R16Float`, and
    /// nothing for float32.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for other formats and usages, and for several layers, mip levels or
    ///   samples of which none is named.
    /// - [`Error::OutOfMemory`].
    pub fn record_reduce<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        pyramid: &Pyramid,
    ) -> Result<()> {
        record_reduce(&self.gpu, encoder, &depth.into(), camera, pyramid)
    }

    /// Makes what multisampled depth of `size` pixels is resolved into.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn create_depth_resolve(
        &self,
        size: ImageSize,
        options: &ResolveOptions,
    ) -> Result<DepthResolve> {
        DepthResolve::new(&self.gpu, size, options)
    }

    /// Records the resolve of multisampled depth of `camera`: one depth per pixel, the farthest of
    /// its samples, the nearest or both ([`ResolveOptions`]).
    ///
    /// `depth` is a texture with several samples per pixel, or a view or a part of one as
    /// [`DepthSource`] describes it.
    /// It has the usage `TEXTURE_BINDING`, and a depth format, `R32Float` or `R16Float`.
    /// The result is [`DepthResolve::farthest`], for [`record_reduce`](Self::record_reduce).
    ///
    /// Samples without a depth (NaN, outside of 0..=1) count as the reduction treats them: as far.
    /// For the nearest depth they count as near.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for one sample per pixel, and for other formats and usages.
    /// - [`Error::OutOfMemory`].
    pub fn record_resolve<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        resolve: &DepthResolve,
    ) -> Result<()> {
        record_resolve(&self.gpu, encoder, &depth.into(), camera, resolve)
    }

    /// Makes a receiver mask for the light's images of `size` pixels.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures or buffers.
    /// - [`Error::OutOfMemory`].
    pub fn create_receiver_mask(&self, size: ImageSize) -> Result<ReceiverMask> {
        ReceiverMask::new(&self.gpu, size)
    }

    /// Records the depth image of `light` that holds the farthest receivers which `camera` sees.
    ///
    /// It is for spot lights and the faces of point lights.
    /// [`ReceiverMask::image`] is reduced with the light's camera, and casters are culled by that
    /// pyramid as anything is.
    /// A culled caster shadows no receiver in `depth`.
    /// `docs/shadows.md` says what is promised.
    ///
    /// `depth` is as in [`record_reduce`](Self::record_reduce), with one sample per pixel.
    /// A pixel of exactly far is background.
    /// An invalid pixel (NaN, outside of 0..=1) keeps every caster.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for options out of range, cameras that float32 cannot hold, and textures
    ///   as in [`record_reduce`](Self::record_reduce).
    /// - [`Error::OutOfMemory`].
    pub fn record_receiver_mask<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        light: &Camera,
        mask: &ReceiverMask,
        options: &ReceiverMaskOptions,
    ) -> Result<()> {
        record_receiver_mask(&self.gpu, encoder, &depth.into(), [camera, light], mask, options)
    }

    /// Records the reduction of a changed rectangle of a depth image into `pyramid`.
    ///
    /// The pyramid must have been built from `depth`, by [`record_reduce`](Self::record_reduce) or
    /// by this method, and no pixel may have changed since except those of the rectangle.
    /// `rectangle` is `[x0, y0, x1, y1]`: columns `x0..=x1` and rows `y0..=y1` of the image, row 0
    /// on top.
    /// It is what [`record_occluder_depth`](Self::record_occluder_depth) returns.
    /// The levels are then what a reduction of the whole image makes, bit for bit.
    ///
    /// Submit it after the reduction that came before.
    /// If that one never ran, culls keep everything until the whole image is reduced again.
    /// So do culls that were recorded before this reduction and run after it.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a pyramid that was never built, for another depth image and for a
    ///   destroyed texture.
    /// - [`Error::Invalid`] for a rectangle that is empty or reaches past the image.
    /// - [`Error::OutOfMemory`].
    pub fn record_reduce_region<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        rectangle: [u32; 4],
        pyramid: &Pyramid,
    ) -> Result<()> {
        record_reduce_region(&self.gpu, encoder, &depth.into(), rectangle, pyramid)
    }

    /// Makes a texture with mip levels of depth, for depth images of `size` pixels.
    ///
    /// It is for shaders of the caller's own, such as screen-space reflections.
    /// No cull of this crate reads it.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures, and for levels beyond one
    ///   storage binding.
    /// - [`Error::OutOfMemory`].
    pub fn create_mip_texture(&self, size: ImageSize, options: &MipOptions) -> Result<MipTexture> {
        MipTexture::new(&self.gpu, size, options)
    }

    /// Records the passes that fill `mips` from a depth image of its size.
    ///
    /// `depth` is what [`record_reduce`](Self::record_reduce) takes: the same formats, usages and
    /// parts of textures.
    /// Level 0 is the depth as given; no tolerance of its format is added.
    /// Shaders that run in later passes of the same encoder read the new levels.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for other formats and usages, and for several layers, mip levels or
    ///   samples of which none is named.
    /// - [`Error::OutOfMemory`].
    pub fn record_mips<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        convention: DepthConvention,
        mips: &MipTexture,
    ) -> Result<()> {
        record_mips(&self.gpu, encoder, &depth.into(), convention, mips)
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
        record_cull(
            &self.gpu,
            encoder,
            &CullInputs::new(instances, camera, pyramid, options),
            visible,
        )
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
        record_cull_approximate(&self.gpu, encoder, &inputs, approximate, negligible_px)
    }

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
        record_late(&self.gpu, encoder, &inputs, temporal)
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
        record_cull(&self.gpu, encoder, &CullInputs { among: Some(among), ..inputs }, visible)
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
        record_cull_views(&self.gpu, encoder, &inputs, &visible.each(), visible.joined())
    }

    /// Makes a timer of stages.
    ///
    /// It needs a device with the feature `TIMESTAMP_QUERY`, and `queue`, whose period the
    /// timestamps count in.
    /// Without the feature it names the stages, and every time is `None`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn create_stage_timer(&self, queue: &wgpu::Queue) -> Result<StageTimer> {
        StageTimer::new(&self.gpu, queue.get_timestamp_period())
    }

    /// Records the copies of what `timer` has timed since the last call.
    ///
    /// Record it in the encoder of the stages, behind them.
    /// The times arrive with a poll of the device after the submit.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a timer of another context, and [`Error::OutOfMemory`].
    pub fn record_stage_times(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &StageTimer,
    ) -> Result<StageTimesInFlight> {
        record_stage_times(&self.gpu, encoder, timer)
    }

    /// Makes a ring of `slots` (1..=64) for answers on their way to the host.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of slots.
    pub fn create_readback(&self, slots: usize) -> Result<ReadbackRing> {
        ReadbackRing::new(&self.gpu, slots)
    }

    /// Records the copies of what a cull leaves in `visible`: mask, list and draw arguments.
    ///
    /// Record it behind the cull.
    /// After the submit the answer arrives with a poll of the device
    /// ([`AnswerInFlight::is_ready`]); nothing here submits, polls or waits.
    /// The whole capacity of the lists is copied.
    /// If the encoder is never submitted, drop the answer.
    ///
    /// # Errors
    /// - [`Error::Invalid`] if all slots are taken: read or drop one of their answers first.
    /// - [`Error::Mismatch`] for objects of another context.
    /// - [`Error::OutOfMemory`].
    pub fn record_readback(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        visible: &Visible,
        ring: &ReadbackRing,
    ) -> Result<AnswerInFlight> {
        record_readback(&self.gpu, encoder, visible, ring)
    }

    /// Makes everything that frames like this one need, and records work that makes the driver
    /// compile it.
    ///
    /// Submit it and wait for it before the first frame.
    /// Then the frame's `record_*` calls make no pipeline, and no bind group, texture or buffer of
    /// their own.
    /// Call it once for each kind of frame: for each cull and each of several depth images.
    ///
    /// Drivers compile at two times, when a pipeline is made and when it is first dispatched.
    /// So the recorded dispatches have no workgroups, and reduce, cull and update nothing.
    /// Two things do change:
    ///
    /// - The occluders are drawn into the depth image, as they are in a frame.
    /// - The mask, the lists' lengths and the counts in `visible` are cleared.
    ///
    /// # Errors
    /// Those of [`HizContext::record_occluders`], [`HizContext::record_reduce`],
    /// [`HizContext::record_cull`] and [`HizContext::record_update`].
    pub fn record_warm_up(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &WarmUp<'_>,
    ) -> Result<()> {
        record_warm_up(&self.gpu, encoder, frame)
    }
}

/// The limits that the shaders and their bindings need, each with what the device has.
///
/// `tests/validation.rs` runs everything on a device with exactly these limits.
/// It also tries devices where one limit is lower by one.
fn needed(have: &wgpu::Limits) -> Vec<(&'static str, u64, u64)> {
    macro_rules! limits {
        ($($name:ident >= $need:expr,)*) => {
            vec![$((stringify!($name), $need, u64::from(have.$name))),*]
        };
    }
    limits! {
        // A row of oriented box records, which take 4 texels each (`instances/records.rs`).
        // It is also a row of the list of surviving groups.
        max_texture_dimension_2d >= 4096,
        // The cull of members: view, records, outputs, survivors.
        max_bind_groups >= 4,
        max_bind_groups_plus_vertex_buffers >= 4,
        // The view of a cull (`cull/pipelines.rs`, `DepthStore::layout`).
        max_bindings_per_bind_group >= 7,
        // A depth image; slots and mesh table of a cull that emits bins; which instances are asked
        // for.
        max_sampled_textures_per_shader_stage >= 4,
        max_samplers_per_shader_stage >= 1,
        // The cull of members: three chunks, mask, list, draws, statistics, survivors.
        max_storage_buffers_per_shader_stage >= 8,
        // An atlas or an image of depth bits; records; the survivors of two tiers of boxes.
        max_storage_textures_per_shader_stage >= 4,
        // Pyramid, view, piece, capacity.
        max_uniform_buffers_per_shader_stage >= 4,
        max_uniform_buffer_binding_size >= size_of::<PyramidUniform>() as u64,
        // The verdicts of a row of records, and the row itself in its staging buffer.
        max_storage_buffer_binding_size >= 8192,
        max_buffer_size >= 65_536,
        // Occluders: vertices and copies (`occluders/device_meshes.rs`).
        max_vertex_buffers >= 2,
        max_vertex_attributes >= 8,
        max_vertex_buffer_array_stride >= 88,
        // No shader needs it, but wgpu 30 counts down from it.
        max_inter_stage_shader_variables >= 1,
        // Prefix sums of 256 words (`output/compact.wgsl`); 64 vectors of four words
        // (`cull/count.wgsl`).
        max_compute_workgroup_storage_size >= 1024,
        max_compute_invocations_per_workgroup >= 256,
        max_compute_workgroup_size_x >= 256,
        max_compute_workgroup_size_y >= 1,
        max_compute_workgroup_size_z >= 1,
        // The least that WebGPU guarantees.
        // A column of blocks of the largest image and every piece fit into it.
        max_compute_workgroups_per_dimension >= 65_535,
    }
}

const _: () = assert!(CULL_WORKGROUP <= 256);
