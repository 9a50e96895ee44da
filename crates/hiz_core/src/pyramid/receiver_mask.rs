//! The receiver mask of a light: what a camera sees, as the light sees it.
//!
//! `shaders/pyramid/receiver_mask.wgsl` scatters each pixel of the camera's depth image into the
//! light's image, where each texel keeps its farthest receiver.
//! The result is a depth image of the light, for a pyramid and an ordinary cull.

use std::array::from_fn;

use crate::error::{Error, Result};
use crate::gpu::buffers::entry;
use crate::gpu::depth_source::SourceKind;
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::layouts::Binding;
use crate::gpu::numbers::Copy;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::gpu::stage_times::stage_pass;
use crate::host::linear::{Mat4, dot};
use crate::host::rounding::{EPS, ROUNDING, flushed, round_up};
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::tolerance::DepthTolerance;
use crate::pyramid::ends::Depths;
use crate::pyramid::layout::PIXELS;
use crate::pyramid::source::{DepthSource, Part, Sampling};
use crate::pyramid::sources::{Binds, Sources};

/// Invocations along a side of a workgroup; twin: `SIDE` in the shader.
pub(crate) const MASK_SIDE: u32 = 8;

/// Texels along a side of a block, as a power of two; twin: `MASK_BLOCK_LOG2` in the shader.
pub(crate) const MASK_BLOCK_LOG2: u32 = 4;

/// A larger filter, in world units, would not fit float32.
const LARGEST: f64 = 1_152_921_504_606_846_976.0; // 2^60

/// What the inverse of the camera's matrix may be off by, relative to rows of length 1.
const LARGEST_RESIDUAL: f64 = 1.0 / 1024.0;

/// What the growth may lose in the shader, in EPS of it.
const GROWTH_ULPS: f64 = 32.0;

/// How a receiver mask is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReceiverMaskOptions {
    /// How far from a point the lookup of its shadow reaches, in world units, at least 0.
    /// That is the radius of the filter's kernel, the diagonal of a texel of the shadow map, and the
    /// bias, added.
    pub filter_radius: f64,
    /// How far from its pixel's centre a receiver may lie along each axis, in pixels: a multiple of
    /// 1/256 in 0..=16.
    /// 0.5 covers the whole pixel, at the pixel's depth; 1/64 a renderer's own sample.
    pub reach_px: f64,
    /// Relative slack of the camera's depth, 0..=0.5.
    /// What the format rounds is added.
    pub depth_slack: f64,
    /// Absolute slack of the camera's depth in units of NDC depth, 0..=0.5.
    pub depth_slack_abs: f64,
}

impl Default for ReceiverMaskOptions {
    fn default() -> Self {
        Self { filter_radius: 0.0, reach_px: 0.5, depth_slack: 4.0 * EPS, depth_slack_abs: 0.0 }
    }
}

/// Twin of `ReceiverMask` in `shaders/pyramid/receiver_mask.wgsl`, which documents the fields.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct MaskUniform {
    pub(crate) rows: [[f32; 4]; 5],
    pub(crate) sizes: [[f32; 4]; 5],
    pub(crate) growth: [f32; 4],
    pub(crate) camera_half_size: [f32; 2],
    pub(crate) reach: f32,
    pub(crate) slack: f32,
    pub(crate) camera_size: [u32; 2],
    pub(crate) light_size: [u32; 2],
    pub(crate) origin: [u32; 2],
    pub(crate) slack_abs: f32,
    pub(crate) stride: u32,
    pub(crate) blocks: u32,
    pub(crate) light_is_reversed: u32,
    pub(crate) padding: [u32; 2],
}

/// A depth image of a light that holds the farthest receivers which a camera sees; made by
/// [`HizContext::create_receiver_mask`](crate::HizContext::create_receiver_mask).
#[derive(Debug)]
pub struct ReceiverMask {
    context: ContextId,
    size: ImageSize,
    keys: wgpu::Buffer,
    uniform: wgpu::Buffer,
    bindings: wgpu::BindGroup,
    image: wgpu::Texture,
    /// By the camera's depth image and how it is read.
    sources: Sources,
}

