//! Which pixels a triangle or an edge of the rounded image meets, in exact integers.
//!
//! Coordinates are below 2^30 units in size, so every product of two differences fits 62 bits.

use crate::occluders::surface::facets::{Corner, REACH, UNITS};

/// Squares that are tested together where a triangle is large.
const RUN: i32 = 8;

/// A part of a grid of squares over the image.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    /// The side of a square is 2 to this power, in units: 8 for pixels.
    pub(super) log2: u32,
    /// The first and the last column and row.
    pub(super) columns: [i32; 2],
    pub(super) rows: [i32; 2],
}

impl Grid {
    /// The side of a square in units.
    #[inline(always)]
    fn side(&self) -> i32 {
        1 << self.log2
    }

    /// The centre of a column or row, in units.
    #[inline]
    pub(super) fn centre(&self, place: i32) -> i32 {
        (place << self.log2) + self.side() / 2
    }

    /// The squares along one axis that meet an interval of units, each grown by [`REACH`].
    ///
    /// `within` are the first and the last that count.
    /// The first of the result is after the last if there are none.
    #[inline(always)]
    fn met(&self, from: i32, to: i32, within: [i32; 2]) -> [i32; 2] {
        let first = (from - self.side() - REACH + self.side() - 1) >> self.log2;
        [first.max(within[0]), ((to + REACH) >> self.log2).min(within[1])]
    }

    /// The squares along one axis whose centres are in an interval of units.
    #[inline]
    fn centres(&self, from: i32, to: i32, within: [i32; 2]) -> [i32; 2] {
        let half = self.side() / 2;
        [((from + half - 1) >> self.log2).max(within[0]), ((to - half) >> self.log2).min(within[1])]
    }

    /// The squares of this grid that a box of units meets, each grown by [`REACH`].
    #[inline]
    pub(super) fn around(&self, x: [i32; 2], y: [i32; 2]) -> ([i32; 2], [i32; 2]) {
        (self.met(x[0], x[1], self.columns), self.met(y[0], y[1], self.rows))
    }
}

/// The pixels along one axis that meet an interval of units, each grown by [`REACH`].
///
/// The first and the last, both within the image; the first is after the last if there are none.
#[inline]
pub(super) fn pixels(from: i32, to: i32, size: i32) -> [i32; 2] {
    let grid = Grid { log2: UNITS.ilog2(), columns: [0, 0], rows: [0, 0] };
    grid.met(from, to, [0, size - 1])
}

/// Twice the area of a triangle; negative if it is counter-clockwise with y up.
#[inline]
pub(super) fn area([a, b, c]: [Corner; 3]) -> i64 {
    i64::from(b.x - a.x) * i64::from(c.y - a.y) - i64::from(b.y - a.y) * i64::from(c.x - a.x)
}

/// The three edge functions of a triangle: none is negative at the points that it covers.
#[derive(Debug, Clone, Copy)]
pub(super) struct EdgeFunctions {
    /// A point of each side, and what its function grows by per unit right and down.
    on: [Corner; 3],
    right: [i64; 3],
    down: [i64; 3],
    /// 1 where a point on the side is outside.
    bias: [i64; 3],
}

impl EdgeFunctions {
    /// By the top-left rule: a point on a side is moved right by an infinitesimal step, and down by
    /// one that is infinitesimal against that, the same for all triangles.
    #[inline]
    pub(super) fn new(corners: [Corner; 3]) -> Self {
        let [p, q, r] = corners;
        let on = if area(corners) < 0 { [p, r, q] } else { corners };
        let (mut right, mut down, mut bias) = ([0_i64; 3], [0_i64; 3], [0_i64; 3]);
        for k in 0..3 {
            let (a, b) = (on[k], on[(k + 1) % 3]);
            right[k] = i64::from(a.y) - i64::from(b.y);
            down[k] = i64::from(b.x) - i64::from(a.x);
            bias[k] = i64::from(!(right[k] > 0 || (right[k] == 0 && down[k] > 0)));
        }
        Self { on, right, down, bias }
    }

