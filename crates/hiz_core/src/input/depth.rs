//! Depth images from other sources, converted to NDC depth in float64 and rounded towards far.
//!
//! Rounding towards far loses a little culling and never hides anything.
//! These numbers are no depth, and become far, which never occludes:
//!
//! - NaN and infinity;
//! - the caller's invalid values;
//! - depth outside the camera's range;
//! - for most cameras, zero and negative numbers.
//!
//! All cores share the rows of an image, and `quick` converts several pixels at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};
use crate::host::memory;
use crate::host::rounding::ROUNDING;
use crate::host::threads::{cores, on_threads};
use crate::host::vectors;
use crate::input::camera::Camera;
use crate::input::depth_kind::DepthKind;
use crate::input::depth_numbers::{DepthNumbers, of_half};
use crate::input::far_pixels::FarPixels;
use crate::input::image::{DepthConvention, ImageSize};
use crate::input::lens::{Lens, toward_far};
use crate::input::near_slack::{self, NearSlack};
use crate::input::quick::{Number, Quick};
use crate::input::tolerance::DepthTolerance;
use crate::input::world_tolerance::{NdcMove, WorldTolerance};

/// Pixels of a band of rows, which one thread converts at a time.
/// A band and its numbers fit the caches of a core.
const BAND_PIXELS: u32 = 1 << 16;

/// More than what moving a number in float64 loses, relative to the result.
const MOVED_ROUNDINGS: f64 = 4.0 * ROUNDING;

/// From this many pixels on, more threads help to convert.
/// One takes tens of microseconds to start.
const PARALLEL_FROM: u64 = 1 << 17;

/// Converts a depth image to NDC depth in `camera`'s convention, rounded to float32 towards far.
///
/// `image` has one number per pixel of `camera`, rows from top to bottom.
/// `scale` times a number is depth of `kind`; it must be 1 for NDC depth.
/// `camera` must have the lens that the image was made with.
/// A view depth or distance belongs to the pixel's centre.
/// The result has the shape of `image`.
///
/// `invalid` lists the numbers of `image`, before `scale`, that mean "no data": they become far.
/// For a float32 image they are rounded to float32 before they are compared.
/// NaN and infinity become far as well.
/// For the kinds `Z` and `Distance` so do zero and negative numbers, with one exception.
/// An orthographic camera with a near plane behind the eye (`near < 0`) sees depth of either sign.
///
/// # Errors
/// [`Error::Invalid`] for
///
/// - a number of pixels that differs from the camera's;
/// - a kind that contradicts the camera's convention;
/// - a scale that is not positive and finite, or not 1 for NDC depth;
/// - for the kinds `Z` and `Distance`: a singular camera, or an orthographic one that was made from
///   a bare matrix, which does not say where depth starts, or whose depth does not grow along its
///   rays.
///
/// [`Error::OutOfMemory`](crate::Error::OutOfMemory) if the host has no room for the result.
///
/// # Examples
/// Millimetres of a sensor, where 0 means "no data":
///
/// ```
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// use hiz_core::{DepthKind, Floats, ndc_from_kind};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let camera = camera.with_size(ImageSize::new(2, 1))?;
///
/// let millimetres = Floats::F32(&[10_000.0, 0.0]);
/// let ndc = ndc_from_kind(millimetres, DepthKind::Z, 0.001, &[0.0], &camera)?;
/// assert!((0.009_999..=0.01).contains(&ndc[0])); // near / view depth = 0.1 / 10
/// assert_eq!(ndc[1], 0.0); // far, which never occludes
/// # Ok::<(), hiz_core::Error>(())
/// ```
pub fn ndc_from_kind<'a>(
    image: impl Into<DepthNumbers<'a>>,
    kind: DepthKind,
    scale: f64,
    invalid: &[f64],
    camera: &Camera,
) -> Result<Vec<f32>> {
    ndc_from_kind_within(image, kind, scale, invalid, camera, DepthTolerance::NONE)
        .map(|(ndc, _)| ndc)
}

