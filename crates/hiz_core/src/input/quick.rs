//! Metric depth to NDC depth for whole rows, where an error bound of the whole image holds.
//!
//! `Lens::ndc` bounds what each pixel loses, in some sixty operations.
//! Here the same bounds are taken once per image, and the constants are moved towards far by them.
//! What is left per pixel is a quotient and a sum, in loops that a compiler turns into vectors.
//! `docs/accuracy.md`, section "Depth of other kinds", has the proof.
//!
//! Where the bounds of an image are not small, there is no [`Quick`], and each pixel takes the long
//! way.
//! Close to the near plane the bounds cannot tell on which side of it a number lies.
//! A segment of a row with such a number takes the long way, too.

use std::ops::Range;

use crate::host::linear::{Vec3, dot};
use crate::host::rounding::ROUNDING;
use crate::host::vectors;
use crate::input::depth_kind::DepthKind;
use crate::input::lens::{Lens, Rays};
use crate::input::tolerance::DepthTolerance;

/// The largest relative tolerance that the quick way takes.
const MOST_RELATIVE: f64 = 0.5;

/// Pixels of a row that are converted together.
const SEGMENT: usize = 256;

static ZEROS: [f64; SEGMENT] = [0.0; SEGMENT];

/// The relative error of one rounding to nearest in float32.
const SINGLE: f64 = 1.0 / 16_777_216.0;

/// Depth below this is a subnormal float32, which counts as 0.
const LEAST: f32 = f32::MIN_POSITIVE;

/// The bits by which the fraction of float64 is longer than that of float32.
const PAST_SINGLE: u64 = (1 << 29) - 1;

/// A bound must be smaller than this share of the depth range, or the long way is taken.
/// With a larger one most numbers would take it anyway.
const LARGEST_MARGIN: f64 = 0.75;

/// The largest shares of a quotient that bounds may take, for images of float64 and others.
/// Where they take more, the long way loses less; other images lose more in float32.
const MOST_LOST_IN_WIDE: f64 = 1e-13;
const MOST_LOST_IN_NARROW: f64 = 1e-7;

/// The largest depth that does not depend on the number, for images of float64.
/// Where the near plane leans, the long way loses less in most pixels.
const MOST_BASE_IN_WIDE: f64 = 4.0;

/// What is below this changes no depth above 2^-126, beside all that a quotient's share counts.
const NO_BASE: f64 = 1e-200;

/// A number of an image: float32 or float64.
pub(super) trait Number: Copy + PartialOrd + Into<f64> {
    const ZERO: Self;
    const MAX: Self;
    const MINUS_INFINITY: Self;
}

impl Number for f32 {
    const ZERO: Self = 0.0;
    const MAX: Self = Self::MAX;
    const MINUS_INFINITY: Self = Self::NEG_INFINITY;
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    const MAX: Self = Self::MAX;
    const MINUS_INFINITY: Self = Self::NEG_INFINITY;
}

/// The constants of an image, moved towards far.
#[derive(Debug, Clone)]
pub(super) struct Quick {
    reversed: bool,
    signed: bool,
    height: f64,
    /// Closer than this to the near plane the bounds cannot tell on which side of it a number lies.
    margin: f64,
    /// Whether the form alone makes all numbers far that are no depth.
    knows_depth: bool,
    form: Form,
}

/// What becomes of a number, before it is rounded to float32.
#[derive(Debug, Clone)]
enum Form {
    /// `of_columns[column] + of_row . (y, 1) + numerator * length / (number + moved)`.
    /// View depth has no `length`.
    FromEye {
        /// `None` where this term and `of_row` are 0.
        of_columns: Option<Vec<f64>>,
        of_row: [f64; 2],
        numerator: f64,
        moved: f64,
        length: Option<RayLength>,
        /// Whether the quotient is taken in float32, where its accuracy will do.
        is_narrow: bool,
    },
    /// `constant + slope * number`, moved by `share` of the product.
    Parallel { constant: f64, slope: f64, share: f64 },
}

