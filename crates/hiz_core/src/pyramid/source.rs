//! Where a depth image lies: which part of which texture.

use crate::error::{Error, Result};
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::Gpu;
use crate::input::image::ImageSize;
use crate::input::near_slack::NearSlack;
use crate::input::tolerance::DepthTolerance;
use crate::pyramid::ends::Depths;
use crate::pyramid::host_levels::HostLevels;

/// For how many depth images bind groups are kept, by reductions, culls and other stages.
/// A renderer may alternate between a few.
pub(super) const KEPT_IMAGES: usize = 3;

/// A depth image in a texture: one layer of one mip level, or a rectangle of it.
///
/// A texture, or a view of it, converts by `From`: its only layer and mip level, from corner to
/// corner.
/// A view does not say which part of its texture it shows.
/// So a texture of several layers or mip levels needs their numbers.
///
/// | what a renderer has | what it passes |
/// |---|---|
/// | a depth buffer of its own | `&texture` or `&view` |
/// | one cascade, or one eye | [`array_layer`](Self::array_layer) |
/// | one mip level | [`mip_level`](Self::mip_level) |
/// | split screen, dynamic resolution | [`origin`](Self::origin) and [`size`](Self::size) |
/// | multisampled depth | what [`record_resolve`](crate::HizContext::record_resolve) returns |
/// | occluders alone | a `&`[`OccluderDepth`](crate::OccluderDepth) |
///
/// # Examples
/// The right half of a split screen:
///
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{DepthSource, ImageSize, PyramidOptions, wgpu};
/// # use hiz_core::{Camera, DepthConvention, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let (device, hiz) = (engine.device(), engine.context());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let convention = DepthConvention::Reversed;
/// # let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
/// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
/// # let depth = device.create_texture(&wgpu::TextureDescriptor {
/// #     label: None,
/// #     size: wgpu::Extent3d { width: 64, height: 48, depth_or_array_layers: 1 },
/// #     mip_level_count: 1,
/// #     sample_count: 1,
/// #     dimension: wgpu::TextureDimension::D2,
/// #     format: wgpu::TextureFormat::Depth32Float,
/// #     usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
/// #     view_formats: &[],
/// # });
///
/// // `depth` has 64 x 48 pixels, and the camera of the right half 32 x 48.
/// let camera = Camera::look_at(&pose, &projection, ImageSize::new(32, 48))?;
/// let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
/// let right = DepthSource { origin: [32, 0], ..DepthSource::from(&depth) };
/// hiz.record_reduce(&mut encoder, right, &camera, &pyramid)?;
/// # engine.queue().submit([encoder.finish()]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct DepthSource<'a> {
    /// The texture.
    pub texture: &'a wgpu::Texture,
    /// `All` or `DepthOnly`: depth is read either way.
    pub aspect: wgpu::TextureAspect,
    /// The mip level; `None`: the only one.
    pub mip_level: Option<u32>,
    /// The layer; `None`: the only one.
    pub array_layer: Option<u32>,
    /// The column and the row where the image begins, in pixels of the mip level.
    pub origin: [u32; 2],
    /// The image's size in pixels; `None`: up to the far corner of the mip level.
    pub size: Option<ImageSize>,
    /// How many samples of each pixel the depth is the farthest of; 1 without multisampling.
    ///
    /// A pixel of several samples says what is behind all of them, and not what is at its centre.
    /// So with more than 1 culls take [`Coverage::Area`](crate::Coverage::Area) alone.
    pub samples: u32,
    /// How far the depths were rounded before they came into the texture.
    ///
    /// What the texture's own format rounds is added ([`DepthTolerance::of`]).
    pub tolerance: DepthTolerance,
    /// How much nearer than the depths the surfaces may be, beside the tolerance.
    ///
    /// It is for depths that a conversion has moved towards far; the nearest end counts it.
    pub near_slack: NearSlack,
    /// The nearest of each pixel's samples, where `texture` has the farthest of several.
    ///
    /// Both are as [`record_resolve`](crate::HizContext::record_resolve) makes them, for pyramids
    /// that have the nearest depths, too.
    pub nearest: Option<&'a wgpu::Texture>,
    /// Levels that the host has made when it drew the image in `texture`.
    ///
    /// A reduction of farthest depths copies them instead of making them; the bits are the same.
    /// A `&`[`OccluderDepth`](crate::OccluderDepth) as the source has them.
    pub levels: Option<&'a HostLevels>,
}

impl<'a> From<&'a wgpu::Texture> for DepthSource<'a> {
    fn from(texture: &'a wgpu::Texture) -> Self {
        Self {
            texture,
            aspect: wgpu::TextureAspect::All,
            mip_level: None,
            array_layer: None,
            origin: [0, 0],
            size: None,
            samples: 1,
            tolerance: DepthTolerance::NONE,
            near_slack: NearSlack::NONE,
            nearest: None,
            levels: None,
        }
    }
}

impl<'a> From<&'a wgpu::TextureView> for DepthSource<'a> {
    fn from(view: &'a wgpu::TextureView) -> Self {
        view.texture().into()
    }
}

