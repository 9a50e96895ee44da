//! Multisampled depth: the farthest of each pixel's samples, the nearest, or both.
//!
//! `shaders/pyramid/resolve.wgsl` writes rows into a buffer.
//! They are copied into a texture of four pixels per texel (`Rgba32Uint`), as uploads have it.
//! Images that are larger than the buffer go through it in bands of rows.

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::Copy;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::tolerance::DepthTolerance;
use crate::pyramid::ends::Depths;
use crate::pyramid::layout::PIXELS;
use crate::pyramid::source::{DepthSource, Part, Sampling};
use crate::pyramid::sources::{Binds, Sources};

/// Invocations of a workgroup; twin: `shaders/pyramid/resolve.wgsl`, `WORKGROUP`.
pub(crate) const WORKGROUP: u32 = 64;

/// Bytes of the buffer at most; larger images go through it in bands.
const BAND_BYTES: u64 = 1 << 26;

/// Which depths of a pixel's samples are kept.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum ResolvedDepths {
    /// The farthest, for a pyramid to cull by.
    #[default]
    Farthest,
    /// The nearest.
    Nearest,
    /// Both, by one pass over the samples.
    Both,
}

impl ResolvedDepths {
    fn farthest(self) -> bool {
        self != Self::Nearest
    }

    fn nearest(self) -> bool {
        self != Self::Farthest
    }
}

/// What a [`DepthResolve`] makes.
#[derive(Debug, Clone, Copy, Default)]
pub struct ResolveOptions {
    /// Which depths are kept.
    pub depths: ResolvedDepths,
}

/// Twin of `ResolvedImage` in `shaders/pyramid/resolve.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct ResolvedUniform {
    pub(crate) origin: [u32; 2],
    pub(crate) size: [u32; 2],
}

const _: () = assert!(size_of::<ResolvedUniform>() == 16);

/// Twin of `Band` in `shaders/pyramid/resolve.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct BandUniform {
    pub(crate) first: u32,
    pub(crate) rows: u32,
    pub(crate) stride: u32,
    pub(crate) nearest: u32,
}

const _: () = assert!(size_of::<BandUniform>() == 16);

/// Some rows of the image, and what a dispatch of them binds.
#[derive(Debug)]
struct Band {
    numbers: BandUniform,
    bindings: wgpu::BindGroup,
}

/// What multisampled depth is resolved into; made by
/// [`HizContext::create_depth_resolve`](crate::HizContext::create_depth_resolve).
///
/// # Examples
/// A frame with four samples per pixel:
///
/// ```
/// # use hiz_core::headless::Engine;
/// use hiz_core::{ImageSize, PyramidOptions, ResolveOptions, wgpu};
/// # use hiz_core::{Camera, DepthConvention, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let (device, hiz) = (engine.device(), engine.context());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let convention = DepthConvention::Reversed;
/// # let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 48))?;
/// # let depth = device.create_texture(&wgpu::TextureDescriptor {
/// #     label: None,
/// #     size: wgpu::Extent3d { width: 64, height: 48, depth_or_array_layers: 1 },
/// #     mip_level_count: 1,
/// #     sample_count: 4,
/// #     dimension: wgpu::TextureDimension::D2,
/// #     format: wgpu::TextureFormat::Depth32Float,
/// #     usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
/// #     view_formats: &[],
/// # });
/// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
///
/// // Once:
/// let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
/// let resolve = hiz.create_depth_resolve(camera.size(), &ResolveOptions::default())?;
///
/// // Each frame, after `depth` was drawn with sample_count: 4:
/// hiz.record_resolve(&mut encoder, &depth, &camera, &resolve)?;
/// hiz.record_reduce(&mut encoder, resolve.farthest()?, &camera, &pyramid)?;
/// # engine.queue().submit([encoder.finish()]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct DepthResolve {
    context: ContextId,
    size: ImageSize,
    depths: ResolvedDepths,
    rows: wgpu::Buffer,
    image: wgpu::Buffer,
    bands: Vec<Band>,
    farthest: Option<wgpu::Texture>,
    nearest: Option<wgpu::Texture>,
    sources: Sources,
    /// Samples and tolerance of what was resolved last.
    resolved: Locked<Option<(u32, DepthTolerance)>>,
}

