//! Proves for each pixel which of its slabs cover it: one pass over triangles, one over edges.
//!
//! Pixels that one triangle covers as a whole are decided before that, see `alone`.
//!
//! Slab k of pixel P holds the facets that reach no farther in P than its threshold, see `is_in`.
//! Both passes decide that by the same function of the same stored numbers.
//!
//! 1. The facets that cover the centre of P add to the winding numbers of their sums.
//!    A centre on an edge counts by the top-left rule: it is moved by an infinitesimal step, the
//!    same for all facets.
//! 2. Each edge that meets P grown by [`REACH`] either cancels or leaves its sums open.
//!
//! Where a sum is not open and its winding number is not 0, its facets cover P.
//! A facet that meets P covers the centre or has an edge that meets P, so it was seen in a pass.
//! The farthest of those is the depth of P.
//!
//! Exact edges are nearer than [`REACH`] to rounded ones.
//! So as the vertices move from their rounded to their exact places, no edge that remains crosses
//! P, and the winding number stays.
//!
//! [`REACH`]: crate::occluders::surface::facets::REACH

use std::cmp::Reverse;

use crate::host::threads::{cores, on_threads, worth_it};
use crate::host::vectors::widest;
use crate::input::image::ImageSize;
use crate::occluders::surface::alone::Alone;
use crate::occluders::surface::chains::{AtEdge, Mask, Steps, Tally};
use crate::occluders::surface::coverage::area;
use crate::occluders::surface::facets::{Corner, Facet, reach};
use crate::occluders::surface::hulls::Hulls;
use crate::occluders::surface::looks::{PixelBox, TILE, Tiles};
use crate::occluders::surface::pixel_bits::PixelBits;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::squares::{Place, Squares, grid};
use crate::occluders::surface::thresholds::{SLABS, Slabs};
use crate::occluders::surface::walk::{Met, Visitor, Walk};

/// Nanoseconds that the proof takes for a pixel, and for a meshlet.
const PER_PIXEL: u64 = 6;
const PER_LOOK: u64 = 10_000;

/// For every pixel, rows from top to bottom: every ray through its closed square is blocked at this
/// value of `far` or before.
///
/// Infinity where that cannot be shown.
///
/// Leaves the slabs of the pixels that are done empty.
/// The others may have a depth, too: that of one triangle which is beyond the first slab.
pub(super) fn proved(
    walk: &Walk<'_>,
    hulls: Option<&Hulls<'_>>,
    slabs: &mut [Slabs],
    tiles: &Tiles,
    size: ImageSize,
) -> Vec<f32> {
    let mut depths = vec![f32::INFINITY; slabs.len()];
    let ns = PER_PIXEL * depths.len() as u64 + PER_LOOK * walk.looks.all.len() as u64;
    let part = (band_rows(size) * size.width) as usize;
    let bands = depths.chunks_mut(part).zip(slabs.chunks_mut(part)).zip(bands(size));
    let mut bands: Vec<_> = bands.collect();
    // The last one to be done should be a small one.
    bands.sort_by_cached_key(|(_, rows)| {
        Reverse(walk.looks.all.iter().filter(|look| look.is_in_rows(*rows)).count())
    });
    on_threads(worth_it(ns), bands, |((depths, slabs), rows)| {
        let grid = grid(size.width, rows);
        let fault = walk.placed.fault;
        if let Some(hulls) = hulls {
            hulls.cover(&mut Alone { grid, tiles, depths, fault });
            for (slabs, depth) in slabs.iter_mut().zip(&*depths) {
                if *depth <= slabs.last() {
                    *slabs = Slabs::NONE;
                }
            }
        }
        let left = widest(
            #[inline(always)]
            || {
                let mut alone = Alone { grid, tiles, depths, fault };
                for look in walk.looks.all.iter().filter(|look| look.is_in_rows(rows)) {
                    let here = look.within(
                        #[inline(always)]
                        |around| around.rows()[0] <= rows[1] && around.rows()[1] >= rows[0],
                    );
                    look.for_each_triangle(
                        &walk.placed,
                        here,
                        #[inline(always)]
                        |_, facet, corners| alone.cover(facet, corners),
                    );
                }
                for (slabs, depth) in slabs.iter_mut().zip(&*depths) {
                    if *depth <= slabs.farthest[0] {
                        *slabs = Slabs::NONE;
                    }
                }
                PixelBits::new(size.width, rows[0], slabs, Slabs::is_any)
            },
        );
        let mut band = Band::new(Squares::left(grid, &left), slabs, walk.placed.fault);
        walk.visit(|look| left.any(look.columns, look.rows), &mut band);
        let states = band.states;
        left.for_each(|number| {
            let (found, depth) = (states[number].depth(), &mut depths[number]);
            if found < f32::INFINITY {
                *depth = depth.min(found);
                slabs[number] = Slabs::NONE;
            }
        });
    });
    depths
}

/// The rows of a band: whole rows of tiles, and some bands more than threads.
pub(super) fn band_rows(size: ImageSize) -> u32 {
    size.height.div_ceil(4 * cores() as u32).next_multiple_of(TILE)
}

/// The first and the last row of each band.
pub(super) fn bands(size: ImageSize) -> impl Iterator<Item = [i32; 2]> + Send + use<> {
    let rows = band_rows(size);
    let band = move |first: u32| [first, (first + rows).min(size.height) - 1];
    (0..size.height).step_by(rows as usize).map(move |first| band(first).map(u32::cast_signed))
}

/// What is known of a square.
#[derive(Debug, Clone, Copy)]
struct State {
    tally: Tally,
    /// By slab: the farthest of its facets.
    far: [f32; SLABS],
}