/// [`ndc_from_kind`] for an image whose numbers were rounded within `tolerance` before this call.
///
/// `tolerance` is in the units of the numbers, before `scale`.
/// The result holds the NDC depth, and the tolerance that is left for the pyramid to account for.
///
/// - Numbers of the kinds `Z` and `Distance` are moved away from the eye by the tolerance before
///   they are converted, and none is left.
/// - NDC depth keeps its numbers and its tolerance.
///
/// # Errors
/// As [`ndc_from_kind`], and [`Error::Invalid`] for a tolerance outside 0..=0.5.
pub fn ndc_from_kind_within<'a>(
    image: impl Into<DepthNumbers<'a>>,
    kind: DepthKind,
    scale: f64,
    invalid: &[f64],
    camera: &Camera,
    tolerance: DepthTolerance,
) -> Result<(Vec<f32>, DepthTolerance)> {
    let world_tolerance = WorldTolerance::NONE;
    let numbers = image.into();
    ndc_of(&DepthInput { numbers, kind, scale, invalid, tolerance, world_tolerance }, camera)
}

/// Converts a depth image as [`ndc_from_kind_within`] does, with all that a [`DepthInput`] says.
///
/// Its `world_tolerance` moves NDC depth, too, and then no tolerance is left.
///
/// # Errors
/// As [`ndc_from_kind_within`], and [`Error::Invalid`] for a world tolerance that is negative or
/// not finite, and for one of NDC depth of a camera that does not say where view depth starts.
pub fn ndc_of(input: &DepthInput<'_>, camera: &Camera) -> Result<(Vec<f32>, DepthTolerance)> {
    let conversion = Conversion::new(input, camera)?;
    let mut ndc = memory::list(conversion.numbers.len(), "depth")?;
    ndc.resize(conversion.numbers.len(), 0.0);
    let bands = ndc.chunks_mut((conversion.band_rows() * conversion.size.width) as usize);
    let first_rows = (0..).step_by(conversion.band_rows() as usize);
    on_threads(conversion.threads(), first_rows.zip(bands), |(first, band)| {
        conversion.rows(first, band);
    });
    Ok((ndc, conversion.left()))
}

/// A depth image of any kind, and what its numbers mean; the fields are the parameters of
/// [`ndc_from_kind_within`].
#[derive(Debug, Clone, Copy)]
pub struct DepthInput<'a> {
    /// One number per pixel, rows from top to bottom.
    pub numbers: DepthNumbers<'a>,
    /// What they are.
    pub kind: DepthKind,
    /// World units of one step; 1 for NDC depth.
    pub scale: f64,
    /// The numbers that mean "no data", before `scale`.
    pub invalid: &'a [f64],
    /// How far the numbers may have been rounded, before `scale`.
    pub tolerance: DepthTolerance,
    /// How far the depths may lie before the surfaces that they measure, in the world.
    pub world_tolerance: WorldTolerance,
}

/// How the numbers of an image become NDC depth, rows at a time.
pub(crate) struct Conversion<'a> {
    pub(super) numbers: DepthNumbers<'a>,
    /// The row of the image that the numbers begin with.
    pub(super) first_row: u32,
    pub(super) size: ImageSize,
    pub(super) convention: DepthConvention,
    /// The invalid values as the image's type holds them.
    pub(super) invalid: Vec<f64>,
    tolerance: DepthTolerance,
    pub(super) world_tolerance: WorldTolerance,
    /// `None` for NDC depth.
    pub(super) metric: Option<Metric>,
    /// How NDC depth is moved by the world tolerance; `None` if it is not.
    moved: Option<NdcMove>,
    /// What is told of pixels that are far.
    pub(super) far_pixels: FarPixels,
    /// Whether a converted depth is far, where nothing more is told of it.
    has_far: AtomicBool,
}

