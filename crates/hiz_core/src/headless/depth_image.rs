//! Depth images on the device: drawn, uploaded, read back.

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::gpu::depth_source::SourceKind;
use crate::headless::engine::Engine;
use crate::headless::readback::{self, to_u32};
use crate::host::memory;
use crate::input::camera::Camera;
use crate::input::depth::{Conversion, DepthInput};
use crate::input::far_pixels::FarPixels;
use crate::input::image::ImageSize;
use crate::input::near_slack::NearSlack;
use crate::input::tolerance::DepthTolerance;
use crate::occluders::depth::OccluderDepth;
use crate::occluders::drawing::{DepthLoad, DrawOptions, Rasteriser, Touched};
use crate::occluders::surface::ConservativeDepthOptions;
use crate::occluders::uploaded::Occluders;
use crate::pyramid::Pyramid;
use crate::pyramid::built::Owner;
use crate::pyramid::ends::Depths;
use crate::pyramid::host_levels::HostLevels;
use crate::pyramid::source::DepthSource;

/// Bytes of an upload's staging buffer at most.
/// Larger images are uploaded in bands of rows.
const STAGING_BYTES: u32 = 1 << 26;

/// What an upload has to tell of far pixels for a pyramid of `depths`.
pub(super) fn far_pixels(depths: Depths) -> FarPixels {
    match depths {
        Depths::Farthest => FarPixels::Alike,
        Depths::Nearest | Depths::Both => FarPixels::NoDepthApart,
        Depths::Receivers => FarPixels::BackgroundApart,
    }
}

/// A depth image on the device, and the camera that made it.
#[derive(Debug, Clone)]
pub struct DepthImage {
    pub(super) engine: Engine,
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
    pub(super) camera: Camera,
    pub(super) tolerance: DepthTolerance,
    /// How much nearer than its depths the surfaces may be, beside the tolerance.
    pub(super) near_slack: NearSlack,
    /// What it tells of pixels that are far.
    pub(super) far_pixels: FarPixels,
    /// Whether its conversion has made pixels far that may have no depth, and does not tell which.
    pub(super) no_data_is_far: bool,
    /// How many samples of each pixel the depth is the farthest of.
    pub(super) samples: u32,
    /// The nearest of several samples.
    pub(super) nearest: Option<wgpu::Texture>,
    /// What draws occluders into it; none for an uploaded image.
    pub(super) drawn: Option<Arc<OccluderDepth>>,
}

