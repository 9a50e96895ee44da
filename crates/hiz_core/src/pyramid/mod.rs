//! The depth pyramid: its storage, and the passes that fill it.
//!
//! Data flows through the room in this order:
//!
//! 1. `layout` plans levels, offsets and dispatches without a device; `levels` says what is stored,
//!    and `blocks` what a step reads.
//! 2. [`Pyramid`] holds the buffers of the stored levels.
//! 3. `ends` says which depths of a block are stored.
//!    `resolve` makes one depth per pixel of multisampled depth.
//!    `source` says where a depth image lies in a texture.
//!    `reduce` records the passes that fill the levels from it; `steps` holds what the passes bind,
//!    and `built` remembers the image.
//!    `region` does the same for a part that has changed.
//!    `host_levels` are made by a host that draws the image (`host_reduce`), and copied instead.
//! 4. `atlas` copies all levels into one texture for large culls.
//! 5. `mips` is a texture with mip levels, for shaders of the caller's own: `mips_plan` plans it,
//!    `mips_bindings` holds what its passes bind, and `mips_passes` records them.
//! 6. `receiver_mask` turns a camera's depth image into one of a light, for its shadow casters.
//!
//! Passes are recorded into the caller's encoder; nothing here submits, waits or reads back.

pub(crate) mod atlas;
pub(crate) mod blocks;
pub(crate) mod built;
pub(crate) mod ends;
pub(crate) mod host_levels;
pub(crate) mod host_reduce;
pub(crate) mod layout;
pub(crate) mod level_texels;
pub(crate) mod levels;
pub(crate) mod mips;
pub(crate) mod mips_bindings;
pub(crate) mod mips_passes;
pub(crate) mod mips_plan;
mod numbering;
pub(crate) mod receiver_mask;
pub(crate) mod reduce;
pub(crate) mod region;
pub(crate) mod resolve;
pub(crate) mod source;
mod sources;
pub(crate) mod steps;

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::kept::Kept;
use crate::gpu::recorded_uniform::RecordedUniform;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::tolerance::DepthTolerance;
use crate::pyramid::atlas::{Atlas, AtlasUse};
use crate::pyramid::built::{Built, Owner};
use crate::pyramid::ends::Depths;
use crate::pyramid::layout::{PYRAMID_CHUNKS, PyramidLayout, chunk_shift};
use crate::pyramid::levels::{Level, MAX_LEVELS, StoredLevels};
use crate::pyramid::source::{KEPT_IMAGES, Subresource};
use crate::pyramid::steps::Steps;

/// Twin of `Pyramid` in `shaders/pyramid/pyramid.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PyramidUniform {
    pub(crate) levels: [Level; MAX_LEVELS],
    /// Column and row in an atlas; offset and stride where all levels are in place.
    pub(crate) origins: [[u32; 4]; MAX_LEVELS],
    pub(crate) chunk_shift: u32,
    pub(crate) first_stored: u32,
    pub(crate) last_stored: u32,
    pub(crate) nearest: u32,
}

const _: () = assert!(size_of::<PyramidUniform>() == 528);

/// What tells the bind groups of reductions apart: the image, that of nearest samples, the kind.
pub(crate) type SourceKey = (Subresource, Option<wgpu::Texture>, SourceKind);

/// What a reduction binds for an image, with the views of both images.
pub(crate) type BoundSource = (wgpu::BindGroup, wgpu::TextureView, Option<wgpu::TextureView>);

/// Labels of the stand-ins that are bound for the chunks that a small pyramid does not have.
const NO_CHUNK: [&str; PYRAMID_CHUNKS] = ["hiz.no_chunk_0", "hiz.no_chunk_1", "hiz.no_chunk_2"];

/// How a pyramid is stored.
#[derive(Debug, Clone, Default)]
pub struct PyramidOptions {
    /// Which levels are stored; all by default.
    pub levels: StoredLevels,
    /// Which depths of each block are stored: the farthest by default.
    pub depths: Depths,
    /// Texels per chunk as a power of two, at least 2.
    ///
    /// `None`: as many as one storage binding of the device holds, which is the most allowed.
    #[cfg(feature = "testing")]
    pub chunk_shift: Option<u32>,
    /// Whether culls read all levels from one texture.
    pub atlas: AtlasUse,
}

impl PyramidOptions {
    /// Texels per chunk as a power of two, at most `most`.
    #[cfg(feature = "testing")]
    fn checked_chunk_shift(&self, most: u32) -> Result<u32> {
        let shift = self.chunk_shift.unwrap_or(most);
        if (2..=most).contains(&shift) {
            return Ok(shift);
        }
        Err(Error::invalid("chunk_shift", format!("expected 2 to {most}, got {shift}")))
    }