/// Words from a row of the image to the next: rows of a copy begin at multiples of 256 bytes.
fn stride(size: ImageSize) -> u32 {
    size.width.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}

fn blocks(side: u32) -> u32 {
    side.div_ceil(1 << MASK_BLOCK_LOG2)
}

/// What scatters and finishes; the depth image has a group of its own.
const BINDINGS: &[(u32, Binding)] = &[(0, Binding::Write), (1, Binding::Uniform)];

const fn source_bindings(kind: SourceKind) -> [(u32, Binding); 2] {
    [(0, Binding::Depth(kind)), (1, Binding::Sampler)]
}

impl ReceiverMask {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize) -> Result<Self> {
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
        let texels = u64::from(stride(size)) * u64::from(size.height);
        let of_blocks = u64::from(blocks(size.width)) * u64::from(blocks(size.height));
        let bytes = 4 * (texels + of_blocks + 1);
        let most = gpu.limits().max_storage_buffer_binding_size;
        if bytes > most {
            return Err(Error::limit("max_storage_buffer_binding_size", bytes, most));
        }
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let keys = gpu.empty("hiz.receiver_mask.keys", bytes, usage)?;
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform =
            gpu.empty("hiz.receiver_mask.uniform", size_of::<MaskUniform>() as u64, usage)?;
        let bindings = gpu.bind_group(
            "hiz.receiver_mask.keys",
            &gpu.layout("hiz.receiver_mask.layout", BINDINGS)?,
            &[entry(0, keys.as_entire_binding()), entry(1, uniform.as_entire_binding())],
        )?;
        let usage = SourceKind::Bits.usage()
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC;
        let texels = SourceKind::Bits.texture_size(size);
        let image = gpu.texture(
            "hiz.receiver_mask.image",
            (texels.width, texels.height),
            wgpu::TextureFormat::Rgba32Uint,
            usage,
        )?;
        let sources = Sources::new();
        Ok(Self { context: gpu.id(), size, keys, uniform, bindings, image, sources })
    }

    /// The size of the light's image in pixels.
    pub fn size(&self) -> ImageSize {
        self.size
    }

    /// The image, for a reduction with the light's camera.
    pub fn image(&self) -> DepthSource<'_> {
        DepthSource::from(&self.image)
    }

    /// The texture: float32 bits of four pixels of a row per texel.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.image
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.keys.size() + 16 * u64::from(self.image.width()) * u64::from(self.image.height())
    }
}

/// The shader module; `kind` is how the camera's depth image is read.
pub(crate) fn receiver_mask_module(kind: SourceKind) -> Source {
    Source::of(&[
        &[wgsl!("gpu/depth_bits")],
        kind.files(),
        &[wgsl!("gpu/ends_one"), wgsl!("pyramid/receiver_mask")],
    ])
}

fn pipeline(
    gpu: &Gpu,
    kind: SourceKind,
    entry_point: &'static str,
    reversed: bool,
) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.receiver_mask.pipeline",
        source: receiver_mask_module(kind),
        entry_point,
        layouts: &[
            gpu.layout("hiz.receiver_mask.source_layout", &source_bindings(kind))?,
            gpu.layout("hiz.receiver_mask.layout", BINDINGS)?,
        ],
        constants: &[("REVERSED", flag(reversed))],
    })
}

/// The bind group of the depth image.
fn bind_source(gpu: &Gpu, part: &Part, mask: &ReceiverMask) -> Result<wgpu::BindGroup> {
    let binds = Binds {
        label: "hiz.receiver_mask.source",
        layout: "hiz.receiver_mask.source_layout",
        bindings: &source_bindings(part.kind),
        rest: &[entry(1, wgpu::BindingResource::Sampler(gpu.sampler()))],
    };
    mask.sources.bind(gpu, part, part.kind, &binds)
}

