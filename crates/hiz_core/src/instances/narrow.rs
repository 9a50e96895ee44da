//! Packs points and spheres whose positions are float32: their records hold these as they are.
//! Boxes of float32 have a file of their own (`narrow_boxes.rs`).
//!
//! A position in float32 needs no second half and has no rest, so nothing is computed.
//! Batches with a number that is invalid, or subnormal in float32, are packed as all others are
//! (`batch.rs`).
//! Both ways give the same bits.

use crate::host::vectors::are_all;
use crate::input::bounds::{Bounds, Floats};
use crate::instances::aabb::Aabb;
use crate::instances::narrow_boxes::Corners;
use crate::instances::point::PointRecord;
use crate::instances::volume_record::{LARGEST, SphereRecord};

/// Scratch memory for the given numbers: three of each volume, and one.
pub(super) struct Fetched<const THREES: usize, const ONES: usize> {
    positions: [f32; THREES],
    radii: [f64; ONES],
    corners: Corners<THREES>,
}

impl<const THREES: usize, const ONES: usize> Fetched<THREES, ONES> {
    pub(super) fn new() -> Self {
        Self { positions: [0.0; THREES], radii: [0.0; ONES], corners: Corners::new() }
    }

    /// Writes the records of the volumes `from`.
    /// Returns false if they have to be packed in another way.
    #[inline(always)]
    pub(super) fn pack(
        &mut self,
        bounds: &Bounds<'_>,
        from: &[usize],
        indices: &[u32],
        records: &mut [u8],
    ) -> bool {
        match *bounds {
            Bounds::Points { positions: Floats::F32(positions) } => {
                let positions = fetch::<3>(positions, from, &mut self.positions);
                if !are_held(positions) {
                    return false;
                }
                let records = records.as_chunks_mut::<{ size_of::<PointRecord>() }>().0;
                let each = positions.as_chunks().0.iter().zip(indices);
                for (record, (position, index)) in records.iter_mut().zip(each) {
                    *record = bytemuck::cast(PointRecord::of_parts(*position, *index));
                }
            }
            Bounds::Spheres { centers: Floats::F32(centers), radii } => {
                let centers = fetch::<3>(centers, from, &mut self.positions);
                self.radii.iter_mut().zip(from).for_each(|(to, i)| *to = radii.get(*i));
                let radii = &self.radii[..from.len()];
                let largest = f64::from(LARGEST) / 2.0;
                let are_sized = are_all(radii.iter().map(|r| (*r >= 0.0) & (*r < largest)));
                if !(are_held(centers) && are_sized) {
                    return false;
                }
                let records = records.as_chunks_mut::<{ size_of::<SphereRecord>() }>().0;
                let each = centers.as_chunks().0.iter().zip(radii).zip(indices);
                for (record, ((center, radius), index)) in records.iter_mut().zip(each) {
                    let radius = round_up_from_0(*radius);
                    let made = SphereRecord::of_parts(*center, radius, [0.0; 3], *index);
                    *record = bytemuck::cast(made);
                }
            }
            Bounds::Boxes { min: Floats::F32(min), max: Floats::F32(max) } => {
                return self.corners.pack([min, max], from, indices, records);
            }
            _ => return false,
        }
        true
    }

    /// The box around the volumes that were packed last.
    #[inline(always)]
    pub(super) fn around(&self, bounds: &Bounds<'_>, count: usize) -> Aabb {
        let positions = self.positions.as_chunks::<3>().0.iter().take(count);
        let positions = positions.map(|position| position.map(f64::from));
        match bounds {
            Bounds::Boxes { .. } => self.corners.around(count),
            Bounds::Spheres { .. } => around_spheres(positions.zip(self.radii.iter().copied())),
            _ => around_spheres(positions.map(|position| (position, 0.0))),
        }
    }
}

/// Fetches `N` numbers of each of the instances `from`.
#[inline(always)]
fn fetch<'a, const N: usize>(numbers: &[f32], from: &[usize], to: &'a mut [f32]) -> &'a [f32] {
    for (to, i) in to.as_chunks_mut::<N>().0.iter_mut().zip(from) {
        to.copy_from_slice(&numbers[N * i..N * i + N]);
    }
    &to[..N * from.len()]
}

/// `round_up` of numbers from 0 on.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "rounded up in the next line")]
pub(super) fn round_up_from_0(v: f64) -> f32 {
    let nearest = v as f32;
    f32::from_bits(nearest.to_bits() + u32::from(f64::from(nearest) < v))
}