    #[cfg(not(feature = "testing"))]
    #[expect(clippy::unnecessary_wraps, clippy::unused_self, reason = "as with the feature")]
    fn checked_chunk_shift(&self, most: u32) -> Result<u32> {
        Ok(most)
    }
}

/// A depth pyramid on the device: for every level, the farthest depth of each block of pixels.
///
/// [`PyramidOptions::depths`] asks for the nearest depth instead, or for both.
///
/// Level 0 is the depth texture itself, which the pyramid does not copy.
/// It keeps the last three depth textures alive, in the bind groups that read them.
/// **Do not write to that texture between the reduction and the culls that use it.**
///
/// # Examples
/// ```
/// use hiz_core::{ImageSize, PyramidOptions, StoredLevels, headless::Engine};
/// # use hiz_core::{Camera, DepthConvention, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let camera = camera.with_size(ImageSize::new(4, 2))?;
///
/// // Reversed Z, so the farthest depth is the least; level 0 is the image itself.
/// let image = [0.9, 0.8, 0.1, 0.2, 0.7, 0.6, 0.3, 0.4];
/// let depth = engine.upload_depth(&image, &camera)?; // 4 x 2 pixels
/// let pyramid = engine.pyramid(&depth)?;
/// assert_eq!(pyramid.num_levels(), 3);
/// assert_eq!(engine.read_level(&pyramid, 1)?, [0.6, 0.1]);
/// assert_eq!(engine.read_level(&pyramid, 2)?, [0.1]);
///
/// // Without level 1: built faster, and culls keep more.
/// let options = PyramidOptions { levels: StoredLevels::from(2), ..PyramidOptions::default() };
/// let coarse = engine.pyramid_with(&depth, &options)?;
/// assert_eq!(coarse.level_size(2), Some(ImageSize::new(1, 1)));
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Pyramid {
    pub(crate) context: ContextId,
    pub(crate) layout: PyramidLayout,
    pub(crate) chunks: Vec<wgpu::Buffer>,
    pub(crate) uniform: wgpu::Buffer,
    built: Locked<Option<Built>>,
    atlas_use: AtlasUse,
    /// Set once there was no memory for an atlas.
    no_atlas: AtomicBool,
    atlas: Locked<Option<Atlas>>,
    /// Held while reductions that build on each other are recorded and submitted.
    #[cfg(feature = "headless")]
    pub(crate) submitting: Locked<()>,
    /// Whether the depth image has far pixels that may have no depth; its conversion lost which.
    #[cfg(feature = "headless")]
    pub(crate) no_data_is_far: AtomicBool,
    /// Whether the last reduction copies levels of the host's.
    #[cfg(feature = "testing")]
    are_copied: AtomicBool,
    /// The last reduction that is known to have run; one that was only recorded may never run.
    reduced: Arc<AtomicU32>,
    /// The view of a cull, for instances and for groups.
    pub(crate) view: RecordedUniform,
    /// What reductions bind for a depth image, and the view of it that they bind.
    pub(crate) sources: Kept<SourceKey, BoundSource>,
    /// What the steps of a reduction bind.
    pub(crate) steps: Steps,
    /// The same for reductions of a part; made by the first of them.
    pub(crate) part_steps: OnceLock<Steps>,
}

