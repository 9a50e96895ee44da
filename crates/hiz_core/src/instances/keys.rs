//! Keys along the Morton curve: in which cell of which cube an instance lies.
//!
//! The keys of 64 instances are computed number by number, in loops that a compiler turns into
//! vectors.
//! Blocks with invalid bounds, and kinds of bounds that are rare, go one by one.
//! Both ways give the same keys.

use std::ops::Range;

use crate::error::Result;
use crate::host::curve::spread;
use crate::host::memory;
use crate::host::vectors::{self, are_all};
use crate::input::bounds::{Bounds, Floats};

/// Bits of a cell's number along each axis.
const AXIS_BITS: u32 = 19;

/// The bits of a cell's three numbers.
const CELL_BITS: u32 = 3 * AXIS_BITS;

/// The highest bit of the key of a cell outside of the innermost cube.
/// The number of its cube stands below this bit.
const OUTER: u64 = 1 << 63;

/// The bits below a cell of the innermost cube, where most instances are.
/// It has no number, so the highest bits of a key tell more of its cells.
const INNER_SHIFT: u32 = 63 - CELL_BITS;

/// The last cube also takes whatever lies outside it: coordinates beyond 2^60, which no record
/// holds.
const LAST_CUBE: u32 = 63;

/// The key of invalid bounds: after every cell of every cube.
pub(super) const INVALID: u64 = u64::MAX;

/// The most centres that are sampled to place the innermost cube.
const SAMPLES: usize = 4096;

/// Instances whose keys are computed at once.
const BLOCK: usize = 64;

/// Three numbers for each instance of a block.
type Threes = [f64; 3 * BLOCK];

/// A cube has 2^18 cells on each side of its centre.
const CELLS_PER_HALF: f64 = (1_u32 << (AXIS_BITS - 1)) as f64;

/// The innermost cube.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cube {
    pub(super) center: [f64; 3],
    /// 1 / half the size.
    pub(super) per_half_size: f64,
}

impl Cube {
    /// Places the innermost cube by a sample of the centres.
    ///
    /// The cube's centre is the median along each axis.
    /// Its half size is the width of the middle eight tenths of the sample, along the widest axis;
    /// if that is 0, the width of the whole sample.
    /// If the centres are spread evenly, the cube holds all of them.
    /// A tenth of outliers on each side cannot move it.
    pub(super) fn new(bounds: &Bounds<'_>, range: &Range<usize>) -> Result<Self> {
        let step = range.len().div_ceil(SAMPLES).max(1);
        let mut axes: [Vec<f64>; 3] = [
            memory::list(SAMPLES, "order")?,
            memory::list(SAMPLES, "order")?,
            memory::list(SAMPLES, "order")?,
        ];
        for center in range.clone().step_by(step).filter_map(|i| center_of(bounds, i)) {
            for (axis, value) in axes.iter_mut().zip(center) {
                axis.push(value);
            }
        }
        let samples = axes[0].len();
        if samples == 0 {
            return Ok(Self { center: [0.0; 3], per_half_size: 1.0 });
        }
        for axis in &mut axes {
            axis.sort_unstable_by(f64::total_cmp);
        }
        let widest =
            |low: usize, high: usize| axes.iter().map(|a| a[high] - a[low]).fold(0.0, f64::max);
        let tenth = samples / 10;
        let width = [widest(tenth, samples - 1 - tenth), widest(0, samples - 1)]
            .into_iter()
            .find(|w| *w > 0.0);
        // An extent below 2^-100 counts as a point; from there 63 cubes still reach past 2^60.
        let half_size = width.unwrap_or(0.0).clamp(1.0 / 2.0_f64.powi(100), 2.0_f64.powi(60));
        Ok(Self { center: axes.map(|a| a[samples / 2]), per_half_size: half_size.recip() })
    }

    /// The keys of the instances from `first` on.
    pub(super) fn keys(&self, bounds: &Bounds<'_>, first: usize, keys: &mut [u64]) {
        vectors::widest(
            #[inline(always)]
            || self.keys_here(bounds, first, keys),
        );
    }

    /// [`Cube::keys`] in the vectors of the function that calls it.
    #[inline(always)]
    fn keys_here(&self, bounds: &Bounds<'_>, first: usize, keys: &mut [u64]) {
        let middle: Threes = std::array::from_fn(|i| self.center[i % 3]);
        let mut centers = [0.0; 3 * BLOCK];
        for (first, keys) in (first..).step_by(BLOCK).zip(keys.chunks_mut(BLOCK)) {
            match keys.as_chunks_mut::<BLOCK>().0 {
                [keys] if centers_of_block(bounds, first, &mut centers) => {
                    self.keys_of_block(&middle, &centers, keys);
                }
                _ => {
                    let each = (first..).zip(keys);
                    each.for_each(|(i, key)| *key = self.key_of(bounds, i));
                }
            }
        }
    }

    /// The key of one instance.
    pub(super) fn key_of(&self, bounds: &Bounds<'_>, i: usize) -> u64 {
        center_of(bounds, i).map_or(INVALID, |center| self.key(center))
    }