/// The length of the ray through a pixel, as a multiple of the part of it along the view.
///
/// Its square is `square (x - x0)^2 + rest`, where `x0` and `rest` belong to a row.
/// `rest` is at least 1, so nothing cancels.
#[derive(Debug, Clone)]
struct RayLength {
    /// x of the columns' centres.
    columns: Vec<f64>,
    /// The same in float32, for quotients that are taken in it.
    narrow_columns: Vec<f32>,
    square: f64,
    /// `x0 = towards . (y, 1)`.
    towards: [f64; 2],
    /// The direction of rays at x = 0 is `across y + ahead`.
    across: Vec3,
    ahead: Vec3,
}

impl Quick {
    /// `None` where the bounds are not small.
    /// `is_wide`: whether the image holds more than float32.
    pub(super) fn new(
        lens: &Lens,
        kind: DepthKind,
        scale: f64,
        tolerance: DepthTolerance,
        is_wide: bool,
    ) -> Option<Self> {
        let (form, margin, knows_depth) = match &lens.rays {
            Rays::Parallel { slope, constant, tilt } => {
                let slope = slope * scale;
                // Roundings: slope (6), `scale`, its products, the constant and the sums, less than
                // 16.
                let lost = 16.0 * ROUNDING * constant.abs()
                    + tilt
                    + slope.abs() * tolerance.absolute * (1.0 + 1e-12)
                    + f64::from(LEAST);
                let share = (16.0 * ROUNDING + tolerance.relative) * (1.0 + 1e-12);
                let margin = 2.0 * lost + 5.0 * (1.0 + constant.abs()) * share;
                let toward_far = if lens.reversed { -1.0 } else { 1.0 };
                let constant = constant + toward_far * lost;
                (Form::Parallel { constant, slope, share: toward_far * share }, margin, false)
            }
            Rays::FromEye { .. } => from_eye(lens, kind, scale, tolerance, is_wide)?,
        };
        let is_small = margin < LARGEST_MARGIN; // not so for NaN
        is_small.then(|| Self {
            reversed: lens.reversed,
            signed: lens.signed,
            height: lens.size[1],
            margin,
            knows_depth,
            form,
        })
    }

    /// Converts the numbers of a row.
    /// `invalid` lists numbers that are no depth.
    /// `exact` is the long way, for column and number.
    pub(super) fn row<T: Number>(
        &self,
        row: u32,
        numbers: &[T],
        invalid: &[T],
        out: &mut [f32],
        exact: impl Fn(usize, T) -> f32,
    ) {
        vectors::widest(
            #[inline(always)]
            || self.row_here(row, numbers, invalid, out, exact),
        );
    }

    /// [`Quick::row`] in the vectors of the function that calls it.
    #[inline(always)]
    fn row_here<T: Number>(
        &self,
        row: u32,
        numbers: &[T],
        invalid: &[T],
        out: &mut [f32],
        exact: impl Fn(usize, T) -> f32,
    ) {
        let y = (self.height - 2.0 * f64::from(row) - 1.0) / self.height;
        let segments = numbers.chunks(SEGMENT).zip(out.chunks_mut(SEGMENT));
        for (first, (numbers, out)) in (0..).step_by(SEGMENT).zip(segments) {
            let is_close = if self.reversed {
                self.depths::<T, true>(first, y, numbers, out);
                self.refuse(numbers, invalid, out);
                clear_past_planes::<true>(out, self.margin)
            } else {
                self.depths::<T, false>(first, y, numbers, out);
                self.refuse(numbers, invalid, out);
                clear_past_planes::<false>(out, self.margin)
            };
            if is_close {
                for (column, (number, out)) in (first..).zip(numbers.iter().zip(out)) {
                    *out = exact(column, *number);
                }
            }
        }
    }