impl DepthImage {
    /// The image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.camera.size()
    }

    /// The camera that made the image.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// How far the depths may have been rounded before they came into the texture.
    pub fn tolerance(&self) -> DepthTolerance {
        self.tolerance
    }

    /// What has drawn occluders into it; `None` for an uploaded image.
    pub fn rasteriser(&self) -> Option<Rasteriser> {
        self.drawn.as_ref().map(|drawn| drawn.rasteriser())
    }

    /// The texture.
    /// Images from [`Engine::upload_depth`], and those that the host has drawn, hold four pixels per
    /// texel (`Rgba32Uint`).
    pub fn texture(&self) -> &wgpu::Texture {
        if let Some(drawn) = self.drawn.as_ref().filter(|_| self.engine.check_process().is_ok()) {
            self.engine.images().keep_apart(drawn);
            // From here to the end no drawing is submitted, or its image would stay on the host.
            let _in_order = drawn.submitting.lock();
            if let Some(levels) = drawn.levels() {
                self.engine.bring_in_order(levels);
                // The caller may write into the texture, too.
                levels.turn_off();
            }
        }
        &self.texture
    }

    /// The image in its texture.
    pub(super) fn source(&self) -> DepthSource<'_> {
        if let Some(drawn) = &self.drawn {
            self.engine.bring_image(&**drawn);
        }
        self.source_with(None)
    }

    /// What a reduction reads, if the image was drawn with `levels`.
    ///
    /// Of such an image [`OccluderDepth::submitting`] is held until the reduction is submitted.
    pub(super) fn source_with<'a>(&'a self, levels: Option<&'a HostLevels>) -> DepthSource<'a> {
        let Self { tolerance, near_slack, samples, .. } = *self;
        let nearest = self.nearest.as_ref();
        let whole = DepthSource::from(&self.texture);
        DepthSource { tolerance, near_slack, samples, nearest, levels, ..whole }
    }

    /// Checks that it tells what a pyramid of `depths` has to know.
    pub(super) fn check_depths(&self, depths: Depths) -> Result<()> {
        if self.far_pixels >= far_pixels(depths) {
            return Ok(());
        }
        Err(Error::mismatch(
            "depth",
            format!(
                "expected an image that was uploaded for Depths::{depths:?}, got one whose \
                 conversion has lost which pixels are no depth; upload_depth_for keeps it"
            ),
        ))
    }

    /// The NDC depths as they were given, one per pixel, row 0 on top.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost),
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn read(&self) -> Result<Vec<f32>> {
        let engine = &self.engine;
        let row = 4 * u64::from(self.size().width);
        let bytes = engine.scoped(|| {
            if let Some(drawn) = &self.drawn {
                engine.bring_image(&**drawn);
            }
            readback::read_texture(engine.device(), engine.queue(), &self.texture, row)
        })?;
        memory::collected(to_u32(&bytes).map(f32::from_bits), "depth")
    }

    /// An image without contents.
    pub(super) fn new(
        engine: &Engine,
        camera: &Camera,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<Self> {
        let size = camera.size();
        // The pyramid's limit, which an image of four pixels per texel could pass here.
        let (side, allowed) =
            (size.width.max(size.height), engine.context().gpu.limits().max_texture_dimension_2d);
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", side.into(), allowed.into()));
        }
        let texels = SourceKind::of(format).map_or(size, |kind| kind.texture_size(size));
        let gpu = &engine.context().gpu;
        let texture =
            gpu.texture("hiz.depth.image", (texels.width, texels.height), format, usage)?;
        let view = gpu.view(&texture)?;
        Ok(Self {
            engine: engine.clone(),
            texture,
            view,
            camera: camera.clone(),
            tolerance: DepthTolerance::NONE,
            near_slack: NearSlack::NONE,
            far_pixels: FarPixels::BackgroundApart,
            no_data_is_far: false,
            samples: 1,
            nearest: None,
            drawn: None,
        })
    }

    /// An image that something else has made, without rounding.
    pub(super) fn of_texture(
        engine: &Engine,
        texture: &wgpu::Texture,
        camera: &Camera,
    ) -> Result<Self> {
        Ok(Self {
            engine: engine.clone(),
            texture: texture.clone(),
            view: engine.context().gpu.view(texture)?,
            camera: camera.clone(),
            tolerance: DepthTolerance::NONE,
            near_slack: NearSlack::NONE,
            far_pixels: FarPixels::BackgroundApart,
            no_data_is_far: false,
            samples: 1,
            nearest: None,
            drawn: None,
        })
    }

    /// Records the drawing of occluders, and submits it.
    fn record_occluders(
        &self,
        occluders: &Occluders,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        let Some(drawn) = &self.drawn else {
            return Err(Error::invalid(
                "depth",
                "expected an image that occluders were drawn into, got an uploaded one",
            ));
        };
        let engine = &self.engine;
        let _in_order = drawn.submitting.lock();
        let mut encoder = engine.encoder("hiz.occluders.encoder");
        let hiz = engine.context();
        let (touched, _) = engine.timed(&mut encoder, |encoder| {
            hiz.record_occluder_depth(encoder, occluders, &self.camera, drawn, options)
        })?;
        engine.queue().submit([encoder.finish()]);
        Ok(touched)
    }

    /// An image that holds the given NDC depths.
    /// Shaders read it as `kind`, which must not be that of a depth texture.
    pub(super) fn uploaded(
        engine: &Engine,
        kind: SourceKind,
        ndc: &[f32],
        camera: &Camera,
    ) -> Result<Self> {
        let size = camera.size();
        if ndc.len() as u64 != size.pixels() {
            return Err(Error::invalid(
                "depth",
                format!(
                    "expected the camera's size {size} = {} numbers, got {}",
                    size.pixels(),
                    ndc.len()
                ),
            ));
        }
        let image = Self::for_upload_as(engine, kind, camera)?;
        engine.scoped(|| image.write(ndc, kind))?;
        Ok(image)
    }

    /// Writes all pixels in bands of rows.
    fn write(&self, ndc: &[f32], kind: SourceKind) -> Result<()> {
        let width = self.size().width;
        let rows_at_once = (STAGING_BYTES / (4 * width)).max(1);
        for (band, rows) in (0..).zip(ndc.chunks((rows_at_once * width) as usize)) {
            self.write_rows(band * rows_at_once, rows, kind.pixels_of_texel());
            if band > 0 {
                // An empty submit releases the staging buffer of the previous band.
                self.engine.queue().submit([]);
            }
        }
        Ok(())
    }

    /// The same image with the contents that `depth` describes, for a pyramid of `depths`.
    pub(super) fn filled(self, depth: &DepthInput<'_>, depths: Depths) -> Result<Self> {
        let conversion = Conversion::new(depth, &self.camera)?.telling(far_pixels(depths));
        let engine = self.engine.clone();
        engine.scoped(|| match conversion.unchanged() {
            // The numbers already are what is uploaded, so they are not copied.
            Some(ndc) => self.write(ndc, SourceKind::Bits),
            None => self.write_converted(conversion.threads(), |first, rows| {
                conversion.rows(first, rows);
            }),
        })?;
        let is_unchanged = conversion.unchanged().is_some();
        let far_pixels = if is_unchanged { FarPixels::BackgroundApart } else { far_pixels(depths) };
        let (tolerance, near_slack) = (conversion.left(), conversion.near_slack());
        let no_data_is_far = conversion.has_lost_no_data();
        Ok(Self { tolerance, near_slack, far_pixels, no_data_is_far, ..self })
    }

    /// An image in a texture of [`DepthImage::for_upload`] that is there already.
    pub(super) fn again(
        engine: &Engine,
        texture: wgpu::Texture,
        view: wgpu::TextureView,
        camera: &Camera,
    ) -> Self {
        let (engine, camera) = (engine.clone(), camera.clone());
        Self {
            engine,
            texture,
            view,
            camera,
            tolerance: DepthTolerance::NONE,
            near_slack: NearSlack::NONE,
            far_pixels: FarPixels::BackgroundApart,
            no_data_is_far: false,
            samples: 1,
            nearest: None,
            drawn: None,
        }
    }

    /// An image without contents, to be written from the host.
    pub(super) fn for_upload(engine: &Engine, camera: &Camera) -> Result<Self> {
        Self::for_upload_as(engine, SourceKind::Bits, camera)
    }

    fn for_upload_as(engine: &Engine, kind: SourceKind, camera: &Camera) -> Result<Self> {
        let format = if kind == SourceKind::Bits {
            wgpu::TextureFormat::Rgba32Uint
        } else {
            wgpu::TextureFormat::R32Float
        };
        let usage = kind.usage() | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
        engine.scoped(|| Self::new(engine, camera, format, usage))
    }

    /// Writes whole rows, the first of which is row `first`.
    fn write_rows(&self, first: u32, rows: &[f32], pixels_of_texel: u32) {
        let width = self.size().width;
        let height = (rows.len() / width as usize) as u32;
        let whole = width / pixels_of_texel;
        let write = |column, texels, bytes: &[u8], bytes_per_row| {
            self.engine.queue().write_texture(
                wgpu::TexelCopyTextureInfo {
                    origin: wgpu::Origin3d { x: column, y: first, z: 0 },
                    ..self.texture.as_image_copy()
                },
                bytes,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_row),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width: texels, height, depth_or_array_layers: 1 },
            );
        };
        if whole > 0 {
            write(0, whole, bytemuck::cast_slice(rows), 4 * width);
        }
        if whole < self.texture.width() {
            // The last texel of a row repeats the row's last pixel.
            let (begin, end) = ((whole * pixels_of_texel) as usize, width as usize);
            let last = rows
                .chunks_exact(end)
                .flat_map(|row| (0..4).map(move |i| row[(begin + i).min(end - 1)]));
            write(whole, 1, bytemuck::cast_slice(&last.collect::<Vec<_>>()), 16);
        }
    }
}