    pub(super) fn key(&self, center: [f64; 3]) -> u64 {
        let from_center: [f64; 3] =
            std::array::from_fn(|k| (center[k] - self.center[k]) * self.per_half_size);
        let cube = cube_at(distance(&from_center));
        joined(cube, from_center.map(|v| spread(cell(v, cells_per_half(cube)))))
    }

    /// `middle`: the cube's centre for each instance of the block.
    #[inline(always)]
    fn keys_of_block(&self, middle: &Threes, centers: &Threes, keys: &mut [u64; BLOCK]) {
        let mut from_center = [0.0; 3 * BLOCK];
        for ((from, center), middle) in from_center.iter_mut().zip(centers).zip(middle) {
            *from = (center - middle) * self.per_half_size;
        }
        let (mut cubes, mut scales) = ([0; BLOCK], [CELLS_PER_HALF; 3 * BLOCK]);
        if !are_all(from_center.iter().map(|v| v.abs() < 1.0)) {
            for (k, (from, scales)) in
                from_center.as_chunks().0.iter().zip(scales.as_chunks_mut::<3>().0).enumerate()
            {
                cubes[k] = cube_at(distance(from));
                *scales = [cells_per_half(cubes[k]); 3];
            }
        }
        let mut spreads = [0; 3 * BLOCK];
        for ((spread_cell, from), scale) in spreads.iter_mut().zip(&from_center).zip(&scales) {
            *spread_cell = spread(cell(*from, *scale));
        }
        for ((key, cube), spreads) in keys.iter_mut().zip(cubes).zip(spreads.as_chunks().0) {
            *key = joined(cube, *spreads);
        }
    }
}

/// The greatest distance along an axis.
#[inline(always)]
fn distance(from_center: &[f64; 3]) -> f64 {
    from_center.iter().fold(0.0, |d: f64, v| d.max(v.abs()))
}

/// The cube that holds what is this far from the centre, in half sizes of the innermost one.
#[inline(always)]
fn cube_at(distance: f64) -> u32 {
    // One more than the binary exponent, and 0 for all that is in the innermost cube.
    let beyond = ((distance.to_bits() >> 52) as u32).max(1022) - 1022;
    beyond.div_ceil(3).min(LAST_CUBE)
}

/// The cells of a cube on each side of its centre, per half size of the innermost one.
#[inline(always)]
fn cells_per_half(cube: u32) -> f64 {
    CELLS_PER_HALF * f64::from_bits(u64::from(1023 - 3 * cube) << 52)
}

/// The number of a cell along an axis.
/// What lies outside of the last cube is in the cell next to it.
#[inline(always)]
fn cell(from_center: f64, scale: f64) -> u64 {
    let last = f64::from((1_u32 << AXIS_BITS) - 1);
    let at = (from_center * scale + CELLS_PER_HALF).clamp(0.0, last);
    // Above 2^32 a float64 has 20 bits of the fraction, and the cell's number lies above them.
    // Every processor has these steps for vectors, but not all convert to integers of 64 bits.
    (at + 4_294_967_296.0).to_bits() >> 20 & ((1 << AXIS_BITS) - 1)
}

#[inline(always)]
fn joined(cube: u32, cell: [u64; 3]) -> u64 {
    let cell = cell[0] << 2 | cell[1] << 1 | cell[2];
    if cube == 0 { cell << INNER_SHIFT } else { OUTER | u64::from(cube - 1) << CELL_BITS | cell }
}

/// The centre by which an instance is sorted; `None` for invalid bounds.
fn center_of(bounds: &Bounds<'_>, i: usize) -> Option<[f64; 3]> {
    let aabb = bounds.aabb(i)?;
    Some(match bounds {
        Bounds::Spheres { centers, .. } => centers.array(i),
        _ => aabb.center(),
    })
}

/// [`center_of`] for a block of instances.
/// Returns false if one of them may have invalid bounds, and for kinds that go one by one.
#[inline(always)]
fn centers_of_block(bounds: &Bounds<'_>, first: usize, centers: &mut Threes) -> bool {
    let (threes, ones) = (3 * first..3 * (first + BLOCK), first..first + BLOCK);
    match *bounds {
        Bounds::Boxes { min: Floats::F32(min), max: Floats::F32(max) } => {
            middles(&min[threes.clone()], &max[threes], centers)
        }
        Bounds::Boxes { min: Floats::F64(min), max: Floats::F64(max) } => {
            middles(&min[threes.clone()], &max[threes], centers)
        }
        Bounds::Points { positions } => copied(positions, threes, centers),
        Bounds::Spheres { centers: given, radii } => {
            // The boxes around these are finite.
            let is_radius = |r: f64| (0.0..2.0_f64.powi(1000)).contains(&r);
            are_all(ones.map(|i| is_radius(radii.get(i))))
                && copied(given, threes, centers)
                && are_all(centers.iter().map(|v| v.abs() < 2.0_f64.powi(1000)))
        }
        Bounds::Boxes { .. } | Bounds::OrientedBoxes { .. } => false,
    }
}