    /// The form's depth of a segment's numbers, rounded to float32 towards far.
    #[inline(always)]
    fn depths<T: Number, const REVERSED: bool>(
        &self,
        first: usize,
        y: f64,
        numbers: &[T],
        out: &mut [f32],
    ) {
        let (of_columns, of_row, numerator, moved, length, is_narrow) = match &self.form {
            Form::Parallel { constant, slope, share } => {
                for (out, number) in out.iter_mut().zip(numbers) {
                    let product = slope * (*number).into();
                    *out = rounded::<REVERSED>(constant + (product + product.abs() * share));
                }
                return;
            }
            Form::FromEye { of_columns, of_row, numerator, moved, length, is_narrow } => {
                (of_columns, of_row[0] * y + of_row[1], *numerator, *moved, length, *is_narrow)
            }
        };
        let range = first..first + numbers.len();
        let of_columns =
            of_columns.as_ref().map_or(&ZEROS[..numbers.len()], |all| &all[range.clone()]);
        if is_narrow {
            narrow_quotients(range, y, [numerator, moved], length.as_ref(), numbers, out);
            if self.has_base() {
                for (out, column) in out.iter_mut().zip(of_columns) {
                    *out = rounded::<REVERSED>((column + of_row) + f64::from(*out));
                }
            }
            return;
        }
        let Some(length) = length else {
            for ((out, number), column) in out.iter_mut().zip(numbers).zip(of_columns) {
                let number: f64 = (*number).into();
                *out = rounded::<REVERSED>((column + of_row) + numerator / (number + moved));
            }
            return;
        };
        let (x0, rest) = length.of_row(y);
        let square = length.square;
        let columns = of_columns.iter().zip(&length.columns[range]);
        for ((out, number), (column, x)) in out.iter_mut().zip(numbers).zip(columns) {
            let number: f64 = (*number).into();
            let from = x - x0;
            let quotient = numerator * (square * (from * from) + rest).sqrt() / (number + moved);
            *out = rounded::<REVERSED>((column + of_row) + quotient);
        }
    }

    fn has_base(&self) -> bool {
        !matches!(&self.form, Form::FromEye { of_columns: None, .. })
    }

    /// Makes far what is no depth, whatever the form makes of it.
    #[inline(always)]
    fn refuse<T: Number>(&self, numbers: &[T], invalid: &[T], out: &mut [f32]) {
        let far = if self.reversed { 0.0 } else { 1.0 };
        if !self.knows_depth {
            let above = if self.signed { T::MINUS_INFINITY } else { T::ZERO };
            for (out, number) in out.iter_mut().zip(numbers) {
                *out = if *number > above { *out } else { far };
            }
            for (out, number) in out.iter_mut().zip(numbers) {
                *out = if *number <= T::MAX { *out } else { far };
            }
        }
        for bad in invalid {
            for (out, number) in out.iter_mut().zip(numbers) {
                *out = if *number == *bad { far } else { *out };
            }
        }
    }
}

/// The quotients of a segment in float32; `lost_in_single` bounds their errors.
#[inline(always)]
fn narrow_quotients<T: Number>(
    range: Range<usize>,
    y: f64,
    [numerator, moved]: [f64; 2],
    length: Option<&RayLength>,
    numbers: &[T],
    out: &mut [f32],
) {
    let [numerator, moved] = [numerator, moved].map(narrowed);
    let Some(length) = length else {
        for (out, number) in out.iter_mut().zip(numbers) {
            *out = numerator / (narrowed((*number).into()) + moved);
        }
        return;
    };
    let (x0, rest) = length.of_row(y);
    let [x0, rest, square] = [x0, rest, length.square].map(narrowed);
    for ((out, number), x) in out.iter_mut().zip(numbers).zip(&length.narrow_columns[range]) {
        let number = narrowed((*number).into());
        let from = x - x0;
        *out = numerator * (square * (from * from) + rest).sqrt() / (number + moved);
    }
}

/// `depth` rounded to float32 towards far: what float32 cannot hold is cut off, or filled up.
#[inline(always)]
fn rounded<const REVERSED: bool>(depth: f64) -> f32 {
    let bits = if REVERSED { depth.to_bits() } else { depth.to_bits().wrapping_add(PAST_SINGLE) };
    narrowed(f64::from_bits(bits & !PAST_SINGLE))
}

