//! In which order the instances of a piece are stored.

use std::ops::Range;

use crate::error::Result;
use crate::host::memory;
use crate::input::bounds::Bounds;
use crate::instances::morton;

/// In which order instances are stored.
/// The indices that come out are the caller's in either.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum StoredOrder {
    /// Neighbours in space together (Morton order), sorted once when they are uploaded.
    #[default]
    Morton,
    /// As they came: no sort, and 8 bytes an instance less on the host.
    /// For what is in such an order already.
    Given,
}

/// Which instance of a piece is stored where; nothing of it where the order is the caller's.
#[derive(Debug, Default)]
pub(crate) struct PieceOrder {
    indices: Vec<u32>,
    places: Vec<u32>,
}

impl PieceOrder {
    pub(super) fn new(
        bounds: &Bounds<'_>,
        range: Range<usize>,
        order: StoredOrder,
    ) -> Result<Self> {
        if order == StoredOrder::Given {
            return Ok(Self::default());
        }
        let indices = morton::order(bounds, range)?;
        let mut places = memory::list(indices.len(), "order")?;
        places.resize(indices.len(), 0);
        for (place, index) in indices.iter().enumerate() {
            places[*index as usize] = place as u32;
        }
        Ok(Self { indices, places })
    }

    pub(crate) fn is_given(&self) -> bool {
        self.indices.is_empty()
    }

    /// Which instance is stored at `place`, relative to the piece's first.
    pub(crate) fn index(&self, place: usize) -> usize {
        self.indices.get(place).map_or(place, |index| *index as usize)
    }

    /// Where the instance `index`, relative to the piece's first, is stored.
    pub(crate) fn place(&self, index: usize) -> usize {
        self.places.get(index).map_or(index, |place| *place as usize)
    }

    /// Where the instances `range` are stored, ascending.
    pub(crate) fn places(&self, range: Range<usize>) -> Result<Vec<u32>> {
        if self.is_given() {
            return memory::collected(range.start as u32..range.end as u32, "update");
        }
        let mut places = memory::list(range.len(), "update")?;
        if range.len() > self.indices.len() / 16 {
            // A look at every place is cheaper than a sort.
            let here = |(place, index): (usize, &u32)| {
                range.contains(&(*index as usize)).then_some(place as u32)
            };
            places.extend(self.indices.iter().enumerate().filter_map(here));
        } else {
            places.extend_from_slice(&self.places[range]);
            places.sort_unstable();
        }
        Ok(places)
    }

    pub(super) fn host_bytes(&self) -> u64 {
        4 * (self.indices.capacity() + self.places.capacity()) as u64
    }
}
