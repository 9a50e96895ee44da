//! Eight tiles in a row, which a triangle of many tiles is compared with at once.
//!
//! What is known of them lies together, and [`Eight`] makes vectors of the comparisons.

use crate::host::vectors::Eight;
use crate::occluders::host_raster::edges::Segment;
use crate::occluders::host_raster::tile::{Plane, State};
use crate::occluders::meshlets::LANES;

/// What is known of [`LANES`] tiles in a row.
#[derive(Debug, Clone, Default)]
pub(super) struct Tiles {
    /// No pixel is farther than this: what is behind it everywhere changes nothing.
    pub(super) farthest: [f32; LANES],
    /// No pixel is nearer than this.
    pub(super) nearest: [f32; LANES],
    pub(super) states: [State; LANES],
    /// Nearness at the first pixel of a tile that is [`FULL`](super::tile::FULL).
    pub(super) first: [f32; LANES],
}

impl Tiles {
    /// Draws a triangle where it covers whole tiles in front of everything; `state` is that of such
    /// a tile then.
    ///
    /// `met` and `covered` have a bit for each tile.
    /// What comes back are the tiles where it may show and is not drawn yet, as bits; `None` if it
    /// shows nowhere.
    #[inline(always)]
    pub(super) fn replace(
        &mut self,
        eight: impl Eight,
        segment: &Segment,
        met: u32,
        covered: u32,
        state: State,
    ) -> Option<u32> {
        let open = eight.greater(&segment.high, &self.farthest) & met;
        if open == 0 {
            return None;
        }
        let front = eight.at_least(&segment.low, &self.nearest) & open & covered;
        if front != 0 {
            eight.put(front, &segment.low, &mut self.farthest);
            eight.put(front, &segment.high, &mut self.nearest);
            eight.put(front, &segment.nearness, &mut self.first);
            eight.put(front, &[state; LANES], &mut self.states);
        }
        Some(open & !front)
    }

    /// Makes one of them that of a plane in front of everything.
    #[inline(always)]
    pub(super) fn put(&mut self, l: usize, plane: &Plane, (low, high): (f32, f32), state: State) {
        (self.farthest[l], self.nearest[l]) = (low, high);
        (self.first[l], self.states[l]) = (plane.nearness, state);
    }
}