/// Makes far what lies past either plane, or is NaN.
/// Returns whether a depth is within `margin` of the near plane, where this cannot decide.
///
/// A depth was rounded before, so the float32 next to the margin may come from within it.
///
/// Floats from 0 on are ordered like their bits.
/// The sign of a difference, spread over all bits, is a mask; compilers make no branches of it.
#[inline(always)]
fn clear_past_planes<const REVERSED: bool>(depths: &mut [f32], margin: f64) -> bool {
    let is_below = |a: i32, b: i32| a.wrapping_sub(b) >> 31;
    let one = 1.0_f32.to_bits().cast_signed();
    let least = LEAST.to_bits().cast_signed();
    let mut close = 0;
    if REVERSED {
        let plane = narrowed(1.0 - margin).next_down().next_down().to_bits().cast_signed();
        for depth in depths {
            let bits = depth.to_bits().cast_signed();
            let bits = bits & !(bits >> 31); // 0 for negative numbers
            let past = is_below(plane, bits);
            close |= past & !is_below(one, bits);
            let inside = !(past | is_below(bits, least));
            *depth = f32::from_bits((bits & inside).cast_unsigned());
        }
    } else {
        let plane = narrowed(margin).next_up().next_up().to_bits().cast_signed();
        for depth in depths {
            let bits = depth.to_bits().cast_signed();
            let negative = bits >> 31;
            let bits = bits & i32::MAX;
            let past = is_below(bits, plane);
            close |= past & !negative;
            let inside = !(past | negative | is_below(one, bits));
            *depth = f32::from_bits((bits & inside | one & !inside).cast_unsigned());
        }
    }
    close != 0
}

/// The constants of a perspective, and the margin of its near plane.
fn from_eye(
    lens: &Lens,
    kind: DepthKind,
    scale: f64,
    tolerance: DepthTolerance,
    is_wide: bool,
) -> Option<(Form, f64, bool)> {
    let Rays::FromEye { k, constant, k_error, constant_error, inverse, w_length } = &lens.rays
    else {
        return None;
    };
    let quotient = constant / (w_length * scale);
    // A camera whose depth runs against its convention is left to the long way.
    let runs_right = (quotient > 0.0) == lens.reversed && (1e-200..1e200).contains(&quotient.abs());
    // Roundings: `w_length` (5), `scale`, this quotient, the factor below and its product, the
    // pixel's number moved, its quotient and the sum: less than 16.
    let mut share = 16.0 * ROUNDING + constant_error / constant.abs();
    let length = match kind {
        DepthKind::Distance => {
            let (length, lost) = RayLength::new(inverse, *w_length, lens.size[0]);
            share += lost;
            Some(length)
        }
        _ => None,
    };
    let most = if is_wide { MOST_LOST_IN_WIDE } else { MOST_LOST_IN_NARROW };
    if share.is_nan() || share > most {
        return None;
    }
    // Without a base, the far plane is infinitely far.
    let has_base = has_base(lens);
    let has_narrow_move = tolerance.absolute > 1e-30;
    // Beside a base, which takes float64, a float32 quotient of view depth gains little.
    let may_be_narrow = !is_wide && (length.is_some() || !has_base);
    let narrow = may_be_narrow.then(|| lost_in_single(length.as_ref(), has_narrow_move));
    let narrow = narrow.filter(|lost| *lost < 1e-5);
    // Quotients between these stay normal float32 wherever they count.
    let narrow = narrow.filter(|_| (1e-15..1e15).contains(&quotient.abs()));
    share += narrow.unwrap_or(0.0);
    if !(runs_right && share < 1e-5) {
        return None;
    }
    // Roundings of x, the products and three sums.
    let base = k.iter().map(|v| v.abs()).sum::<f64>();
    let base_error = k_error.iter().sum::<f64>() * (1.0 + 1e-9);
    if is_wide && (base > MOST_BASE_IN_WIDE || base_error > ROUNDING) {
        return None;
    }
    let lost = 16.0 * ROUNDING * base + base_error
        // What underflows in a quotient.
        + f64::from(LEAST);
    let numerator = quotient * (1.0 - share) / (1.0 + tolerance.relative);
    let moved = tolerance.absolute / (1.0 + tolerance.relative) * (1.0 + 1e-15);
    let [width, _] = lens.size;
    let columns = columns(width);
    // A number v counts as close if v (1 - relative) - absolute may lie before the near plane.
    // The greatest such number is moved to at most `1 + beyond` times the near plane's depth.
    let (relative, absolute) = (
        tolerance.relative,
        // In units of the least depth of the near plane.
        tolerance.absolute * (1.0 + base) / quotient.abs(),
    );
    if relative > MOST_RELATIVE {
        return None;
    }
    let beyond =
        (1.0 + 2.0 * share + absolute) * (1.0 + relative) / (1.0 - relative) + absolute - 1.0;
    let margin = 2.0 * lost + (1.0 + base) * (5.0 * share + beyond / (1.0 + beyond) * (1.0 + 1e-9));
    let base_far = if lens.reversed { k[2] - lost } else { k[2] + lost };
    let leaning = k[0].abs() + k[1].abs();
    // Numbers that are no depth give less than the depth of an infinite one, infinity or NaN.
    let knows_depth =
        if lens.reversed { base_far + leaning <= 0.0 } else { base_far - leaning >= 1.0 };
    let form = Form::FromEye {
        of_columns: has_base.then(|| columns.iter().map(|x| k[0] * x).collect()),
        of_row: if has_base { [k[1], base_far] } else { [0.0; 2] },
        numerator: if narrow.is_some() { toward_zero(numerator) } else { numerator },
        moved,
        length,
        is_narrow: narrow.is_some(),
    };
    Some((form, margin, knows_depth))
}