    /// The functions at a point.
    #[inline]
    fn at(&self, x: i32, y: i32) -> [i64; 3] {
        std::array::from_fn(|k| {
            self.right[k] * (i64::from(x) - i64::from(self.on[k].x))
                + self.down[k] * (i64::from(y) - i64::from(self.on[k].y))
                - self.bias[k]
        })
    }
}

/// The sides of a triangle about a point, to ask how it winds there and nearby.
///
/// The rule for points on a side is that of [`EdgeFunctions`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    /// None is negative if the triangle covers the point.
    value: [i64; 3],
    /// What they grow by per unit right and down.
    right: [i64; 3],
    down: [i64; 3],
    sense: i32,
}

impl Sides {
    #[inline]
    pub(super) fn new(corners: &[[i32; 2]; 3], point: [i32; 2]) -> Self {
        let c = corners.map(|c| [0, 1].map(|k| i64::from(c[k]) - i64::from(point[k])));
        // Twice the areas of the point and a side.
        let beside = |a: [i64; 2], b: [i64; 2]| a[0] * b[1] - a[1] * b[0];
        let areas = [beside(c[0], c[1]), beside(c[1], c[2]), beside(c[2], c[0])];
        let sense = if areas[0] + areas[1] + areas[2] < 0 { -1_i64 } else { 1 };
        let (mut value, mut right, mut down) = ([0; 3], [0; 3], [0; 3]);
        for k in 0..3 {
            let (a, b) = (c[k], c[(k + 1) % 3]);
            right[k] = sense * (a[1] - b[1]);
            down[k] = sense * (b[0] - a[0]);
            let bias = i64::from(!(right[k] > 0 || (right[k] == 0 && down[k] > 0)));
            value[k] = sense * areas[k] - bias;
        }
        Self { value, right, down, sense: sense as i32 }
    }

    /// How the triangle winds about the point: +1 or -1 by its own sense if it covers it, or 0.
    #[inline]
    pub(super) fn winding(&self) -> i32 {
        let [a, b, c] = self.value;
        if (a | b | c) >= 0 { self.sense } else { 0 }
    }

    /// The same for the points that are so many units left or right and above or below.
    ///
    /// They are in the order of [`QUARTERS`].
    #[inline]
    pub(super) fn windings(&self, units: i32) -> [i32; 4] {
        let units = i64::from(units);
        let (right, down) = (self.right.map(|v| units * v), self.down.map(|v| units * v));
        QUARTERS.map(|[x, y]| {
            let at = |k: usize| self.value[k] + i64::from(x) * right[k] + i64::from(y) * down[k];
            if (at(0) | at(1) | at(2)) >= 0 { self.sense } else { 0 }
        })
    }
}

/// Where the quarters of a square are from its centre.
pub(super) const QUARTERS: [[i32; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];

/// Calls `cover` for the squares whose centres a triangle covers.
///
/// Runs of 8 squares, at multiples of 8, may be left out where `is_hidden` says so of the first.
#[inline]
pub(super) fn for_each_centre(
    corners: [Corner; 3],
    grid: Grid,
    is_hidden: impl Fn(i32, i32) -> bool,
    mut cover: impl FnMut(i32, i32),
) {
    let [p, q, r] = corners;
    let columns = grid.centres(p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x), grid.columns);
    let rows = grid.centres(p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y), grid.rows);
    if columns[0] > columns[1] || rows[0] > rows[1] {
        return;
    }
    let functions = EdgeFunctions::new(corners);
    let EdgeFunctions { right, down, .. } = functions;
    // Divided by the side of a square: floors keep the sign, and all values in a row or column
    // differ by whole steps.
    let mut value =
        functions.at(grid.centre(columns[0]), grid.centre(rows[0])).map(|v| v >> grid.log2);
    let is_large = columns[1] - columns[0] >= 2 * RUN;
    for y in rows[0]..=rows[1] {
        let mut now = value;
        let mut x = columns[0];
        while x <= columns[1] {
            if is_large && x % RUN == 0 && x + RUN - 1 <= columns[1] {
                let misses = |k: usize| now[k].max(now[k] + i64::from(RUN - 1) * right[k]) < 0;
                if (0..3).any(misses) || is_hidden(x, y) {
                    for k in 0..3 {
                        now[k] += i64::from(RUN) * right[k];
                    }
                    x += RUN;
                    continue;
                }
            }
            if (now[0] | now[1] | now[2]) >= 0 {
                cover(x, y);
            }
            for k in 0..3 {
                now[k] += right[k];
            }
            x += 1;
        }
        for k in 0..3 {
            value[k] += down[k];
        }
    }
}

