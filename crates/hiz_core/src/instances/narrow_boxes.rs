//! Packs boxes whose corners are float32, in float32 alone: twice as many numbers in a vector.
//!
//! A record holds the box's centre in two float32, and its half size rounded up.
//! Both are half of a sum or difference of two float32.
//! Knuth's two-sum gives such a sum's rounding error exactly, also in float32.
//! So the error of the centre is its second half, and the sign of the other error says whether the
//! half size has to be rounded up.
//!
//! The general way (`batch.rs`) takes both in float64, and gives the same bits where float64 holds
//! them exactly.
//! That is so where neither corner is much smaller than the other (`GAP`).
//! Batches with other numbers take the general way.

use crate::host::vectors::are_all;
use crate::instances::aabb::Aabb;
use crate::instances::volume_record::{BoxRecord, LARGEST};

/// Corners must be below this, as in `plain_boxes` of `batch.rs`.
const WITHIN: f32 = LARGEST / 4.0;

/// The smaller corner along an axis, unless it is 0, over the larger one, at least.
///
/// With it both are multiples of one unit, and their sum is less than 2^53 units.
const GAP: f32 = 1.0 / 268_435_456.0; // 2^-28

/// The larger corner along an axis, unless it is 0, at least: 2^-70.
///
/// With `GAP`, each bit of the results is worth at least 2^-123, so nothing is subnormal.
const LEAST: f32 = f32::from_bits((127 - 70) << 23);

/// Numbers that the box around a batch takes at once: four boxes, and whole vectors.
const AT_ONCE: usize = 12;

/// Scratch memory: three numbers of each box.
pub(super) struct Corners<const THREES: usize> {
    min: [f32; THREES],
    max: [f32; THREES],
    center_hi: [f32; THREES],
    center_lo: [f32; THREES],
    half_size: [f32; THREES],
}

impl<const THREES: usize> Corners<THREES> {
    pub(super) fn new() -> Self {
        Self {
            min: [0.0; THREES],
            max: [0.0; THREES],
            center_hi: [0.0; THREES],
            center_lo: [0.0; THREES],
            half_size: [0.0; THREES],
        }
    }

    /// Writes the records of the boxes `from`.
    /// Returns false if they have to be packed in another way.
    #[inline(always)]
    pub(super) fn pack(
        &mut self,
        [min, max]: [&[f32]; 2],
        from: &[usize],
        indices: &[u32],
        records: &mut [u8],
    ) -> bool {
        let (to_min, to_max) = (self.min.as_chunks_mut::<3>().0, self.max.as_chunks_mut::<3>().0);
        for ((to_min, to_max), i) in to_min.iter_mut().zip(to_max).zip(from) {
            to_min.copy_from_slice(&min[3 * i..3 * i + 3]);
            to_max.copy_from_slice(&max[3 * i..3 * i + 3]);
        }
        if !self.compute(3 * from.len()) {
            return false;
        }
        let records = records.as_chunks_mut::<{ size_of::<BoxRecord>() }>().0;
        let centers = self.center_hi.as_chunks().0.iter().zip(self.center_lo.as_chunks().0);
        let parts = centers.zip(self.half_size.as_chunks().0);
        for ((record, index), ((hi, lo), half_size)) in records.iter_mut().zip(indices).zip(parts) {
            *record = bytemuck::cast(BoxRecord::of_parts(*hi, *lo, *half_size, *index));
        }
        true
    }

    /// Computes centres and half sizes of the first `count` numbers.
    /// Returns false if they are not those that float64 gives.
    #[inline(always)]
    fn compute(&mut self, count: usize) -> bool {
        let (min, max) = (&self.min[..count], &self.max[..count]);
        if !are_all(min.iter().zip(max).map(|(min, max)| is_plain(*min, *max))) {
            return false;
        }
        let (hi, lo) = (&mut self.center_hi[..count], &mut self.center_lo[..count]);
        let half_size = &mut self.half_size[..count];
        for i in 0..count {
            let (a, b) = (0.5 * min[i], 0.5 * max[i]);
            let (center, rest) = two_sum(a, b);
            (hi[i], lo[i]) = (center, rest);
            let (half, lost) = two_sum(b, -a);
            // At least 0, so its bits ascend with it; the sum makes 0 of -0.
            half_size[i] = f32::from_bits((half + 0.0).to_bits() + u32::from(lost > 0.0));
        }
        true
    }

    /// The box around the first `count` boxes.
    #[inline(always)]
    pub(super) fn around(&self, count: usize) -> Aabb {
        let (min, max) = (&self.min[..3 * count], &self.max[..3 * count]);
        let (mut least, mut most) = ([f32::INFINITY; AT_ONCE], [f32::NEG_INFINITY; AT_ONCE]);
        let (min, last_min) = min.as_chunks::<AT_ONCE>();
        let (max, last_max) = max.as_chunks::<AT_ONCE>();
        for (min, max) in min.iter().zip(max) {
            for i in 0..AT_ONCE {
                least[i] = if min[i] < least[i] { min[i] } else { least[i] };
                most[i] = if max[i] > most[i] { max[i] } else { most[i] };
            }
        }
        let mut around = Aabb::EMPTY;
        for (i, least) in least.iter().chain(last_min).enumerate() {
            around.min[i % 3] = around.min[i % 3].min(f64::from(*least));
        }
        for (i, most) in most.iter().chain(last_max).enumerate() {
            around.max[i % 3] = around.max[i % 3].max(f64::from(*most));
        }
        around
    }
}