/// Whether records hold all positions as they are.
/// A device may flush subnormal numbers, so records do not have them.
#[inline(always)]
fn are_held(positions: &[f32]) -> bool {
    are_all(positions.iter().map(|v| {
        let size = v.abs();
        (size < LARGEST) & ((size >= f32::MIN_POSITIVE) | (size == 0.0))
    }))
}

/// The union of the boxes around valid spheres ([`Bounds::aabb`]).
///
/// Rounding outwards keeps the order of numbers.
/// So it is done once, after the least and greatest of all were found.
#[inline(always)]
pub(super) fn around_spheres(spheres: impl Iterator<Item = ([f64; 3], f64)>) -> Aabb {
    // What has no size is not rounded.
    let (mut sized, mut points) = (Aabb::EMPTY, Aabb::EMPTY);
    for (center, radius) in spheres {
        let around = if radius == 0.0 { &mut points } else { &mut sized };
        for (k, center) in center.iter().enumerate() {
            let (min, max) = (center - radius, center + radius);
            around.min[k] = if min < around.min[k] { min } else { around.min[k] };
            around.max[k] = if max > around.max[k] { max } else { around.max[k] };
        }
    }
    // Infinity, where there is no sphere, stays beyond all numbers.
    let out = Aabb { min: sized.min.map(f64::next_down), max: sized.max.map(f64::next_up) };
    out.union(&points)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of float32 of many sizes, with some zeros, and with one of `bad` among 400.
    fn numbers(count: usize, seed: u64, bad: &[f32]) -> Vec<f32> {
        let mut state = seed;
        let mut next = move || {
            // Knuth's linear congruence.
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            state >> 33
        };
        let number = |_| {
            let size = f32::from_bits((next() as u32 & 0x007F_FFFF) | 0x3F80_0000);
            let power = [0, 0, 0, 3, -3, 20, -20, 40, -120][next() as usize % 9];
            let sign = if next() % 2 == 0 { -1.0 } else { 1.0 };
            match next() % 400 {
                0 if !bad.is_empty() => bad[next() as usize % bad.len()],
                1..9 => 0.0,
                _ => sign * size * 2.0_f32.powi(power),
            }
        };
        (0..count).map(number).collect()
    }

    /// Batches with and without bad numbers, in given and in another order.
    #[test]
    fn bits_and_boxes_are_those_of_one_by_one() {
        let bad = [f32::NAN, f32::INFINITY, 1e-40, LARGEST, -LARGEST, -1.5 * LARGEST, -1e-39];
        let (mut plain, mut others) = (0, 0);
        for trial in 0..4000 {
            let bad = if trial % 2 == 0 { &bad[..] } else { &[] };
            let centers = numbers(3 * 200, trial, bad);
            let radii: Vec<f32> = numbers(200, trial + 9999, bad)
                .iter()
                .map(|r| if trial % 3 == 0 { r.abs() * 0.0 } else { r.abs() })
                .collect();
            let wide: Vec<f64> = radii.iter().map(|r| f64::from(*r) * (1.0 + 1e-12)).collect();
            let count = [1, 2, 63, 64][trial as usize % 4];
            let step = [1, 3, 7][trial as usize % 3];
            let from: Vec<usize> = (0..count).map(|k| (trial as usize + step * k) % 200).collect();
            let indices: [u32; 64] = std::array::from_fn(|k| 5 * k as u32);
            for bounds in [
                Bounds::Points { positions: Floats::F32(&centers) },
                Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) },
                Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F64(&wide) },
            ] {
                let bytes = bounds.kind().record_bytes() as usize;
                let mut got = vec![0xff; count * bytes];
                let mut fetched = Fetched::<192, 64>::new();
                if !fetched.pack(&bounds, &from, &indices, &mut got) {
                    others += 1;
                    continue;
                }
                plain += 1;
                let mut around = Aabb::EMPTY;
                for (k, i) in from.iter().enumerate() {
                    let mut expected = vec![0; bytes];
                    assert!(bounds.write_record(*i, indices[k], &mut expected), "{trial} {k}");
                    assert_eq!(got[k * bytes..][..bytes], expected, "{trial} {k} {bounds:?}");
                    around = around.union(&bounds.aabb(*i).unwrap());
                }
                assert_eq!(fetched.around(&bounds, count), around, "{trial} {:?}", bounds.kind());
            }
        }
        assert!(plain > 2000 && others > 500, "{plain} {others}");
    }
}