impl Engine {
    /// Brings an image that occluders were drawn into to its texture, if it is not there yet.
    ///
    /// Whoever reads the texture calls this before, within [`Engine::scoped`].
    pub(super) fn bring_image(&self, drawn: &dyn Owner) {
        let Some(levels) = drawn.levels() else { return };
        let _in_order = drawn.submitting().lock();
        self.bring_in_order(levels);
    }

    /// The same for those who hold [`Owner::submitting`].
    fn bring_in_order(&self, levels: &HostLevels) {
        if levels.holds_image() {
            let mut encoder = self.encoder("hiz.depth.encoder");
            levels.record_image(&mut encoder);
            self.queue().submit([encoder.finish()]);
            levels.image_has_come();
        }
    }

    /// The same for the image of a pyramid.
    ///
    /// Counts of pixels read so much of it that they gain by it, too.
    pub(super) fn bring_image_of(&self, pyramid: &Pyramid) {
        // One of another device is refused by whoever reads it.
        let is_ours = pyramid.context == self.context().gpu.id();
        let built = is_ours.then(|| pyramid.built()).flatten();
        if let Some(owner) = built.and_then(|built| built.owner) {
            self.bring_image(&*owner);
        }
    }

    /// Draws all occluders into a depth image of the camera's size, by the rasteriser that suits
    /// the device.
    ///
    /// # Errors
    /// Those of [`Engine::render_depth_with`].
    pub fn render_depth(&self, occluders: &Occluders, camera: &Camera) -> Result<DepthImage> {
        self.render_depth_with(occluders, camera, Rasteriser::Auto, &DrawOptions::default())
            .map(|(depth, _)| depth)
    }