/// The kinds `Z` and `Distance`.
pub(super) struct Metric {
    pub(super) kind: DepthKind,
    scale: f64,
    pub(super) lens: Lens,
    quick: Option<Quick>,
}

impl<'a> Conversion<'a> {
    /// Checks what was given; the errors are those of [`ndc_from_kind_within`].
    pub(crate) fn new(input: &DepthInput<'a>, camera: &Camera) -> Result<Self> {
        let size = camera.size();
        if input.numbers.len() as u64 != size.pixels() {
            return Err(Error::invalid(
                "depth",
                format!(
                    "expected the camera's size {size} = {} numbers, got {}",
                    size.pixels(),
                    input.numbers.len()
                ),
            ));
        }
        Self::of_rows(input, camera, 0)
    }

    /// [`Conversion::new`] of whole rows of an image, from row `first_row` on.
    pub(crate) fn of_rows(input: &DepthInput<'a>, camera: &Camera, first_row: u32) -> Result<Self> {
        let DepthInput { numbers, kind, scale, invalid, tolerance, world_tolerance } = *input;
        let (size, convention, tolerance) =
            (camera.size(), camera.convention(), tolerance.checked()?);
        let world_tolerance = world_tolerance.checked()?;
        let mut moved = None;
        let (given, row) = (numbers.len() as u64, u64::from(size.width));
        let left = u64::from(size.height.saturating_sub(first_row));
        if given % row != 0 || given / row > left {
            return Err(Error::invalid(
                "depth",
                format!("expected at most {left} rows of {row} numbers each, got {given} numbers"),
            ));
        }
        let metric = match kind {
            DepthKind::Ndc | DepthKind::ReversedNdc => {
                check_ndc(kind, scale, convention)?;
                if world_tolerance != WorldTolerance::NONE {
                    moved = Some(NdcMove::new(camera, world_tolerance, tolerance)?);
                }
                None
            }
            DepthKind::Z | DepthKind::Distance => {
                if !(scale.is_finite() && scale > 0.0) {
                    return Err(Error::invalid(
                        "scale",
                        format!("expected a positive finite number, got {scale}"),
                    ));
                }
                let lens = Lens::new(camera)?;
                let is_wide = matches!(numbers, DepthNumbers::F64(_));
                let both = world_tolerance.with_rounding(tolerance, scale);
                let quick = Quick::new(&lens, kind, scale, both, is_wide);
                Some(Metric { kind, scale, lens, quick })
            }
        };
        let mut invalid = numbers.as_stored(invalid);
        if metric.as_ref().is_some_and(|metric| !metric.lens.signed) {
            // Zero and negative numbers are far in any case.
            invalid.retain(|v| *v > 0.0);
        }
        Ok(Self {
            numbers,
            first_row,
            size,
            convention,
            invalid,
            tolerance,
            world_tolerance,
            metric,
            moved,
            far_pixels: FarPixels::Alike,
            has_far: AtomicBool::new(false),
        })
    }

    /// The same conversion, which tells more of pixels that are far.
    pub(crate) fn telling(self, far_pixels: FarPixels) -> Self {
        Self { far_pixels, ..self }
    }

    /// The tolerance that the NDC depth still has.
    pub(crate) fn left(&self) -> DepthTolerance {
        let is_counted = self.metric.is_some() || self.moved.is_some();
        let left = if is_counted { DepthTolerance::NONE } else { self.tolerance };
        if self.unchanged().is_some() {
            return left;
        }
        self.far_pixels.tolerance(self.convention).after(left)
    }

    /// How near the depth may be that the NDC depth stands for, beside the tolerance that is left.
    pub(crate) fn near_slack(&self) -> NearSlack {
        let reversed = self.convention.is_reversed();
        let of_rounding = NearSlack::of_rounding(reversed);
        match (&self.metric, &self.moved) {
            (Some(Metric { kind, scale, lens, .. }), _) => {
                let both = self.world_tolerance.with_rounding(self.tolerance, *scale);
                near_slack::of_metric(lens, *kind, *scale, both)
            }
            (None, Some(moved)) => moved.near_slack(),
            (None, None) if matches!(self.numbers, DepthNumbers::F64(_)) => of_rounding,
            (None, None) => NearSlack::NONE,
        }
    }

