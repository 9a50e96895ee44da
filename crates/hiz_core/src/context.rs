//! The crate's face: what a renderer calls on its own device and encoder.

use std::sync::Arc;

use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::input::bounds::Bounds;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::mesh::MeshData;
use crate::input::tolerance::DepthTolerance;
use crate::instances::piece::CULL_WORKGROUP;
use crate::instances::update::record_update;
use crate::instances::{InstanceOptions, Instances};
use crate::occluders::raster::record_occluders;
use crate::occluders::{OccluderOptions, Occluders};
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;
use crate::pyramid::reduce::record_reduce;
use crate::pyramid::{Pyramid, PyramidOptions, PyramidUniform};

/// Everything that is made once a device.
/// Cheap to clone.
///
/// Nothing here submits, polls or maps: `record_*` writes into the caller's encoder, `create_*`
/// makes buffers.
///
/// # Errors
/// What wgpu finds wrong with what is made here comes back as an [`Error`], and never at the
/// device's own error handler, which ends the process by default.
/// After an error the caller's encoder and device can be used on: nothing that is invalid was
/// recorded.
/// (What was recorded before the error came up may be part of the work.)
///
/// Three things cannot be known here:
///
/// - An encoder of another device, or one with an open pass (whose lifetime was forgotten). wgpu
///   tells of it when the encoder is finished; of an open pass sometimes at once, which is an
///   [`Error::Invalid`] that names the encoder.
/// - What is destroyed between the recording and the submit. wgpu tells of it then.
/// - Views, encoders and buffers of another `wgpu::Instance`. wgpu takes them for others, for its
///   handles are numbers that each instance gives out anew.
#[derive(Debug, Clone)]
pub struct HizContext {
    pub(crate) gpu: Arc<Gpu>,
}

impl HizContext {
    /// A context on the caller's device.
    ///
    /// # Errors
    /// [`Error::Limit`] where the device offers less than the shaders need;
    /// [`HizContext::required_limits`] are enough.
    pub fn new(device: &wgpu::Device) -> Result<Self> {
        Self::with_pipeline_cache(device, None)
    }

    /// The same, with a cache that pipelines are compiled into and taken from: of a device with the
    /// feature `PIPELINE_CACHE`, whose data the caller keeps from run to run.
    /// Pipelines are made when they are first used, each once; drivers that have a shader cache of
    /// their own on the disk, as Mesa's have, need nothing more.
    ///
    /// # Errors
    /// As [`HizContext::new`].
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

    /// A context whose shaders have texts replaced, `(what, by what)`, for tests: a suite is
    /// trusted once a planted fault turns it red.
    ///
    /// # Errors
    /// As [`HizContext::new`].
    ///
    /// # Panics
    /// If no shader holds such a text: a fault that was never planted proves nothing.
    #[cfg(feature = "testing")]
    pub fn with_planted_faults(device: &wgpu::Device, faults: &[(&str, &str)]) -> Result<Self> {
        Self::new(device)?;
        Ok(Self { gpu: Arc::new(Gpu::new(device, None)?.with_planted_faults(faults)) })
    }

    /// Limits that are enough for a device: WebGPU's defaults.
    /// [`HizContext::new`] takes less where the shaders, their bindings and one row of records fit
    /// into it, and names the first limit that is too low.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// The features that a device needs: none.
    /// (A [`DrawTemplate::first_instance`](crate::DrawTemplate::first_instance) other than 0 needs
    /// `INDIRECT_FIRST_INSTANCE`.)
    pub fn required_features() -> wgpu::Features {
        wgpu::Features::empty()
    }

    /// The device that everything of this context lives on.
    pub fn device(&self) -> &wgpu::Device {
        self.gpu.device()
    }

    /// An empty pyramid for depth images of `size`.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a size of 0 and options out of range, [`Error::Limit`] past the
    /// device's textures or bindings, [`Error::OutOfMemory`].
    pub fn create_pyramid(&self, size: ImageSize, options: &PyramidOptions) -> Result<Pyramid> {
        Pyramid::new(&self.gpu, size, options)
    }

