//! What a triangle does from pixel to pixel and from tile to tile: its edges and its depth.

use crate::occluders::host_raster::lanes::{lanes, three};
use crate::occluders::host_raster::lens::{HALF, UNITS, greatest, least};
use crate::occluders::host_raster::planted_fault::{Planted, is_planted};
use crate::occluders::host_raster::tile::{Mask, SIDE};
use crate::occluders::host_raster::triangle::Triangle;
use crate::occluders::meshlets::LANES;

/// [`SIDE`] as a number of pixels.
pub(super) const STEP: i32 = SIDE as i32;

/// Exact edges: three linear functions of the pixel that are not negative inside.
///
/// They are the cross products of an edge with the way to a pixel's centre, divided by
/// [`UNITS`] and rounded down: from pixel to pixel they grow by whole numbers.
/// A centre on an edge belongs to the triangle whose top or left edge that is.
pub(super) struct Edges {
    /// Growth from pixel to pixel, to the right and downwards.
    pub(super) right: [i32; 3],
    pub(super) down: [i32; 3],
    pub(super) bias: [i32; 3],
}

impl Edges {
    #[inline(always)]
    pub(super) fn new(t: &Triangle, fault: Planted) -> Self {
        let next = |k: usize| if k == 2 { 0 } else { k + 1 };
        let right = three(|k| t.y[k] - t.y[next(k)]);
        let down = three(|k| t.x[next(k)] - t.x[k]);
        let bias = three(|k| {
            let is_top_left = right[k] > 0 || (right[k] == 0 && down[k] > 0);
            let is_top_left = is_top_left && !is_planted!(fault, EdgesOfNoSide);
            if is_top_left || is_planted!(fault, EdgesOfBothSides) { 0 } else { -1 }
        });
        Self { right, down, bias }
    }

    /// The functions at a pixel, for a triangle of at most [`SMALL`] near it.
    #[inline(always)]
    pub(super) fn at_small(&self, t: &Triangle, column: i32, row: i32) -> [i32; 3] {
        let (x, y) = (column * UNITS + HALF, row * UNITS + HALF);
        three(|k| (self.right[k] * (x - t.x[k]) + self.down[k] * (y - t.y[k]) + self.bias[k]) >> 8)
    }

    #[inline(always)]
    pub(super) fn at(&self, t: &Triangle, column: i32, row: i32) -> [i64; 3] {
        let (x, y) = (column * UNITS + HALF, row * UNITS + HALF);
        three(|k| {
            (i64::from(self.right[k]) * i64::from(x - t.x[k])
                + i64::from(self.down[k]) * i64::from(y - t.y[k])
                + i64::from(self.bias[k]))
                >> 8
        })
    }

    /// The functions along the columns of a tile's first row, given those at its first pixel.
    #[inline(always)]
    pub(super) fn columns(&self, at: [i32; 3]) -> [[i32; LANES]; 3] {
        three(|k| lanes(|l| at[k] + self.right[k] * l as i32))
    }

    /// Which pixels of a tile are inside, given the functions at its first pixel.
    #[inline(never)]
    pub(super) fn mask(&self, at: [i32; 3]) -> Mask {
        let columns = self.columns(at);
        // By column, a bit for each row.
        // Each row has a bit of its own, since of shifts compilers make no vectors here.
        let mut outside = [0_i32; LANES];
        for k in 0..3 {
            // Most edges do not cross the tile.
            if at[k] + (STEP - 1) * (self.right[k].min(0) + self.down[k].min(0)) >= 0 {
                continue;
            }
            let mut edge = columns[k];
            for row in 0..SIDE {
                for l in 0..LANES {
                    outside[l] |= (edge[l] >> 31) & (1 << (SIDE - 1 - row));
                    edge[l] += self.down[k];
                }
            }
        }
        !Mask::from_le_bytes(lanes(|l| outside[l] as u8))
    }

    #[inline(always)]
    pub(super) fn step_down(&self, edges: &mut [[i32; LANES]; 3]) {
        for k in 0..3 {
            for l in 0..LANES {
                edges[k][l] += self.down[k];
            }
        }
    }
}

/// For each column: all bits set if the pixel is inside of three edges.
#[inline(always)]
pub(super) fn inside(edges: &[[i32; LANES]; 3]) -> [u32; LANES] {
    lanes(|l| !((edges[0][l] | edges[1][l] | edges[2][l]) >> 31) as u32)
}

/// Beyond this size the sign of an edge's function is the same over [`LANES`] tiles.
pub(super) const LARGE: i64 = 1 << 30;

/// What a triangle's functions do within a tile and from tile to tile.
pub(super) struct Steps {
    /// Growth of the edges' functions over the next [`LANES`] tiles of a row.
    pub(super) ramp: [[i32; LANES]; 3],
    /// What they gain and lose at most within a tile.
    pub(super) gain: [i32; 3],
    pub(super) loss: [i32; 3],
    /// The nearness at a tile's farthest and at its nearest corner, less that at its first pixel:
    /// along the row, and down the column.
    pub(super) low: [f32; 2],
    pub(super) high: [f32; 2],
}