/// Records the scatter of `depth` into `mask`, and the copy into its image.
///
/// # Errors
/// As [`HizContext::record_receiver_mask`](crate::HizContext::record_receiver_mask).
pub(crate) fn record_receiver_mask(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    depth: &DepthSource<'_>,
    [camera, light]: [&Camera; 2],
    mask: &ReceiverMask,
    options: &ReceiverMaskOptions,
) -> Result<()> {
    gpu.check_context("mask", mask.context)?;
    if light.size() != mask.size {
        return Err(Error::mismatch(
            "light_camera",
            format!("expected the mask's size {}, got {}", mask.size, light.size()),
        ));
    }
    let part = Part::new(depth, Sampling::Single, (camera.size(), "camera"), Depths::Farthest)?;
    if part.samples > 1 {
        return Err(Error::invalid(
            "depth",
            format!(
                "expected one sample per pixel, got the farthest of {}: the others receive shadows, \
                 too",
                part.samples
            ),
        ));
    }
    let numbers = mask_uniform([camera, light], &part, options)?;
    let source = bind_source(gpu, &part, mask)?;
    let reversed = camera.convention().is_reversed();
    let scatter = pipeline(gpu, part.kind, "scatter_receivers", reversed)?;
    let finish = pipeline(gpu, part.kind, "finish_receivers", reversed)?;
    let staged = gpu.numbers(bytemuck::bytes_of(&numbers))?;
    gpu.recorded(|| {
        let size = staged.len();
        staged.record(encoder, &[Copy { from: 0, target: &mask.uniform, to: 0, size }]);
        encoder.clear_buffer(&mask.keys, 0, None);
        for (pipeline, size) in
            [(&scatter, camera.size()), (&finish, ImageSize::new(numbers.stride, mask.size.height))]
        {
            let mut pass = stage_pass(encoder, "hiz.receiver_mask.pass", "receiver mask");
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &source, &[]);
            pass.set_bind_group(1, &mask.bindings, &[]);
            let [x, y] = [size.width, size.height].map(|side| side.div_ceil(MASK_SIDE));
            pass.dispatch_workgroups(x, y, 1);
        }
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &mask.keys,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * numbers.stride),
                    rows_per_image: None,
                },
            },
            mask.image.as_image_copy(),
            wgpu::Extent3d {
                width: mask.size.width.div_ceil(PIXELS),
                height: mask.size.height,
                depth_or_array_layers: 1,
            },
        );
        Ok(())
    })
}

fn mask_uniform(
    [camera, light]: [&Camera; 2],
    part: &Part,
    options: &ReceiverMaskOptions,
) -> Result<MaskUniform> {
    let range = |name: &str, value: f64, most: f64| {
        if (0.0..=most).contains(&value) {
            Ok(value)
        } else {
            Err(Error::invalid(name, format!("expected a number in 0..={most}, got {value}")))
        }
    };
    let radius = range("filter_radius", options.filter_radius, LARGEST)?;
    let reach = range("reach_px", options.reach_px, 16.0)?;
    if (reach * 256.0).fract() != 0.0 {
        return Err(Error::invalid(
            "reach_px",
            format!("expected a multiple of 1/256, got {reach}"),
        ));
    }
    let of_caller = DepthTolerance {
        relative: range("depth_slack", options.depth_slack, 0.5)?,
        absolute: range("depth_slack_abs", options.depth_slack_abs, 0.5)?,
    };
    let DepthTolerance { relative, absolute } = part.tolerance.after(of_caller);
    // Conversions have moved depth towards far, so surfaces may be nearer by more than that.
    let convention = camera.convention();
    let nearer = part.near_slack.with(part.tolerance, of_caller, convention);
    let (factor, offset) = nearer.in_single(convention);
    let relative = relative.max((f64::from(factor) - 1.0).abs());
    let absolute = absolute.max(f64::from(offset).abs());
    let (rows, steepness) = light_rows([camera, light])?;
    let growth = steepness.map(|s| round_up(s * radius * (1.0 + GROWTH_ULPS * EPS)));
    let (size, of_light) = (camera.size(), light.size());
    if growth.iter().any(|g| !g.is_finite()) {
        return Err(Error::invalid(
            "filter_radius",
            format!("expected a length that the light's image has room for, got {radius}"),
        ));
    }
    Ok(MaskUniform {
        rows: rows.map(|row| row.m),
        sizes: rows.map(|row| row.a),
        growth,
        camera_half_size: [size.width as f32 / 2.0, size.height as f32 / 2.0],
        reach: round_up(reach),
        slack: round_up(relative),
        camera_size: [size.width, size.height],
        light_size: [of_light.width, of_light.height],
        origin: part.origin,
        slack_abs: round_up(absolute),
        stride: stride(of_light),
        blocks: blocks(of_light.width),
        light_is_reversed: u32::from(light.convention().is_reversed()),
        padding: [0; 2],
    })
}

