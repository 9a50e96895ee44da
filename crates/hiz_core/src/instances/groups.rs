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

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::buffers::Mapped;
use crate::host::memory;
use crate::host::threads::{Locked, cores, on_threads};
use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::aabb::Aabb;
use crate::instances::batch::{Around, Batch, Boxes, GROUP, Origin};
use crate::instances::volume_record::BoxRecord;

/// From this many instances on, more threads help to pack.
/// One takes tens of microseconds to start, and packing them takes hundreds.
const PARALLEL_FROM: usize = 1 << 14;

/// Groups that one thread packs at a time.
const PART: usize = 64;

/// How many threads pack so many instances.
fn threads_for(count: usize) -> usize {
    if count < PARALLEL_FROM { 1 } else { cores() }
}

/// Runs `work` on the parts, on at most so many threads.
/// The first error is returned.
fn on_parts<T: Send>(
    threads: usize,
    parts: impl IntoIterator<Item = T, IntoIter: Send>,
    work: impl Fn(T, &mut Batch) -> Result<()> + Sync,
) -> Result<()> {
    let failed: Locked<Option<Error>> = Locked::default();
    // One for each thread, however many parts it packs.
    let spare_batches: Locked<Vec<Box<Batch>>> = Locked::default();
    on_threads(threads, parts, |part| {
        let mut batch = spare_batches.lock().pop().unwrap_or_else(|| Box::new(Batch::new()));
        if let Err(error) = work(part, &mut batch) {
            failed.lock().get_or_insert(error);
        }
        spare_batches.lock().push(batch);
    });
    failed.lock().take().map_or(Ok(()), Err)
}