impl Steps {
    #[inline(always)]
    pub(super) fn new(t: &Triangle, edges: &Edges, fault: Planted) -> Self {
        let last = STEP - 1;
        let middle = if is_planted!(fault, FarthestInTheMiddle) { 0.5 } else { 1.0 };
        let corner = |k: usize, is_last: bool| t.slope[k] * if is_last { last as f32 } else { 0.0 };
        Self {
            ramp: three(|k| lanes(|l| STEP * edges.right[k] * l as i32)),
            gain: three(|k| last * (edges.right[k].max(0) + edges.down[k].max(0))),
            loss: three(|k| last * (edges.right[k].min(0) + edges.down[k].min(0))),
            low: std::array::from_fn(|k| corner(k, t.slope[k] < 0.0) * middle),
            high: std::array::from_fn(|k| corner(k, t.slope[k] >= 0.0)),
        }
    }

    /// The greatest nearness over [`LANES`] tiles; `x` and `y` as for [`Segment::look`].
    #[inline(always)]
    pub(super) fn nearest_of_segment(&self, t: &Triangle, x: f32, y: f32) -> f32 {
        // Rounded sums are monotone, so one of the two ends has the greatest value of all.
        let beyond = if t.slope[0] > 0.0 { ((LANES - 1) * SIDE) as f32 } else { 0.0 };
        let nearness = (t.nearness + t.slope[0] * (x + beyond)) + t.slope[1] * y;
        least(self.high[0] + (nearness + self.high[1]), t.nearest)
    }
}

/// [`LANES`] tiles in a row, and how a triangle meets them.
#[derive(Default)]
pub(super) struct Segment {
    /// The edges' functions at the first pixel of the first one.
    pub(super) at: [i32; 3],
    /// Nearness at the first pixel of each, and the least and the greatest over each.
    pub(super) nearness: [f32; LANES],
    pub(super) low: [f32; LANES],
    pub(super) high: [f32; LANES],
    /// A bit for each tile that the triangle may change, and one for each that it covers.
    pub(super) open: u32,
    pub(super) full: u32,
}

impl Segment {
    /// `first` are the edges' functions at the first pixel, `x` and `y` its centre from corner 0 in
    /// pixels, and `farthest` what is known of the tiles.
    #[inline(never)]
    pub(super) fn look(
        &mut self,
        t: &Triangle,
        steps: &Steps,
        first: &[i64; 3],
        (x, y): (f32, f32),
        farthest: &[f32; LANES],
    ) {
        let at = three(|k| first[k].clamp(-LARGE, LARGE) as i32);
        let (mut most, mut least_of_edges) = ([0; LANES], [0; LANES]);
        for k in 0..3 {
            for l in 0..LANES {
                let value = at[k] + steps.ramp[k][l];
                most[l] |= value + steps.gain[k];
                least_of_edges[l] |= value + steps.loss[k];
            }
        }
        let below = t.slope[1] * y;
        let mut shows = [0; LANES];
        for l in 0..LANES {
            let nearness = (t.nearness + t.slope[0] * (x + (l * SIDE) as f32)) + below;
            self.nearness[l] = nearness;
            // As in `Plane::row`.
            self.low[l] = least(steps.low[0] + (nearness + steps.low[1]), t.nearest);
            let high = least(steps.high[0] + (nearness + steps.high[1]), t.nearest);
            self.high[l] = high;
            shows[l] = if high > farthest[l] { 1 << l } else { 0 };
        }
        (self.at, self.open, self.full) = (at, 0, 0);
        for l in 0..LANES {
            self.open |= (shows[l] & !(most[l] >> 31)) as u32;
            self.full |= ((1 << l) & !(least_of_edges[l] >> 31)) as u32;
        }
    }
}

#[inline(always)]
pub(super) fn to_pixels(units: i32) -> f32 {
    units as f32 * (1.0 / UNITS as f32)
}

/// The tiles of a row that no edge excludes as a whole.
///
/// A tile to spare on each side covers the roundings; exact tests follow.
#[inline(always)]
pub(super) fn span(
    at: &[i64; 3],
    gain: &[i32; 3],
    right: &[i32; 3],
    begin: i32,
    end: i32,
) -> (i32, i32) {
    let (mut first, mut last) = (begin, end);
    let count = (end - begin + 2) as f32;
    // How many tiles from `begin` on; far outside of the row there is nothing to tell apart.
    let tiles = |value: f32, step: f32| greatest(-2.0, least(value / step, count)) as i32;
    for k in 0..3 {
        let value = (at[k] + i64::from(gain[k])) as f32;
        let step = SIDE as f32 * right[k] as f32;
        if right[k] > 0 {
            first = first.max(begin + tiles(-value, step) - 1);
        } else if right[k] < 0 {
            last = last.min(begin + tiles(value, -step) + 1);
        } else if value < 0.0 {
            return (begin, begin - 1);
        }
    }
    (first, last)
}
