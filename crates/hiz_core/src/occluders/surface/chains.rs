//! Four ways to add up the borders of triangles, and what is known of each in a pixel.
//!
//! Let P be a pixel, G a set of triangles, and B a sum of their borders with any signs.
//! No remaining edge of B may meet P, and B may wind w != 0 times about P's centre.
//! Then every point of P is in a triangle of G (see the module above).
//! The signs are chosen so that the edges of usual meshes cancel:
//!
//! | sum | sign of a triangle | cancels where |
//! |---|---|---|
//! | given | +1 | a mesh is oriented, folds included |
//! | fronts | +1 if its corners run counter-clockwise in the image, else 0 | fronts meet fronts |
//! | turned | by its sense of rotation in the image | the image does not fold |
//! | parity | none, since borders are counted modulo 2 | an even number of triangles meet |
//!
//! Each is kept for each slab of depth.

use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::thresholds::SLABS;

/// A set of slabs: bit k is slab k.
pub(super) type Mask = u8;

/// Sums with a winding number of their own; parity has that of the first one modulo 2.
const SUMS: usize = 3;
const LANES: usize = 8;
const MASKS: usize = 1 << SLABS;
const GIVEN: usize = 0;
const FRONTS: usize = 1;
const TURNED: usize = 2;
/// Rows run downwards, so a triangle that is counter-clockwise with y up turns negatively.
const FRONT: i8 = -1;

/// What is known of a pixel's sums.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    /// Lane `SLABS * sum + slab`: how often the sum winds about the centre, modulo 256.
    windings: [i8; LANES],
    /// The same bits, then those of the parities: an edge that remains may meet the pixel.
    open: u8,
}

/// By mask: what a triangle adds to the windings of a pixel.
#[derive(Debug)]
pub(super) struct Steps([[i8; LANES]; MASKS]);

impl Steps {
    /// For a triangle of sense `sign`, of which a part with the sense `own` covers the centre.
    ///
    /// Both are +1 or -1; they differ where rounding turns a part of a polygon round.
    pub(super) fn of(sign: i8, own: i8) -> &'static Self {
        static ALL: [Steps; 4] =
            [Steps::new(-1, -1), Steps::new(-1, 1), Steps::new(1, -1), Steps::new(1, 1)];
        &ALL[usize::from(sign > 0) * 2 + usize::from(own > 0)]
    }

    const fn new(sign: i8, own: i8) -> Self {
        let mut steps = [[0; LANES]; MASKS];
        let mut mask = 0;
        while mask < MASKS {
            let mut slab = 0;
            while slab < SLABS {
                if mask >> slab & 1 != 0 {
                    steps[mask][SLABS * GIVEN + slab] = own;
                    steps[mask][SLABS * FRONTS + slab] = if sign == FRONT { own } else { 0 };
                    steps[mask][SLABS * TURNED + slab] = own * sign;
                }
                slab += 1;
            }
            mask += 1;
        }
        Self(steps)
    }
}

/// A triangle at an edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct AtEdge {
    pub(super) sign: i8,
    /// Whether it runs along the edge in the direction of the first one.
    pub(super) is_along: bool,
    /// The slabs that it is in.
    pub(super) mask: Mask,
}

impl Tally {
    /// A pixel that nothing covers or meets.
    pub(super) const START: Self = Self { windings: [0; LANES], open: 0 };

    /// Adds a triangle that covers the pixel's centre.
    #[inline(always)]
    pub(super) fn cover(&mut self, steps: &Steps, mask: Mask) {
        let step = &steps.0[usize::from(mask) % MASKS];
        for (winding, step) in self.windings.iter_mut().zip(step) {
            *winding = winding.wrapping_add(*step);
        }
    }

    /// Notes an edge that meets the pixel and that two triangles share, or one has alone.
    ///
    /// The mask of a triangle that is not there is 0.
    #[inline(always)]
    pub(super) fn meet(&mut self, a: AtEdge, b: AtEdge, fault: Planted) {
        let front = |t: &AtEdge| if t.sign == FRONT { t.mask } else { 0 };
        let sums = |a: Mask, b: Mask, cancel: bool| if cancel { a ^ b } else { a | b };
        let folds_cancel = is_planted!(fault, FoldsCancel);
        let (given, fronts) =
            (sums(a.mask, b.mask, !b.is_along), sums(front(&a), front(&b), !b.is_along));
        let is_fold = (a.sign == b.sign) == b.is_along;
        let turned = sums(a.mask, b.mask, !is_fold || folds_cancel);
        self.open(given, fronts, turned, a.mask ^ b.mask, fault);
    }

    /// Notes an edge that meets the pixel and at which any number of triangles meet.
    #[cold]
    pub(super) fn meet_many(&mut self, triangles: &[AtEdge], fault: Planted) {
        let mut remain = [0; 4];
        for slab in 0..SLABS {
            let mut sums = [0_i32; 3];
            let mut count = 0;
            for t in triangles.iter().filter(|t| t.mask >> slab & 1 != 0) {
                let along = if t.is_along { 1 } else { -1 };
                sums[GIVEN] += along;
                sums[FRONTS] += if t.sign == FRONT { along } else { 0 };
                sums[TURNED] += along * i32::from(t.sign);
                count ^= 1;
            }
            for (remain, sum) in remain.iter_mut().zip(sums.into_iter().chain([count])) {
                *remain |= Mask::from(sum != 0) << slab;
            }
        }
        let [given, fronts, turned, parity] = remain;
        self.open(given, fronts, turned, parity, fault);
    }

    #[inline(always)]
    fn open(&mut self, given: Mask, fronts: Mask, turned: Mask, parity: Mask, fault: Planted) {
        if is_planted!(fault, BordersIgnored) {
            return;
        }
        self.open |=
            given | fronts << SLABS | turned << (SLABS * TURNED) | parity << (SLABS * SUMS);
    }

    /// Whether the triangles of a slab cover every point of the pixel.
    pub(super) fn is_covered(&self, slab: usize) -> bool {
        let is_closed = |sum: usize| self.open >> (SLABS * sum + slab) & 1 == 0;
        let parity = self.windings[SLABS * GIVEN + slab] & 1 != 0;
        (0..SUMS).any(|sum| is_closed(sum) && self.windings[SLABS * sum + slab] != 0)
            || (is_closed(SUMS) && parity)
    }
}
