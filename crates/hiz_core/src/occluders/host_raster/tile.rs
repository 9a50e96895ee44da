//! A tile of 8x8 pixels: nothing, a few planes with coverage masks, or pixels.
//!
//! A triangle that covers a whole tile, or an edge's side of it, costs one plane and one mask of 64
//! bits, and no pixel is written (Greene 1996; Hasselgren, Andersson and Akenine-Moller 2016).
//! Unlike in the masked method of 2016 no depths are merged: each plane is kept as it is.
//! Where planes would have to be compared pixel by pixel the tile turns into pixels.
//!
//! Every way gives the same numbers: a pixel holds the greatest nearness of the planes that cover
//! its centre.

use crate::occluders::host_raster::lens::{greatest, least};
use crate::occluders::host_raster::planted_fault::{Planted, is_planted};
use crate::occluders::meshlets::LANES;

/// Pixels along a side of a tile; a row of them is one vector.
pub(super) const SIDE: usize = 8;
const _: () = assert!(SIDE == LANES, "a row of a tile is one group of lanes");

/// The most planes of a tile.
pub(super) const MOST_LAYERS: usize = 4;
/// Which pixels of a tile are covered.
///
/// Byte l belongs to column l; its highest bit is the tile's first row.
/// So a loop over the rows shifts each column's byte, and a loop over lanes becomes vectors.
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
    /// A row of the tile.
    ///
    /// Sums in this order are monotone in the column and in the row, rounding included.
    /// So the least and the greatest value of a tile are those of two of its corners, exactly.
    #[inline(always)]
    fn row(&self, row: usize) -> [f32; SIDE] {
        let first = self.nearness + self.slope[1] * row as f32;
        std::array::from_fn(|l| least(self.slope[0] * l as f32 + first, self.nearest))
    }
}

/// A plane where it is the nearest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layer {
    mask: Mask,
    plane: Plane,
    least: f32,
    greatest: f32,
}

/// How the depth of a tile is kept: as so many layers, or as [`PIXELS`].
pub(super) type State = u8;
/// Nothing was drawn.
pub(super) const CLEAR: State = 0;
/// The tile has pixels.
pub(super) const PIXELS: State = State::MAX;

/// A tile with everything that belongs to it.
pub(super) struct Tile<'a> {
    /// No pixel is farther than this: what is behind it everywhere changes nothing.
    pub(super) farthest: &'a mut f32,
    /// No pixel is nearer than this.
    pub(super) nearest: &'a mut f32,
    pub(super) state: &'a mut State,
    /// The band's layers from the tile's first one on: layer k is `k * layer_stride` behind it.
    ///
    /// Most tiles have one layer at most, so the first layers of all tiles lie together.
    pub(super) layers: &'a mut [Layer],
    pub(super) layer_stride: usize,
    /// The band's pixels from the tile's first one on, and how many there are in a row.
    pub(super) pixels: &'a mut [f32],
    pub(super) stride: usize,
    pub(super) fault: Planted,
}

/// One row of a mask: all bits of a lane for a pixel that is covered.
#[inline(always)]
pub(super) fn mask_row(columns: &[u32; SIDE], row: usize) -> [u32; SIDE] {
    columns.map(|bits| 0_u32.wrapping_sub(bits >> (SIDE - 1 - row) & 1))
}

#[inline(always)]
pub(super) fn columns_of(mask: Mask) -> [u32; SIDE] {
    mask.to_le_bytes().map(u32::from)
}

#[inline(always)]
fn row_mut(pixels: &mut [f32], at: usize) -> &mut [f32; SIDE] {
    // The slice has this length.
    let Ok(row) = (&mut pixels[at..at + SIDE]).try_into() else { unreachable!() };
    row
}

