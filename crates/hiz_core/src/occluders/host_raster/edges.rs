//! What a triangle does from pixel to pixel and from tile to tile: its edges and its depth.

use crate::host::vectors::{Eight, Linear};
use crate::occluders::host_raster::lanes::{lanes, least, three};
use crate::occluders::host_raster::lens::{HALF, UNITS};
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
            // Without branches, which no processor would foretell.
            let is_top_left = (right[k] > 0) | ((right[k] == 0) & (down[k] > 0));
            let is_top_left = is_top_left & !is_planted!(fault, EdgesOfNoSide);
            i32::from(is_top_left | is_planted!(fault, EdgesOfBothSides)) - 1
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

    /// What the functions gain along the columns of a tile.
    #[inline(always)]
    pub(super) fn along(&self) -> [[i32; LANES]; 3] {
        three(|k| lanes(|l| self.right[k] * l as i32))
    }

    /// Which pixels of a tile are inside, given the functions at its first pixel.
    #[inline(always)]
    pub(super) fn mask(&self, eight: impl Eight, steps: &Steps, at: [i32; 3]) -> Mask {
        !eight.rows_with_negative(&Linear { at, along: &steps.along, down: &self.down })
    }
}

/// Beyond this size the sign of an edge's function is the same over [`LANES`] tiles in a row: from
/// pixel to pixel it grows by 2^23 at most.
pub(super) const LARGE: i64 = 1 << 30;

/// What a triangle's functions do within a tile.
pub(super) struct Steps {
    /// What the edges' functions gain and lose at most within a tile.
    pub(super) gain: [i32; 3],
    pub(super) loss: [i32; 3],
    /// What they gain along the columns of a tile, and from tile to tile along a row.
    along: [[i32; LANES]; 3],
    along_tiles: [[i32; LANES]; 3],
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
        let low = |k: usize| corner(k, t.slope[k] < 0.0) * middle;
        let high = |k: usize| corner(k, t.slope[k] >= 0.0);
        Self {
            gain: three(|k| last * (edges.right[k].max(0) + edges.down[k].max(0))),
            loss: three(|k| last * (edges.right[k].min(0) + edges.down[k].min(0))),
            along: edges.along(),
            along_tiles: three(|k| lanes(|l| edges.right[k] * (STEP * l as i32))),
            low: [low(0), low(1)],
            high: [high(0), high(1)],
        }
    }
}

impl Steps {
    /// The edges' functions at the first pixels of [`LANES`] tiles in a row, given those of the
    /// first one.
    ///
    /// Where they are [`LARGE`] their signs are right.
    #[inline(always)]
    pub(super) fn along_tiles(&self, at: &[i64; 3]) -> [[i32; LANES]; 3] {
        three(|k| {
            let first = at[k].clamp(-LARGE, LARGE) as i32;
            lanes(|l| first + self.along_tiles[k][l])
        })
    }
}

/// The depth of a triangle over [`LANES`] tiles in a row.
pub(super) struct Segment {
    /// Nearness at the first pixel of each, and the least and the greatest over each.
    pub(super) nearness: [f32; LANES],
    pub(super) low: [f32; LANES],
    pub(super) high: [f32; LANES],
}

impl Segment {
    /// `x` and `y` are the centre of the first tile's first pixel from corner 0, in pixels.
    #[inline(always)]
    pub(super) fn new(t: &Triangle, steps: &Steps, (x, y): (f32, f32)) -> Self {
        let below = t.slope[1] * y;
        let nearness = lanes(|l| (t.nearness + t.slope[0] * (x + (l * SIDE) as f32)) + below);
        // As in `Plane::row`.
        let over =
            |[right, down]: [f32; 2]| lanes(|l| least(right + (nearness[l] + down), t.nearest));
        Self { nearness, low: over(steps.low), high: over(steps.high) }
    }
}

/// How many tiles a triangle meets and covers in one row of tiles after the other.
///
/// Along a row an edge's function grows by the same number from tile to tile.
/// So the tiles where it is not negative end at a quotient of two integers.
/// From row to row the dividend grows by the same number, too.
/// Its quotient and its remainder are carried along, as for a line (Bresenham 1965): exactly, and
/// with divisions for the first row alone.
pub(super) struct Spans {
    edges: [EdgeSpans; 3],
    /// The first tile that the triangle may meet, and how many in a row.
    begin: i32,
    count: i64,
    fault: Planted,
}

/// Where one edge ends the tiles of a row.
struct EdgeSpans {
    /// The sign of the growth along a row.
    right: i32,
    /// Its size, which divides.
    step: i64,
    /// Of the greatest and of the least value over the row's first tile.
    met: Quotient,
    covered: Quotient,
    /// Of the growth from row to row.
    down: Quotient,
}

#[derive(Clone, Copy)]
struct Quotient {
    whole: i64,
    rest: i64,
}

impl Quotient {
    /// Rounded down, for a dividend below 2^53 in size.
    #[inline(always)]
    fn new(dividend: i64, divisor: i64) -> Self {
        // In float64, because some processors divide 64-bit integers slowly.
        #[expect(clippy::cast_possible_truncation, reason = "rounded towards zero, then corrected")]
        let whole = (dividend as f64 / divisor as f64) as i64;
        let rest = dividend - whole * divisor;
        let over = i64::from(rest >= divisor) - i64::from(rest < 0);
        Self { whole: whole + over, rest: rest - over * divisor }
    }