    /// The numbers, where they already are the NDC depth.
    pub(crate) fn unchanged(&self) -> Option<&'a [f32]> {
        match self.numbers {
            DepthNumbers::F32(ndc)
                if self.metric.is_none() && self.moved.is_none() && self.invalid.is_empty() =>
            {
                Some(ndc)
            }
            _ => None,
        }
    }

    /// Rows that one thread converts at a time.
    pub(crate) fn band_rows(&self) -> u32 {
        (BAND_PIXELS / self.size.width).max(1)
    }

    /// How many threads are worth their start.
    pub(crate) fn threads(&self) -> usize {
        if self.size.pixels() < PARALLEL_FROM { 1 } else { cores() }
    }

    /// Converts whole rows, the first of which is row `first`.
    pub(crate) fn rows(&self, first: u32, out: &mut [f32]) {
        let begin = (first - self.first_row) as usize * self.size.width as usize;
        let range = begin..begin + out.len();
        match self.numbers {
            DepthNumbers::F32(numbers) => {
                self.convert(first, &numbers[range], &self.narrow_invalid(), out);
            }
            DepthNumbers::F64(numbers) => {
                self.convert(first, &numbers[range], &self.invalid, out);
            }
            DepthNumbers::F16(bits) => self.widened(first, &bits[range], of_half, out),
            DepthNumbers::U16(numbers) => self.widened(first, &numbers[range], f32::from, out),
        }
        if self.far_pixels == FarPixels::Alike {
            self.note_far(out);
        } else {
            self.tell_apart(first, out);
        }
    }

    /// Whether a depth that was converted is far, and nothing tells whether it is one at all.
    pub(crate) fn has_lost_no_data(&self) -> bool {
        self.unchanged().is_none() && self.has_far.load(Ordering::Relaxed)
    }

    fn note_far(&self, depths: &[f32]) {
        let far = self.convention.far();
        if self.has_far.load(Ordering::Relaxed) {
            return;
        }
        let has_far = vectors::widest(
            #[inline(always)]
            || depths.iter().fold(false, |f, d| f | (*d == far)),
        );
        if has_far {
            self.has_far.store(true, Ordering::Relaxed);
        }
    }

    /// The invalid values of a type that float32 holds exactly.
    #[expect(clippy::cast_possible_truncation, reason = "exact, by the image's type")]
    fn narrow_invalid(&self) -> Vec<f32> {
        self.invalid.iter().map(|v| *v as f32).collect()
    }

    /// Converts rows of 16 bits, which `read` turns into float32.
    fn widened(&self, first: u32, stored: &[u16], read: impl Fn(u16) -> f32, out: &mut [f32]) {
        let (width, invalid) = (self.size.width as usize, self.narrow_invalid());
        let mut numbers = vec![0.0; width];
        let rows = stored.chunks_exact(width).zip(out.chunks_exact_mut(width));
        for (row, (stored, out)) in (first..).zip(rows) {
            vectors::widest(
                #[inline(always)]
                || numbers.iter_mut().zip(stored).for_each(|(number, v)| *number = read(*v)),
            );
            self.convert(row, &numbers, &invalid, out);
        }
    }

    fn convert<T: Number>(&self, first: u32, numbers: &[T], invalid: &[T], out: &mut [f32]) {
        let width = self.size.width as usize;
        let Some(metric) = &self.metric else {
            if let Some(moved) = &self.moved {
                let rows = numbers.chunks_exact(width).zip(out.chunks_exact_mut(width));
                (first..).zip(rows).for_each(|(row, (numbers, out))| {
                    moved.row(row, numbers, invalid, out);
                });
                return;
            }
            let (far, reversed) = (self.convention.far(), self.convention.is_reversed());
            for (out, number) in out.iter_mut().zip(numbers) {
                let rounded = toward_far((*number).into(), reversed);
                *out = if invalid.contains(number) { far } else { rounded };
            }
            return;
        };
        let rows = numbers.chunks_exact(width).zip(out.chunks_exact_mut(width));
        for (row, (numbers, out)) in (first..).zip(rows) {
            let exact =
                |column: usize, number: T| self.exact(metric, column as u32, row, number.into());
            if let Some(quick) = &metric.quick {
                quick.row(row, numbers, invalid, out, exact);
            } else {
                for (column, (out, number)) in out.iter_mut().zip(numbers).enumerate() {
                    *out = exact(column, *number);
                }
            }
        }
    }

    /// The NDC depth of one number, by the bounds of its own pixel.
    pub(super) fn exact(&self, metric: &Metric, column: u32, row: u32, number: f64) -> f32 {
        let Metric { kind, lens, .. } = metric;
        let Some((value, off)) = self.value_of(metric, number) else {
            return self.convention.far();
        };
        let own = lens.ndc(column, row, (value, off), *kind);
        let by = self.world_tolerance;
        if by == WorldTolerance::NONE || own == self.convention.far() {
            return own;
        }
        // In front of the near plane nothing is moved, so that it stays no depth.
        let moved = by.moved(value);
        let off = (off * (1.0 + by.relative) + moved.abs() * MOVED_ROUNDINGS) * (1.0 + 1e-15);
        lens.ndc(column, row, (moved, off), *kind)
    }

    /// A number in world units, and by how much it may be off; `None` for what is no depth.
    #[inline]
    pub(super) fn value_of(&self, metric: &Metric, number: f64) -> Option<(f64, f64)> {
        let Metric { scale, lens, .. } = metric;
        let value = number * scale;
        let known =
            value.is_finite() && (value > 0.0 || lens.signed) && !self.invalid.contains(&number);
        // Slightly more than the tolerance, to cover the roundings of this expression.
        let DepthTolerance { relative, absolute } = self.tolerance;
        let off = (number.abs() * relative + absolute) * scale * (1.0 + 1e-15);
        known.then_some((value, off))
    }
}