impl DepthResolve {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, options: &ResolveOptions) -> Result<Self> {
        let (side, allowed) = (size.width.max(size.height), gpu.limits().max_texture_dimension_2d);
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", side.into(), allowed.into()));
        }
        if size.pixels() == 0 {
            return Err(Error::invalid(
                "size",
                format!("expected at least one pixel a side, got {size}"),
            ));
        }
        let depths = options.depths;
        let texels = SourceKind::Bits.texture_size(size);
        let texture = |label| {
            let usage = SourceKind::Bits.usage()
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::COPY_SRC;
            gpu.texture(label, (texels.width, size.height), wgpu::TextureFormat::Rgba32Uint, usage)
        };
        let farthest = depths.farthest().then(|| texture("hiz.resolve.farthest")).transpose()?;
        let nearest = depths.nearest().then(|| texture("hiz.resolve.nearest")).transpose()?;
        let limits = gpu.limits();
        let most =
            BAND_BYTES.min(limits.max_storage_buffer_binding_size).min(limits.max_buffer_size);
        let bands = bands(size, depths, most);
        let of_one = bands[0].rows * bands[0].stride;
        let ends = u64::from(depths.farthest()) + u64::from(depths.nearest());
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
        let rows = gpu.empty("hiz.resolve.rows", VECTOR_BYTES * u64::from(of_one) * ends, usage)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let image = gpu.empty("hiz.resolve.image", size_of::<ResolvedUniform>() as u64, usage)?;
        let layout = gpu.layout("hiz.resolve.band_layout", BAND_BINDINGS)?;
        let bind = |numbers: BandUniform| {
            let uniform = gpu.uniform("hiz.resolve.band", &numbers)?;
            let bound = entry(0, uniform.as_entire_binding());
            Ok(Band { numbers, bindings: gpu.bind_group("hiz.resolve.band", &layout, &[bound])? })
        };
        Ok(Self {
            context: gpu.id(),
            size,
            depths,
            rows,
            image,
            bands: bands.into_iter().map(bind).collect::<Result<_>>()?,
            farthest,
            nearest,
            sources: Sources::new(),
            resolved: Locked::default(),
        })
    }

    /// The image's size in pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// The texture of [`DepthResolve::farthest`], before anything was resolved into it.
    pub(crate) fn unresolved(&self) -> Option<DepthSource<'_>> {
        self.farthest.as_ref().map(DepthSource::from)
    }

    /// The farthest depth of each pixel's samples, as
    /// [`record_reduce`](crate::HizContext::record_reduce) takes it.
    ///
    /// A pyramid of it holds for everything that is drawn with these samples.
    /// Culls by it take [`Coverage::Area`](crate::Coverage::Area), the default.
    ///
    /// # Errors
    /// [`Error::Mismatch`] before the first
    /// [`record_resolve`](crate::HizContext::record_resolve), and where
    /// [`ResolvedDepths::Nearest`] alone was asked for.
    pub fn farthest(&self) -> Result<DepthSource<'_>> {
        let (samples, tolerance) = self.resolved()?;
        let texture = made(self.farthest.as_ref(), "Farthest or Both", self.depths)?;
        let nearest = self.nearest.as_ref();
        Ok(DepthSource { samples, tolerance, nearest, ..DepthSource::from(texture) })
    }

    /// All that was made, as [`record_reduce`](crate::HizContext::record_reduce) takes it for a
    /// pyramid of any [`Depths`].
    ///
    /// | resolved | pyramids of |
    /// |---|---|
    /// | [`ResolvedDepths::Farthest`] | [`Depths::Farthest`] |
    /// | [`ResolvedDepths::Nearest`] | [`Depths::Nearest`] |
    /// | [`ResolvedDepths::Both`] | any |
    ///
    /// # Errors
    /// [`Error::Mismatch`] before the first
    /// [`record_resolve`](crate::HizContext::record_resolve).
    pub fn source(&self) -> Result<DepthSource<'_>> {
        let (samples, tolerance) = self.resolved()?;
        let nearest = self.nearest.as_ref();
        let texture = self.farthest.as_ref().or(nearest);
        let texture = made(texture, "Farthest, Nearest or Both", self.depths)?;
        Ok(DepthSource { samples, tolerance, nearest, ..DepthSource::from(texture) })
    }

    /// The nearest depth of each pixel's samples: a texture of the format `Rgba32Uint`, with the
    /// float32 bits of four pixels of a row per texel.
    ///
    /// Samples without a depth (NaN, outside of 0..=1) count as near.
    /// A pyramid to cull by is made of the farthest depths, never of these.
    ///
    /// # Errors
    /// [`Error::Mismatch`] before the first
    /// [`record_resolve`](crate::HizContext::record_resolve), and where
    /// [`ResolvedDepths::Farthest`] alone was asked for.
    pub fn nearest(&self) -> Result<&wgpu::Texture> {
        self.resolved()?;
        made(self.nearest.as_ref(), "Nearest or Both", self.depths)
    }

    fn resolved(&self) -> Result<(u32, DepthTolerance)> {
        self.resolved.lock().ok_or_else(|| {
            Error::mismatch(
                "resolve",
                "expected one that depth was resolved into, got one that never was; record_resolve \
                 does it",
            )
        })
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        let texture = |texture: &wgpu::Texture| {
            VECTOR_BYTES * u64::from(texture.width()) * u64::from(texture.height())
        };
        let textures = self.farthest.iter().chain(&self.nearest).map(texture).sum::<u64>();
        self.rows.size() + textures
    }
}

