//! Groups: 64 instances that are stored one after the other, with a box around all of them.
//! Whatever hides the box hides every member.
//!
//! For the exact real numbers, a box contains the *given* volumes of its members.
//! It is computed in float64 and rounded outwards, and its record on the device contains it.
//! A group with an invalid member gets an invalid record, so it is never culled as a whole.
//!
//! An update moves some members, and the host keeps no bounds of the others.
//! For each group the host keeps one box.
//! If only *part* of a group was moved, it also keeps the boxes of the moved members.
//! The new box is then the union of these boxes and of the box that held the others from the start.
//! This has three effects:
//!
//! - A group does not grow along the path of a moving member.
//! - Once every member was moved at least once, the group is as tight as a new one.
//! - A group that never moves, or moves as a whole, costs 88 bytes on the host.

use wgpu::WriteOnly;

use crate::error::Result;
use crate::gpu::buffers::Mapped;
use crate::host::memory;
use crate::host::threads::on_two_threads;
use crate::input::bounds::{Bounds, Floats};
use crate::instances::aabb::Aabb;
use crate::instances::volume_record::{BoxRecord, OrientedBoxRecord};

/// Members of a full group: as many as a `u64` has bits.
/// Twin: `shaders/instances/groups.wgsl`, `GROUP`.
pub(crate) const GROUP: usize = 64;

/// From this many instances on, a second thread helps to pack.
/// It takes tens of microseconds to start, and packing them takes hundreds.
const PARALLEL_FROM: usize = 1 << 13;

#[derive(Debug)]
struct Group {
    /// A box around every member that no later update has moved.
    around: Aabb,
    /// Bit k: the bounds of member k are invalid now.
    invalid: u64,
    /// Bit k: member k was moved since `around` was formed.
    moved: u64,
    /// The box of member k at position k: filled for moved members, empty for invalid bounds.
    /// The list has no elements until a part of the group is moved.
    boxes: Vec<Aabb>,
}

/// The groups of one piece, of which the last may be short.
#[derive(Debug)]
pub(crate) struct Groups {
    count: usize,
    groups: Vec<Group>,
}

/// Where the instance at a place comes from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Origin {
    /// Its position in the given bounds.
    pub(crate) bounds: usize,
    /// The caller's index of the instance, relative to the piece's first.
    pub(crate) index: u32,
}

/// Scratch memory for packing some members of one group.
///
/// The stored order scatters the reads over the caller's arrays.
/// So all given numbers are fetched first, and the processor can wait for many loads at once.
/// `threes`, `ones` and `nines` hold arrays of three, one and nine numbers per instance.
/// The records are made here, too, and then copied as one block to the mapped staging buffer.
struct Batch {
    indices: [u32; GROUP],
    threes: [[f64; 3 * GROUP]; 2],
    ones: [f64; GROUP],
    nines: [f64; 9 * GROUP],
    records: [u8; GROUP * LARGEST_RECORD],
}

const LARGEST_RECORD: usize = size_of::<OrientedBoxRecord>();

impl Batch {
    fn new() -> Self {
        Self {
            indices: [0; GROUP],
            threes: [[0.0; 3 * GROUP]; 2],
            ones: [0.0; GROUP],
            nines: [0.0; 9 * GROUP],
            records: [0; GROUP * LARGEST_RECORD],
        }
    }

