//! Records of bounding volumes: from the caller's float32 or float64 arrays to what the cull reads.
//!
//! A position becomes two float32, `hi + lo`, so that the shader can subtract the eye before it
//! rounds.
//! Radii and half sizes are rounded up, and what the position cannot hold is added to them.
//! So the stored volume contains the given one.
//!
//! Invalid bounds (NaN, infinite, negative radius, min > max) are not repaired.
//! Their record fails a test in the shader; the instance is kept visible and counted as invalid.

use crate::host::rounding::{round_up, split, sum_up, sum_up_difference};

/// Sizes and coordinates must stay below this, or the bounds are invalid.
/// Then no product in the shader overflows.
pub(crate) const LARGEST: f32 = 1_152_921_504_606_846_976.0;

/// The size in the record of invalid bounds.
///
/// It exceeds every camera's coordinate limit, so the shader keeps the instance as invalid.
/// The shader need not recognise NaN or infinity, which a compiler may assume to be absent.
pub(crate) const BEYOND_LIMITS: f32 = 4.0 * LARGEST;

/// The centre in the record of an absent instance, on the first axis.
///
/// It is farther from every reference point than a valid centre can be.
/// The shader asks for a centre below half of it (`shaders/cull/decision.wgsl`, `ABSENT_BELOW`).
pub(crate) const ABSENT_CENTER: f32 = -BEYOND_LIMITS;

pub(super) trait Record: bytemuck::Pod {
    /// The record that is stored for an absent instance.
    const ABSENT: Self;

    /// The record that is stored for invalid bounds.
    const INVALID: Self;

    /// Whether all numbers are below 2^60 in magnitude, and no length is negative.
    fn is_valid(&self) -> bool;

    /// The same record with the caller's index.
    fn numbered(self, index: u32) -> Self;
}

pub(super) fn all_small<const N: usize>(values: [f32; N]) -> bool {
    values.iter().all(|v| v.abs() < LARGEST)
}

/// Twin: `shaders/instances/bounds_sphere.wgsl`, `load_volume`, which reads two texels.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SphereRecord {
    center_hi: [f32; 3],
    radius: f32,
    center_lo: [f32; 3],
    index: u32,
}

/// Twin: `shaders/instances/bounds_box.wgsl`, `load_volume`, which reads three texels.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct BoxRecord {
    center_hi: [f32; 3],
    padding_0: f32,
    center_lo: [f32; 3],
    index: u32,
    half_size: [f32; 3],
    /// Not 0 in the box of a group: a member is absent.
    padding_2: f32,
}

/// Twin: `shaders/instances/bounds_oriented_box.wgsl`, `load_volume`, which reads four texels.
/// Half axis 2 fills the fourth lanes of the first three texels.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct OrientedBoxRecord {
    center_hi: [f32; 3],
    half_axis_2_x: f32,
    center_lo: [f32; 3],
    half_axis_2_y: f32,
    half_axis_0: [f32; 3],
    half_axis_2_z: f32,
    half_axis_1: [f32; 3],
    index: u32,
}

const _: () = assert!(
    size_of::<SphereRecord>() == 32
        && size_of::<BoxRecord>() == 48
        && size_of::<OrientedBoxRecord>() == 64
);

/// A position as two float32 halves.
/// `rest` is what they cannot hold, axis by axis; it is 0 for float32 input.
pub(super) struct Position {
    pub(super) hi: [f32; 3],
    pub(super) lo: [f32; 3],
    rest: [f64; 3],
}

impl Position {
    pub(super) fn new(p: [f64; 3]) -> Self {
        let halves = p.map(split);
        // Exact: `p - hi` is, because both are float64 within a factor of two or hi is 0.
        // Subtracting `lo` is exact, too.
        let rest =
            std::array::from_fn(|k| (p[k] - f64::from(halves[k].0) - f64::from(halves[k].1)).abs());
        Self { hi: halves.map(|h| h.0), lo: halves.map(|h| h.1), rest }
    }
}

impl SphereRecord {
    pub(super) fn of_parts(
        center_hi: [f32; 3],
        radius: f32,
        center_lo: [f32; 3],
        index: u32,
    ) -> Self {
        Self { center_hi, radius, center_lo, index }
    }

    pub(super) fn new(center: [f64; 3], radius: f64) -> Self {
        let p = Position::new(center);
        // The stored centre is off by at most the 1-norm of the rests.
        let moved = p.rest.iter().fold(0.0, |sum, r| sum_up(sum, *r));
        // A negative radius stays negative, however small it is.
        let radius = if radius < 0.0 { -1.0 } else { round_up(sum_up(radius, moved)) };
        Self { center_hi: p.hi, radius, center_lo: p.lo, index: 0 }
    }
}

impl Record for SphereRecord {
    const ABSENT: Self =
        Self { center_hi: [ABSENT_CENTER, 0.0, 0.0], radius: 0.0, ..Self::INVALID };