/// Bytes of four depths.
const VECTOR_BYTES: u64 = 16;

fn made<'a>(
    texture: Option<&'a wgpu::Texture>,
    expected: &str,
    depths: ResolvedDepths,
) -> Result<&'a wgpu::Texture> {
    texture.ok_or_else(|| {
        let message = format!("expected ResolveOptions::depths {expected}, got {depths:?}");
        Error::mismatch("resolve", message)
    })
}

/// The bands of an image, each of at most `most` bytes or of one row.
fn bands(size: ImageSize, depths: ResolvedDepths, most: u64) -> Vec<BandUniform> {
    // Rows of a copy into a texture begin at multiples of 256 bytes.
    let row_bytes = VECTOR_BYTES * u64::from(size.width.div_ceil(PIXELS));
    let row_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT.into());
    let ends = u64::from(depths.farthest()) + u64::from(depths.nearest());
    let rows = (most / (row_bytes * ends)).clamp(1, u64::from(size.height)) as u32;
    let stride = (row_bytes / VECTOR_BYTES) as u32;
    let nearest = if depths.farthest() { rows * stride } else { 0 };
    (0..size.height)
        .step_by(rows as usize)
        .map(|first| BandUniform { first, rows: rows.min(size.height - first), stride, nearest })
        .collect()
}

/// The bindings of the samples and of what is made of them.
const fn bindings(kind: SourceKind) -> [(u32, Binding); 3] {
    [(0, Binding::Samples(kind)), (1, Binding::Write), (2, Binding::Uniform)]
}

/// The binding of a band.
const BAND_BINDINGS: &[(u32, Binding)] = &[(0, Binding::Uniform)];

/// The shader module of the resolve; `kind` is [`SourceKind::Depth`] or [`SourceKind::Float`].
pub(crate) fn resolve_module(kind: SourceKind) -> Source {
    let samples = if kind == SourceKind::Float {
        wgsl!("gpu/samples_float")
    } else {
        wgsl!("gpu/samples_depth")
    };
    Source::of(&[&[wgsl!("gpu/depth_bits"), samples, wgsl!("pyramid/resolve")]])
}

fn pipeline(
    gpu: &Gpu,
    kind: SourceKind,
    (reversed, samples, depths): (bool, u32, ResolvedDepths),
) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.resolve.pipeline",
        source: resolve_module(kind),
        entry_point: "resolve",
        layouts: &[
            gpu.layout("hiz.resolve.layout", &bindings(kind))?,
            gpu.layout("hiz.resolve.band_layout", BAND_BINDINGS)?,
        ],
        constants: &[
            ("REVERSED", flag(reversed)),
            ("SAMPLES", f64::from(samples)),
            ("FARTHEST", flag(depths.farthest())),
            ("NEAREST", flag(depths.nearest())),
        ],
    })
}

/// Records the resolve of `depth` into `resolve`.
///
/// # Errors
/// As [`HizContext::record_resolve`](crate::HizContext::record_resolve).
pub(crate) fn record_resolve(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    camera: &Camera,
    resolve: &DepthResolve,
) -> Result<()> {
    // Everything that can fail comes before the first command is recorded.
    let (part, pipeline, samples) = prepare(gpu, depth, camera, resolve)?;
    let ImageSize { width, height } = resolve.size;
    let image = ResolvedUniform { origin: part.origin, size: [width, height] };
    let numbers = gpu.numbers(bytemuck::bytes_of(&image))?;
    gpu.recorded(|| {
        let len = numbers.len();
        numbers.record(encoder, &[Copy { from: 0, target: &resolve.image, to: 0, size: len }]);
        for band in &resolve.bands {
            record_band(encoder, (&pipeline, &samples), band, resolve);
        }
        Ok(())
    })?;
    *resolve.resolved.lock() = Some((part.samples, part.tolerance));
    Ok(())
}