/// Whether something is added to quotients: not so with an infinite far plane in reversed Z.
/// Then no more than a subnormal is lost beside the quotient.
///
/// Error bounds are never 0, since products may underflow.
fn has_base(lens: &Lens) -> bool {
    match &lens.rays {
        Rays::FromEye { k, k_error, .. } => {
            !(lens.reversed && *k == [0.0; 3] && k_error.iter().all(|error| *error < NO_BASE))
        }
        Rays::Parallel { .. } => true,
    }
}

/// The share of a quotient that the length of its ray and float32 may lose.
pub(super) fn quotient_share(lens: &Lens, kind: DepthKind) -> f64 {
    match &lens.rays {
        Rays::FromEye { inverse, w_length, .. } if kind == DepthKind::Distance => {
            let (length, lost) = RayLength::new(inverse, *w_length, lens.size[0]);
            lost + lost_in_single(Some(&length), true)
        }
        Rays::FromEye { .. } if !has_base(lens) => lost_in_single(None, true),
        _ => 0.0,
    }
}

/// x of the columns' centres, from -1 to 1.
fn columns(width: f64) -> Vec<f64> {
    (0..width as u32).map(|column| (2.0 * f64::from(column) + 1.0 - width) / width).collect()
}

impl RayLength {
    /// The lengths of the rays of a camera, and a bound of their relative error in float64.
    fn new(inverse: &[[(f64, f64); 3]; 3], w_length: f64, width: f64) -> (Self, f64) {
        let column = |j: usize| inverse.map(|row| row[j].0 * w_length);
        let [aside, across, ahead] = [0, 1, 2].map(column);
        let square = dot(aside, aside);
        let towards = [-dot(aside, across) / square, -dot(aside, ahead) / square];
        // No ray is longer than this, and none is shorter than 1.
        let longest: f64 = [aside, across, ahead].iter().map(|v| dot(*v, *v).sqrt()).sum();
        let off = inverse.as_flattened().iter().map(|entry| entry.1).sum::<f64>() * w_length;
        let lost = 64.0 * ROUNDING * longest * longest + 1.01 * off;
        let columns = columns(width);
        let narrow_columns = columns.iter().copied().map(narrowed).collect();
        let this = Self { columns, narrow_columns, square, towards, across, ahead };
        (this, lost)
    }

    /// `x0` and `rest` of a row.
    fn of_row(&self, y: f64) -> (f64, f64) {
        let x0 = self.towards[0] * y + self.towards[1];
        let ray: Vec3 = std::array::from_fn(|i| self.across[i] * y + self.ahead[i]);
        // Never below 1 but for roundings.
        (x0, (dot(ray, ray) - self.square * x0 * x0).max(1.0))
    }
}

