//! A tile of 8x8 pixels: nothing, a few planes with coverage masks, or pixels.
//!
//! A triangle that covers a whole tile, or an edge's side of it, costs one plane and one mask of 64
//! bits, and no pixel is written (Greene 1996; Hasselgren, Andersson and Akenine-Moller 2016).
//! Unlike in the masked method of 2016 no depths are merged: each plane is kept as it is.
//! Where two planes cross, their masks are split pixel by pixel.
//! A tile that more planes share than it has room for turns into pixels, and so does one that small
//! triangles meet.
//!
//! Every way gives the same numbers: a pixel holds the greatest nearness of the planes that cover
//! its centre.

use crate::host::vectors::{Eight, with_eight};
use crate::occluders::host_raster::lanes::{greatest, lanes, least, least_of};
use crate::occluders::host_raster::planted_fault::{Planted, is_planted};
use crate::occluders::meshlets::LANES;

/// Pixels along a side of a tile; a row of them is one vector.
pub(super) const SIDE: usize = 8;
const _: () = assert!(SIDE == LANES, "a row of a tile is one group of lanes");

/// The most planes of a tile.
pub(super) const MOST_LAYERS: usize = 4;
/// Which pixels of a tile are covered.
///
/// Byte y belongs to row y; its lowest bit is the tile's first column.
pub(super) type Mask = u64;

/// A plane of nearness over a tile.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Plane {
    /// At the centre of the tile's first pixel.
    pub(super) nearness: f32,
    /// From pixel to pixel, to the right and downwards.
    pub(super) slope: [f32; 2],
    /// No pixel is nearer.
    pub(super) nearest: f32,
}

impl Plane {
    /// The plane over a tile, of whose triangle `rise` is known.
    #[inline(always)]
    pub(super) fn at(nearness: f32, rise: &Rise) -> Self {
        Self { nearness, slope: rise.slope, nearest: rise.nearest }
    }

    /// A row of the tile.
    ///
    /// Sums in this order are monotone in the column and in the row, rounding included.
    /// So the least and the greatest value of a tile are those of two of its corners, exactly.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> [f32; SIDE] {
        let first = self.nearness + self.slope[1] * row as f32;
        lanes(|l| least(self.slope[0] * l as f32 + first, self.nearest))
    }
}

/// What the planes of a triangle have in common over all tiles.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rise {
    pub(super) slope: [f32; 2],
    pub(super) nearest: f32,
}

/// Where the first of two planes is nearer than the second.
#[inline(never)]
fn nearer(plane: &Plane, other: &Plane) -> Mask {
    with_eight!(eight => {
        let mut is_nearer = 0;
        for row in 0..SIDE {
            let bits = eight.greater(&plane.row(row), &other.row(row));
            is_nearer |= Mask::from(bits) << (SIDE * row);
        }
        is_nearer
    })
}

/// Whether the first of two planes is nearer than the second over all of a tile, or nowhere;
/// `None` where each pixel has to be asked.
///
/// `high` and `other_high` are their greatest values over the tile.
/// docs/occluders.md has the proof that this is what [`nearer`] finds.
#[inline(always)]
pub(super) fn order(
    (plane, high): (&Plane, f32),
    (other, other_high): (&Plane, f32),
    fault: Planted,
) -> Option<bool> {
    /// Twice what the roundings amount to at most, as a share of the terms' sizes.
    const MARGIN: f32 = 8.0 * f32::EPSILON;
    const LAST: f32 = (SIDE - 1) as f32;
    let first = plane.nearness - other.nearness;
    let (mut low, mut top) = (first, first);
    let mut size = plane.nearness.abs() + other.nearness.abs();
    for k in 0..2 {
        let rise = (plane.slope[k] - other.slope[k]) * LAST;
        low += least(rise, 0.0);
        top += greatest(rise, 0.0);
        size += (plane.slope[k].abs() + other.slope[k].abs()) * LAST;
    }
    let margin = size * MARGIN + f32::MIN_POSITIVE;
    if is_planted!(fault, OrderOfOnePixel) {
        return Some(first > 0.0);
    }
    if low > margin && plane.nearest > other_high {
        Some(true)
    } else if top < -margin && other.nearest >= high {
        Some(false)
    } else {
        None
    }
}

/// The layers of a tile, of which its state counts those in use: planes where they are the nearest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layers {
    /// Those of layers that are not in use are 0.
    masks: [Mask; MOST_LAYERS],
    /// Those of layers that are not in use are infinite.
    least: [f32; MOST_LAYERS],
    greatest: [f32; MOST_LAYERS],
    planes: [Plane; MOST_LAYERS],
}

