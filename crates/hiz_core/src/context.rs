//! The crate's face: what a renderer calls on its own device and encoder.

use std::sync::Arc;

use crate::bounds::Bounds;
use crate::camera::{Camera, ImageSize};
use crate::cull::{self, CullInputs, CullOptions};
use crate::error::{Error, Result};
use crate::gpu::Gpu;
use crate::instances::{InstanceOptions, Instances};
use crate::layout::CULL_WORKGROUP;
use crate::occluders::{self, MeshData, OccluderOptions, Occluders};
use crate::pyramid::{self, Pyramid, PyramidOptions};
use crate::update;
use crate::visible::{Visible, VisibleOptions};

/// Everything that is made once a device. Cheap to clone.
///
/// Nothing here submits, polls or maps: `record_*` writes into the caller's encoder, `create_*` makes buffers.
#[derive(Debug, Clone)]
pub struct HizContext {
    pub(crate) gpu: Arc<Gpu>,
}

impl HizContext {
    /// A context on the caller's device.
    ///
    /// # Errors
    /// [`Error::Limit`] where the device offers less than [`HizContext::required_limits`].
    pub fn new(device: &wgpu::Device) -> Result<Self> {
        Self::with_pipeline_cache(device, None)
    }

    /// The same, with a cache that pipelines are compiled into and taken from: of a device with the feature `PIPELINE_CACHE`, whose
    /// data the caller keeps from run to run. Pipelines are made when they are first used, each once; drivers that have a shader
    /// cache of their own on the disk, as Mesa's have, need nothing more.
    ///
    /// # Errors
    /// As [`HizContext::new`].
    pub fn with_pipeline_cache(device: &wgpu::Device, cache: Option<wgpu::PipelineCache>) -> Result<Self> {
        Self::make(device, cache, &[])
    }

    /// For tests: a context whose shaders have texts replaced, `(what, by what)`. A suite is trusted once a planted fault
    /// turns it red.
    ///
    /// # Panics
    /// If no shader holds such a text: a fault that was never planted proves nothing.
    #[doc(hidden)]
    pub fn with_planted_faults(device: &wgpu::Device, faults: &[(&str, &str)]) -> Result<Self> {
        Self::make(device, None, faults)
    }

    fn make(device: &wgpu::Device, cache: Option<wgpu::PipelineCache>, faults: &[(&str, &str)]) -> Result<Self> {
        let (have, need) = (device.limits(), Self::required_limits());
        for (name, need, have) in [
            (
                "max_storage_buffers_per_shader_stage",
                need.max_storage_buffers_per_shader_stage,
                have.max_storage_buffers_per_shader_stage,
            ),
            (
                "max_compute_invocations_per_workgroup",
                need.max_compute_invocations_per_workgroup,
                have.max_compute_invocations_per_workgroup,
            ),
            ("max_compute_workgroup_size_x", need.max_compute_workgroup_size_x, have.max_compute_workgroup_size_x),
            ("max_bind_groups", need.max_bind_groups, have.max_bind_groups),
        ] {
            if have < need {
                return Err(Error::limit(name, u64::from(need), u64::from(have)));
            }
        }
        Ok(Self { gpu: Arc::new(Gpu::new(device, cache, faults)) })
    }

    /// The limits that a device needs: WebGPU's defaults are enough.
    pub fn required_limits() -> wgpu::Limits {
        wgpu::Limits::default()
    }