impl Pyramid {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, options: &PyramidOptions) -> Result<Self> {
        let side = size.width.max(size.height);
        let allowed = gpu.limits().max_texture_dimension_2d;
        if side > allowed {
            return Err(Error::limit(
                "max_texture_dimension_2d",
                u64::from(side),
                u64::from(allowed),
            ));
        }
        if side == 0 || size.width.min(size.height) == 0 {
            return Err(Error::invalid(
                "size",
                format!("expected at least one pixel a side, got {size}"),
            ));
        }
        let chunk_shift = options.checked_chunk_shift(chunk_shift(gpu.limits()))?;
        let layout = PyramidLayout::new(size, options.levels, options.depths, chunk_shift)?;
        let chunks = layout
            .chunk_sizes()
            .iter()
            .map(|texels| {
                let copies = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
                let usage = wgpu::BufferUsages::STORAGE | copies;
                gpu.empty("hiz.pyramid.chunk", texels * 4, usage)
            })
            .collect::<Result<_>>()?;
        let mut levels = [Level { offset: 0, stride: 0, width: 0, height: 0 }; MAX_LEVELS];
        levels[..layout.levels.len()].copy_from_slice(&layout.levels);
        let mut origins = layout.atlas.origins;
        let mut in_place = levels;
        in_place[0] = layout.image().unwrap_or(levels[0]);
        for (origin, Level { offset, stride, .. }) in origins.iter_mut().zip(in_place) {
            origin[2..].copy_from_slice(&[offset, stride]);
        }
        let StoredLevels { first, last } = layout.stored;
        let uniform = gpu.uniform(
            "hiz.pyramid.layout",
            &PyramidUniform {
                levels,
                origins,
                chunk_shift,
                first_stored: first,
                last_stored: last,
                nearest: layout.nearest,
            },
        )?;
        let steps = Steps::new(gpu, &layout.steps)?;
        Ok(Self {
            context: gpu.id(),
            layout,
            chunks,
            uniform,
            built: Locked::default(),
            atlas_use: options.atlas,
            no_atlas: AtomicBool::new(false),
            atlas: Locked::default(),
            #[cfg(feature = "headless")]
            submitting: Locked::default(),
            #[cfg(feature = "headless")]
            no_data_is_far: AtomicBool::new(false),
            #[cfg(feature = "testing")]
            are_copied: AtomicBool::new(false),
            reduced: Arc::default(),
            // Culls read each image, or the atlas.
            view: RecordedUniform::new(gpu, "hiz.cull.view_uniform", KEPT_IMAGES + 1)?,
            sources: Kept::new(KEPT_IMAGES),
            steps,
            part_steps: OnceLock::new(),
        })
    }

    /// The depth image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.layout.size
    }

    /// The number of levels, from level 0 down to the level of 1x1.
    pub fn num_levels(&self) -> u32 {
        self.layout.num_levels()
    }

    /// Which levels above 0 are stored, limited to those that exist.
    ///
    /// `None` for an image of one pixel, which has level 0 alone.
    pub fn stored_levels(&self) -> Option<StoredLevels> {
        let stored = self.layout.stored;
        (stored.first <= stored.last).then_some(stored)
    }

    /// Which depths of each block of pixels are stored.
    pub fn depths(&self) -> Depths {
        self.layout.depths
    }

    /// Whether the nearest depths are stored, beside the farthest or alone.
    pub fn has_nearest(&self) -> bool {
        self.layout.depths.has_nearest()
    }

    /// The size of a level in texels; `None` past the last level.
    pub fn level_size(&self, level: u32) -> Option<ImageSize> {
        self.layout.levels.get(level as usize).map(|l| ImageSize::new(l.width, l.height))
    }

    /// Bytes on the device, including an atlas and excluding the depth image, wherever it is.
    pub fn device_bytes(&self) -> u64 {
        let atlas = self.atlas.lock();
        let atlas = atlas.as_ref().map_or(0, Atlas::bytes);
        self.chunks.iter().map(wgpu::Buffer::size).sum::<u64>() + atlas
    }

    /// Whether culls of `instances` instances read an atlas: where one is possible, and pays.
    ///
    /// `built` is what the cull is against.
    /// The pyramid may meanwhile be built from another kind of image.
    pub(crate) fn wants_atlas(&self, gpu: &Gpu, built: &Built, instances: u32) -> bool {
        self.atlas_use.pays(&self.layout, instances)
            && !self.no_atlas.load(Ordering::Relaxed)
            && atlas::is_possible(&self.layout, &built.part, gpu.limits())
    }

    /// Releases everything that was made for culls, after an error on the device.
    ///
    /// Returns whether that included an atlas.
    pub(crate) fn forget(&self) -> bool {
        self.view.clear();
        self.sources.clear();
        self.atlas.lock().take().is_some()
    }

    /// Called where there is no memory for an atlas.
    ///
    /// From now on culls read the depth image and the stored levels in place.
    pub(crate) fn do_without_atlas(&self) {
        self.no_atlas.store(true, Ordering::Relaxed);
    }

    /// The atlas of what the pyramid was built from; `None` where there is no memory for one.
    ///
    /// The copies into it are recorded, unless they are known to have run after that reduction.
    /// Once memory was short the pyramid never tries an atlas again.
    pub(crate) fn record_atlas(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        built: &Built,
    ) -> Result<Option<wgpu::TextureView>> {
        let mut kept = self.atlas.lock();
        let made = match kept.take() {
            Some(there) => Ok(there),
            None => Atlas::new(gpu, &self.layout),
        };
        let recorded = made.and_then(|mut atlas| {
            if !atlas.holds(built.reduction) {
                atlas.record(gpu, encoder, &self.layout, &self.chunks[0], built)?;
                self.note_copies(encoder, &atlas, built.reduction);
            }
            Ok(atlas)
        });
        let error = match recorded {
            Ok(atlas) => return Ok(Some(kept.insert(atlas).view())),
            Err(error) => error,
        };
        // The kept bind groups may refer to the atlas that was just dropped.
        self.view.clear();
        if matches!(error, Error::OutOfMemory(_)) {
            self.do_without_atlas();
            return Ok(None);
        }
        Err(error)
    }

    /// Notes what the atlas holds once the copies into it have run.
    fn note_copies(&self, encoder: &wgpu::CommandEncoder, atlas: &Atlas, reduction: u32) {
        let (contents, reduced) = (atlas.contents(), self.reduced());
        encoder.on_submitted_work_done(move || {
            // If the copies ran before their reduction or after the next one, they have overwritten
            // the atlas with other levels.
            let ran_behind_it = reduced.load(Ordering::Acquire) == reduction;
            contents.store(if ran_behind_it { reduction } else { 0 }, Ordering::Release);
        });
    }

    /// The camera of the depth image that the pyramid was last built from.
    ///
    /// `None` before the first reduction.
    pub fn camera(&self) -> Option<Camera> {
        self.built().map(|b| b.camera)
    }

    /// How far the depths in the pyramid may lie from those that were given to be stored.
    ///
    /// The bound combines the format of the depth image ([`DepthTolerance::of`]) and the rounding
    /// of what was uploaded into it.
    /// `None` before the first reduction.
    /// Every cull counts it, beside the slack of its options.
    pub fn tolerance(&self) -> Option<DepthTolerance> {
        self.built().map(|b| b.part.tolerance)
    }

    /// Checks that the depth image of `built` has not been destroyed.
    ///
    /// A cull would bind it, and a destroyed texture makes the caller's encoder invalid.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a destroyed depth image.
    pub(crate) fn check_source(gpu: &Gpu, built: &Built) -> Result<()> {
        let views = [&built.source].into_iter().chain(&built.nearest);
        let mut textures = views.map(wgpu::TextureView::texture);
        textures.try_for_each(|texture| gpu.view(texture).map(drop)).map_err(|error| match error {
            Error::Device(why) => Error::mismatch(
                "pyramid",
                format!(
                    "expected one whose depth image has not been destroyed since it was \
                     reduced, but {why}"
                ),
            ),
            other => other,
        })
    }

    /// Whether the last reduction that was recorded copies levels that the host has made.
    #[cfg(feature = "testing")]
    pub fn has_host_levels(&self) -> bool {
        self.are_copied.load(Ordering::Relaxed)
    }

    /// Whether culls may read all levels and the image in the buffer that the host has written.
    #[cfg(feature = "testing")]
    pub fn is_in_place(&self) -> bool {
        self.built().is_some_and(|built| built.in_place.is_some())
    }

    /// The buffer of chunk `i`, or a stand-in if the pyramid has fewer chunks.
    pub(crate) fn chunk(&self, gpu: &Gpu, i: usize) -> Result<wgpu::Buffer> {
        match self.chunks.get(i) {
            Some(chunk) => Ok(chunk.clone()),
            None => gpu.stand_in(NO_CHUNK[i]),
        }
    }

    /// Keeps `owner` with the image that the pyramid was just built from.
    pub(crate) fn keep_with_it(&self, owner: Arc<dyn Owner>) {
        if let Some(built) = &mut *self.built.lock() {
            built.owner = Some(owner);
        }
    }

    /// Keeps its image from being drawn again until the commands of `encoder` have run.
    ///
    /// An engine lends the images of its own again, and submits what it records at once.
    /// The encoder of a caller may be submitted when pyramid and image are long gone.
    pub(crate) fn hold_image(&self, encoder: &wgpu::CommandEncoder) {
        if let Some(owner) = self.built().and_then(|built| built.owner) {
            // An encoder that is never submitted drops this, too.
            encoder.on_submitted_work_done(move || drop(owner));
        }
    }

    /// Notes that a reduction was recorded.
    pub(super) fn set_built(&self, built: Built) {
        // No later cull has the same view, since that contains the number of the reduction.
        self.view.forget_contents();
        *self.built.lock() = Some(built);
    }

    /// The last reduction that is known to have run, shared with the callback that sets it.
    pub(super) fn reduced(&self) -> Arc<AtomicU32> {
        Arc::clone(&self.reduced)
    }

    pub(crate) fn built(&self) -> Option<Built> {
        self.built.lock().clone()
    }

    /// What the pyramid was built from, for a cull with `camera`.
    ///
    /// # Errors
    /// [`Error::Mismatch`] if the pyramid was never built, or was built with another camera.
    pub(crate) fn built_for(&self, camera: &Camera) -> Result<Built> {
        let built = self.built().ok_or_else(|| {
            Error::mismatch(
                "pyramid",
                "expected one that was built from a depth image, got one that never was",
            )
        })?;
        if built.camera == *camera {
            return Ok(built);
        }
        let (theirs, ours) = (built.camera.size(), camera.size());
        Err(Error::mismatch(
            "camera",
            if theirs == ours {
                "expected the camera of the pyramid's depth image, got another one".to_owned()
            } else {
                format!(
                    "expected the camera of the pyramid's depth image, size {theirs}, got one of \
                     size {ours}"
                )
            },
        ))
    }
}

const _: () = assert!(PYRAMID_CHUNKS == 3, "the bind groups list three chunks");
