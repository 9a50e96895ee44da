//! Groups: 64 instances that are stored one after the other, with a box around all of them. What hides the box hides every member.
//!
//! A box contains the *given* volumes of its members for the exact real numbers, in float64; its record on the device contains the
//! box. A group with a member that is no volume has a record that is none either, so that it is never culled as a whole.
//!
//! An update moves some members and says nothing of the others, and the host keeps no bounds. It keeps a box for each group, and for
//! a group of which a *part* was moved the boxes of the moved members: the new box is the union of those and of the box that
//! held the others from the start. So a group does not grow along the path of a moving member; it is as tight as a new one
//! once all members were moved at least once; and what never moves, or moves as a whole, costs 56 bytes a group.

use std::collections::HashMap;

use crate::bounds::{Bounds, BoxRecord, OrientedBoxRecord};
use crate::error::{Error, Result};
use crate::extent::Extent;
use crate::host;

/// Instances of a group, as many as a `u64` has bits.
pub(crate) const GROUP: usize = 64;

/// From how many instances on a second thread packs; `examples/upload.rs` prints both.
const PARALLEL_FROM: usize = 1 << 13;

/// A group as it was stored.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stored {
    /// Holds every member that no later update has moved.
    around: Extent,
    /// Bit k: member k is no volume, now.
    invalid: u64,
}

/// The members of a group that were moved since it was stored.
#[derive(Debug, Clone)]
struct Moved {
    /// Bit k: member k was moved.
    members: u64,
    /// Their boxes; empty for what is no volume.
    extents: [Extent; GROUP],
}

/// The groups of one piece.
#[derive(Debug)]
pub(crate) struct Groups {
    count: usize,
    stored: Vec<Stored>,
    moved: Vec<Moved>,
    /// Which of `moved` belongs to a group.
    slots: HashMap<usize, usize>,
}

/// One bit for each of the first `n` members.
fn members(n: usize) -> u64 {
    if n == GROUP { u64::MAX } else { (1 << n) - 1 }
}

/// The records of some members of one group, before they are copied to where the device finds them.
struct Packed {
    bytes: [u8; GROUP * LARGEST_RECORD],
    len: usize,
}

const LARGEST_RECORD: usize = size_of::<OrientedBoxRecord>();

impl Packed {
    fn new() -> Self {
        Self { bytes: [0; GROUP * LARGEST_RECORD], len: 0 }
    }