impl State {
    const START: Self = Self { tally: Tally::START, far: [f32::NEG_INFINITY; SLABS] };

    /// The nearest depth of the slabs that cover the square; infinity without one.
    fn depth(&self) -> f32 {
        let mut nearest = f32::INFINITY;
        for (slab, far) in self.far.iter().enumerate() {
            if self.tally.is_covered(slab) && *far < nearest {
                nearest = *far;
            }
        }
        nearest
    }

    /// Counts the facets of `mask` as reaching as far as `far`.
    #[inline(always)]
    fn reaches(&mut self, far: f32, mask: Mask) {
        for (slab, farthest) in self.far.iter_mut().enumerate() {
            let far = if mask >> slab & 1 != 0 { far } else { f32::NEG_INFINITY };
            *farthest = if far > *farthest { far } else { *farthest };
        }
    }
}

/// The proof of the pixels of some rows.
struct Band<'a> {
    squares: Squares<'a>,
    /// By pixel.
    slabs: &'a [Slabs],
    states: Vec<State>,
    /// Half the side of a pixel, and `REACH`, in units.
    half: f64,
    fault: Planted,
    /// Of the facets at an edge where more than two meet.
    around: Vec<AtEdge>,
}

impl<'a> Band<'a> {
    fn new(squares: Squares<'a>, slabs: &'a [Slabs], fault: Planted) -> Self {
        let half = if is_planted!(fault, PlaneWithoutReach) { 0.0 } else { Squares::HALF };
        let states = vec![State::START; slabs.len()];
        Self { squares, slabs, states, half, fault, around: Vec::new() }
    }
}

impl Visitor for Band<'_> {
    #[inline]
    fn asks(&self, around: &PixelBox) -> bool {
        self.squares.any_of(around)
    }

    #[inline]
    fn wants(&self, ends: &[Corner; 2]) -> bool {
        self.squares.any(ends)
    }

    /// Adds a triangle to the windings of the pixels whose centres it covers.
    #[inline]
    fn cover(&mut self, met: Met<'_>, corners: [Corner; 3]) {
        let facet = met.facet;
        let own = if area(corners) < 0 { -1 } else { 1 };
        let steps = Steps::of(facet.sign, own);
        let (slabs, states, half, fault) = (self.slabs, &mut self.states, self.half, self.fault);
        let is_wanted = |number: usize| facet.nearest <= f64::from(slabs[number].last());
        self.squares.for_each_covered(corners, is_wanted, |square| {
            let (mask, far) = is_in(facet, &square, half, &slabs[square.number], fault);
            if mask != 0 {
                let state = &mut states[square.number];
                state.tally.cover(steps, mask);
                state.reaches(far, mask);
            }
        });
    }

    /// Notes an edge of one or two facets in the pixels that it meets.
    #[inline]
    fn border(&mut self, ends: [Corner; 2], one: Met<'_>, other: Met<'_>, is_along: bool) {
        let (half, fault) = (self.half, self.fault);
        let (all_slabs, states) = (self.slabs, &mut self.states);
        let float32;
        let [one, other] = if is_planted!(fault, MembershipInFloat32) {
            float32 = [one, other].map(|met| met.facet.in_float32());
            float32.each_ref()
        } else {
            [one.facet, other.facet]
        };
        let nearest = one.nearest.min(other.nearest);
        self.squares.for_each_met(ends, reach(fault), |square| {
            let slabs = &all_slabs[square.number];
            if nearest > f64::from(slabs.last()) {
                return;
            }
            let (first, far) = is_in(one, &square, half, slabs, fault);
            let (second, other_far) = is_in(other, &square, half, slabs, fault);
            if first | second == 0 {
                return;
            }
            let state = &mut states[square.number];
            state.reaches(far, first);
            state.reaches(other_far, second);
            state.tally.meet(
                AtEdge { sign: one.sign, is_along: true, mask: first },
                AtEdge { sign: other.sign, is_along, mask: second },
                fault,
            );
        });
    }

    #[cold]
    fn many(&mut self, ends: [Corner; 2], around: &[(Met<'_>, bool)]) {
        let (half, fault) = (self.half, self.fault);
        let (all_slabs, states, at_edge) = (self.slabs, &mut self.states, &mut self.around);
        self.squares.for_each_met(ends, reach(fault), |square| {
            at_edge.clear();
            let (slabs, state) = (&all_slabs[square.number], &mut states[square.number]);
            for (met, is_along) in around {
                let (mask, far) = if is_planted!(fault, MembershipInFloat32) {
                    is_in(&met.facet.in_float32(), &square, half, slabs, fault)
                } else {
                    is_in(met.facet, &square, half, slabs, fault)
                };
                state.reaches(far, mask);
                at_edge.push(AtEdge { sign: met.facet.sign, is_along: *is_along, mask });
            }
            state.tally.meet_many(at_edge, fault);
        });
    }
}

/// The slabs of a square that a facet is in, and how far it reaches there.
///
/// What is not there is in none.
#[inline(always)]
fn is_in(facet: &Facet, square: &Place, half: f64, slabs: &Slabs, fault: Planted) -> (Mask, f32) {
    if !facet.is_there() {
        return (0, f32::NEG_INFINITY);
    }
    let (far, near) = facet.range(square.centre[0], square.centre[1], half);
    // What is rounded up to a float32 is beyond another one where it was before.
    let [first, second] = slabs.farthest.map(|farthest| far <= f64::from(farthest));
    let mask = Mask::from(first) | Mask::from(second && near >= f64::from(slabs.nearest)) << 1;
    if mask == 0 {
        return (0, f32::NEG_INFINITY);
    }
    (mask, Facet::rounded(far, fault))
}
