//! Arrays that are computed element by element, in the loops that cost most.
//!
//! `array::map` and `array::from_fn` do the same, but compilers do not always inline them.
//! Then each element costs a call, which made whole images up to a fifth slower.

use crate::occluders::meshlets::LANES;

/// One value for each corner or edge of a triangle.
#[inline(always)]
pub(super) fn three<T>(value: impl Fn(usize) -> T) -> [T; 3] {
    [value(0), value(1), value(2)]
}

/// One value for each of [`LANES`] lanes.
#[inline(always)]
pub(super) fn lanes<T: Copy + Default>(value: impl Fn(usize) -> T) -> [T; LANES] {
    let mut lanes = [T::default(); LANES];
    for l in 0..LANES {
        lanes[l] = value(l);
    }
    lanes
}

/// The least of all lanes.
#[inline(always)]
pub(super) fn least_of(v: &[f32; LANES]) -> f32 {
    let pair = |i: usize| least(v[i], v[i + 4]);
    let half = [pair(0), pair(1), pair(2), pair(3)];
    least(least(half[0], half[2]), least(half[1], half[3]))
}

/// `a` where it is less, else `b`: one instruction for vectors, unlike `f32::min`.
#[inline(always)]
pub(super) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// `a` where it is greater, else `b`.
#[inline(always)]
pub(super) fn greatest(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