/// Checks kind and scale of NDC depth.
fn check_ndc(kind: DepthKind, scale: f64, convention: DepthConvention) -> Result<()> {
    let reversed = convention.is_reversed();
    if (kind == DepthKind::ReversedNdc) != reversed {
        let (image, camera) =
            if reversed { ("ndc", "reversed Z") } else { ("reversed_ndc", "standard Z") };
        return Err(Error::invalid(
            "kind",
            format!("expected the camera's convention, {camera}, got {image}"),
        ));
    }
    if scale != 1.0 {
        return Err(Error::invalid("scale", format!("expected 1 for NDC depth, got {scale}")));
    }
    Ok(())
}

/// A stored depth as the shaders read it.
///
/// NaN and numbers outside 0..1 become far; subnormals and -0 become 0.
pub(crate) fn sanitized(bits: u32, convention: DepthConvention) -> f32 {
    let d = f32::from_bits(bits);
    if !(0.0..=1.0).contains(&d) {
        convention.far()
    } else if d.is_subnormal() || d == 0.0 {
        0.0
    } else {
        d
    }
}

/// The same for the nearest end, where what is no depth becomes near.
pub(crate) fn sanitized_near(bits: u32, convention: DepthConvention) -> f32 {
    if (0.0..=1.0).contains(&f32::from_bits(bits)) {
        sanitized(bits, convention)
    } else {
        convention.near()
    }
}

