//! Packs the records of up to 64 instances at once.
//!
//! The stored order scatters the reads over the caller's arrays.
//! So all given numbers are fetched first, and the processor can wait for many loads at once.
//! Then the records of boxes and spheres are computed number by number, in loops that a compiler
//! turns into vectors.
//! Batches with a number that such a loop cannot take are packed one volume after the other.
//! Both ways give the same bits.

use wgpu::WriteOnly;

use crate::host::vectors::{self, are_all};
use crate::input::bounds::{Bounds, BoundsKind, Floats};
use crate::instances::aabb::Aabb;
use crate::instances::narrow::{Fetched, around_spheres, round_up_from_0};
use crate::instances::point::{PointRecord, WidePointRecord};
use crate::instances::volume_record::{BoxRecord, LARGEST, OrientedBoxRecord, SphereRecord};
use crate::instances::write_record::write_absent;

/// Members of a full group: as many as a `u64` has bits.
/// Twin: `shaders/instances/groups.wgsl`, `GROUP`.
pub(crate) const GROUP: usize = 64;

/// Where the instance at a place comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Origin {
    /// Its position in the given bounds.
    pub(crate) bounds: usize,
    /// The caller's index of the instance, relative to the piece's first.
    pub(crate) index: u32,
}

/// A box around some of the volumes of a batch.
pub(super) enum Around {
    /// Around the volume of this number; `None` if its bounds are invalid, and empty if it is
    /// absent.
    One(usize, Option<Aabb>),
    /// Around all volumes of the batch, none of which is invalid.
    All(Aabb),
}

/// Which boxes [`Batch::pack`] tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Boxes {
    /// One for each volume.
    Each,
    /// One for all volumes, where that is quicker.
    Whole,
    /// None at all.
    None,
}

/// Scratch memory for packing some members of one group.
///
/// `threes`, `ones` and `nines` hold arrays of three, one and nine numbers per instance.
/// The records are made here, too, and then copied as one block to the mapped staging buffer.
pub(super) struct Batch {
    indices: [u32; GROUP],
    sources: [usize; GROUP],
    threes: [Threes; 2],
    ones: [f64; GROUP],
    nines: [f64; 9 * GROUP],
    records: [u8; GROUP * LARGEST_RECORD],
    narrow: Fetched<{ 3 * GROUP }, GROUP>,
}

type Threes = [f64; 3 * GROUP];

const LARGEST_RECORD: usize = size_of::<OrientedBoxRecord>();

impl Batch {
    pub(super) fn new() -> Self {
        Self {
            indices: [0; GROUP],
            sources: [0; GROUP],
            threes: [[0.0; 3 * GROUP]; 2],
            ones: [0.0; GROUP],
            nines: [0.0; 9 * GROUP],
            records: [0; GROUP * LARGEST_RECORD],
            narrow: Fetched::new(),
        }
    }