    /// Adds the record of volume `i`; the box around it, if it is one.
    fn push(&mut self, bounds: &Bounds<'_>, i: usize) -> Option<Extent> {
        let end = self.len + bounds.kind().record_bytes() as usize;
        let is_volume = bounds.write_record(i, &mut self.bytes[self.len..end]);
        self.len = end;
        bounds.extent(i).filter(|_| is_volume)
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

impl Groups {
    /// Gives the records of a piece's instances to `write` (an offset, and the bytes that belong there) in their stored order, on
    /// two threads where that pays, and forms their groups. `index` turns a place of the piece into an index of `bounds`.
    pub(crate) fn packed(
        bounds: &Bounds<'_>,
        count: usize,
        index: impl Fn(usize) -> usize + Sync,
        write: impl Fn(u64, &[u8]) -> Result<()> + Sync,
    ) -> Result<Self> {
        let mut stored = host::list(count.div_ceil(GROUP), "groups")?;
        stored.resize(count.div_ceil(GROUP), Stored { around: Extent::EMPTY, invalid: 0 });
        let half = if count < PARALLEL_FROM { 0 } else { stored.len() / 2 };
        let (first, second) = stored.split_at_mut(half);
        let work = |groups: &mut [Stored], begin: usize| -> Result<()> {
            for (g, group) in (begin..).zip(groups) {
                let mut packed = Packed::new();
                for (k, place) in (g * GROUP..count.min((g + 1) * GROUP)).enumerate() {
                    match packed.push(bounds, index(place)) {
                        Some(extent) => group.around = group.around.union(&extent),
                        None => group.invalid |= 1 << k,
                    }
                }
                write((g * GROUP) as u64 * bounds.kind().record_bytes(), packed.bytes())?;
            }
            Ok(())
        };
        std::thread::scope(|scope| {
            let other = (half > 0).then(|| scope.spawn(|| work(first, 0)));
            let result = work(second, half);
            let other =
                other.map_or(Ok(()), |thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
            other.and(result)
        })?;
        Ok(Self { count, stored, moved: Vec::new(), slots: HashMap::new() })
    }

    /// The number of groups.
    pub(crate) fn len(&self) -> usize {
        self.stored.len()
    }

    /// Places of the members that are no volume, ascending.
    pub(crate) fn invalid(&self) -> impl Iterator<Item = usize> {
        self.stored.iter().enumerate().flat_map(|(g, group)| bits(group.invalid).map(move |k| g * GROUP + k))
    }

    /// The box around a group; `None` if a member is no volume.
    pub(crate) fn extent(&self, group: usize) -> Option<Extent> {
        let Stored { around, invalid } = self.stored[group];
        if invalid != 0 {
            return None;
        }
        let Some(moved) = self.slots.get(&group).map(|slot| &self.moved[*slot]) else { return Some(around) };
        let others = if moved.members == self.all(group) { Extent::EMPTY } else { around };
        Some(bits(moved.members).fold(others, |sum, k| sum.union(&moved.extents[k])))
    }

    /// A group's record for the device.
    pub(crate) fn record(&self, group: usize) -> BoxRecord {
        match self.extent(group) {
            Some(extent) => BoxRecord::new(extent.min, extent.max),
            None => BoxRecord::new([f64::NAN; 3], [f64::NAN; 3]),
        }
    }

    /// Bytes on the host.
    pub(crate) fn host_bytes(&self) -> u64 {
        (self.stored.capacity() * size_of::<Stored>()
            + self.moved.capacity() * size_of::<Moved>()
            + self.slots.capacity() * size_of::<(usize, usize)>()) as u64
    }

    fn all(&self, group: usize) -> u64 {
        members((self.count - group * GROUP).min(GROUP))
    }

    /// Takes new bounds for the instances at `places` (ascending, each once), `index(places[k])` of `bounds`, and gives their records,
    /// one after the other, to `write`. The groups that they are in, ascending.
    pub(crate) fn replace(
        &mut self,
        bounds: &Bounds<'_>,
        places: &[u32],
        index: impl Fn(usize) -> usize,
        write: impl Fn(u64, &[u8]) -> Result<()>,
    ) -> Result<Vec<u32>> {
        let parts = || places.chunk_by(|a, b| *a as usize / GROUP == *b as usize / GROUP);
        let mut touched = host::list(parts().count(), "update")?;
        let mut offset = 0;
        for part in parts() {
            let group = part[0] as usize / GROUP;
            touched.push(group as u32);
            let mut packed = Packed::new();
            let (mut members, mut invalid) = (0, 0);
            let mut extents = [Extent::EMPTY; GROUP];
            for place in part {
                let k = *place as usize % GROUP;
                members |= 1 << k;
                match packed.push(bounds, index(*place as usize)) {
                    Some(extent) => extents[k] = extent,
                    None => invalid |= 1 << k,
                }
            }
            write(offset, packed.bytes())?;
            offset += packed.bytes().len() as u64;
            self.stored[group].invalid = self.stored[group].invalid & !members | invalid;
            if members != self.all(group) {
                let moved = self.moved(group)?;
                moved.members |= members;
                for k in bits(members) {
                    moved.extents[k] = extents[k];
                }
            } else {
                // As new. A slot that it has waits for the next part that moves.
                self.stored[group].around = extents.iter().fold(Extent::EMPTY, |sum, e| sum.union(e));
                if let Some(slot) = self.slots.get(&group) {
                    self.moved[*slot].members = 0;
                }
            }
        }
        Ok(touched)
    }

    /// The slot of a group of which a part is moved.
    fn moved(&mut self, group: usize) -> Result<&mut Moved> {
        let slot = match self.slots.get(&group) {
            Some(slot) => *slot,
            None => {
                host::reserve(&mut self.moved, 1, "update")?;
                let no_memory = |_| Error::OutOfMemory("no host memory for one more group (update)".to_owned());
                self.slots.try_reserve(1).map_err(no_memory)?;
                self.slots.insert(group, self.moved.len());
                self.moved.push(Moved { members: 0, extents: [Extent::EMPTY; GROUP] });
                self.moved.len() - 1
            }
        };
        Ok(&mut self.moved[slot])
    }
}

/// The numbers of the bits that are set, ascending.
fn bits(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let k = word.trailing_zeros();
        word &= word.wrapping_sub(1);
        (k < 64).then_some(k as usize)
    })
}
