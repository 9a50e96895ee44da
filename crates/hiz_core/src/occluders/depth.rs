//! A depth image that occluders are drawn into, by the rasteriser that suits the device.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::kept::RingShare;
use crate::gpu::row_staging::{record_rows, staging_bytes};
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::occluders::device_raster::{OCCLUDER_DEPTH_FORMAT, record_occluders};
use crate::occluders::drawing::{DepthLoad, DrawOptions, Rasteriser, Touched};
use crate::occluders::host_raster::{HostRaster, Way};
use crate::occluders::uploaded::Occluders;
use crate::pyramid::built::Owner;
use crate::pyramid::host_levels::HostLevels;
use crate::pyramid::source::DepthSource;

const STAGING: &str = "hiz.occluders.staging";

/// Staging buffers that are kept for an image: two frames may be on their way.
const STAGING_KEPT: usize = 2;

/// A depth image for occluders, made once and drawn each frame.
///
/// [`HizContext::record_occluder_depth`](crate::HizContext::record_occluder_depth) draws into it,
/// and [`HizContext::record_reduce`](crate::HizContext::record_reduce) takes it.
///
/// The device's rasteriser draws into a `Depth32Float` texture.
/// The host's draws into memory, and its rows are copied into an `Rgba32Uint` texture of four
/// pixels per texel.
/// The host makes the levels of a pyramid with them, which a reduction copies ([`HostLevels`]).
///
/// # Examples
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{DrawOptions, Floats, HizContext, MeshData, OccluderOptions, PyramidOptions};
/// use hiz_core::Rasteriser;
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, wgpu};
/// # let engine = Engine::new(None)?;
/// # let (device, queue) = (engine.device(), engine.queue());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
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
///
/// // Each frame:
/// let all = DrawOptions::default();
/// hiz.record_occluder_depth(&mut encoder, &occluders, &camera, &depth, &all)?;
/// hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
/// # queue.submit([encoder.finish()]);
/// # engine.wait()?;
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct OccluderDepth {
    context: ContextId,
    size: ImageSize,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    /// What the rasteriser on the host has, if that one draws.
    host: Option<Host>,
    /// Held from the recording to the submit by those who submit, so that drawings, and what reads
    /// the texture, keep their order.
    pub(crate) submitting: Locked<()>,
}

/// An image of the host's rasteriser, and how it comes to the device.
#[derive(Debug)]
struct Host {
    image: Locked<HostImage>,
    /// Buffers through which rows come to the texture.
    staging: RingShare,
    /// Levels that the host makes with the image.
    levels: Option<HostLevels>,
}

/// What the host's rasteriser has drawn.
#[derive(Debug)]
struct HostImage {
    raster: HostRaster,
    /// The convention of the cameras that have drawn into it since it was cleared.
    convention: Option<DepthConvention>,
}