    /// Packs the volumes `sources` of `bounds` into the beginning of `target`.
    /// Calls `each` with the number of each volume and the box around it; `None` if its bounds are
    /// invalid.
    /// Returns the rest of `target`.
    fn pack<'a>(
        &mut self,
        bounds: &Bounds<'_>,
        sources: impl ExactSizeIterator<Item = Origin>,
        target: WriteOnly<'a, [u8]>,
        mut each: impl FnMut(usize, Option<Aabb>),
    ) -> WriteOnly<'a, [u8]> {
        let count = sources.len();
        let Self { indices, threes: [first, second], ones, nines, records } = self;
        for (k, Origin { bounds: i, index }) in sources.enumerate() {
            indices[k] = index;
            match bounds {
                Bounds::Spheres { centers, radii } => {
                    first[3 * k..3 * k + 3].copy_from_slice(&centers.array::<3>(i));
                    ones[k] = radii.get(i);
                }
                Bounds::Boxes { min, max } => {
                    first[3 * k..3 * k + 3].copy_from_slice(&min.array::<3>(i));
                    second[3 * k..3 * k + 3].copy_from_slice(&max.array::<3>(i));
                }
                Bounds::OrientedBoxes { centers, half_sizes, rotations } => {
                    first[3 * k..3 * k + 3].copy_from_slice(&centers.array::<3>(i));
                    second[3 * k..3 * k + 3].copy_from_slice(&half_sizes.array::<3>(i));
                    nines[9 * k..9 * k + 9].copy_from_slice(&rotations.array::<9>(i));
                }
            }
        }
        let (first, second) = (Floats::F64(first), Floats::F64(second));
        let fetched = match bounds {
            Bounds::Spheres { .. } => Bounds::Spheres { centers: first, radii: Floats::F64(ones) },
            Bounds::Boxes { .. } => Bounds::Boxes { min: first, max: second },
            Bounds::OrientedBoxes { .. } => Bounds::OrientedBoxes {
                centers: first,
                half_sizes: second,
                rotations: Floats::F64(nines),
            },
        };
        let record_bytes = bounds.kind().record_bytes() as usize;
        for (k, record) in records.chunks_exact_mut(record_bytes).take(count).enumerate() {
            let is_volume = fetched.write_record(k, indices[k], record);
            each(k, fetched.aabb(k).filter(|_| is_volume));
        }
        let (mut here, rest) = target.split_at(count * record_bytes);
        here.copy_from_slice(&records[..count * record_bytes]);
        rest
    }
}

impl Group {
    fn new() -> Self {
        Self { around: Aabb::EMPTY, invalid: 0, moved: 0, boxes: Vec::new() }
    }

    /// The box around all members, given as the bits of `all`; `None` if a member is invalid.
    fn aabb(&self, all: u64) -> Option<Aabb> {
        if self.invalid != 0 {
            return None;
        }
        let others = if self.moved == all { Aabb::EMPTY } else { self.around };
        Some(bits(self.moved).fold(others, |sum, k| sum.union(&self.boxes[k])))
    }

    /// Takes new boxes for `members`; those in `invalid` have invalid bounds.
    fn replace(
        &mut self,
        all: u64,
        members: u64,
        invalid: u64,
        boxes: &[Aabb; GROUP],
    ) -> Result<()> {
        if members == all {
            let around = boxes.iter().fold(Aabb::EMPTY, |sum, e| sum.union(e));
            *self = Self { around, invalid, ..Self::new() };
            return Ok(());
        }
        if self.boxes.is_empty() {
            self.boxes = memory::collected([Aabb::EMPTY; GROUP].into_iter(), "update")?;
        }
        for k in bits(members) {
            self.boxes[k] = boxes[k];
        }
        self.moved |= members;
        self.invalid = self.invalid & !members | invalid;
        Ok(())
    }
}

/// One bit per member of group `group` in a piece of `count` instances.
fn all_members(count: usize, group: usize) -> u64 {
    let n = (count - group * GROUP).min(GROUP);
    if n == GROUP { u64::MAX } else { (1 << n) - 1 }
}

impl Groups {
    /// Writes the records of a piece's instances to `records` in stored order, and forms their
    /// groups.
    /// `source` says which instance is stored at a place of the piece.
    pub(crate) fn packed(
        bounds: &Bounds<'_>,
        count: usize,
        source: impl Fn(usize) -> Origin + Sync,
        records: &Mapped<'_>,
    ) -> Result<Self> {
        let mut groups = memory::list(count.div_ceil(GROUP), "groups")?;
        groups.resize_with(count.div_ceil(GROUP), Group::new);
        let record_bytes = bounds.kind().record_bytes();
        let work = |(begin, groups): (usize, &mut [Group])| -> Result<()> {
            if groups.is_empty() {
                return Ok(());
            }
            let (first, end) = (begin * GROUP, count.min((begin + groups.len()) * GROUP));
            let mut view = records.range(first as u64 * record_bytes..end as u64 * record_bytes)?;
            let mut rest = view.slice(..);
            let mut batch = Batch::new();
            for (g, group) in (begin..).zip(groups) {
                let sources = (g * GROUP..count.min((g + 1) * GROUP)).map(&source);
                rest = batch.pack(bounds, sources, rest, |k, aabb| match aabb {
                    Some(aabb) => group.around = group.around.union(&aabb),
                    None => group.invalid |= 1 << k,
                });
            }
            Ok(())
        };
        let half = if count < PARALLEL_FROM { 0 } else { groups.len() / 2 };
        let (first, second) = groups.split_at_mut(half);
        on_two_threads((half > 0).then_some((0, first)), (half, second), work)?;
        Ok(Self { count, groups })
    }