/// Records a resolve of nothing, for a driver that compiles at the first dispatch.
pub(crate) fn record_idle_resolve(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    camera: &Camera,
    resolve: &DepthResolve,
) -> Result<()> {
    let (_, pipeline, samples) = prepare(gpu, depth, camera, resolve)?;
    gpu.recorded(|| {
        let mut pass = stage_pass(encoder, "hiz.resolve.pass", "resolve");
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &samples, &[]);
        if let Some(band) = resolve.bands.first() {
            pass.set_bind_group(1, &band.bindings, &[]);
            pass.dispatch_workgroups(0, 0, 1);
        }
        Ok(())
    })
}

/// Checks the arguments of a resolve, and makes what it needs.
fn prepare(
    gpu: &Gpu,
    depth: &DepthSource<'_>,
    camera: &Camera,
    resolve: &DepthResolve,
) -> Result<(Part, wgpu::ComputePipeline, wgpu::BindGroup)> {
    gpu.check_context("resolve", resolve.context)?;
    let (size, depths) = (resolve.size, resolve.depths);
    let part = Part::new(depth, Sampling::Multiple, (size, "resolve"), Depths::Farthest)?;
    if size != camera.size() {
        return Err(Error::mismatch(
            "camera",
            format!("expected the depth image's size {size}, got {}", camera.size()),
        ));
    }
    let kind = part.kind.whole();
    let count = part.subresource.texture.sample_count();
    let reversed = camera.convention().is_reversed();
    let pipeline = pipeline(gpu, kind, (reversed, count, depths))?;
    let samples = bind_samples(gpu, &part, kind, resolve)?;
    Ok((part, pipeline, samples))
}

/// The bind group of the samples.
fn bind_samples(
    gpu: &Gpu,
    part: &Part,
    kind: SourceKind,
    resolve: &DepthResolve,
) -> Result<wgpu::BindGroup> {
    let binds = Binds {
        label: "hiz.resolve.samples",
        layout: "hiz.resolve.layout",
        bindings: &bindings(kind),
        rest: &[
            entry(1, resolve.rows.as_entire_binding()),
            entry(2, resolve.image.as_entire_binding()),
        ],
    };
    resolve.sources.bind(gpu, part, kind, &binds)
}

/// Records the pass that resolves some rows, and the copies into the textures.
fn record_band(
    encoder: &mut wgpu::CommandEncoder,
    (pipeline, samples): (&wgpu::ComputePipeline, &wgpu::BindGroup),
    band: &Band,
    resolve: &DepthResolve,
) {
    let BandUniform { first, rows, stride, nearest } = band.numbers;
    let vectors = resolve.size.width.div_ceil(PIXELS);
    let mut pass = stage_pass(encoder, "hiz.resolve.pass", "resolve");
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, samples, &[]);
    pass.set_bind_group(1, &band.bindings, &[]);
    pass.dispatch_workgroups(vectors.div_ceil(WORKGROUP), rows, 1);
    drop(pass);
    for (texture, from) in [(&resolve.farthest, 0), (&resolve.nearest, nearest)] {
        let Some(texture) = texture else { continue };
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &resolve.rows,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: VECTOR_BYTES * u64::from(from),
                    bytes_per_row: Some(VECTOR_BYTES as u32 * stride),
                    rows_per_image: None,
                },
            },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: first, z: 0 },
                ..texture.as_image_copy()
            },
            wgpu::Extent3d { width: vectors, height: rows, depth_or_array_layers: 1 },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 5 columns are two vectors, and a row takes 256 bytes: 16 vectors.
    #[test]
    fn bands_fit_the_buffer_and_cover_all_rows() {
        let band = |first, rows, nearest| BandUniform { first, rows, stride: 16, nearest };
        let of = |depths, most| {
            let found = bands(ImageSize::new(5, 7), depths, most);
            found.iter().map(|b| (b.first, b.rows, b.stride, b.nearest)).collect::<Vec<_>>()
        };
        let expected = |bands: &[BandUniform]| {
            bands.iter().map(|b| (b.first, b.rows, b.stride, b.nearest)).collect::<Vec<_>>()
        };
        assert_eq!(of(ResolvedDepths::Farthest, 1 << 20), expected(&[band(0, 7, 112)]));
        assert_eq!(
            of(ResolvedDepths::Both, 3 * 512),
            expected(&[band(0, 3, 48), band(3, 3, 48), band(6, 1, 48)])
        );
        assert_eq!(of(ResolvedDepths::Nearest, 1).len(), 7);
    }
}
