//! Pixels that one triangle covers as a whole.
//!
//! It is a set G of its own: where none of its edges meets the pixel grown by [`REACH`], and it
//! covers the centre, it covers the pixel.
//! This is the proof of `proof` for one triangle, by the same integers and the same planes.
//!
//! Where such a triangle is in the pixel's first slab, nothing is much nearer at the centre.
//! No other set can give the pixel a depth that is much nearer, so no other is tried.
//! A triangle that is much larger than a pixel decides most of its pixels in this way.
//! Where it is beyond that slab, its depth is where the search begins.
//!
//! [`REACH`]: crate::occluders::surface::facets::REACH

use crate::occluders::surface::coverage::{Grid, for_each_run_inside};
use crate::occluders::surface::facets::{Corner, Facet, reach};
use crate::occluders::surface::looks::{TILE, Tiles};
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::squares::Squares;

/// The pixels of some rows, with what single triangles show of them.
pub(super) struct Alone<'a> {
    pub(super) grid: Grid,
    pub(super) tiles: &'a Tiles,
    /// By pixel: the nearest depth that a triangle gives; infinity without one.
    pub(super) depths: &'a mut [f32],
    pub(super) fault: Planted,
}

impl Alone<'_> {
    /// Lowers the depths of the pixels that a triangle of `facet` covers as a whole.
    #[inline(always)]
    pub(super) fn cover(&mut self, facet: &Facet, corners: [Corner; 3]) {
        let Self { grid, tiles, fault, .. } = *self;
        let half = if is_planted!(fault, PlaneWithoutReach) { 0.0 } else { Squares::HALF };
        // The fault asks of the centre alone.
        let grown = if is_planted!(fault, CentreForSquare) { None } else { Some(reach(fault)) };
        for_each_run_inside(
            corners,
            grid,
            grown,
            #[inline(always)]
            |[first, last], y| {
                let line = ((y - grid.rows[0]) * (grid.columns[1] + 1)).cast_unsigned() as usize;
                let mut begin = first;
                while begin <= last {
                    let end = (begin | (TILE.cast_signed() - 1)).min(last);
                    if facet.nearest <= f64::from(tiles.last(begin, y)) {
                        // All eight, since a loop of fixed length becomes vectors.
                        let mut all = [0.0; TILE as usize];
                        for (far, x) in all.iter_mut().zip(begin..) {
                            let most = facet.range(grid.centre(x), grid.centre(y), half).0;
                            *far = Facet::rounded(most, fault);
                        }
                        let run = line + begin as usize..=line + end as usize;
                        for (depth, far) in self.depths[run].iter_mut().zip(all) {
                            *depth = if far < *depth { far } else { *depth };
                        }
                    }
                    begin = end + 1;
                }
            },
        );
    }
}