/// Writes the records of instances that are culled one by one, once: no groups are formed.
///
/// `shares_cores`: meanwhile the device culls other instances on the same cores.
/// Half of them are enough then, and every thread less is one less to wait for.
pub(crate) fn pack_without_groups(
    shares_cores: bool,
    (bounds, kind): (&Bounds<'_>, BoundsKind),
    places: Range<usize>,
    source: impl Fn(usize) -> Origin + Sync,
    records: &Mapped<'_>,
) -> Result<()> {
    let parts = places.clone().step_by(PART * GROUP);
    let threads = threads_for(places.len());
    let threads = if shares_cores { threads.div_ceil(2) } else { threads };
    on_parts(threads, parts, |first: usize, batch| {
        let part = first..places.end.min(first + PART * GROUP);
        let mut view = records.range(bytes_of(&part, places.start, kind))?;
        let mut rest = view.slice(..);
        for first in part.clone().step_by(GROUP) {
            let sources = (first..part.end.min(first + GROUP)).map(&source);
            rest = batch.pack((bounds, kind), sources, rest, (Boxes::None, 0), |_| ());
        }
        Ok(())
    })
}

/// Where the records of `places` lie in a buffer that begins with that of place `first`.
fn bytes_of(places: &Range<usize>, first: usize, kind: BoundsKind) -> Range<u64> {
    let at = |place: usize| (place - first) as u64 * kind.record_bytes();
    at(places.start)..at(places.end)
}

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
    /// A word per group, with a bit for each absent member; empty if none is absent.
    absent: Vec<u64>,
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
    /// Groups of `count` instances, which [`Groups::pack`] fills.
    /// `absent` has a word per group, with a bit for each absent member, or no word at all.
    pub(crate) fn new(count: usize, absent: Vec<u64>) -> Result<Self> {
        let mut groups = memory::list(count.div_ceil(GROUP), "groups")?;
        groups.resize_with(count.div_ceil(GROUP), Group::new);
        Ok(Self { count, groups, absent })
    }

    /// Forms the groups `range`, and writes the records of their members to `records` in stored
    /// order.
    /// `source` says which instance is stored at a place of the piece.
    pub(crate) fn pack(
        &mut self,
        (bounds, kind): (&Bounds<'_>, BoundsKind),
        range: Range<usize>,
        source: impl Fn(usize) -> Origin + Sync,
        records: &Mapped<'_>,
    ) -> Result<()> {
        let (count, absent) = (self.count, &self.absent);
        let places = range.start * GROUP..count.min(range.end * GROUP);
        let parts = range.clone().step_by(PART).zip(self.groups[range].chunks_mut(PART));
        let threads = threads_for(places.len());
        on_parts(threads, parts, |(begin, groups): (usize, &mut [Group]), batch| {
            let part = begin * GROUP..places.end.min((begin + groups.len()) * GROUP);
            let mut view = records.range(bytes_of(&part, places.start, kind))?;
            let mut rest = view.slice(..);
            for (g, group) in (begin..).zip(groups) {
                let sources = (g * GROUP..count.min((g + 1) * GROUP)).map(&source);
                let absent = absent.get(g).copied().unwrap_or(0);
                let boxes = (Boxes::Whole, absent);
                rest = batch.pack((bounds, kind), sources, rest, boxes, |told| match told {
                    Around::All(aabb) | Around::One(_, Some(aabb)) => {
                        group.around = group.around.union(&aabb);
                    }
                    Around::One(k, None) => group.invalid |= 1 << k,
                });
            }
            Ok(())
        })
    }

    /// Of a piece whose group boxes are made on the device: the host knows none.
    pub(crate) fn unknown(count: usize) -> Self {
        Self { count, groups: Vec::new(), absent: Vec::new() }
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
        let absent = self.absent.get(group).copied().unwrap_or(0);
        if absent == all_members(self.count, group) {
            return BoxRecord::of_absent_group();
        }
        let record = BoxRecord::valid_or_none(self.aabb(group).map(|aabb| [aabb.min, aabb.max]));
        if absent == 0 { record } else { record.with_absent_member() }
    }

    /// Whether the instance at a place is absent.
    pub(crate) fn is_absent(&self, place: usize) -> bool {
        self.absent.get(place / GROUP).is_some_and(|word| word >> (place % GROUP) & 1 == 1)
    }

    /// How many instances are absent.
    pub(crate) fn num_absent(&self) -> u64 {
        self.absent.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Bytes on the host.
    pub(crate) fn host_bytes(&self) -> u64 {
        let boxes = self.groups.iter().map(|g| g.boxes.capacity()).sum::<usize>();
        let groups = self.groups.capacity() * size_of::<Group>();
        let absent = self.absent.capacity() * size_of::<u64>();
        (groups + absent + boxes * size_of::<Aabb>()) as u64
    }

    /// Takes new bounds for the instances at `places`, which ascend without repetition.
    /// The bounds of `places[k]` are at `source(places[k])`.
    /// Writes their records to `records`, one after the other.
    /// Returns the groups that contain these places, ascending.
    pub(crate) fn replace(
        &mut self,
        (bounds, kind): (&Bounds<'_>, BoundsKind),
        places: &[u32],
        source: impl Fn(usize) -> Origin + Sync,
        records: &Mapped<'_>,
    ) -> Result<Vec<u32>> {
        let group_of = |place: u32| place as usize / GROUP;
        let record_bytes = kind.record_bytes();
        let (count, all_absent) = (self.count, &self.absent);
        // Parts of whole groups: positions in `places`, the first group, and the groups.
        let mut parts = memory::list(places.len().div_ceil(PART * GROUP) + 1, "update")?;
        let (mut rest, mut begin, mut first_group) = (&mut self.groups[..], 0, 0);
        while begin < places.len() {
            let last = (begin + PART * GROUP).min(places.len()) - 1;
            let end_group = group_of(places[last]) + 1;
            let end = begin + places[begin..].partition_point(|p| group_of(*p) < end_group);
            let (groups, behind) = rest.split_at_mut(end_group - first_group);
            parts.push((begin, &places[begin..end], first_group, groups));
            (rest, begin, first_group) = (behind, end, end_group);
        }
        let threads = threads_for(places.len());
        on_parts(threads, parts, |(begin, places, first_group, groups), batch| {
            let end = begin + places.len();
            let bytes = begin as u64 * record_bytes..end as u64 * record_bytes;
            let mut view = records.range(bytes)?;
            let mut rest = view.slice(..);
            for places in places.chunk_by(|a, b| group_of(*a) == group_of(*b)) {
                let group = group_of(places[0]);
                let (mut members, mut invalid, mut boxes) = (0, 0, [Aabb::EMPTY; GROUP]);
                let sources = places.iter().map(|place| source(*place as usize));
                let word = all_absent.get(group).copied().unwrap_or(0);
                let absent = |place: &u32| word >> (*place as usize % GROUP) & 1;
                let absent = (0..).zip(places).fold(0, |all, (k, p)| all | absent(p) << k);
                rest = batch.pack((bounds, kind), sources, rest, (Boxes::Each, absent), |told| {
                    let Around::One(k, aabb) = told else { return };
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
        })?;
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