impl OccluderDepth {
    /// `keeps_image`: what the host draws stays on the host until a copy to the texture is asked
    /// for ([`HostLevels::record_image`]), where culls can do without the texture.
    pub(crate) fn new(
        gpu: &Gpu,
        size: ImageSize,
        rasteriser: Rasteriser,
        keeps_image: bool,
    ) -> Result<Self> {
        if size.width == 0 || size.height == 0 {
            return Err(Error::invalid("size", format!("expected at least one pixel, got {size}")));
        }
        let on_host = match rasteriser {
            Rasteriser::Auto => gpu.is_processor(),
            Rasteriser::Device => false,
            Rasteriser::Host => true,
        };
        let common = wgpu::TextureUsages::COPY_SRC;
        let (texels, format, usage) = if on_host {
            let kind = SourceKind::Bits;
            (
                kind.texture_size(size),
                wgpu::TextureFormat::Rgba32Uint,
                kind.usage() | wgpu::TextureUsages::COPY_DST | common,
            )
        } else {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | SourceKind::Depth.usage() | common;
            (size, OCCLUDER_DEPTH_FORMAT, usage)
        };
        // The pyramid's limit, which an image of four pixels per texel could pass here.
        let (side, allowed) = (size.width.max(size.height), gpu.limits().max_texture_dimension_2d);
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", side.into(), allowed.into()));
        }
        let texture =
            gpu.texture("hiz.depth.image", (texels.width, texels.height), format, usage)?;
        let view = gpu.view(&texture)?;
        let host = on_host.then(|| Host {
            image: Locked::new(HostImage { raster: HostRaster::new(size), convention: None }),
            staging: gpu.rings.share((STAGING, staging_bytes(&texture, size.height)), STAGING_KEPT),
            levels: HostLevels::new(gpu, &texture, size, keeps_image),
        });
        Ok(Self { context: gpu.id(), size, texture, view, host, submitting: Locked::default() })
    }

    /// The image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// The rasteriser that draws: [`Rasteriser::Device`] or [`Rasteriser::Host`].
    pub fn rasteriser(&self) -> Rasteriser {
        if self.host.is_some() { Rasteriser::Host } else { Rasteriser::Device }
    }

    /// The texture.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// A view of all of it.
    ///
    /// As the source of a reduction it lacks the levels that `&depth` has: pass it where something
    /// else was written into the texture.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// Levels that the host makes with the image, if it draws it.
    pub(crate) fn levels(&self) -> Option<&HostLevels> {
        self.host.as_ref().and_then(|host| host.levels.as_ref())
    }

    /// Records the drawing of `occluders`.
    ///
    /// # Errors
    /// As [`HizContext::record_occluder_depth`](crate::HizContext::record_occluder_depth).
    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        gpu.check_context("depth", self.context)?;
        gpu.check_context("occluders", occluders.context)?;
        let Some(host) = &self.host else {
            return record_occluders(gpu, encoder, occluders, camera, &self.view, options);
        };
        if camera.size() != self.size {
            return Err(Error::mismatch(
                "camera",
                format!(
                    "expected the size of the depth image, {}, got {}",
                    self.size,
                    camera.size()
                ),
            ));
        }
        // What is refused leaves the image as it was.
        occluders.surface.check_drawing(camera, options)?;
        let mut image = host.image.lock();
        let convention = camera.convention();
        match options.load {
            DepthLoad::Clear => image.raster.clear(),
            DepthLoad::Load => {
                if let Some(drawn) = image.convention.filter(|drawn| *drawn != convention) {
                    return Err(Error::mismatch(
                        "camera",
                        format!(
                            "expected the depth convention that was drawn with before, {drawn:?}, \
                             got {convention:?}"
                        ),
                    ));
                }
            }
        }
        // An image that is new or cleared has to come to the device as a whole.
        // So has one whose rows could not be copied, or the texture would keep older ones, and one
        // that is not in the texture yet.
        let is_held = host.levels.as_ref().is_some_and(HostLevels::holds_image);
        let is_whole = options.load == DepthLoad::Clear || image.convention.is_none() || is_held;
        image.convention = None;
        let way = Way { threads: None, skip: true };
        let touched = occluders.surface.draw_into(&mut image.raster, camera, way, options)?;
        let rows = match touched {
            _ if is_whole => 0..self.size.height,
            Some([_, y0, _, y1]) => y0..y1 + 1,
            None => 0..0,
        };
        if !rows.is_empty() {
            // What is added to an image changes few of its levels; a reduction of that part does.
            let is_anew = options.load == DepthLoad::Clear;
            let drawn = (&image.raster, convention, rows);
            host.record_rows(gpu, encoder, &self.texture, drawn, is_anew)?;
        }
        image.convention = Some(convention);
        Ok(touched)
    }
}

impl Owner for OccluderDepth {
    fn submitting(&self) -> &Locked<()> {
        &self.submitting
    }

    fn levels(&self) -> Option<&HostLevels> {
        self.levels()
    }
}

impl Host {
    /// Records the copy of rows of the host's image into the texture, and of its levels, if the
    /// rows are all of an image that was drawn anew.
    /// Such an image may stay with its levels.
    fn record_rows(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        texture: &wgpu::Texture,
        (raster, convention, rows): (&HostRaster, DepthConvention, Range<u32>),
        is_anew: bool,
    ) -> Result<()> {
        let levels = match &self.levels {
            Some(levels) if is_anew => levels.begin(gpu, convention)?,
            _ => None,
        };
        if let Some((made, pitch)) = levels.as_ref().and_then(|l| Some(l).zip(l.image_pitch())) {
            let open = |part| made.open_image(part);
            raster.write_rows(open, pitch, convention, &rows, Some(made))?;
        } else {
            let (ring, part) = (self.staging.ring(), (texture, rows.clone(), texture.height()));
            record_rows(gpu, encoder, (ring, STAGING), part, |mapped, pitch| {
                let open = |part| mapped.range(part);
                raster.write_rows(open, pitch, convention, &rows, levels.as_ref())
            })?;
        }
        match (levels, &self.levels) {
            (Some(made), _) => made.record(gpu, encoder),
            (None, Some(levels)) => levels.retract(gpu, encoder),
            (None, None) => Ok(()),
        }
    }
}

impl<'a> From<&'a OccluderDepth> for DepthSource<'a> {
    /// What was drawn, with the levels that the host has made of it.
    ///
    /// Where something else was written into the texture, too, take the texture as the source.
    fn from(depth: &'a OccluderDepth) -> Self {
        Self { levels: depth.levels(), ..Self::from(&depth.texture) }
    }
}