    /// Uploads bounding volumes; records their copies, which run before what is recorded later.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays that do not agree and, with `strict`, for bad bounds.
    pub fn record_instances(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        bounds: &Bounds<'_>,
        options: &InstanceOptions,
    ) -> Result<Instances> {
        Instances::new(&self.gpu, bounds, options, |copies, _| {
            self.gpu.recorded(|| {
                copies(encoder);
                Ok(())
            })
        })
    }

    /// Records the replacement of instances `first..first + n` by the `n` new bounds, of the same
    /// kind.
    /// They keep their places in the stored order, and the boxes of their groups of 64 follow:
    /// where instances have moved far, groups have grown, and new [`Instances`] are faster to cull.
    /// `strict` refuses bad bounds, and then nothing has changed.
    ///
    /// What was submitted before sees the old bounds, what is submitted later the new ones.
    /// (The verdicts of an [`Engine`](crate::headless::Engine)'s culls are refined here, from the
    /// old bounds. Of a cull that is submitted between this recording and its submit, read them
    /// before.)
    /// Submit updates of the same instances in the order in which they were recorded, each one:
    /// after one that was left out or overtaken, groups that are touched are never culled as a
    /// whole any more.
    /// (Nothing visible is culled for it.)
    /// The new records wait in memory of the device until then.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for another kind of bounds or context, [`Error::Invalid`] for instances
    /// that there are not and, with `strict`, for bad bounds, [`Error::OutOfMemory`].
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        record_update(&self.gpu, encoder, instances, first, bounds, strict, |encoder, range| {
            // Recording is not running: the verdicts stay to be refined, which a second time
            // changes nothing.
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder)?;
            watches.note(&range);
            Ok(())
        })
    }

    /// Buffers for what a cull of `instances` finds.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for instances of another context, [`Error::Invalid`] for a
    /// [`DrawTemplate::first_instance`](crate::DrawTemplate::first_instance) other than 0 on a
    /// device without the feature `INDIRECT_FIRST_INSTANCE`, [`Error::OutOfMemory`],
    /// [`Error::Device`] where the device is lost.
    pub fn create_visible(&self, instances: &Instances, outputs: &Outputs) -> Result<Visible> {
        Visible::new(&self.gpu, instances, outputs)
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays that do not fit and indices out of range, [`Error::Limit`]
    /// past the device's buffers, [`Error::OutOfMemory`].
    pub fn create_occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Occluders> {
        Occluders::new(&self.gpu, meshes, options)
    }

    /// Records the drawing of `occluders` into `target`, which is cleared first: a view of one
    /// layer of a 2D `Depth32Float` texture of the camera's size, with one mip level, one sample a
    /// pixel and the usage `RENDER_ATTACHMENT`.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a target of another size, format or device and for a destroyed one,
    /// [`Error::Invalid`] for one of other usages, samples or mip levels and for a camera that
    /// float32 cannot hold.
    pub fn record_occluders(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        target: &wgpu::TextureView,
    ) -> Result<()> {
        record_occluders(&self.gpu, encoder, occluders, camera, target)
    }

    /// Records the reduction of a depth image of `camera` into `pyramid`.
    ///
    /// `depth` is a view of a 2D texture of one mip level, sample and layer, whose whole depth is
    /// read, whatever part of it the view shows: the default view of a texture with a stencil will
    /// do.
    /// Formats and usages:
    ///
    /// - any depth format, `R32Float` or `R16Float`, with `TEXTURE_BINDING`;
    /// - `Rgba32Uint` with `STORAGE_BINDING`: the float bits of four pixels of a row in a texel.
    ///   It is `width.div_ceil(4)` texels wide; pixels past the width count as depth of the row's
    ///   last ones, so repeat the last.
    ///
    /// Give it `COPY_SRC` as well, and large culls read faster ([`AtlasUse`](crate::AtlasUse)).
    /// The texture must neither change nor be destroyed before the culls that use it have run.
    /// Submit the reduction before them or with them: a cull that runs before it keeps everything.
    ///
    /// What the format rounds is slack that the pyramid keeps ([`Pyramid::tolerance`]), and every
    /// cull counts it beside the slack of its [`CullOptions`]: a step of `Depth16Unorm`,
    /// `Depth24Plus`, `Depth24PlusStencil8` and `R16Float`, nothing of float32.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for sizes or devices that do not agree and for a destroyed texture,
    /// [`Error::Invalid`] for other formats and usages, [`Error::OutOfMemory`].
    pub fn record_reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        camera: &Camera,
        pyramid: &Pyramid,
    ) -> Result<()> {
        record_reduce(&self.gpu, encoder, depth, camera, pyramid, DepthTolerance::NONE)
    }

    /// Records the cull of `instances` against `pyramid`, whose depth image must be `camera`'s;
    /// `visible` takes what is found.
    ///
    /// A cull of a quarter as many instances as depth image and stored levels have texels copies
    /// them into one texture first, which costs less than it saves ([`AtlasUse`](crate::AtlasUse)).
    ///
    /// # Errors
    /// [`Error::Mismatch`] for objects that do not belong together, for a depth image that was
    /// destroyed since it was reduced and for destroyed buffers of `visible`; [`Error::Invalid`]
    /// for unusable options or cameras; [`Error::OutOfMemory`].
    pub fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = CullInputs { instances, camera, pyramid, options, idle: false };
        record_cull(&self.gpu, encoder, &inputs, visible)
    }
}