impl Layers {
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.masks = [0; MOST_LAYERS];
        self.least = [f32::INFINITY; MOST_LAYERS];
    }

    #[inline(always)]
    fn put(&mut self, k: usize, mask: Mask, plane: &Plane, (low, high): (f32, f32)) {
        (self.masks[k], self.planes[k]) = (mask, *plane);
        (self.least[k], self.greatest[k]) = (low, high);
    }

    /// Where a plane is nearer than all layers, of `mask`.
    #[inline(never)]
    fn shown(&self, mask: Mask, plane: &Plane, (low, high): (f32, f32), fault: Planted) -> Mask {
        let mut shown = mask;
        for k in 0..MOST_LAYERS {
            if self.masks[k] & shown == 0 || low >= self.greatest[k] {
                continue;
            }
            let hidden = if high > self.least[k] {
                match order((plane, high), (&self.planes[k], self.greatest[k]), fault) {
                    Some(true) => 0,
                    Some(false) => self.masks[k],
                    None => self.masks[k] & !nearer(plane, &self.planes[k]),
                }
            } else {
                self.masks[k]
            };
            if !is_planted!(fault, LayersOverlap) {
                shown &= !hidden;
            }
        }
        shown
    }

    /// Moves layers that still cover something to the front; says how many they are.
    #[inline(never)]
    fn close_ranks(&mut self) -> usize {
        let mut kept = 0;
        for k in 0..MOST_LAYERS {
            let mask = std::mem::take(&mut self.masks[k]);
            let low = std::mem::replace(&mut self.least[k], f32::INFINITY);
            if mask != 0 {
                let (plane, range) = (self.planes[k], (low, self.greatest[k]));
                self.put(kept, mask, &plane, range);
                kept += 1;
            }
        }
        kept
    }
}

/// How the depth of a tile is kept: as so many layers, as [`PIXELS`], or as one plane ([`FULL`]).
pub(super) type State = u32;
/// Nothing was drawn.
pub(super) const CLEAR: State = 0;
/// The tile has pixels.
pub(super) const PIXELS: State = MOST_LAYERS as State + 1;
/// From here on, one plane in front of everything else covers the tile.
/// What is added is the number of its [`Rise`] in the pane.
pub(super) const FULL: State = PIXELS + 1;

/// A tile with everything that belongs to it.
pub(super) struct Tile<'a> {
    /// No pixel is farther than this: what is behind it everywhere changes nothing.
    pub(super) farthest: &'a mut f32,
    /// No pixel is nearer than this.
    pub(super) nearest: &'a mut f32,
    pub(super) state: &'a mut State,
    pub(super) layers: &'a mut Layers,
    pub(super) fault: Planted,
}

/// The pixels of a tile.
pub(super) struct Pixels<'a> {
    /// The pane's pixels from the tile's first one on, and how many there are in a row.
    from_first: &'a mut [f32],
    stride: usize,
}

/// One row of a mask: all bits of a lane for a pixel that is covered.
#[inline(always)]
fn mask_row(mask: Mask, row: usize) -> [u32; SIDE] {
    let bits = (mask >> (SIDE * row)) as u32;
    lanes(|l| if bits & (1 << l) == 0 { 0 } else { u32::MAX })
}

impl Tile<'_> {
    /// Makes the plane of a tile that is [`FULL`] its first layer.
    #[inline(always)]
    pub(super) fn settle(&mut self, plane: Plane) {
        self.layers.clear();
        self.layers.put(0, Mask::MAX, &plane, (*self.farthest, *self.nearest));
        *self.state = 1;
    }

    /// Draws a plane where `mask` is set, as the only layer.
    #[inline(always)]
    pub(super) fn first_layer(&mut self, mask: Mask, plane: &Plane, range: (f32, f32)) {
        self.layers.clear();
        self.layers.put(0, mask, plane, range);
        *self.state = 1;
        *self.nearest = range.1;
    }

    /// Draws a plane where `mask` is set, as one more layer; false if that would need pixels.
    ///
    /// The tile must have layers.
    #[inline(always)]
    pub(super) fn add_layer(&mut self, mask: Mask, plane: &Plane, range: (f32, f32)) -> bool {
        let [a, b, c, d] = self.layers.masks;
        let before = (a | b) | (c | d);
        let count = *self.state as usize;
        // Most often it lies beside the other layers.
        if before & mask != 0 || count >= MOST_LAYERS {
            return self.add_layer_over_others(mask, plane, range);
        }
        self.put(count, mask, plane, range, before | mask);
        true
    }

    /// Draws a plane as layer `count`, where `covered` is what all layers cover.
    #[inline(always)]
    fn put(
        &mut self,
        count: usize,
        mask: Mask,
        plane: &Plane,
        (low, high): (f32, f32),
        covered: Mask,
    ) {
        // Before the next one is written: a wider read would wait for it.
        let [a, b, c, d] = self.layers.least;
        self.layers.put(count, mask, plane, (low, high));
        *self.state = count as State + 1;
        *self.nearest = greatest(*self.nearest, high);
        if covered == Mask::MAX {
            let least_of_all = least(least(least(a, b), least(c, d)), low);
            *self.farthest = greatest(*self.farthest, least_of_all);
        }
    }

    #[inline(never)]
    fn add_layer_over_others(
        &mut self,
        mut mask: Mask,
        plane: &Plane,
        (low, high): (f32, f32),
    ) -> bool {
        let Self { layers, fault, .. } = self;
        // Most often all of it shows.
        let is_behind = |k: usize| (layers.masks[k] & mask != 0) & (low < layers.greatest[k]);
        if is_behind(0) | is_behind(1) | is_behind(2) | is_behind(3) {
            mask = layers.shown(mask, plane, (low, high), *fault);
            if mask == 0 {
                return true;
            }
        }
        let mut count = *self.state as usize;
        let before = layers.masks;
        let covered = mask | (before[0] | before[1]) | (before[2] | before[3]);
        let is_lost = |k: usize| (before[k] != 0) & (before[k] & !mask == 0);
        let is_any_lost = is_lost(0) | is_lost(1) | is_lost(2) | is_lost(3);
        for k in 0..MOST_LAYERS {
            layers.masks[k] = before[k] & !mask;
        }
        if is_any_lost {
            count = layers.close_ranks();
        }
        if count >= MOST_LAYERS {
            *self.state = MOST_LAYERS as State;
            return false;
        }
        self.put(count, mask, plane, (low, high), covered);
        true
    }
}