    /// Packs the volumes `sources` of `bounds` into the beginning of `target`.
    /// The records are those of `kind`.
    /// Bit k of `absent`: number k is absent, whatever its bounds are.
    /// Calls `tell` with those boxes around them that are asked for; that of an absent one is
    /// empty.
    /// Returns the rest of `target`.
    pub(super) fn pack<'a>(
        &mut self,
        (bounds, kind): (&Bounds<'_>, BoundsKind),
        sources: impl ExactSizeIterator<Item = Origin>,
        target: WriteOnly<'a, [u8]>,
        (boxes, absent): (Boxes, u64),
        mut tell: impl FnMut(Around),
    ) -> WriteOnly<'a, [u8]> {
        let count = sources.len();
        let Self { indices, sources: from, threes: [first, second], ones, nines, records, narrow } =
            self;
        for ((index, from), origin) in indices.iter_mut().zip(from.iter_mut()).zip(sources) {
            (*index, *from) = (origin.index, origin.bounds);
        }
        let from = &from[..count];
        let record_bytes = kind.record_bytes() as usize;
        let may_be_narrow = absent == 0 && boxes != Boxes::Each && kind != BoundsKind::WidePoint;
        let around_narrow = may_be_narrow.then(|| {
            let records = &mut records[..count * record_bytes];
            vectors::widest(
                #[inline(always)]
                || {
                    let is_packed = narrow.pack(bounds, from, indices, records);
                    is_packed.then(|| (boxes == Boxes::Whole).then(|| narrow.around(bounds, count)))
                },
            )
        });
        if let Some(around) = around_narrow.flatten() {
            if let Some(around) = around {
                tell(Around::All(around));
            }
            let (mut here, rest) = target.split_at(count * record_bytes);
            here.copy_from_slice(&records[..count * record_bytes]);
            return rest;
        }
        match bounds {
            Bounds::Spheres { centers, radii } => {
                fetch::<3>(centers, from, first);
                fetch::<1>(radii, from, ones);
            }
            Bounds::Boxes { min, max } => {
                fetch::<3>(min, from, first);
                fetch::<3>(max, from, second);
            }
            Bounds::OrientedBoxes { centers, half_sizes, rotations } => {
                fetch::<3>(centers, from, first);
                fetch::<3>(half_sizes, from, second);
                fetch::<9>(rotations, from, nines);
            }
            Bounds::Points { positions } => fetch::<3>(positions, from, first),
        }
        let (are_plain, around_all) = vectors::widest(
            #[inline(always)]
            || {
                let numbers = (&*first, &*second, &*ones);
                let indices = &indices[..count];
                let are_plain = absent == 0 && plain((bounds, kind), numbers, indices, records);
                let (lows, highs) = (&first[..3 * count], &second[..3 * count]);
                let around_all = match bounds {
                    _ if !(are_plain && boxes == Boxes::Whole) => None,
                    Bounds::Boxes { .. } => Some(around_boxes(lows, highs)),
                    Bounds::Points { .. } => Some(around_boxes(lows, lows)),
                    Bounds::Spheres { .. } => {
                        let centers = lows.as_chunks().0.iter().copied();
                        Some(around_spheres(centers.zip(ones.iter().copied())))
                    }
                    Bounds::OrientedBoxes { .. } => None,
                };
                (are_plain, around_all)
            },
        );
        let (first, second) = (Floats::F64(first), Floats::F64(second));
        let fetched = match bounds {
            Bounds::Spheres { .. } => Bounds::Spheres { centers: first, radii: Floats::F64(ones) },
            Bounds::Boxes { .. } => Bounds::Boxes { min: first, max: second },
            Bounds::OrientedBoxes { .. } => Bounds::OrientedBoxes {
                centers: first,
                half_sizes: second,
                rotations: Floats::F64(nines),
            },
            Bounds::Points { .. } => Bounds::Points { positions: first },
        };
        if let Some(around) = around_all {
            tell(Around::All(around));
        } else if are_plain {
            if boxes == Boxes::Each {
                (0..count).for_each(|k| tell(Around::One(k, fetched.aabb(k))));
            }
        } else {
            for (k, record) in records.chunks_exact_mut(record_bytes).take(count).enumerate() {
                if absent >> k & 1 == 1 {
                    write_absent(kind, indices[k], record);
                    tell(Around::One(k, Some(Aabb::EMPTY)));
                    continue;
                }
                let is_volume = fetched.write_record(k, indices[k], record);
                if boxes != Boxes::None {
                    tell(Around::One(k, fetched.aabb(k).filter(|_| is_volume)));
                }
            }
        }
        let (mut here, rest) = target.split_at(count * record_bytes);
        here.copy_from_slice(&records[..count * record_bytes]);
        rest
    }
}

