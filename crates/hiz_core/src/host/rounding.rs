//! Rounding from float64 to float32: to nearest in two halves, and upwards.
//!
//! All functions are `#[inline]`: loops over pixels and instances in other rooms call them.

use crate::host::linear::Vec3;

/// The spacing of float32 at 1.
///
/// WGSL lets a "correctly rounded" operation round up or down, so its relative error is below this.
pub(crate) const EPS: f64 = 1.0 / 8_388_608.0; // 2^-23

/// The relative error of one rounding to nearest in float64: half its spacing at 1.
pub(crate) const ROUNDING: f64 = f64::EPSILON / 2.0;

/// `v` as two float32 vectors: `hi` is nearest to `v`, and `lo` is nearest to the remainder.
///
/// Subnormal halves become 0.
#[inline]
pub(crate) fn split3(v: Vec3) -> ([f32; 3], [f32; 3]) {
    let halves = v.map(split);
    (halves.map(|h| h.0), halves.map(|h| h.1))
}

/// `v` as two float32; see [`split3`].
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
pub(crate) fn split(v: f64) -> (f32, f32) {
    let hi = flushed(v as f32);
    let lo = if hi.is_finite() { flushed((v - f64::from(hi)) as f32) } else { 0.0 };
    (hi, lo)
}

/// `v` with subnormals replaced by 0, since a device may flush them anyway.
#[inline]
pub(crate) fn flushed(v: f32) -> f32 {
    if v.is_subnormal() { 0.0 } else { v }
}

/// The least float32 that is not below `v`; infinity past the largest finite one, NaN for NaN.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "rounded up in the next line")]
pub(crate) fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    // `next_up` without its branches, so that loops become vectors: -0 is never below `v`.
    let bits = nearest.to_bits().cast_signed();
    let up = f32::from_bits(bits.wrapping_add(bits >> 31 | 1).cast_unsigned());
    if f64::from(nearest) < v { up } else { nearest }
}

/// A float64 that is certain not to be below the exact `a + b`.
///
/// It is at most one float64 above the rounded sum.
#[inline]
pub(crate) fn sum_up(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if b == 0.0 { sum } else { sum.next_up() }
}

/// The least float64 that is certain not to be below the exact `a - b`.
///
/// Knuth's two-sum gives the rounding error.
#[inline]
pub(crate) fn sum_up_difference(a: f64, b: f64) -> f64 {
    let d = a - b;
    let bb = a - d;
    let error = (a - (d + bb)) + (bb - b);
    if error > 0.0 { d.next_up() } else { d }
}