    /// Draws occluders into a new depth image of the camera's size.
    ///
    /// The image is cleared in any case.
    /// Returns the rectangle around what was drawn, too, as
    /// [`HizContext::record_occluder_depth`](crate::HizContext::record_occluder_depth) does.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for occluders of another device.
    /// - [`Error::Invalid`] for a camera that float32 cannot hold, and for copies that do not exist.
    /// - [`Error::Limit`] for an image larger than the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn render_depth_with(
        &self,
        occluders: &Occluders,
        camera: &Camera,
        rasteriser: Rasteriser,
        options: &DrawOptions<'_>,
    ) -> Result<(DepthImage, Touched)> {
        self.scoped(|| {
            let drawn = self.images().lend(self.context(), camera.size(), rasteriser)?;
            let depth = DepthImage {
                engine: self.clone(),
                texture: drawn.texture().clone(),
                view: drawn.view().clone(),
                camera: camera.clone(),
                tolerance: DepthTolerance::NONE,
                near_slack: NearSlack::NONE,
                far_pixels: FarPixels::BackgroundApart,
                no_data_is_far: false,
                samples: 1,
                nearest: None,
                drawn: Some(drawn),
            };
            let options = DrawOptions { load: DepthLoad::Clear, ..*options };
            let touched = depth.record_occluders(occluders, &options);
            let touched = touched.inspect_err(|_| self.images().forget())?;
            Ok((depth, touched))
        })
    }

    /// Draws occluders into an image that was made by [`Engine::render_depth`], as its camera sees
    /// them.
    ///
    /// [`DrawOptions::load`] says whether they are added to what is there.
    /// Culls and pyramids of the image that were submitted before see it as it was.
    /// A pyramid that was built before is out of date afterwards: build it again.
    ///
    /// # Errors
    /// Those of [`Engine::render_depth_with`], and [`Error::Invalid`] for an image that was uploaded.
    pub fn render_depth_into(
        &self,
        depth: &DepthImage,
        occluders: &Occluders,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        self.context().gpu.check_context("depth", depth.engine.context().gpu.id())?;
        self.scoped(|| depth.record_occluders(occluders, options))
    }

    /// Makes occluder depth that holds for every larger image of the same view
    /// ([`OccluderSurface::conservative_depth`]).
    /// It is computed on the host and uploaded.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth`] and [`OccluderSurface::conservative_depth`], and
    /// [`Error::Mismatch`] for occluders of another device.
    ///
    /// [`OccluderSurface::conservative_depth`]: crate::OccluderSurface::conservative_depth
    pub fn render_depth_conservative(
        &self,
        occluders: &Occluders,
        camera: &Camera,
        options: &ConservativeDepthOptions,
    ) -> Result<DepthImage> {
        self.check_process()?;
        self.context().gpu.check_context("occluders", occluders.context)?;
        self.upload_depth(&occluders.surface().conservative_depth(camera, options)?, camera)
    }

    /// Uploads NDC depth: one float32 per pixel, row 0 on top, in the camera's size and convention.
    /// Values that are no depth (NaN, infinite, outside 0..=1) become far when they are read.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for another number of pixels.
    /// - [`Error::Limit`] for an image larger than the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn upload_depth(&self, ndc: &[f32], camera: &Camera) -> Result<DepthImage> {
        DepthImage::uploaded(self, SourceKind::Bits, ndc, camera)
    }

    /// [`Engine::upload_depth`] for depth that was rounded within `tolerance` before.
    /// For half floats that is [`DepthTolerance::HALF`].
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth`], and [`Error::Invalid`] for a tolerance outside 0..=0.5.
    pub fn upload_depth_within(
        &self,
        ndc: &[f32],
        camera: &Camera,
        tolerance: DepthTolerance,
    ) -> Result<DepthImage> {
        let tolerance = tolerance.checked()?;
        Ok(DepthImage { tolerance, ..self.upload_depth(ndc, camera)? })
    }

    /// Uploads depth of any kind, and converts it on all cores on its way.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth`] and [`ndc_from_kind`](crate::ndc_from_kind), and
    /// [`Error::Invalid`] for a tolerance outside 0..=0.5.
    pub fn upload_depth_of_kind(
        &self,
        depth: &DepthInput<'_>,
        camera: &Camera,
    ) -> Result<DepthImage> {
        self.upload_depth_for(depth, camera, Depths::Farthest)
    }

    /// [`Engine::upload_depth_of_kind`] for a pyramid of `depths`, or of the farthest depths alone.
    ///
    /// What is no depth stays NaN, so that the nearest end counts it as near.
    /// For [`Depths::Receivers`] a measured depth stops one float short of far, so that it is never
    /// background.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth_of_kind`].
    ///
    /// # Examples
    /// ```
    /// use hiz_core::headless::Engine;
    /// use hiz_core::{DepthEnd, DepthInput, DepthKind, DepthTolerance, Depths, Floats};
    /// use hiz_core::{PyramidOptions, WorldTolerance};
    /// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
    /// # let engine = Engine::new(None)?;
    /// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    /// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
    /// # let projection = Projection::Perspective { fov_y, near: 1.0, far: None, convention };
    /// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(4, 1))?;
    ///
    /// // Walls at 2 m and 4 m, and a pixel without data.
    /// let depth = DepthInput {
    ///     numbers: Floats::F32(&[4.0, 4.0, 2.0, f32::NAN]).into(),
    ///     kind: DepthKind::Z,
    ///     scale: 1.0,
    ///     invalid: &[],
    ///     tolerance: DepthTolerance::NONE,
    ///     world_tolerance: WorldTolerance::NONE,
    /// };
    /// let depth = engine.upload_depth_for(&depth, &camera, Depths::Both)?;
    /// let options = PyramidOptions { depths: Depths::Both, ..PyramidOptions::default() };
    /// let pyramid = engine.pyramid_with(&depth, &options)?;
    /// let level = |end| engine.read_level_of(&pyramid, 1, end);
    /// let farthest = level(DepthEnd::Farthest)?;
    /// assert!((farthest[0] - 0.25).abs() < 1e-6 && farthest[1] == 0.0);
    /// assert!((level(DepthEnd::Nearest)?[1] - 1.0).abs() < 1e-6); // near, by the pixel without data
    /// # Ok::<(), hiz_core::Error>(())
    /// ```
    pub fn upload_depth_for(
        &self,
        depth: &DepthInput<'_>,
        camera: &Camera,
        depths: Depths,
    ) -> Result<DepthImage> {
        self.check_process()?;
        DepthImage::for_upload(self, camera)?.filled(depth, depths)
    }

    /// [`Engine::upload_depth`] into a float texture, for tests.
    /// Shaders sample it like a depth texture.
    ///
    /// # Errors
    /// Those of [`Engine::upload_depth`].
    #[cfg(feature = "testing")]
    pub fn upload_depth_sampled(&self, ndc: &[f32], camera: &Camera) -> Result<DepthImage> {
        DepthImage::uploaded(self, SourceKind::Float, ndc, camera)
    }
}