#[inline(always)]
fn middles<T: Copy + Into<f64>>(min: &[T], max: &[T], middles: &mut Threes) -> bool {
    for ((middle, min), max) in middles.iter_mut().zip(min).zip(max) {
        *middle = 0.5 * (*min).into() + 0.5 * (*max).into();
    }
    are_all(min.iter().zip(max).map(|(min, max)| {
        let (min, max): (f64, f64) = ((*min).into(), (*max).into());
        (min <= max) & (min > f64::NEG_INFINITY) & (max < f64::INFINITY)
    }))
}

/// Copies numbers; returns whether all are finite.
#[inline(always)]
fn copied(numbers: Floats<'_>, range: Range<usize>, to: &mut Threes) -> bool {
    match numbers {
        Floats::F32(numbers) => {
            to.iter_mut().zip(&numbers[range]).for_each(|(to, v)| *to = f64::from(*v));
        }
        Floats::F64(numbers) => to.copy_from_slice(&numbers[range]),
    }
    are_all(to.iter().map(|v| v.abs() < f64::INFINITY))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::random::Random;

    fn number(random: &mut Random, special: &[f64]) -> f64 {
        let unit = random.unit() - 0.5;
        match random.bits() % 2000 {
            0 => random.pick(special),
            // Outliers of every size.
            1..20 => unit * 2.0_f64.powi((random.bits() % 80) as i32),
            _ => unit,
        }
    }

    /// The key as it is defined, with branches and an integer division.
    fn written_out(cube: &Cube, center: [f64; 3]) -> u64 {
        let from: [f64; 3] =
            std::array::from_fn(|k| (center[k] - cube.center[k]) * cube.per_half_size);
        let mut number = 0;
        let mut half = 1.0;
        while number < 63 && from.iter().any(|v| v.abs() >= half) {
            (number, half) = (number + 1, 8.0 * half);
        }
        let mut key = 0;
        for (k, v) in from.iter().enumerate() {
            let at = (v / half * 262_144.0 + 262_144.0).clamp(0.0, 524_287.0);
            // Within a millionth of a cell's end it may count as the next one.
            let at = (at * 1_048_576.0).round_ties_even() / 1_048_576.0;
            for bit in 0..19 {
                key |= (at as u64 >> bit & 1) << (3 * bit + 2 - k as u64);
            }
        }
        if number == 0 { key * 64 } else { (1 << 63) + (number - 1) * (1 << 57) + key }
    }

    #[test]
    fn keys_of_blocks_are_those_of_one_by_one() {
        let special =
            [f64::NAN, f64::INFINITY, -f64::INFINITY, 1e300, -1e308, 2.0_f64.powi(1000), 1.0, -0.0];
        let mut random = Random(3);
        let n = 64 * 40 + 17;
        let (mut in_blocks, mut invalid) = (0, 0);
        for trial in 0..40 {
            let few = if trial % 2 == 0 { &special[..] } else { &[0.25] };
            let min: Vec<f64> = (0..3 * n).map(|_| number(&mut random, few)).collect();
            let max: Vec<f64> = min
                .iter()
                .map(|v| v + number(&mut random, few).abs() * f64::from(trial % 3))
                .collect();
            let radii: Vec<f64> = (0..n).map(|_| number(&mut random, few).abs()).collect();
            let narrow = |v: &[f64]| v.iter().map(|v| *v as f32).collect::<Vec<_>>();
            let (min_32, max_32, radii_32) = (narrow(&min), narrow(&max), narrow(&radii));
            let wide = |v| Floats::F64(v);
            let all = [
                Bounds::Boxes { min: wide(&min), max: wide(&max) },
                Bounds::Boxes { min: Floats::F32(&min_32), max: Floats::F32(&max_32) },
                Bounds::Boxes { min: Floats::F32(&min_32), max: wide(&max) },
                Bounds::Spheres { centers: wide(&min), radii: wide(&radii) },
                Bounds::Spheres { centers: Floats::F32(&min_32), radii: Floats::F32(&radii_32) },
                Bounds::Points { positions: wide(&min) },
                Bounds::Points { positions: Floats::F32(&min_32) },
            ];
            for bounds in all {
                let cube = Cube::new(&bounds, &(0..n)).unwrap();
                let first = trial as usize % 5;
                let mut keys = vec![1; n - first];
                cube.keys(&bounds, first, &mut keys);
                for (i, key) in (first..).zip(&keys) {
                    let expected = match center_of(&bounds, i) {
                        None => INVALID,
                        Some(center) => written_out(&cube, center),
                    };
                    assert_eq!(*key, expected, "{trial} {i} {:?}", center_of(&bounds, i));
                    assert_eq!(*key, cube.key_of(&bounds, i));
                    invalid += usize::from(*key == INVALID);
                }
                let blocks = (first..n - BLOCK).step_by(BLOCK);
                let mut centers = [0.0; 3 * BLOCK];
                in_blocks += blocks.filter(|i| centers_of_block(&bounds, *i, &mut centers)).count();
            }
        }
        assert!(in_blocks > 5000 && invalid > 100, "{in_blocks} {invalid}");
    }
}