/// What the shaders and their bindings need of a device, and what it has.
/// `tests/validation.rs` runs everything on a device that has just this, and on devices with one
/// less.
fn needed(have: &wgpu::Limits) -> Vec<(&'static str, u64, u64)> {
    macro_rules! limits {
        ($($name:ident >= $need:expr,)*) => {
            vec![$((stringify!($name), $need, u64::from(have.$name))),*]
        };
    }
    limits! {
        // A row of records of oriented boxes, 4 texels each (`records`), and a row of surviving
        // groups.
        max_texture_dimension_2d >= 4096,
        // The cull of members: view, records, outputs, survivors.
        max_bind_groups >= 4,
        max_bind_groups_plus_vertex_buffers >= 4,
        // The view of a cull (`gpu/layouts`).
        max_bindings_per_bind_group >= 7,
        // A depth image.
        max_sampled_textures_per_shader_stage >= 1,
        max_samplers_per_shader_stage >= 1,
        // Of the cull of members: three chunks, mask, list, draws, statistics, survivors.
        max_storage_buffers_per_shader_stage >= 8,
        // An atlas, or an image of bits; records; the list of survivors.
        max_storage_textures_per_shader_stage >= 3,
        // Pyramid, view, piece, capacity.
        max_uniform_buffers_per_shader_stage >= 4,
        max_uniform_buffer_binding_size >= size_of::<PyramidUniform>() as u64,
        // The words of the verdicts of a row of records; and the row itself on its way.
        max_storage_buffer_binding_size >= 8192,
        max_buffer_size >= 65_536,
        // Occluders.
        max_vertex_buffers >= 1,
        max_vertex_attributes >= 2,
        max_vertex_buffer_array_stride >= 24,
        // None, but wgpu 30 counts down from it.
        max_inter_stage_shader_variables >= 1,
        // Prefix sums of 256 words (`compact`), 64 vectors of four (`count`).
        max_compute_workgroup_storage_size >= 1024,
        max_compute_invocations_per_workgroup >= 256,
        max_compute_workgroup_size_x >= 256,
        max_compute_workgroup_size_y >= 1,
        max_compute_workgroup_size_z >= 1,
        // What WebGPU promises everywhere: a column of blocks of the largest image, the pieces.
        max_compute_workgroups_per_dimension >= 65_535,
    }
}

const _: () = assert!(CULL_WORKGROUP <= 256);