impl Tile<'_> {
    /// Draws a plane that covers the whole tile, in front of everything.
    #[inline(always)]
    pub(super) fn replace(&mut self, plane: Plane, (low, high): (f32, f32)) {
        self.layers[0] = Layer { mask: Mask::MAX, plane, least: low, greatest: high };
        (*self.state, *self.farthest, *self.nearest) = (1, low, high);
    }

    #[inline(always)]
    fn layer(&mut self, k: usize) -> &mut Layer {
        &mut self.layers[k * self.layer_stride]
    }

    /// Draws a plane where `mask` is set, as one more layer; false if that would need pixels.
    ///
    /// The tile must not have pixels.
    pub(super) fn add_layer(
        &mut self,
        mut mask: Mask,
        plane: Plane,
        (low, high): (f32, f32),
    ) -> bool {
        let (count, fault) = (usize::from(*self.state), self.fault);
        // First see whether it is possible, then change the layers.
        for k in 0..count {
            let layer = self.layer(k);
            if layer.mask & mask == 0 || low >= layer.greatest {
                continue;
            }
            if high > layer.least {
                return false;
            }
            if !is_planted!(fault, LayersOverlap) {
                mask &= !layer.mask;
            }
        }
        if mask == 0 {
            return true;
        }
        let (mut kept, mut covered, mut farthest) = (0, mask, low);
        for k in 0..count {
            let mut layer = *self.layer(k);
            layer.mask &= !mask;
            if layer.mask != 0 {
                covered |= layer.mask;
                farthest = least(farthest, layer.least);
                *self.layer(kept) = layer;
                kept += 1;
            }
        }
        *self.state = kept as u8;
        if kept == MOST_LAYERS {
            return false;
        }
        *self.layer(kept) = Layer { mask, plane, least: low, greatest: high };
        *self.state += 1;
        *self.nearest = greatest(*self.nearest, high);
        if covered == Mask::MAX {
            *self.farthest = greatest(*self.farthest, farthest);
        }
        true
    }

    /// Turns layers into pixels.
    #[inline(never)]
    pub(super) fn expand(&mut self) {
        for row in 0..SIDE {
            *row_mut(self.pixels, row * self.stride) =
                row_of_layers(*self.state, self.layers, self.layer_stride, row, self.fault);
        }
        *self.state = PIXELS;
    }

    /// Draws a plane into the pixels that `covered` names row by row.
    #[inline(always)]
    pub(super) fn draw_pixels(
        &mut self,
        plane: &Plane,
        mut covered: impl FnMut(usize) -> [u32; SIDE],
    ) {
        if *self.state != PIXELS {
            self.expand();
        }
        let mut farthest = [f32::MAX; SIDE];
        for row in 0..SIDE {
            let (covered, nearness) = (covered(row), plane.row(row));
            let pixels = row_mut(self.pixels, row * self.stride);
            for l in 0..SIDE {
                let drawn = f32::from_bits(nearness[l].to_bits() & covered[l]);
                pixels[l] = greatest(drawn, pixels[l]);
                farthest[l] = least(pixels[l], farthest[l]);
            }
        }
        *self.farthest = least_of(&farthest);
    }

    /// Computes `farthest` again after pixels were written.
    #[inline(never)]
    pub(super) fn renew(&mut self) {
        let mut farthest = [f32::MAX; SIDE];
        for row in 0..SIDE {
            let pixels = row_mut(self.pixels, row * self.stride);
            for l in 0..SIDE {
                farthest[l] = least(pixels[l], farthest[l]);
            }
        }
        *self.farthest = least_of(&farthest);
    }
}

/// The least of a row.
#[inline(always)]
fn least_of(v: &[f32; SIDE]) -> f32 {
    let half: [f32; 4] = std::array::from_fn(|i| least(v[i], v[i + 4]));
    least(least(half[0], half[2]), least(half[1], half[3]))
}

/// Row `row` of a tile whose depth is in layers, not in pixels.
#[inline(always)]
pub(super) fn row_of_layers(
    state: State,
    layers: &[Layer],
    layer_stride: usize,
    row: usize,
    fault: Planted,
) -> [f32; SIDE] {
    match usize::from(state) {
        0 => [0.0; SIDE],
        1 if layers[0].mask == Mask::MAX => {
            // What lies beyond the far plane has no depth.
            let least = if is_planted!(fault, BeyondFar) { f32::MIN } else { 0.0 };
            layers[0].plane.row(row).map(|nearness| greatest(nearness, least))
        }
        count => {
            let mut out = [0.0; SIDE];
            for k in 0..count {
                let layer = &layers[k * layer_stride];
                let covered = mask_row(&columns_of(layer.mask), row);
                let nearness = layer.plane.row(row);
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