/// A row in float32; `a` bounds its coefficients, and in EPS their errors.
#[derive(Debug, Clone, Copy)]
struct MaskRow {
    m: [f32; 4],
    a: [f32; 4],
}

/// The rows of a camera with x and y in pixels from the middle, about its origin.
fn pixel_rows(camera: &Camera) -> Mat4 {
    let [x, y, z, w] = camera.rows_near_one();
    let size = camera.size();
    [x.map(|v| v * f64::from(size.width) / 2.0), y.map(|v| v * f64::from(size.height) / -2.0), z, w]
}

/// The light's rows and the scale 1 / w, as functions of the camera's pixel and of depth counted
/// from far.
/// Besides the norm of each row of the light, rounded up.
fn light_rows([camera, light]: [&Camera; 2]) -> Result<([MaskRow; 5], [f64; 4])> {
    // Rows of length near 1 keep the inverse well scaled; powers of two are exact.
    let mut rows = pixel_rows(camera);
    let mut units = [1.0; 4];
    for (row, unit) in rows.iter_mut().zip(&mut units) {
        let largest = row.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        *unit = 2.0_f64.powf(largest.log2().floor()).recip();
        *row = row.map(|v| v * *unit);
    }
    let (inverse, inverse_error) = bounded_inverse(&rows).ok_or_else(|| {
        Error::invalid(
            "camera",
            "expected a projection that float64 can invert, got one that is nearly singular",
        )
    })?;
    // The light's rows about the camera's origin.
    let (mut of_light, mut light_error) = (pixel_rows(light), [[0.0; 4]; 4]);
    let (to, from) = (camera.origin(), light.origin());
    for (row, error) in of_light.iter_mut().zip(&mut light_error) {
        let linear = [row[0], row[1], row[2]];
        let travelled: f64 = (0..3).map(|k| linear[k].abs() * (to[k].abs() + from[k].abs())).sum();
        error[3] = 8.0 * ROUNDING * (travelled + row[3].abs());
        row[3] += dot(linear, from_fn(|k| to[k] - from[k]));
    }
    let norm = |row: &[f64; 4]| dot([row[0], row[1], row[2]], [row[0], row[1], row[2]]).sqrt();
    let steepness: [f64; 4] = from_fn(|r| norm(&of_light[r]) * (1.0 + 16.0 * ROUNDING));
    let mut all = [[0.0; 4]; 5];
    let mut errors = [[0.0; 4]; 5];
    for r in 0..5 {
        // The scale is the last coordinate of the homogeneous point.
        let (row, error) =
            if r < 4 { (of_light[r], light_error[r]) } else { ([0.0, 0.0, 0.0, 1.0], [0.0; 4]) };
        for j in 0..4 {
            let mut size = 0.0;
            for k in 0..4 {
                all[r][j] += row[k] * inverse[k][j];
                let larger = inverse[k][j].abs() + inverse_error[k][j];
                size += row[k].abs() * larger;
                errors[r][j] += row[k].abs() * inverse_error[k][j] + error[k] * larger;
            }
            errors[r][j] = (errors[r][j] + 8.0 * ROUNDING * size) * units[j] * (1.0 + EPS);
            all[r][j] *= units[j];
        }
        // Depth is counted from far.
        // There the constant is the row's value at far, where most terms cancel.
        if !camera.convention().is_reversed() {
            let [.., depth, one] = all[r];
            all[r][3] = depth + one;
            all[r][2] = -depth;
            errors[r][3] += errors[r][2] + ROUNDING * (depth.abs() + one.abs());
        }
    }
    // One power of two for all rows keeps their ratios.
    let largest = all.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    let unit = 2.0_f64.powf(largest.log2().floor()).recip();
    let rounded = from_fn(|r| mask_row(all[r].map(|v| v * unit), errors[r].map(|v| v * unit)));
    if !(unit.is_normal()
        && rounded.iter().all(|row: &MaskRow| row.a.iter().all(|a| *a < LARGEST as f32)))
    {
        return Err(Error::invalid(
            "light_camera",
            "expected a light whose rows float32 can hold beside those of the camera",
        ));
    }
    Ok((rounded, steepness))
}