/// Whether a pixel shows the background: exactly the bits of far, or -0 where far is 0.
pub(crate) fn is_background(bits: u32, convention: DepthConvention) -> bool {
    f32::from_bits(bits) == convention.far()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::lens::test_cameras::{POSE, perspective};
    use crate::input::projection::Projection;

    #[test]
    fn view_depth_and_distance_give_hand_worked_ndc_depth() {
        // Pixel centres lie at tangents +-1/2.
        // A ray is sqrt(1 + 1/4 + 1/4) times as long as its view depth.
        let length = 1.5_f64.sqrt();
        for (convention, expected) in [
            (DepthConvention::Standard, (9.0 - 9.0 / 3.0) / 8.0),
            (DepthConvention::Reversed, (9.0 / 3.0 - 1.0) / 8.0),
        ] {
            let camera = perspective(convention);
            let z = ndc_from_kind(Floats::F64(&[3.0; 4]), DepthKind::Z, 1.0, &[], &camera).unwrap();
            let distance = ndc_from_kind(
                Floats::F64(&[3000.0 * length; 4]),
                DepthKind::Distance,
                0.001,
                &[],
                &camera,
            )
            .unwrap();
            for d in z.iter().chain(&distance) {
                let off = f64::from(*d) - expected;
                assert!(off.abs() < 1e-7, "{d} {expected}");
            }
        }
    }

    /// For an eye far from the origin in a bare matrix the constant cancels.
    /// The error has to go towards far.
    /// The truth consists of integers: for an eye at (0, 0, e) that looks along +z, near 1 and far
    /// 9, the matrix is exact, and so is (9 - 9 / z) / 8.
    #[test]
    fn a_cancelling_eye_rounds_towards_far() {
        for e in [1.0e4, 1.0e6, 1.0e9] {
            for (convention, z_row) in [
                (DepthConvention::Standard, [0.0, 0.0, 9.0 / 8.0, -9.0 / 8.0 - 9.0 / 8.0 * e]),
                (DepthConvention::Reversed, [0.0, 0.0, -1.0 / 8.0, 9.0 / 8.0 + e / 8.0]),
            ] {
                let m = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z_row, [0.0, 0.0, 1.0, -e]];
                let camera =
                    Camera::from_clip_from_world(m, ImageSize::new(1, 1), convention).unwrap();
                for z in [1.5, 2.0, 3.0, 7.7] {
                    let d = f64::from(
                        ndc_from_kind(Floats::F64(&[z]), DepthKind::Z, 1.0, &[], &camera).unwrap()
                            [0],
                    );
                    let truth = if convention.is_reversed() {
                        (9.0 / z - 1.0) / 8.0
                    } else {
                        (9.0 - 9.0 / z) / 8.0
                    };
                    let nearer = if convention.is_reversed() { d - truth } else { truth - d };
                    assert!(
                        nearer <= 1e-15 && nearer > -1e-4,
                        "{convention:?} eye {e} depth {z}: {d} for {truth}"
                    );
                }
            }
        }
    }

    #[test]
    fn orthographic_depth_by_hand_and_tilted_rows_refused() {
        for (convention, expected) in
            [(DepthConvention::Standard, 0.25), (DepthConvention::Reversed, 0.75)]
        {
            let projection = Projection::Orthographic {
                left: -1.0,
                right: 1.0,
                bottom: -1.0,
                top: 1.0,
                near: 1.0,
                far: 9.0,
                convention,
            };
            let camera = Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap();
            for kind in [DepthKind::Z, DepthKind::Distance] {
                let d = ndc_from_kind(Floats::F64(&[3.0; 4]), kind, 1.0, &[], &camera).unwrap();
                assert!(d.iter().all(|d| (f64::from(*d) - expected).abs() < 1e-7), "{d:?}");
            }
            // Depth that also depends on x: a wall at one view depth has more than one NDC depth.
            let s = if convention.is_reversed() { -1.0 } else { 1.0 };
            let p = [
                [1.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0],
                [0.03 * s, 0.0, 0.04 * s, 0.5],
                [0.0, 0.0, 0.0, 1.0],
            ];
            let identity =
                std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
            let tilted =
                Camera::from_clip_from_camera(p, identity, ImageSize::new(2, 2), convention)
                    .unwrap();
            let error =
                ndc_from_kind(Floats::F64(&[0.5; 4]), DepthKind::Z, 1.0, &[], &tilted).unwrap_err();
            assert!(error.to_string().contains("does not grow along its rays"), "{error}");
        }
    }

    #[test]
    fn what_is_no_depth_is_far() {
        let bad = [0.0, -1.0, f64::NAN, f64::INFINITY];
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = perspective(convention);
            for kind in [DepthKind::Z, DepthKind::Distance] {
                assert_eq!(
                    ndc_from_kind(Floats::F64(&bad), kind, 1.0, &[], &camera).unwrap(),
                    [far; 4]
                );
            }
            // In front of the near plane and beyond the far one.
            assert_eq!(
                ndc_from_kind(Floats::F64(&[0.5, 9.5, 0.99, 1e9]), DepthKind::Z, 1.0, &[], &camera)
                    .unwrap(),
                [far; 4]
            );
        }
    }

    /// A camera at z = 3 that looks along -z and sees view depths from `near` to `far`.
    fn orthographic(near: f64, far: f64, convention: DepthConvention) -> Camera {
        let projection = Projection::Orthographic {
            left: -1.0,
            right: 1.0,
            bottom: -1.0,
            top: 1.0,
            near,
            far,
            convention,
        };
        Camera::look_at(&POSE, &projection, ImageSize::new(2, 2)).unwrap()
    }

    /// A near plane behind the eye: 8 units from -4 to 4, so depth is (z + 4) / 8, rounded.
    #[test]
    fn depth_of_either_sign_behind_the_eye() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = orthographic(-4.0, 4.0, convention);
            // An image of another size is seen from the same place.
            for camera in [camera.clone(), camera.with_size(ImageSize::new(4, 1)).unwrap()] {
                for kind in [DepthKind::Z, DepthKind::Distance] {
                    let found = ndc_from_kind(
                        Floats::F64(&[-2.0, 0.0, -0.0, 3.0]),
                        kind,
                        1.0,
                        &[],
                        &camera,
                    )
                    .unwrap();
                    for (d, standard) in found.iter().zip([0.25, 0.5, 0.5, 0.875]) {
                        let expected =
                            if convention.is_reversed() { 1.0 - standard } else { standard };
                        assert!((d - expected).abs() < 1e-6, "{found:?}");
                        assert!(
                            if convention.is_reversed() { *d <= expected } else { *d >= expected },
                            "{found:?}"
                        );
                    }
                    let no_data = [f64::NAN, f64::NEG_INFINITY, -4.5, 4.5];
                    assert_eq!(
                        ndc_from_kind(Floats::F64(&no_data), kind, 1.0, &[], &camera).unwrap(),
                        [far; 4]
                    );
                    // Zero is depth for this camera, unless the caller lists it as invalid.
                    let zero = ndc_from_kind(
                        Floats::F64(&[0.0, -0.0, 2.0, -2.0]),
                        kind,
                        1.0,
                        &[0.0, -2.0],
                        &camera,
                    );
                    let zero = zero.unwrap();
                    assert_eq!([zero[0], zero[1], zero[3]], [far; 3]);
                    assert_ne!(zero[2], far);
                }
            }
            for near in [0.0, 1.0] {
                let camera = orthographic(near, 9.0, convention);
                let found = ndc_from_kind(
                    Floats::F64(&[0.0, -0.0, -2.0, -8.0]),
                    DepthKind::Z,
                    1.0,
                    &[],
                    &camera,
                );
                assert_eq!(found.unwrap(), [far; 4], "near {near}");
            }
            // Near planes at the eye that lie behind it by rounding alone.
            // float64 cannot hold these eyes exactly in world-to-camera form.
            let mut behind = 0;
            for step in 1..20 {
                let t = 1.0e6 / 3.0 * f64::from(step);
                let (s, c) = (0.3 * f64::from(step)).sin_cos();
                let m = [
                    [c, 0.0, s, t],
                    [0.0, 1.0, 0.0, t],
                    [-s, 0.0, c, t / 7.0],
                    [0.0, 0.0, 0.0, 1.0],
                ];
                let reversed = convention.is_reversed();
                let z = if reversed { [0.0, 0.0, -0.1, 1.0] } else { [0.0, 0.0, 0.1, 0.0] };
                let p = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 0.0, 1.0]];
                let camera =
                    Camera::from_clip_from_camera(p, m, ImageSize::new(2, 2), convention).unwrap();
                let at_eye = camera.rows()[2][3];
                behind += usize::from(if reversed { at_eye < 1.0 - 1e-13 } else { at_eye > 1e-13 });
                let found =
                    ndc_from_kind(Floats::F64(&[0.0; 4]), DepthKind::Z, 1.0, &[], &camera).unwrap();
                assert_eq!(found, [far; 4], "{at_eye}");
            }
            assert!(behind > 1, "{behind} residuals of the eye put the near plane behind it");
        }
    }

    /// For every kind, invalid values are numbers as the image stores them, before the scale.
    #[test]
    fn invalid_values_are_far() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let camera = perspective(convention);
            for kind in [DepthKind::Z, DepthKind::Distance] {
                let image = Floats::F32(&[30.0, 40.1, 30.0, 40.1]);
                let found = ndc_from_kind(image, kind, 0.1, &[40.1, f64::NAN], &camera).unwrap();
                assert_eq!(
                    [found[1], found[3]],
                    [far; 2],
                    "float32(40.1), and not 40.1, is what the image holds"
                );
                assert!(found[0] != far && found[2] != far);
                let scaled = ndc_from_kind(image, kind, 0.1, &[4.01, 3.0], &camera).unwrap();
                assert!(scaled.iter().all(|d| *d != far), "{scaled:?}");
            }
            let own =
                if convention.is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc };
            let found =
                ndc_from_kind(Floats::F64(&[0.5, 0.25, 0.5, 0.75]), own, 1.0, &[0.5], &camera)
                    .unwrap();
            assert_eq!(found, [far, 0.25, far, 0.75]);
        }
    }

    /// A number in front of the near plane is far, however little it is in front.
    /// So is a number on the plane where float64 cannot decide.
    #[test]
    fn at_the_near_plane_nothing_is_nearer() {
        for (convention, far) in
            [(DepthConvention::Standard, 1.0), (DepthConvention::Reversed, 0.0)]
        {
            let before = ndc_from_kind(
                Floats::F64(&[1.0_f64.next_down(); 4]),
                DepthKind::Z,
                1.0,
                &[],
                &perspective(convention),
            );
            assert_eq!(before.unwrap(), [far; 4]);
        }
    }

    #[test]
    fn rounding_goes_towards_far() {
        let third = 1.0 / 3.0;
        assert!(
            f64::from(toward_far(third, false)) >= third
                && f64::from(toward_far(third, true)) <= third
        );
        assert_eq!(toward_far(0.25, false), 0.25);
        assert_eq!((toward_far(-1e-300, false), toward_far(1.0 + 1e-15, true)), (1.0, 0.0));
    }

    #[test]
    fn contradictions_are_refused() {
        let camera = perspective(DepthConvention::Reversed);
        let message = |kind, scale| {
            ndc_from_kind(Floats::F32(&[0.5; 4]), kind, scale, &[], &camera)
                .unwrap_err()
                .to_string()
        };
        assert!(
            message(DepthKind::Ndc, 1.0)
                .starts_with("kind: expected the camera's convention, reversed Z")
        );
        assert!(message(DepthKind::ReversedNdc, 2.0).starts_with("scale:"));
        assert!(message(DepthKind::Z, 0.0).starts_with("scale:"));
        let short = ndc_from_kind(Floats::F32(&[0.5; 3]), DepthKind::Z, 1.0, &[], &camera)
            .unwrap_err()
            .to_string();
        assert!(short.contains("4 numbers, got 3"), "{short}");
    }
}