    #[inline(always)]
    fn add(&mut self, other: Self, divisor: i64, fault: Planted) {
        self.whole += other.whole;
        self.rest += other.rest;
        let is_over = (self.rest >= divisor) & !is_planted!(fault, RemaindersDropped);
        self.whole += i64::from(is_over);
        self.rest -= if is_over { divisor } else { 0 };
    }
}

impl Spans {
    /// `at` are the edges' functions at the first pixel of tile `begin` in the first row.
    #[inline(always)]
    pub(super) fn new(
        at: &[i64; 3],
        edges: &Edges,
        steps: &Steps,
        (begin, end): (i32, i32),
        fault: Planted,
    ) -> Self {
        let edges = three(|k| {
            let step = i64::from((STEP * edges.right[k]).abs().max(1));
            let quotient = |dividend: i64| Quotient::new(dividend, step);
            EdgeSpans {
                right: edges.right[k].signum(),
                step,
                met: quotient(at[k] + i64::from(steps.gain[k])),
                covered: quotient(at[k] + i64::from(steps.loss[k])),
                down: quotient(i64::from(STEP * edges.down[k])),
            }
        });
        Self { edges, begin, count: i64::from(end - begin) + 1, fault }
    }

    /// The tiles of the row that the triangle may change, and those that it covers, from the first
    /// one to the one after the last.
    #[inline(always)]
    pub(super) fn row(&self) -> [(i32, i32); 2] {
        [self.tiles(|edge| edge.met), self.tiles(|edge| edge.covered)]
    }

    #[inline(always)]
    fn tiles(&self, of: impl Fn(&EdgeSpans) -> Quotient) -> (i32, i32) {
        let (mut first, mut end) = (0, self.count);
        for edge in &self.edges {
            let quotient = of(edge).whole;
            if edge.right > 0 {
                first = first.max(-quotient);
            } else if edge.right < 0 {
                end = end.min(quotient + 1);
            } else if quotient < 0 {
                end = 0;
            }
        }
        let tile = |from_begin: i64| self.begin + from_begin.clamp(0, self.count) as i32;
        (tile(first), tile(end))
    }

    #[inline(always)]
    pub(super) fn step_down(&mut self) {
        for edge in &mut self.edges {
            edge.met.add(edge.down, edge.step, self.fault);
            edge.covered.add(edge.down, edge.step, self.fault);
        }
    }
}

/// A bit for each of the [`LANES`] tiles from `first` on that lie in a range.
#[inline(always)]
pub(super) fn bits((begin, end): (i32, i32), first: i32) -> u32 {
    let below = |tile: i32| (1_u32 << (tile - first).clamp(0, LANES as i32)) - 1;
    below(end) & !below(begin)
}

#[inline(always)]
pub(super) fn to_pixels(units: i32) -> f32 {
    units as f32 * (1.0 / UNITS as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::host::vectors::Plain;

    /// Numbers that look random (Steele, Lea and Flood 2014).
    struct Numbers(u64);

    impl Numbers {
        fn within(&mut self, most: i32) -> i32 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            (z >> 33) as i32 % (2 * most + 1) - most
        }
    }

    #[test]
    fn tiles_of_a_row_are_met_and_covered_as_the_edges_of_each_say() {
        let mut numbers = Numbers(7);
        let mut met_and_covered = [0; 2];
        for case in 0..2000 {
            // Up to the size of a screen, of the largest image, and along the axes.
            let most = [1 << 18, 1 << 22, 1 << 12][case % 3];
            let mut corner = || numbers.within(most) & if case % 5 == 0 { !0x7FF } else { !0 };
            let mut t = Triangle {
                x: three(|_| 0),
                y: three(|_| 0),
                nearness: 0.5,
                slope: [0.0; 2],
                nearest: 1.0,
            };
            for k in 0..3 {
                (t.x[k], t.y[k]) = (corner(), corner());
            }
            let edges = Edges::new(&t, Planted::default());
            let steps = Steps::new(&t, &edges, Planted::default());
            let (begin, end, top) = (numbers.within(20), 25, numbers.within(20));
            let at = |column: i32, row: i32| edges.at(&t, column * STEP, row * STEP);
            let mut spans =
                Spans::new(&at(begin, top), &edges, &steps, (begin, end), Planted::default());
            for row in top..top + 20 {
                let found = spans.row();
                spans.step_down();
                let mut together = [0; 2];
                for column in begin..=end {
                    let at = at(column, row);
                    let l = (column - begin) as usize % LANES;
                    if l == 0 {
                        let tiles = steps.along_tiles(&at);
                        together = [steps.gain, steps.loss]
                            .map(|spare| !Plain.any_negative(&tiles, &spare));
                    }
                    let all = |spare: &[i32; 3]| (0..3).all(|k| at[k] + i64::from(spare[k]) >= 0);
                    for (i, expected) in
                        [all(&steps.gain), all(&steps.loss)].into_iter().enumerate()
                    {
                        let (first, after) = found[i];
                        assert_eq!(
                            (first..after).contains(&column),
                            expected,
                            "{t:?} {column} {row}"
                        );
                        assert_eq!(together[i] >> l & 1 == 1, expected, "{t:?} {column} {row}");
                        met_and_covered[i] += u32::from(expected);
                    }
                }
            }
        }
        assert!(met_and_covered.iter().all(|count| *count > 1000), "{met_and_covered:?}");
    }
}