    const INVALID: Self =
        Self { center_hi: [0.0; 3], radius: BEYOND_LIMITS, center_lo: [0.0; 3], index: 0 };

    fn numbered(self, index: u32) -> Self {
        Self { index, ..self }
    }

    fn is_valid(&self) -> bool {
        all_small(self.center_hi)
            && all_small(self.center_lo)
            && all_small([self.radius])
            && self.radius >= 0.0
    }
}

impl BoxRecord {
    pub(super) fn of_parts(
        center_hi: [f32; 3],
        center_lo: [f32; 3],
        half_size: [f32; 3],
        index: u32,
    ) -> Self {
        Self { center_hi, padding_0: 0.0, center_lo, index, half_size, padding_2: 0.0 }
    }

    /// The record of a box, or an invalid record for `None` and for invalid bounds.
    pub(crate) fn valid_or_none(corners: Option<[[f64; 3]; 2]>) -> Self {
        let record = corners.map(|[min, max]| Self::new(min, max));
        record.filter(Self::is_valid).unwrap_or(Self::INVALID)
    }

    /// The record of a group without any member that is there.
    pub(crate) fn of_absent_group() -> Self {
        Self::ABSENT
    }

    /// The same box around a group of which a member is absent (`shaders/cull/refine_groups.wgsl`).
    pub(crate) fn with_absent_member(self) -> Self {
        Self { padding_2: 1.0, ..self }
    }

    pub(super) fn new(min: [f64; 3], max: [f64; 3]) -> Self {
        // Halved first, because min + max may overflow.
        let center: [f64; 3] = std::array::from_fn(|k| 0.5 * min[k] + 0.5 * max[k]);
        let p = Position::new(center);
        let half_size = std::array::from_fn(|k| {
            if min[k] > max[k] {
                return -1.0;
            }
            let half =
                sum_up_difference(max[k], center[k]).max(sum_up_difference(center[k], min[k]));
            round_up(sum_up(half, p.rest[k]))
        });
        // A NaN corner makes a NaN centre, so the maximum above cannot hide it.
        Self {
            center_hi: p.hi,
            padding_0: 0.0,
            center_lo: p.lo,
            index: 0,
            half_size,
            padding_2: 0.0,
        }
    }
}

impl Record for BoxRecord {
    const ABSENT: Self =
        Self { center_hi: [ABSENT_CENTER, 0.0, 0.0], half_size: [0.0; 3], ..Self::INVALID };

    const INVALID: Self = Self {
        center_hi: [0.0; 3],
        padding_0: 0.0,
        center_lo: [0.0; 3],
        index: 0,
        half_size: [BEYOND_LIMITS; 3],
        padding_2: 0.0,
    };

    fn numbered(self, index: u32) -> Self {
        Self { index, ..self }
    }

    fn is_valid(&self) -> bool {
        all_small(self.center_hi)
            && all_small(self.center_lo)
            && all_small(self.half_size)
            && self.half_size.iter().all(|h| *h >= 0.0)
    }
}

impl OrientedBoxRecord {
    /// Forms the half axes `A_k h_k` in float64, and rounds them to nearest.
    ///
    /// Neither this rounding nor the rest of the centre is added to the sizes.
    /// A flat box has no size that could take it, so the error bound covers both
    /// (`docs/accuracy.md`).
    pub(super) fn new(center: [f64; 3], half_size: [f64; 3], rotation: [f64; 9]) -> Self {
        let p = Position::new(center);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "rounding to nearest; the error bound covers it"
        )]
        let half_axis = |k: usize| -> [f32; 3] {
            std::array::from_fn(|i| {
                let v = (rotation[3 * i + k] * half_size[k]) as f32;
                if v.is_subnormal() { 0.0 } else { v }
            })
        };
        // The half axes alone would not show a negative size, so this check does.
        // An infinite entry times a size of 0 is NaN, which is found in the half axes.
        let negative = !half_size.iter().all(|h| *h >= 0.0);
        let last = half_axis(2);
        Self {
            center_hi: p.hi,
            half_axis_2_x: last[0],
            center_lo: p.lo,
            half_axis_2_y: last[1],
            half_axis_0: if negative { [f32::NAN; 3] } else { half_axis(0) },
            half_axis_2_z: last[2],
            half_axis_1: half_axis(1),
            index: 0,
        }
    }
}

impl Record for OrientedBoxRecord {
    const ABSENT: Self =
        Self { center_hi: [ABSENT_CENTER, 0.0, 0.0], half_axis_0: [0.0; 3], ..Self::INVALID };

    const INVALID: Self = Self {
        center_hi: [0.0; 3],
        half_axis_2_x: 0.0,
        center_lo: [0.0; 3],
        half_axis_2_y: 0.0,
        half_axis_0: [BEYOND_LIMITS; 3],
        half_axis_2_z: 0.0,
        half_axis_1: [0.0; 3],
        index: 0,
    };

    fn numbered(self, index: u32) -> Self {
        Self { index, ..self }
    }

