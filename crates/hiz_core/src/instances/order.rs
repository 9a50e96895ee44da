//! The order in which the instances of a piece are stored, and the maps between places and indices.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use crate::error::Result;
use crate::host::memory;
use crate::host::threads::{cores, on_threads};
use crate::input::bounds::Bounds;
use crate::instances::morton;

/// The order in which instances are stored.
/// The indices that come out are the caller's in either order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum StoredOrder {
    /// Neighbours in space are stored together (Morton order).
    /// The instances are sorted once, when they are uploaded.
    #[default]
    Morton,
    /// As given: no sort, and 8 bytes less per instance on the host.
    /// Use it for instances that are already in such an order.
    Given,
}

/// Which instance of a piece is stored where.
/// Both maps are empty if the order is the caller's.
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
        let places = inverse(&indices)?;
        Ok(Self { indices, places })
    }

    pub(crate) fn is_given(&self) -> bool {
        self.indices.is_empty()
    }

    /// The index of the instance at each place; empty if the order is the caller's.
    pub(super) fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The index of the instance that is stored at `place`, relative to the piece's first.
    pub(crate) fn index(&self, place: usize) -> usize {
        self.indices.get(place).map_or(place, |index| *index as usize)
    }

    /// The place of the instance `index`, which is relative to the piece's first.
    pub(crate) fn place(&self, index: usize) -> usize {
        self.places.get(index).map_or(index, |place| *place as usize)
    }

    /// The places of the instances `range`, ascending.
    pub(crate) fn places(&self, range: Range<usize>) -> Result<Vec<u32>> {
        if self.is_given() {
            return memory::collected(range.start as u32..range.end as u32, "update");
        }
        let mut places = memory::list(range.len(), "update")?;
        if range.len() > self.indices.len() / 16 {
            // Scanning every place is cheaper than a sort.
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

/// Indices whose places one thread writes at a time.
const WRITTEN_AT_A_TIME: usize = 1 << 16;

/// The place of each index.
///
/// Each index is there once, so no two threads write to the same place of the list.
/// Atomics say so without `unsafe`, and cost nothing here.
fn inverse(indices: &[u32]) -> Result<Vec<u32>> {
    let mut places = memory::list(indices.len(), "order")?;
    places.resize_with(indices.len(), AtomicU32::default);
    let parts = indices.chunks(WRITTEN_AT_A_TIME).enumerate();
    on_threads(parts.len().min(cores()), parts, |(part, indices)| {
        let first = part * WRITTEN_AT_A_TIME;
        for (place, index) in (first..).zip(indices) {
            places[*index as usize].store(place as u32, Ordering::Relaxed);
        }
    });
    // The numbers stay where they are: this takes no memory.
    Ok(places.into_iter().map(AtomicU32::into_inner).collect())
}