/// A bound of the relative error of the quotient in float32.
fn lost_in_single(length: Option<&RayLength>, has_move: bool) -> f64 {
    // Of the square of the length: `square`, the square of x - x0, their product and the sum.
    // The root halves the sum of these, and of what x, x0 and their difference lose.
    // Then the root itself and its product.
    let of_length = length.map_or(0.0, |length| {
        let farthest = 1.0 + length.towards[0].abs() + length.towards[1].abs();
        4.0 + length.square.sqrt() * farthest
    });
    // The quotient; `moved` and its sum.
    let of_quotient = 1.0 + if has_move { 2.0 } else { 0.0 };
    (of_length + of_quotient) * SINGLE * (1.0 + 1e-3)
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the bounds count this rounding")]
fn narrowed(v: f64) -> f32 {
    v as f32
}

/// `v` rounded to float32 towards 0.
fn toward_zero(v: f64) -> f64 {
    let nearest = narrowed(v);
    let size =
        if f64::from(nearest).abs() > v.abs() { nearest.abs().next_down() } else { nearest.abs() };
    f64::from(size).copysign(v)
}

#[cfg(test)]
mod margins;
#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::camera::Camera;
    use crate::input::image::{DepthConvention, ImageSize};
    use crate::input::projection::{Pose, Projection};

    /// Wider than a segment, and no multiple of the lanes of any processor.
    const SIZE: ImageSize = ImageSize { width: 271, height: 2 };

    fn camera(convention: DepthConvention, far: Option<f64>) -> Camera {
        let pose = Pose { eye: [3.0, -2.0, 1.0], target: [9.0, 5.0, -7.0], up: [0.1, 1.0, 0.0] };
        let projection = Projection::Frustum {
            left: -0.09,
            right: 0.12,
            bottom: -0.05,
            top: 0.06,
            near: 0.1,
            far,
            convention,
        };
        Camera::look_at(&pose, &projection, SIZE).unwrap()
    }

    /// View depths and distances from 0.2 to 600, each in float32.
    fn numbers() -> Vec<f32> {
        (0..SIZE.pixels()).map(|i| 0.2 * 1.014_99_f32.powi((i * 211 % 542) as i32)).collect()
    }

    /// What `quick` makes of the numbers, in float32 steps beyond the oracle's depth of the far end
    /// of `tolerance`.
    /// Negative steps are nearer than the exact depth.
    fn steps(
        camera: &Camera,
        kind: DepthKind,
        tolerance: DepthTolerance,
        quick: &Quick,
    ) -> [i64; 2] {
        let reversed = camera.convention().is_reversed();
        let view = hiz_ref::View {
            rows: camera.rows(),
            origin: camera.origin(),
            width: SIZE.width,
            height: SIZE.height,
            reversed,
        };
        let meaning = hiz_ref::DepthMeaning {
            kind: match kind {
                DepthKind::Distance => hiz_ref::DepthKind::Distance,
                _ => hiz_ref::DepthKind::Z,
            },
            scale: 1.0,
            invalid: &[],
            origin_is_eye: true,
        };
        let numbers = numbers();
        let moved: Vec<f64> = numbers
            .iter()
            .map(|n| f64::from(*n) * (1.0 + tolerance.relative) + tolerance.absolute)
            .collect();
        let exact = hiz_ref::depth_bounds(&view, &moved, meaning).unwrap().farther;
        let mut got = vec![0.0; numbers.len()];
        let width = SIZE.width as usize;
        let rows = numbers.chunks(width).zip(got.chunks_mut(width));
        for (row, (numbers, out)) in (0..).zip(rows) {
            quick.row(row, numbers, &[], out, |_, _| unreachable!("no number is close to a plane"));
        }
        let far = camera.convention().far();
        let pairs = got.iter().zip(&exact).filter(|(_, exact)| **exact != far);
        let steps = pairs.map(|(got, exact)| {
            (i64::from(got.to_bits()) - i64::from(exact.to_bits())) * if reversed { -1 } else { 1 }
        });
        let steps: Vec<_> = steps.collect();
        assert!(steps.len() > 300, "{}", steps.len());
        [*steps.iter().min().unwrap(), *steps.iter().max().unwrap()]
    }

    type Fault = fn(&mut Quick);

    const OTHER_SIDE: &str = "rounded to the other side";

    /// Each fault must show as a depth that is nearer than the exact one.
    const FAULTS: [(&str, DepthKind, Fault); 5] = [
        ("a numerator that is moved towards near", DepthKind::Z, |quick| {
            if let Form::FromEye { numerator, .. } = &mut quick.form {
                *numerator *= 1.0 + 8.0 * SINGLE;
            }
        }),
        ("float32 that is off by more than its bound", DepthKind::Distance, |quick| {
            if let Form::FromEye { numerator, .. } = &mut quick.form {
                *numerator *= 1.0 + 16.0 * SINGLE;
            }
        }),
        (OTHER_SIDE, DepthKind::Z, |quick| quick.reversed = !quick.reversed),
        ("rays a little too long", DepthKind::Distance, |quick| {
            if let Form::FromEye { length: Some(length), .. } = &mut quick.form {
                // A longer ray is a larger quotient, which is nearer.
                length.square *= 1.0 + 1e-3;
            }
        }),
        ("rays about another middle", DepthKind::Distance, |quick| {
            if let Form::FromEye { length: Some(length), .. } = &mut quick.form {
                length.towards[1] += 1e-2;
            }
        }),
    ];

    #[test]
    fn rows_are_never_nearer_and_hardly_farther() {
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            for far in [None, Some(1000.0)] {
                let camera = camera(convention, far);
                let lens = Lens::new(&camera).unwrap();
                for kind in [DepthKind::Z, DepthKind::Distance] {
                    for tolerance in
                        [DepthTolerance::NONE, DepthTolerance::SINGLE, DepthTolerance::HALF]
                    {
                        for is_wide in [false, true] {
                            let quick = Quick::new(&lens, kind, 1.0, tolerance, is_wide).unwrap();
                            let [least, most] = steps(&camera, kind, tolerance, &quick);
                            println!("{convention:?} {far:?} {kind:?} {is_wide}: {least}..{most}");
                            assert!(least >= 0, "{convention:?} {far:?} {kind:?}: nearer");
                            // A step is smaller where the far plane is close.
                            let few = match kind {
                                _ if is_wide => 1,
                                DepthKind::Z if has_base(&lens) => 1,
                                DepthKind::Z => 6,
                                _ => 60,
                            };
                            assert!(most <= few, "{convention:?} {far:?} {kind:?}: {most}");
                        }
                    }
                }
            }
        }
    }

    /// Rows of every type and form, with numbers that are no depth.
    #[test]
    fn wider_vectors_give_the_same_bits() {
        fn compare<T: Number>(quick: &Quick, numbers: &[T], invalid: &[T]) {
            let exact = |column: usize, number: T| column as f32 + narrowed(number.into());
            let mut out = [(); 2].map(|()| vec![0.0; numbers.len()]);
            for row in [0, 1] {
                quick.row(row, numbers, invalid, &mut out[0], exact);
                quick.row_here(row, numbers, invalid, &mut out[1], exact);
                let [wide, plain] = &out;
                assert!(wide.iter().zip(plain).all(|(a, b)| a.to_bits() == b.to_bits()));
            }
        }
        let mut wide: Vec<f64> = (0..2000).map(|i| 0.02 * 1.0071_f64.powi(i)).collect();
        for (i, special) in [0.0, -1.0, f64::INFINITY, f64::NEG_INFINITY, 1e-310, 1e39, -0.0, 5.0]
            .iter()
            .enumerate()
        {
            wide[37 * i + 11] = *special;
        }
        let narrow: Vec<f32> = wide.iter().map(|v| narrowed(*v)).collect();
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            let parallel = Projection::Orthographic {
                left: -3.0,
                right: 2.0,
                bottom: -1.0,
                top: 1.0,
                near: 0.1,
                far: 900.0,
                convention,
            };
            let pose =
                Pose { eye: [3.0, -2.0, 1.0], target: [9.0, 5.0, -7.0], up: [0.1, 1.0, 0.0] };
            let size = ImageSize::new(2000, 2);
            let cameras = [None, Some(1000.0)].map(|far| camera(convention, far).with_size(size));
            let parallel = Camera::look_at(&pose, &parallel, size);
            for camera in cameras.into_iter().chain([parallel]) {
                let lens = Lens::new(&camera.unwrap()).unwrap();
                for kind in [DepthKind::Z, DepthKind::Distance] {
                    for is_wide in [false, true] {
                        let tolerance = DepthTolerance::SINGLE;
                        let quick = Quick::new(&lens, kind, 1.0, tolerance, is_wide).unwrap();
                        compare(&quick, &narrow, &[5.0]);
                        compare(&quick, &wide, &[5.0]);
                    }
                }
            }
        }
    }

    /// Nothing is added to quotients of the commonest cameras.
    #[test]
    fn an_infinite_far_plane_in_reversed_z_has_no_base() {
        for (convention, far, expected) in [
            (DepthConvention::Reversed, None, false),
            (DepthConvention::Reversed, Some(1000.0), true),
            (DepthConvention::Standard, None, true),
        ] {
            let lens = Lens::new(&camera(convention, far)).unwrap();
            let quick = Quick::new(&lens, DepthKind::Z, 1.0, DepthTolerance::NONE, false).unwrap();
            assert_eq!(quick.has_base(), expected, "{convention:?} {far:?}");
        }
    }

    #[test]
    fn planted_faults_show() {
        for convention in [DepthConvention::Standard, DepthConvention::Reversed] {
            for far in [None, Some(1000.0)] {
                let camera = camera(convention, far);
                let lens = Lens::new(&camera).unwrap();
                let tolerance = DepthTolerance::SINGLE;
                for (what, kind, plant) in FAULTS {
                    if what == OTHER_SIDE && !has_base(&lens) {
                        continue; // nothing is rounded after the quotient
                    }
                    let mut quick = Quick::new(&lens, kind, 1.0, tolerance, false).unwrap();
                    plant(&mut quick);
                    let [least, _] = steps(&camera, kind, tolerance, &quick);
                    assert!(least < 0, "{convention:?} {far:?}, {what}: {least}");
                }
                // Without the tolerance of the image's numbers.
                let (kind, none) = (DepthKind::Z, DepthTolerance::NONE);
                let quick = Quick::new(&lens, kind, 1.0, none, false).unwrap();
                let [least, _] = steps(&camera, kind, DepthTolerance::HALF, &quick);
                assert!(least < 0, "{convention:?} {far:?}: the tolerance");
            }
        }
    }

    /// From far inside the margin of either plane to well past it, every depth is told apart.
    #[test]
    fn what_is_close_to_the_near_plane_takes_the_long_way() {
        let margin = 1e-14;
        for (depth, close, reversed) in [
            (1.0 - 1e-12, true, 1.0),
            (1.0 - 3e-7, false, 1.0 - 3e-7),
            (1.0 + 1e-6, false, 0.0),
            (f64::INFINITY, false, 0.0),
            (f64::NAN, false, 0.0),
            (-1e-9, false, 0.0),
            (f64::NEG_INFINITY, false, 0.0),
            (1e-40, false, 0.0),
        ] {
            let mut out = [rounded::<true>(depth)];
            assert_eq!(clear_past_planes::<true>(&mut out, margin), close, "{depth}");
            if !close {
                assert!((f64::from(out[0]) - reversed).abs() < 1e-7, "{depth} {out:?}");
            }
        }
        for (depth, close, standard) in [
            (1e-15, true, 0.0),
            (3e-7, false, 3e-7),
            (-1e-6, false, 1.0),
            (f64::NEG_INFINITY, false, 1.0),
            (f64::NAN, false, 1.0),
            (1.0 + 1e-9, false, 1.0),
            (f64::INFINITY, false, 1.0),
            (1.0, false, 1.0),
        ] {
            let mut out = [rounded::<false>(depth)];
            assert_eq!(clear_past_planes::<false>(&mut out, margin), close, "{depth}");
            if !close {
                assert!((f64::from(out[0]) - standard).abs() < 1e-7, "{depth} {out:?}");
            }
        }
    }
}