    fn is_valid(&self) -> bool {
        all_small(self.center_hi)
            && all_small(self.center_lo)
            && all_small(self.half_axis_0)
            && all_small(self.half_axis_1)
            && all_small([self.half_axis_2_x, self.half_axis_2_y, self.half_axis_2_z])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::{Bounds, Floats};

    const TINY: f64 = 1.0 / 9_007_199_254_740_992.0; // 2^-53

    #[test]
    fn a_stored_sphere_contains_the_given_one() {
        // 1 + 2^-53 * k needs more bits than these two float32 can hold exactly.
        let center = [1.0 + 4.0 * TINY + 1.0e-9, 1.0e7 + 1.0 / 3.0, -1.0e-30];
        let record = SphereRecord::new(center, 0.1);
        let off: f64 = (0..3)
            .map(|k| {
                (center[k] - f64::from(record.center_hi[k]) - f64::from(record.center_lo[k])).abs()
            })
            .sum();
        assert!(f64::from(record.radius) >= 0.1 + off);
        assert!(f64::from(record.radius) < 0.100_001);
        assert!(record.is_valid());
    }

    #[test]
    fn a_stored_box_contains_the_given_one_and_flat_float32_boxes_stay_flat() {
        let (min, max) = ([0.1, -1.0e6 - 0.3, 5.0], [0.3, -1.0e6, 5.0]);
        let record = BoxRecord::new(min, max);
        for k in 0..3 {
            let c = f64::from(record.center_hi[k]) + f64::from(record.center_lo[k]);
            let h = f64::from(record.half_size[k]);
            assert!(c - h <= min[k] && c + h >= max[k], "axis {k}");
        }
        assert_eq!(record.half_size[2], 0.0);
    }

    /// Far from the origin, two float32 cannot hold a centre.
    /// The rest is added to the half size and rounded up.
    #[test]
    fn stored_boxes_contain_what_their_centres_cannot_hold() {
        // Multiples of 2^-23 near 1e9, so that these differences are exact in float64.
        let unit = 1.0 / 8_388_608.0;
        for k in 0..500_u32 {
            let middle = 1.0e9 + f64::from(k.wrapping_mul(2_654_435_761) >> 4) * unit;
            let half = f64::from(k * 31 % 1000) * unit * if k % 2 == 0 { 1.0 } else { 1_000_003.0 };
            let (min, max) = ([middle - half; 3], [middle + half; 3]);
            let record = BoxRecord::new(min, max);
            let (hi, lo) = (f64::from(record.center_hi[0]), f64::from(record.center_lo[0]));
            let stored = f64::from(record.half_size[0]);
            assert!(
                stored >= (max[0] - hi) - lo && stored >= lo - (min[0] - hi),
                "{k}: {min:?} {max:?} {record:?}"
            );
            assert!(
                stored <= (half + 2e-6) * (1.0 + 1e-6),
                "{k}: not much larger: {half} {record:?}"
            );
        }
    }

    fn invalid(bounds: &Bounds<'_>) -> Vec<usize> {
        let mut record = vec![0; bounds.kind().record_bytes() as usize];
        (0..bounds.len().unwrap()).filter(|i| !bounds.write_record(*i, 0, &mut record)).collect()
    }

    #[test]
    fn bad_bounds_are_counted_and_named() {
        let bounds = Bounds::Boxes {
            min: Floats::F64(&[
                0.0,
                0.0,
                0.0,
                2.0,
                0.0,
                0.0,
                f64::NAN,
                0.0,
                0.0,
                0.0,
                0.0,
                f64::NEG_INFINITY,
            ]),
            max: Floats::F64(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]),
        };
        assert_eq!(invalid(&bounds), [1, 2, 3]);
        let spheres = Bounds::Spheres {
            centers: Floats::F32(&[
                0.0,
                0.0,
                0.0,
                f32::INFINITY,
                0.0,
                0.0,
                1e30,
                0.0,
                0.0,
                0.0,
                0.0,
                0.0,
            ]),
            radii: Floats::F32(&[-0.0, 1.0, 1.0, -1e-30]),
        };
        assert_eq!(invalid(&spheres), [1, 2, 3]);
        let oriented = Bounds::OrientedBoxes {
            centers: Floats::F32(&[0.0; 9]),
            half_sizes: Floats::F32(&[0.0, 0.0, 0.0, 1.0, -1.0, 1.0, 0.0, 1.0, 1.0]),
            rotations: Floats::F64(
                &[
                    [0.0; 9],
                    [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                    [f64::INFINITY, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
                ]
                .concat(),
            ),
        };
        assert_eq!(invalid(&oriented), [1, 2], "a singular matrix and zero sizes are valid");
    }

    #[test]
    fn arrays_that_do_not_agree_are_refused() {
        let bounds =
            Bounds::Spheres { centers: Floats::F32(&[0.0; 6]), radii: Floats::F32(&[1.0; 3]) };
        assert_eq!(
            bounds.len().unwrap_err().to_string(),
            "radii: expected 2 x 1 = 2 numbers, got 3"
        );
    }
}