/// Whether both ways give the same bits for an axis of a box, whose bounds are valid.
#[inline(always)]
fn is_plain(min: f32, max: f32) -> bool {
    let (a, b) = (min.abs(), max.abs());
    let (smaller, larger) = if a < b { (a, b) } else { (b, a) };
    (min <= max)
        & (larger < WITHIN)
        & ((larger >= LEAST) | (larger == 0.0))
        & ((smaller >= larger * GAP) | (smaller == 0.0))
}

/// The rounded sum, and what it has lost (Knuth).
#[inline(always)]
fn two_sum(a: f32, b: f32) -> (f32, f32) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::vectors;
    use crate::input::bounds::{Bounds, Floats};

    /// Knuth's linear congruence.
    struct Random(u64);

    impl Random {
        fn below(&mut self, n: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (self.0 >> 33) as usize % n
        }

        /// With few or all bits of the fraction, of either sign, of sizes within `powers`.
        fn number(&mut self, powers: &[i32]) -> f32 {
            let fraction = (self.below(1 << 23) as u32) >> [0, 0, 5, 20][self.below(4)];
            let size = f32::from_bits(0x3F80_0000 | fraction);
            let power = powers[self.below(powers.len())];
            let sign = if self.below(2) == 0 { -1.0 } else { 1.0 };
            if self.below(30) == 0 { 0.0 * sign } else { sign * size * 2.0_f32.powi(power) }
        }
    }

    /// Corners of 200 boxes, some of them flat.
    fn corners(random: &mut Random, powers: &[i32]) -> [Vec<f32>; 2] {
        let mut pair = || {
            let (a, b) = (random.number(powers), random.number(powers));
            let b = if random.below(20) == 0 { a } else { b };
            if a < b { (a, b) } else { (b, a) }
        };
        let pairs: Vec<_> = (0..600).map(|_| pair()).collect();
        [pairs.iter().map(|p| p.0).collect(), pairs.iter().map(|p| p.1).collect()]
    }

    /// Ordinary corners are taken, and those of any size are, or are not.
    /// What is taken has the bits of the general way, on any processor.
    #[test]
    fn bits_and_boxes_are_those_of_one_by_one() {
        let mut random = Random(7);
        let indices: [u32; 64] = std::array::from_fn(|k| 5 * k as u32);
        let (mut taken, mut others) = (0, 0);
        for trial in 0..4000 {
            let (powers, must): (&[i32], bool) = match trial % 4 {
                0 => (&[0, 1, 3, 9, 10], true),
                1 => (&[-40, -38, -41, -14], true),
                // At the greatest gap, and a little beyond it.
                2 => (&[10, -16, -17, -18, -19], false),
                _ => (&[57, 58, -69, -70, -71, -90, 0, -126], false),
            };
            let [min, mut max] = corners(&mut random, powers);
            let bad = [f32::NAN, f32::INFINITY, LARGEST, -1e30, 1e-40];
            if trial % 3 == 0 {
                max[random.below(600)] = bad[random.below(5)];
            }
            let count = [1, 2, 63, 64][random.below(4)];
            let step = [1, 3, 7][random.below(3)];
            let from: Vec<usize> = (0..count).map(|k| (trial + step * k) % 200).collect();
            let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
            let [mut got, mut wide] = [(); 2].map(|()| vec![0xff; count * size_of::<BoxRecord>()]);
            let mut scratch = Corners::<192>::new();
            let is_taken = scratch.pack([&min, &max], &from, &indices, &mut got);
            let around = scratch.around(count);
            let wider = vectors::widest(
                #[inline(always)]
                || {
                    let is_taken = scratch.pack([&min, &max], &from, &indices, &mut wide);
                    (is_taken, scratch.around(count))
                },
            );
            assert_eq!((is_taken, &got), (wider.0, &wide), "{trial}");
            if !is_taken {
                assert!(!must || trial % 3 == 0, "{trial}");
                others += 1;
                continue;
            }
            taken += 1;
            let mut expected_around = Aabb::EMPTY;
            for (k, i) in from.iter().enumerate() {
                let mut expected = vec![0; size_of::<BoxRecord>()];
                assert!(bounds.write_record(*i, indices[k], &mut expected), "{trial} {k}");
                let got = &got[k * expected.len()..][..expected.len()];
                assert_eq!(got, expected, "{trial} {k}: {:?} {:?}", &min[3 * i..], &max[3 * i..]);
                expected_around = expected_around.union(&bounds.aabb(*i).unwrap());
            }
            assert_eq!((around, wider.1), (expected_around, expected_around), "{trial}");
        }
        assert!(taken > 1500 && others > 1000, "{taken} {others}");
    }

    /// Numbers for which the two ways differ are not taken.
    #[test]
    fn what_float64_cannot_hold_is_left_to_the_general_way() {
        let tiny = 2.0_f32.powi(-29);
        for (min, max) in [(tiny, 1.0), (-1.0, tiny), (-1.0, -tiny), (0.0, 2.0_f32.powi(-71))] {
            assert!(!is_plain(min, max), "{min} {max}");
        }
        for (min, max) in [(2.0 * tiny, 1.0), (0.0, 1.0), (-0.0, 0.0), (-1.0, 2.0 * tiny)] {
            assert!(is_plain(min, max), "{min} {max}");
        }
    }
}