/// One layer of one mip level of a texture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Subresource {
    pub(crate) texture: wgpu::Texture,
    pub(crate) mip_level: u32,
    pub(crate) array_layer: u32,
}

impl Subresource {
    /// Its size in texels.
    pub(crate) fn texels(&self) -> ImageSize {
        let level = |side: u32| (side >> self.mip_level).max(1);
        ImageSize::new(level(self.texture.width()), level(self.texture.height()))
    }

    /// Its first texel, for copies.
    pub(crate) fn as_image_copy(&self) -> wgpu::TexelCopyTextureInfo<'_> {
        wgpu::TexelCopyTextureInfo {
            mip_level: self.mip_level,
            origin: wgpu::Origin3d { x: 0, y: 0, z: self.array_layer },
            ..self.texture.as_image_copy()
        }
    }

    /// A view of its depth.
    ///
    /// # Errors
    /// [`Error::Device`] for a texture of another device, and for a destroyed one.
    pub(crate) fn view(&self, gpu: &Gpu) -> Result<wgpu::TextureView> {
        // A view of another device's texture would report its errors to that device, whose handler
        // may end the process.
        gpu.check_owned(&self.texture)?;
        gpu.view_of(&self.texture, self.mip_level, self.array_layer)
    }
}

/// A [`DepthSource`] that was checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Part {
    pub(crate) subresource: Subresource,
    pub(crate) origin: [u32; 2],
    /// How shaders read it.
    pub(crate) kind: SourceKind,
    pub(crate) samples: u32,
    /// What the format and the caller have rounded.
    pub(crate) tolerance: DepthTolerance,
    /// What was moved towards far before that.
    pub(crate) near_slack: NearSlack,
    /// The image of nearest samples, if it is read beside the other.
    pub(crate) nearest: Option<wgpu::Texture>,
}

/// How many samples a texture must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sampling {
    Single,
    Multiple,
}

impl Part {
    /// Checks that `source` is an image of `size`, that of `of`, for a pyramid of `depths`.
    ///
    /// # Errors
    /// [`Error::Invalid`] and [`Error::Mismatch`], as
    /// [`HizContext::record_reduce`](crate::HizContext::record_reduce) has them.
    pub(crate) fn new(
        source: &DepthSource<'_>,
        sampling: Sampling,
        (size, of): (ImageSize, &str),
        depths: Depths,
    ) -> Result<Self> {
        let (texture, nearest) = images(source, depths)?;
        let source = &DepthSource { texture, ..*source };
        let (whole, of_format) = read_as(texture.format(), sampling)?;
        check_samples(source, sampling)?;
        if source.aspect == wgpu::TextureAspect::StencilOnly {
            return refused("expected the aspect All or DepthOnly, got StencilOnly".to_owned());
        }
        let subresource = subresource(source)?;
        let (kind, origin) = (part_kind(source, &subresource, whole, size, of)?, source.origin);
        let needed = kind.usage();
        if !texture.usage().contains(needed) {
            let name = if kind == SourceKind::Bits { "STORAGE_BINDING" } else { "TEXTURE_BINDING" };
            return refused(format!("expected the usage {name}, got {:?}", texture.usage()));
        }
        let samples = source.samples * texture.sample_count();
        let tolerance = of_format.after(source.tolerance.checked()?);
        let near_slack = source.near_slack.checked()?;
        let nearest = nearest.cloned();
        let kind = if nearest.is_some() { SourceKind::Pair } else { kind };
        Ok(Self { subresource, origin, kind, samples, tolerance, near_slack, nearest })
    }
}

fn refused<T>(message: String) -> Result<T> {
    Err(Error::invalid("depth", message))
}

/// The image that a pyramid of `depths` reads, and beside it that of the nearest samples.
///
/// # Errors
/// [`Error::Invalid`] where a pixel has several samples and the images lack an end.
fn images<'a>(
    source: &DepthSource<'a>,
    depths: Depths,
) -> Result<(&'a wgpu::Texture, Option<&'a wgpu::Texture>)> {
    let has_nearest_alone = source.nearest == Some(source.texture);
    let lacks = |has: &str, way: &str| {
        Err(Error::invalid("depths", format!("expected {has}, got Depths::{depths:?}; {way}")))
    };
    match source.nearest {
        _ if depths.has_farthest() && has_nearest_alone => lacks(
            "Depths::Nearest for an image of the nearest samples alone",
            "resolve with ResolvedDepths::Farthest or Both",
        ),
        None if depths.has_nearest() && source.samples > 1 => lacks(
            &format!(
                "Depths::Farthest for an image of the farthest of {} samples per pixel",
                source.samples
            ),
            "resolve with ResolvedDepths::Both",
        ),
        Some(nearest) if depths.has_nearest() => {
            check_nearest(source.texture, nearest)?;
            let is_pair = depths.has_farthest();
            Ok(if is_pair { (source.texture, Some(nearest)) } else { (nearest, None) })
        }
        _ => Ok((source.texture, None)),
    }
}