/// Calls `meet` for the squares that an edge meets, each grown by `reach`.
///
/// `reach` is at most [`REACH`].
/// There are three separating axes: x, y and the edge's normal.
/// Squares are left out where `is_wanted` is false.
#[inline]
pub(super) fn for_each_met(
    [a, b]: [Corner; 2],
    reach: i32,
    grid: Grid,
    is_wanted: impl Fn(i32, i32) -> bool,
    mut meet: impl FnMut(i32, i32),
) {
    let columns = grid.met(a.x.min(b.x), a.x.max(b.x), grid.columns);
    let rows = grid.met(a.y.min(b.y), a.y.max(b.y), grid.rows);
    let normal = [i64::from(a.y) - i64::from(b.y), i64::from(b.x) - i64::from(a.x)];
    let most = (normal[0].abs() + normal[1].abs()) * i64::from(grid.side() / 2 + reach);
    for y in rows[0]..=rows[1] {
        let mut columns = columns;
        if columns[1] - columns[0] > 4 && normal[0] != 0 {
            // Where the edge's line is within the row, with room for the rounding of float64.
            let slope = normal[1] as f64 / -(normal[0] as f64);
            let at = |units: i32| f64::from(a.x) + f64::from(units - a.y) * slope;
            let top = y << grid.log2;
            let ends = [at(top - 2 * REACH), at(top + grid.side() + 2 * REACH)];
            let square = |units: f64| (units / f64::from(grid.side())).floor();
            let room = f64::from(4 * REACH);
            let low = square(ends[0].min(ends[1]) - room).max(f64::from(columns[0]));
            let high = square(ends[0].max(ends[1]) + room).min(f64::from(columns[1]));
            if low > high {
                continue;
            }
            #[expect(clippy::cast_possible_truncation, reason = "within the image")]
            let within = [low as i32, high as i32];
            columns = within;
        }
        let row = normal[1] * (i64::from(grid.centre(y)) - i64::from(a.y));
        for x in (columns[0]..=columns[1]).filter(|x| is_wanted(*x, y)) {
            let beside = normal[0] * (i64::from(grid.centre(x)) - i64::from(a.x)) + row;
            if beside.abs() <= most {
                meet(x, y);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_to_cover_a_point_agree() {
        let mut state = 1_u32;
        let mut below = |n: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((state >> 16) % n).cast_signed()
        };
        let grid = Grid { log2: UNITS.ilog2(), columns: [0, 3], rows: [0, 3] };
        let mut covered = [0; 2];
        for _ in 0..20_000 {
            // Many sides run through centres, which are odd multiples of 128.
            let corners = [0; 3].map(|_| [below(12) * 128 - 256, below(12) * 128 - 256]);
            let [a, b, c] = corners.map(|[x, y]| Corner { x, y, far: 0.0 });
            let mut found = [[false; 4]; 4];
            for_each_centre(
                [a, b, c],
                grid,
                |_, _| false,
                |x, y| {
                    found[y as usize][x as usize] = true;
                },
            );
            let sense = if area([a, b, c]) < 0 { -1 } else { 1 };
            for (y, row) in (0..).zip(found) {
                for (x, found) in (0..).zip(row) {
                    let expected = if found { sense } else { 0 };
                    let [x, y] = [x, y].map(|place| grid.centre(place));
                    let sides = Sides::new(&corners, [x, y]);
                    assert_eq!(sides.winding(), expected, "{corners:?} {x} {y}");
                    for (k, [dx, dy]) in QUARTERS.into_iter().enumerate() {
                        let nearby = Sides::new(&corners, [x - 64 * dx, y - 64 * dy]);
                        assert_eq!(nearby.windings(64)[k], expected, "{corners:?} {x} {y}");
                    }
                    covered[usize::from(found)] += 1;
                }
            }
        }
        assert!(covered[1] > 10_000, "{covered:?}");
    }
}