impl<'a> Pixels<'a> {
    /// Those of the tile in this column and row of a pane's `pixels`.
    #[inline(always)]
    pub(super) fn new(pixels: &'a mut [f32], stride: usize, (column, row): (usize, usize)) -> Self {
        Self { from_first: &mut pixels[row * SIDE * stride + column * SIDE..], stride }
    }

    #[inline(always)]
    fn row(&mut self, row: usize) -> &mut [f32; SIDE] {
        let first = row * self.stride;
        // The slice has this length.
        let Ok(row) = (&mut self.from_first[first..first + SIDE]).try_into() else {
            unreachable!()
        };
        row
    }

    /// Writes all of them, row by row.
    #[inline(always)]
    pub(super) fn fill(&mut self, nearness: impl Fn(usize) -> [f32; SIDE]) {
        for row in 0..SIDE {
            *self.row(row) = nearness(row);
        }
    }

    /// Draws a plane into those that `mask` names, which must be some.
    #[inline(always)]
    pub(super) fn draw(&mut self, plane: &Plane, mask: Mask) {
        let first = mask.trailing_zeros() as usize / SIDE;
        let last = (Mask::BITS - 1 - mask.leading_zeros()) as usize / SIDE;
        for row in first..=last {
            let (covered, nearness) = (mask_row(mask, row), plane.row(row));
            let pixels = self.row(row);
            for l in 0..SIDE {
                let drawn = f32::from_bits(nearness[l].to_bits() & covered[l]);
                pixels[l] = greatest(drawn, pixels[l]);
            }
        }
    }

    /// The farthest of them, if they were no farther than `before`.
    ///
    /// `witness` is a guess which one that is: while it is as far as before, none else is asked.
    #[inline(always)]
    pub(super) fn farthest(&mut self, before: f32, witness: &mut u8) -> f32 {
        let (row, column) = (usize::from(*witness) / SIDE % SIDE, usize::from(*witness) % SIDE);
        if self.row(row)[column] <= before {
            return before;
        }
        self.farthest_of_all(witness)
    }

    /// The farthest of them, and which one it is.
    #[inline(never)]
    fn farthest_of_all(&mut self, witness: &mut u8) -> f32 {
        with_eight!(eight => {
            let mut farthest = [f32::MAX; SIDE];
            for row in 0..SIDE {
                let pixels = self.row(row);
                farthest = lanes(|l| least(pixels[l], farthest[l]));
            }
            let farthest_of_all = least_of(&farthest);
            let here = eight.at_least(&[farthest_of_all; SIDE], &farthest);
            let column = here.trailing_zeros() as usize % SIDE;
            let row = (0..SIDE - 1).find(|row| self.row(*row)[column] <= farthest_of_all);
            *witness = (row.unwrap_or(SIDE - 1) * SIDE + column) as u8;
            farthest_of_all
        })
    }
}

/// Whether layers cover all of a tile.
#[cfg(feature = "methods")]
pub(super) fn is_covered(state: State, layers: &Layers) -> bool {
    let used = &layers.masks[..(state as usize).min(MOST_LAYERS)];
    used.iter().fold(0, |covered, mask| covered | mask) == Mask::MAX
}

/// Row `row` of a tile whose depth is in layers, not in pixels.
#[inline(always)]
pub(super) fn row_of_layers(
    state: State,
    layers: &Layers,
    row: usize,
    fault: Planted,
) -> [f32; SIDE] {
    match state as usize {
        0 => [0.0; SIDE],
        1 if layers.masks[0] == Mask::MAX => {
            // What lies beyond the far plane has no depth.
            let least = if is_planted!(fault, BeyondFar) { f32::MIN } else { 0.0 };
            let nearness = layers.planes[0].row(row);
            lanes(|l| greatest(nearness[l], least))
        }
        count => {
            let mut out = [0.0; SIDE];
            for k in 0..count.min(MOST_LAYERS) {
                let covered = mask_row(layers.masks[k], row);
                let nearness = layers.planes[k].row(row);
                for l in 0..SIDE {
                    // The layers' masks have no pixel in common.
                    let drawn = f32::from_bits(nearness[l].to_bits() & covered[l]);
                    out[l] = greatest(out[l], drawn);
                }
            }
            out
        }
    }
}