    /// The number of groups.
    pub(crate) fn len(&self) -> usize {
        self.groups.len()
    }

    /// Places of the members with invalid bounds, ascending.
    pub(crate) fn invalid(&self) -> impl Iterator<Item = usize> {
        self.groups
            .iter()
            .enumerate()
            .flat_map(|(g, group)| bits(group.invalid).map(move |k| g * GROUP + k))
    }

    /// The box around a group; `None` if a member is invalid.
    pub(crate) fn aabb(&self, group: usize) -> Option<Aabb> {
        self.groups[group].aabb(all_members(self.count, group))
    }

    /// The record of a group for the device.
    pub(crate) fn record(&self, group: usize) -> BoxRecord {
        BoxRecord::valid_or_none(self.aabb(group).map(|aabb| [aabb.min, aabb.max]))
    }

    /// Bytes on the host.
    pub(crate) fn host_bytes(&self) -> u64 {
        let boxes = self.groups.iter().map(|g| g.boxes.capacity()).sum::<usize>();
        (self.groups.capacity() * size_of::<Group>() + boxes * size_of::<Aabb>()) as u64
    }

    /// Takes new bounds for the instances at `places`, which ascend without repetition.
    /// The bounds of `places[k]` are at `source(places[k])`.
    /// Writes their records to `records`, one after the other.
    /// Returns the groups that contain these places, ascending.
    pub(crate) fn replace(
        &mut self,
        bounds: &Bounds<'_>,
        places: &[u32],
        source: impl Fn(usize) -> Origin + Sync,
        records: &Mapped<'_>,
    ) -> Result<Vec<u32>> {
        let group_of = |place: u32| place as usize / GROUP;
        let record_bytes = bounds.kind().record_bytes();
        let count = self.count;
        // Packs `places`, which begin at position `begin` of the list, into `groups`, the first of
        // which is `first_group`.
        let work = |half: (usize, &[u32], usize, &mut [Group])| -> Result<()> {
            let (begin, places, first_group, groups) = half;
            let end = begin + places.len();
            let bytes = begin as u64 * record_bytes..end as u64 * record_bytes;
            let mut view = records.range(bytes)?;
            let mut rest = view.slice(..);
            let mut batch = Batch::new();
            for places in places.chunk_by(|a, b| group_of(*a) == group_of(*b)) {
                let group = group_of(places[0]);
                let (mut members, mut invalid, mut boxes) = (0, 0, [Aabb::EMPTY; GROUP]);
                let sources = places.iter().map(|place| source(*place as usize));
                rest = batch.pack(bounds, sources, rest, |k, aabb| {
                    let k = places[k] as usize % GROUP;
                    members |= 1 << k;
                    match aabb {
                        Some(aabb) => boxes[k] = aabb,
                        None => invalid |= 1 << k,
                    }
                });
                let all = all_members(count, group);
                groups[group - first_group].replace(all, members, invalid, &boxes)?;
            }
            Ok(())
        };
        // The second half begins with a whole group, and it is never empty.
        let half_group =
            if places.len() < PARALLEL_FROM { 0 } else { group_of(places[places.len() / 2]) };
        let half = places.partition_point(|place| group_of(*place) < half_group);
        let (first, second) = self.groups.split_at_mut(half_group);
        let first = (half > 0).then_some((0, &places[..half], 0, first));
        on_two_threads(first, (half, &places[half..], half_group, second), work)?;
        let touched = || {
            places
                .chunk_by(|a, b| group_of(*a) == group_of(*b))
                .map(|part| group_of(part[0]) as u32)
        };
        let mut list = memory::list(touched().count(), "update")?;
        list.extend(touched());
        Ok(list)
    }
}

/// The positions of the bits that are set, ascending.
fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let k = word.trailing_zeros();
        word &= word.wrapping_sub(1);
        (k < 64).then_some(k as usize)
    })
}