    /// The features that a device needs: none. (`DrawTemplate::first_instance` other than 0 needs
    /// `INDIRECT_FIRST_INSTANCE` in the caller's own draw.)
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
    /// [`Error::Limit`] past the device's textures or bindings.
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
            copies(encoder);
            Ok(())
        })
    }

    /// Records the replacement of instances `first..first + n` by the `n` new bounds, of the same kind. They keep their places in the
    /// stored order, and the boxes of their groups of 64 follow: where instances have moved far, groups have grown, and
    /// new [`Instances`] are faster to cull. `strict` refuses bad bounds, and then nothing has changed.
    ///
    /// What was submitted before sees the old bounds, what is submitted later the new ones. (The
    /// verdicts of an [`Engine`](crate::headless::Engine)'s culls are refined here, from the old
    /// bounds. Of a cull that is submitted between this recording and its submit, read them
    /// before.) Submit updates of the same instances in
    /// the order in which they were recorded, each one: after one that was left out or overtaken, groups that are touched are never
    /// culled as a whole any more. (Nothing visible is culled for it.) The new records wait in memory of the device until then.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for another kind of bounds or context, [`Error::Invalid`] for instances that there are not and, with
    /// `strict`, for bad bounds, [`Error::OutOfMemory`].
    pub fn record_update(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        update::record(&self.gpu, encoder, instances, first, bounds, strict, |encoder, range| {
            // Recording is not running: the verdicts stay to be refined, which a second time
            // changes nothing.
            let watches = instances.watches();
            watches.record_refinements(&self.gpu, encoder, instances)?;
            watches.note(&range);
            Ok(())
        })
    }

    /// Buffers for what a cull of `instances` finds.
    ///
    /// # Errors
    /// [`Error::Device`] where the device has no memory for them, or is lost.
    pub fn create_visible(&self, instances: &Instances, options: &VisibleOptions) -> Result<Visible> {
        Visible::new(&self.gpu, instances, options)
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays that do not fit and indices out of range.
    pub fn create_occluders(&self, meshes: &[MeshData<'_>], options: &OccluderOptions) -> Result<Occluders> {
        Occluders::new(&self.gpu, meshes, options)
    }

    /// Records the drawing of `occluders` into `target`, a `Depth32Float` texture view of the camera's size, which is cleared first.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a target of another size or format, [`Error::Invalid`] for a camera that float32 cannot hold.
    pub fn record_occluders(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        target: &wgpu::TextureView,
    ) -> Result<()> {
        occluders::record(&self.gpu, encoder, occluders, camera, target)
    }

    /// Records the reduction of a depth image of `camera` into `pyramid`.
    ///
    /// `depth` is a view of a whole 2D texture of one mip level, sample and layer, with the usage `TEXTURE_BINDING`
    /// (`Rgba32Uint`: `STORAGE_BINDING`) and a depth format (with stencil: the view's aspect is `DepthOnly`), `R32Float`, or
    /// `Rgba32Uint` of the float bits of four pixels of a row a texel, which is `width.div_ceil(4)` texels wide (pixels past the
    /// width count as depth of the row's last ones: repeat the last). Give it `COPY_SRC` as well, and large culls read
    /// faster ([`AtlasUse`](crate::AtlasUse)). The reduction has to be submitted before a cull
    /// that uses it, or with it: a cull that runs before it keeps everything.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for sizes or devices that do not agree, [`Error::Invalid`] for other formats.
    pub fn record_reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: &wgpu::TextureView,
        camera: &Camera,
        pyramid: &Pyramid,
    ) -> Result<()> {
        pyramid::record_reduce(&self.gpu, encoder, depth, camera, pyramid)
    }

    /// Records the cull of `instances` against `pyramid`, whose depth image must be `camera`'s; `visible` takes what is found.
    ///
    /// A cull of a quarter as many instances as depth image and stored levels have texels copies them into one texture first, which costs less
    /// than it saves ([`AtlasUse`](crate::AtlasUse)).
    ///
    /// # Errors
    /// [`Error::Mismatch`] for objects that do not belong together, [`Error::Invalid`] for unusable options or cameras.
    pub fn record_cull(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        camera: &Camera,
        pyramid: &Pyramid,
        visible: &Visible,
        options: &CullOptions,
    ) -> Result<()> {
        let inputs = CullInputs { instances, camera, pyramid, options, certified: true, idle: false };
        cull::record(&self.gpu, encoder, &inputs, visible)
    }
}

// `required_limits` promises what WebGPU's defaults give.
const _: () = assert!(CULL_WORKGROUP <= 256);