#[expect(clippy::cast_possible_truncation, reason = "the magnitude bounds this rounding")]
fn mask_row(row: [f64; 4], error: [f64; 4]) -> MaskRow {
    let m = row.map(|v| flushed(v as f32));
    let a = from_fn(|j| {
        let lost = error[j] + (row[j] - f64::from(m[j])).abs();
        round_up(f64::from(m[j]).abs().max(lost / EPS))
    });
    MaskRow { m, a }
}

/// The inverse of a matrix whose rows have lengths near 1, and a bound of each entry's error.
///
/// With `m a = 1 + e` the exact inverse is `a (1 + e)^-1`, so `|inverse - a| <= |a| f`.
/// There f is `|e|`, and for the later terms of the series twice the square of its norm.
fn bounded_inverse(m: &Mat4) -> Option<(Mat4, Mat4)> {
    let inverse = inverse4(m)?;
    let mut residual = [[0.0; 4]; 4];
    for i in 0..4 {
        for j in 0..4 {
            let (mut sum, mut size) = (if i == j { -1.0 } else { 0.0 }, 1.0);
            for k in 0..4 {
                sum += m[i][k] * inverse[k][j];
                size += (m[i][k] * inverse[k][j]).abs();
            }
            residual[i][j] = sum.abs() + 8.0 * ROUNDING * size;
        }
    }
    let norm = residual.iter().map(|row| row.iter().sum::<f64>()).fold(0.0, f64::max);
    if norm.is_nan() || norm > LARGEST_RESIDUAL {
        return None;
    }
    let later = 2.0 * norm * norm;
    let error = from_fn(|i| {
        from_fn(|j| {
            let sum: f64 = (0..4).map(|k| inverse[i][k].abs() * (residual[k][j] + later)).sum();
            sum * (1.0 + EPS)
        })
    });
    Some((inverse, error))
}

/// The inverse by elimination with the largest pivots; `None` for a singular matrix.
fn inverse4(m: &Mat4) -> Option<Mat4> {
    let (mut a, mut b) = (*m, [[0.0; 4]; 4]);
    for (i, row) in b.iter_mut().enumerate() {
        row[i] = 1.0;
    }
    for column in 0..4 {
        let pivot = (column..4)
            .max_by(|i, j| a[*i][column].abs().total_cmp(&a[*j][column].abs()))
            .filter(|i| a[*i][column] != 0.0)?;
        a.swap(column, pivot);
        b.swap(column, pivot);
        let unit = a[column][column];
        a[column] = a[column].map(|v| v / unit);
        b[column] = b[column].map(|v| v / unit);
        for row in (0..4).filter(|row| *row != column) {
            let factor = a[row][column];
            for k in 0..4 {
                a[row][k] -= factor * a[column][k];
                b[row][k] -= factor * b[column][k];
            }
        }
    }
    Some(b)
}