/// Checks that the image of nearest samples is like that of the farthest.
fn check_nearest(farthest: &wgpu::Texture, nearest: &wgpu::Texture) -> Result<()> {
    let of = |texture: &wgpu::Texture| (texture.format(), texture.size());
    let expected = (wgpu::TextureFormat::Rgba32Uint, farthest.size());
    if of(farthest) != expected || of(nearest) != expected {
        return Err(Error::invalid(
            "nearest",
            format!(
                "expected two textures of one size and of the format Rgba32Uint, got {:?} and {:?}",
                of(farthest),
                of(nearest)
            ),
        ));
    }
    if nearest.mip_level_count() > 1 || !nearest.usage().contains(SourceKind::Pair.usage()) {
        return Err(Error::invalid(
            "nearest",
            format!(
                "expected one mip level and the usage STORAGE_BINDING, got {} and {:?}",
                nearest.mip_level_count(),
                nearest.usage()
            ),
        ));
    }
    Ok(())
}

/// How a format is read, and what it rounds.
fn read_as(
    format: wgpu::TextureFormat,
    sampling: Sampling,
) -> Result<(SourceKind, DepthTolerance)> {
    let found = SourceKind::of(format).zip(DepthTolerance::of(format));
    match (found, sampling) {
        (Some(found), Sampling::Single) => Ok(found),
        (Some(found @ (SourceKind::Depth | SourceKind::Float, _)), Sampling::Multiple) => Ok(found),
        (_, Sampling::Single) => refused(format!(
            "expected a depth format, R32Float, R16Float or Rgba32Uint (the bits of four pixels), \
             got {format:?}"
        )),
        (_, Sampling::Multiple) => {
            refused(format!("expected a depth format, R32Float or R16Float, got {format:?}"))
        }
    }
}

fn check_samples(source: &DepthSource<'_>, sampling: Sampling) -> Result<()> {
    let texture = source.texture;
    if texture.dimension() != wgpu::TextureDimension::D2 {
        return refused(format!("expected a 2D texture, got {:?}", texture.dimension()));
    }
    if source.samples == 0 {
        return refused("expected at least one sample per pixel, got samples 0".to_owned());
    }
    match (sampling, texture.sample_count()) {
        (Sampling::Single, 1) | (Sampling::Multiple, 2..) => Ok(()),
        (Sampling::Single, several) => refused(format!(
            "expected one sample per pixel, got {several}; record_resolve takes the farthest of \
             them"
        )),
        (Sampling::Multiple, one) => refused(format!(
            "expected several samples per pixel, got {one}; record_reduce takes such an image as \
             it is"
        )),
    }
}

/// The layer and the mip level that `source` names.
fn subresource(source: &DepthSource<'_>) -> Result<Subresource> {
    let texture = source.texture;
    let chosen = |what: &str, field: &str, asked: Option<u32>, count: u32| match asked {
        None if count > 1 => refused(format!(
            "expected which of {count} {what}s, got none: a texture or a view does not say it; set \
             DepthSource::{field}"
        )),
        Some(k) if k >= count => refused(format!("expected a {what} below {count}, got {k}")),
        asked => Ok(asked.unwrap_or(0)),
    };
    let (levels, layers) = (texture.mip_level_count(), texture.depth_or_array_layers());
    Ok(Subresource {
        texture: texture.clone(),
        mip_level: chosen("mip level", "mip_level", source.mip_level, levels)?,
        array_layer: chosen("layer", "array_layer", source.array_layer, layers)?,
    })
}

/// How the image is read: all of its level, or a rectangle.
fn part_kind(
    source: &DepthSource<'_>,
    subresource: &Subresource,
    whole: SourceKind,
    size: ImageSize,
    of: &str,
) -> Result<SourceKind> {
    let (texels, [x, y]) = (subresource.texels(), source.origin);
    let expected = whole.texture_size(size);
    if let Some(asked) = source.size.filter(|asked| *asked != size) {
        let message = format!("expected the {of}'s size {size}, got DepthSource::size {asked}");
        return Err(Error::mismatch("depth", message));
    }
    if whole == SourceKind::Bits && (x, y) != (0, 0) {
        return refused(format!(
            "expected the origin (0, 0) for Rgba32Uint, whose texels hold four pixels, got \
             ({x}, {y}); copy the part to a texture of its own"
        ));
    }
    let left = ImageSize::new(texels.width.saturating_sub(x), texels.height.saturating_sub(y));
    let fits = left.width >= expected.width && left.height >= expected.height;
    let is_exact = source.size.is_some() && whole != SourceKind::Bits;
    if left != expected && !(is_exact && fits) {
        let packed = if expected == size {
            String::new()
        } else {
            format!(" as {expected} texels of four pixels")
        };
        let from = if (x, y) == (0, 0) {
            String::new()
        } else {
            format!(" from ({x}, {y}) on, of a level of {texels}")
        };
        // A larger texture without a size: which part is meant?
        let way = if fits && whole != SourceKind::Bits {
            "; set DepthSource::size for a part of a larger texture"
        } else {
            ""
        };
        return Err(Error::mismatch(
            "depth",
            format!("expected the {of}'s size {size}{packed}, got {left}{from}{way}"),
        ));
    }
    if left == texels && left == expected {
        return Ok(whole);
    }
    Ok(whole.part().unwrap_or(whole))
}
