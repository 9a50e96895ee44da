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