/// Writes records number by number; returns false if they have to be written one after the other.
#[inline(always)]
fn plain(
    (bounds, kind): (&Bounds<'_>, BoundsKind),
    (first, second, ones): (&Threes, &Threes, &[f64; GROUP]),
    indices: &[u32],
    records: &mut [u8],
) -> bool {
    match bounds {
        Bounds::Boxes { .. } => plain_boxes(first, second, indices, records),
        Bounds::Spheres { .. } => plain_spheres(first, ones, indices, records),
        Bounds::OrientedBoxes { .. } => false,
        Bounds::Points { .. } => plain_points(first, kind, indices, records),
    }
}

/// The box around boxes without NaN.
#[inline(always)]
fn around_boxes(min: &[f64], max: &[f64]) -> Aabb {
    let mut around = Aabb::EMPTY;
    for (min, max) in min.as_chunks::<3>().0.iter().zip(max.as_chunks::<3>().0) {
        for k in 0..3 {
            around.min[k] = if min[k] < around.min[k] { min[k] } else { around.min[k] };
            around.max[k] = if max[k] > around.max[k] { max[k] } else { around.max[k] };
        }
    }
    around
}

/// Fetches `N` numbers of each of the instances `from`.
fn fetch<const N: usize>(array: &Floats<'_>, from: &[usize], to: &mut [f64]) {
    let to = to.chunks_exact_mut(N).zip(from);
    match array {
        Floats::F32(numbers) => {
            for (to, i) in to {
                let numbers = &numbers[N * i..N * i + N];
                to.iter_mut().zip(numbers).for_each(|(to, number)| *to = f64::from(*number));
            }
        }
        Floats::F64(numbers) => {
            for (to, i) in to {
                to.copy_from_slice(&numbers[N * i..N * i + N]);
            }
        }
    }
}

/// Positions as two float32 halves, and what these cannot hold.
struct Halves {
    hi: [f32; 3 * GROUP],
    lo: [f32; 3 * GROUP],
    rest: Threes,
}

impl Halves {
    /// As `volume_record::Position` does it, without its care for what is not finite.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "rounding to float32 is the point")]
    fn of(positions: &Threes) -> Self {
        // As `rounding::flushed`.
        let flushed = |v: f32| if v.abs() >= f32::MIN_POSITIVE || v == 0.0 { v } else { 0.0 };
        let mut halves =
            Self { hi: [0.0; 3 * GROUP], lo: [0.0; 3 * GROUP], rest: [0.0; 3 * GROUP] };
        for (hi, position) in halves.hi.iter_mut().zip(positions) {
            *hi = flushed(*position as f32);
        }
        for ((lo, hi), position) in halves.lo.iter_mut().zip(&halves.hi).zip(positions) {
            *lo = flushed((position - f64::from(*hi)) as f32);
        }
        for (i, rest) in halves.rest.iter_mut().enumerate() {
            *rest = (positions[i] - f64::from(halves.hi[i]) - f64::from(halves.lo[i])).abs();
        }
        halves
    }

    /// Whether all positions are small enough for records; not so for NaN.
    #[inline(always)]
    fn are_small(&self) -> bool {
        are_all(self.hi.iter().map(|v| v.abs() < LARGEST))
    }

    #[inline(always)]
    fn hi(&self, k: usize) -> [f32; 3] {
        [self.hi[3 * k], self.hi[3 * k + 1], self.hi[3 * k + 2]]
    }

    #[inline(always)]
    fn lo(&self, k: usize) -> [f32; 3] {
        [self.lo[3 * k], self.lo[3 * k + 1], self.lo[3 * k + 2]]
    }
}

/// `next_up` of numbers from 0 on, where `is_so`.
#[inline(always)]
fn next_up_if(v: f64, is_so: bool) -> f64 {
    f64::from_bits(v.to_bits() + u64::from(is_so))
}

/// [`sum_up_difference`] where the difference is at least 0.
#[inline(always)]
fn difference_up(a: f64, b: f64) -> f64 {
    let d = a - b;
    let bb = a - d;
    let error = (a - (d + bb)) + (bb - b);
    next_up_if(d, error > 0.0)
}

/// Writes the records of boxes if all are valid and no corner is beyond the limits.
/// Returns false if one is not.
#[inline(always)]
fn plain_boxes(min: &Threes, max: &Threes, indices: &[u32], records: &mut [u8]) -> bool {
    let within = f64::from(LARGEST) / 4.0;
    let ordered = are_all(min.iter().zip(max).map(|(min, max)| min <= max));
    let least = are_all(min.iter().map(|v| *v > -within));
    let greatest = are_all(max.iter().map(|v| *v < within));
    if !(ordered && least && greatest) {
        return false;
    }
    let mut centers = [0.0; 3 * GROUP];
    for (center, (min, max)) in centers.iter_mut().zip(min.iter().zip(max)) {
        *center = 0.5 * min + 0.5 * max;
    }
    let halves = Halves::of(&centers);
    let mut reach = [0.0; 3 * GROUP];
    for i in 0..3 * GROUP {
        let (up, down) = (difference_up(max[i], centers[i]), difference_up(centers[i], min[i]));
        reach[i] = if down > up { down } else { up };
    }
    for (reach, rest) in reach.iter_mut().zip(&halves.rest) {
        *reach = next_up_if(*reach + rest, *rest != 0.0);
    }
    let half_sizes = reach.map(round_up_from_0);
    let records = records.chunks_exact_mut(size_of::<BoxRecord>());
    for (k, (record, index)) in records.zip(indices).enumerate() {
        let half_size = [half_sizes[3 * k], half_sizes[3 * k + 1], half_sizes[3 * k + 2]];
        let made = BoxRecord::of_parts(halves.hi(k), halves.lo(k), half_size, *index);
        record.copy_from_slice(bytemuck::bytes_of(&made));
    }
    true
}

/// Writes the records of spheres if all are valid, and two float32 hold every centre.
/// Returns false if one is not so.
#[inline(always)]
fn plain_spheres(
    centers: &Threes,
    radii: &[f64; GROUP],
    indices: &[u32],
    records: &mut [u8],
) -> bool {
    let halves = Halves::of(centers);
    let held = are_all(halves.rest.iter().map(|rest| *rest == 0.0));
    let sized = are_all(radii.iter().map(|r| *r >= 0.0 && *r < f64::from(LARGEST) / 2.0));
    if !(held && sized && halves.are_small()) {
        return false;
    }
    let radii = radii.map(round_up_from_0);
    let records = records.chunks_exact_mut(size_of::<SphereRecord>());
    for (k, (record, index)) in records.zip(indices).enumerate() {
        let made = SphereRecord::of_parts(halves.hi(k), radii[k], halves.lo(k), *index);
        record.copy_from_slice(bytemuck::bytes_of(&made));
    }
    true
}

/// Writes the records of points if all are valid.
/// Returns false if one is not.
#[inline(always)]
fn plain_points(positions: &Threes, kind: BoundsKind, indices: &[u32], records: &mut [u8]) -> bool {
    let halves = Halves::of(positions);
    // A NaN shows in the rest alone.
    let are_numbers = are_all(halves.rest.iter().map(|rest| *rest < f64::INFINITY));
    if !(are_numbers && halves.are_small()) {
        return false;
    }
    let records = records.chunks_exact_mut(kind.record_bytes() as usize);
    for (k, (record, index)) in records.zip(indices).enumerate() {
        if kind == BoundsKind::Point {
            let made = PointRecord::of_parts(halves.hi(k), *index);
            record.copy_from_slice(bytemuck::bytes_of(&made));
        } else {
            let made = WidePointRecord::of_parts(halves.hi(k), halves.lo(k), *index);
            record.copy_from_slice(bytemuck::bytes_of(&made));
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::random::Random;
    use crate::host::rounding::sum_up_difference;

    /// Of any size, with few or all bits of the fraction, and of either sign.
    fn number(random: &mut Random) -> f64 {
        let fraction = random.bits() >> random.pick(&[12, 12, 30, 45, 60]);
        let size = 1.0 + fraction as f64 / 2.0_f64.powi(52);
        let power = random.pick(&[0, 0, 0, 3, -3, 20, -20, -40, -126, -140, -149, -1000]);
        let signed = if random.bits() & 1 == 0 { size } else { -size };
        random.pick(&[signed * 2.0_f64.powi(power), signed, signed * 100.0, 0.0, -0.0])
    }

    /// Batches with and without bad numbers: both ways give the same bytes.
    #[test]
    fn both_ways_give_the_same_bits() {
        let mut random = Random(9);
        let (mut vectors_took, mut others) = (0, 0);
        for trial in 0..4000 {
            let narrow = trial % 3 == 0;
            let count = random.pick(&[1, 2, 63, 64]);
            let mut number = || {
                let v = number(&mut random);
                if narrow { f64::from(v as f32) } else { v }
            };
            let mut min: Threes = std::array::from_fn(|_| number());
            let mut max: Threes = std::array::from_fn(|i| min[i] + number().abs());
            let mut radii: [f64; GROUP] = std::array::from_fn(|_| number().abs());
            let bad = random.pick(&[
                None,
                None,
                None,
                Some(f64::NAN),
                Some(f64::INFINITY),
                Some(-1e300),
                Some(1e18),
                Some(2.0_f64.powi(60)),
                Some(5e17),
            ]);
            if let Some(bad) = bad {
                let at = (random.bits() % 192) as usize;
                random.pick(&[0, 1, 2]).eq(&0).then(|| min[at] = bad);
                max[at] = bad;
                radii[at % GROUP] = bad;
            }
            let indices: [u32; GROUP] = std::array::from_fn(|k| 7 * k as u32);
            let boxes = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
            let spheres =
                Bounds::Spheres { centers: Floats::F64(&min), radii: Floats::F64(&radii) };
            let points = Bounds::Points { positions: Floats::F64(&min) };
            for bounds in [boxes, spheres, points] {
                let kind = bounds.kind();
                let bytes = kind.record_bytes() as usize;
                let [mut got, mut wide] = [(); 2].map(|()| vec![0xff; GROUP * bytes]);
                let (numbers, some) = ((&min, &max, &radii), &indices[..count]);
                let are_plain = plain((&bounds, kind), numbers, some, &mut got);
                let are_plain_wide = vectors::widest(
                    #[inline(always)]
                    || plain((&bounds, kind), numbers, some, &mut wide),
                );
                assert_eq!((are_plain, &got), (are_plain_wide, &wide), "{trial} {kind:?}");
                if !are_plain {
                    others += 1;
                    continue;
                }
                vectors_took += 1;
                for (k, got) in got.chunks_exact(bytes).take(count).enumerate() {
                    let mut expected = vec![0; bytes];
                    let is_valid = bounds.write_record(k, indices[k], &mut expected);
                    assert!(is_valid, "{trial} {k} {kind:?} {:?}", &min[3 * k..3 * k + 3]);
                    assert_eq!(got, expected, "{trial} {k}: {:?} {:?}", min[3 * k], max[3 * k]);
                }
                assert!(got[count * bytes..].iter().all(|byte| *byte == 0xff), "past the end");
            }
        }
        assert!(vectors_took > 1000 && others > 1000, "{vectors_took} {others}");
        assert_eq!(difference_up(1.0, 1e-30), sum_up_difference(1.0, 1e-30));
    }
}
