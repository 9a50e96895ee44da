//! Which pixels a triangle or an edge of the rounded image meets, in exact integers.
//!
//! Coordinates are below 2^30 units in size, so every product of two differences fits 62 bits.

use crate::occluders::surface::facets::{Corner, REACH, UNITS};

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
    #[inline(always)]
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
    #[inline(always)]
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
#[inline(always)]
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
    #[inline(always)]
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
    #[inline(always)]
    pub(super) fn at(&self, x: i32, y: i32) -> [i64; 3] {
        std::array::from_fn(|k| {
            self.right[k] * (i64::from(x) - i64::from(self.on[k].x))
                + self.down[k] * (i64::from(y) - i64::from(self.on[k].y))
                - self.bias[k]
        })
    }

    /// Whether the triangle covers the point that is so many steps right of one with these values.
    #[inline(always)]
    fn covers(&self, values: [i64; 3], steps: i64) -> bool {
        let [a, b, c] = std::array::from_fn(|k| values[k] + steps * self.right[k]);
        (a | b | c) >= 0
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
    #[inline(always)]
    pub(super) fn new(corners: &[[i32; 2]; 3], point: [i32; 2]) -> Self {
        let [x, y] = point.map(i64::from);
        let [a, b, c] = corners;
        let x = [i64::from(a[0]) - x, i64::from(b[0]) - x, i64::from(c[0]) - x];
        let y = [i64::from(a[1]) - y, i64::from(b[1]) - y, i64::from(c[1]) - y];
        // Twice the areas of the point and a side.
        let mut value = [0; 3];
        for k in 0..3 {
            let next = (k + 1) % 3;
            value[k] = x[k] * y[next] - y[k] * x[next];
        }
        let sense = if value[0] + value[1] + value[2] < 0 { -1_i64 } else { 1 };
        let (mut right, mut down) = ([0; 3], [0; 3]);
        for k in 0..3 {
            let next = (k + 1) % 3;
            right[k] = sense * (y[k] - y[next]);
            down[k] = sense * (x[next] - x[k]);
            let bias = i64::from(!(right[k] > 0 || (right[k] == 0 && down[k] > 0)));
            value[k] = sense * value[k] - bias;
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
    /// Then whether the triangle covers the squares around them, where `half` is half a side: it
    /// covers the point, and no side of it meets the square.
    #[inline]
    pub(super) fn around(&self, units: i32, half: i32) -> ([i32; 4], [bool; 4]) {
        let [units, half] = [units, half].map(i64::from);
        let (mut outside, mut beside) = ([0; 4], [0; 4]);
        for k in 0..3 {
            let (value, right, down) = (self.value[k], units * self.right[k], units * self.down[k]);
            let most = (self.right[k].abs() + self.down[k].abs()) * half;
            for (i, [x, y]) in QUARTERS.into_iter().enumerate() {
                let at = value + i64::from(x) * right + i64::from(y) * down;
                outside[i] |= at;
                beside[i] |= at - most - 1;
            }
        }
        (outside.map(|outside| if outside >= 0 { self.sense } else { 0 }), beside.map(|v| v >= 0))
    }
}

/// Where the quarters of a square are from its centre.
pub(super) const QUARTERS: [[i32; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];

/// Calls `cover` for the squares whose centres a triangle covers.
///
/// `wanted` says of which columns of a row, from a first to a last one, squares are wanted at all.
#[inline]
pub(super) fn for_each_centre<Columns: Iterator<Item = i32>>(
    corners: [Corner; 3],
    grid: Grid,
    wanted: impl Fn(i32, [i32; 2]) -> Columns,
    mut cover: impl FnMut(i32, i32),
) {
    let [p, q, r] = corners;
    let columns = grid.centres(p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x), grid.columns);
    let rows = grid.centres(p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y), grid.rows);
    if columns[0] > columns[1] || rows[0] > rows[1] {
        return;
    }
    let functions = EdgeFunctions::new(corners);
    // Divided by the side of a square: floors keep the sign, and all values in a row or column
    // differ by whole steps.
    let mut value =
        functions.at(grid.centre(columns[0]), grid.centre(rows[0])).map(|v| v >> grid.log2);
    for y in rows[0]..=rows[1] {
        for x in wanted(y, columns) {
            if functions.covers(value, i64::from(x - columns[0])) {
                cover(x, y);
            }
        }
        for (value, down) in value.iter_mut().zip(functions.down) {
            *value += down;
        }
    }
}

/// Calls `inside` for runs of squares that a triangle covers as a whole, each grown by `reach`.
///
/// A run is its first and its last column, and its row.
/// A square is covered if no side of the triangle meets it as in [`for_each_met`], and the triangle
/// covers its centre.
/// Without a `reach` the centre is all that counts.
#[inline(always)]
pub(super) fn for_each_run_inside(
    corners: [Corner; 3],
    grid: Grid,
    reach: Option<i32>,
    mut inside: impl FnMut([i32; 2], i32),
) {
    let [p, q, r] = corners;
    let (x, y) = (
        [p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x)],
        [p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y)],
    );
    let columns = grid.centres(x[0], x[1], grid.columns);
    let rows = grid.centres(y[0], y[1], grid.rows);
    // No less than its height and width: most triangles are smaller than a square.
    let least = reach.map_or(0, |reach| grid.side() + 2 * reach);
    let is_small = x[1] - x[0] < least || y[1] - y[0] < least;
    if is_small || columns[0] > columns[1] || rows[0] > rows[1] {
        return;
    }
    let mut functions = EdgeFunctions::new(corners);
    if let Some(reach) = reach {
        let half = i64::from(grid.side() / 2 + reach);
        for k in 0..3 {
            let [right, down] = [functions.right[k].abs(), functions.down[k].abs()];
            functions.bias[k] = (right + down) * half + 1;
        }
    }
    let EdgeFunctions { right, down, .. } = functions;
    // As in `for_each_centre`.
    let mut value =
        functions.at(grid.centre(columns[0]), grid.centre(rows[0])).map(|v| v >> grid.log2);
    for y in rows[0]..=rows[1] {
        let (mut first, mut last) = (0, i64::from(columns[1] - columns[0]));
        for k in 0..3 {
            // The steps to the right after which the function is not negative.
            let (value, step) = (value[k], right[k]);
            match step.signum() {
                1 if value < 0 => first = first.max((-value + step - 1) / step),
                -1 if value >= 0 => last = last.min(value / -step),
                0 | -1 if value < 0 => last = -1,
                _ => {}
            }
        }
        if first <= last {
            // Both are within the columns.
            inside([first, last].map(|steps| columns[0] + steps as i32), y);
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
/// `wanted` says of which columns of a row, from a first to a last one, squares are wanted at all.
#[inline]
pub(super) fn for_each_met<Columns: Iterator<Item = i32>>(
    [a, b]: [Corner; 2],
    reach: i32,
    grid: Grid,
    wanted: impl Fn(i32, [i32; 2]) -> Columns,
    mut meet: impl FnMut(i32, i32),
) {
    let columns = grid.met(a.x.min(b.x), a.x.max(b.x), grid.columns);
    let rows = grid.met(a.y.min(b.y), a.y.max(b.y), grid.rows);
    let normal = [i64::from(a.y) - i64::from(b.y), i64::from(b.x) - i64::from(a.x)];
    let most = (normal[0].abs() + normal[1].abs()) * i64::from(grid.side() / 2 + reach);
    let is_long = columns[1] - columns[0] > 4 && normal[0] != 0;
    let slope = if is_long { normal[1] as f64 / -(normal[0] as f64) } else { 0.0 };
    for y in rows[0]..=rows[1] {
        let mut columns = columns;
        if is_long {
            // Where the edge's line is within the row, with room for roundings.
            let at = |units: i32| f64::from(a.x) + f64::from(units - a.y) * slope;
            let top = y << grid.log2;
            let ends = [at(top - 2 * REACH), at(top + grid.side() + 2 * REACH)];
            let (low, high) =
                if ends[0] < ends[1] { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
            let room = f64::from(4 * REACH);
            #[expect(clippy::cast_possible_truncation, reason = "`as` saturates")]
            let square = |units: f64| units as i32 >> grid.log2;
            columns = [square(low - room).max(columns[0]), square(high + room).min(columns[1])];
        }
        if columns[0] > columns[1] {
            continue;
        }
        let row = normal[1] * (i64::from(grid.centre(y)) - i64::from(a.y));
        for x in wanted(y, columns) {
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
        let (mut covered, mut whole) = ([0; 2], 0);
        let (mut agreed, mut asked) = ([0_u32; 2], [0_u32; 2]);
        for _ in 0..20_000 {
            // Many sides run through centres, which are odd multiples of 128.
            let corners = [0; 3].map(|_| [below(12) * 128 - 256, below(12) * 128 - 256]);
            let [a, b, c] = corners.map(|[x, y]| Corner { x, y, far: 0.0 });
            let mut found = [[false; 4]; 4];
            for_each_centre(
                [a, b, c],
                grid,
                |_, [first, last]| first..=last,
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
                        assert_eq!(nearby.around(64, 0).0[k], expected, "{corners:?} {x} {y}");
                    }
                    covered[usize::from(found)] += 1;
                }
            }
            // What no side meets and what is covered at its centre is covered as a whole.
            let mut expected = found;
            for side in [[a, b], [b, c], [c, a]] {
                let all = |_, [first, last]: [i32; 2]| first..=last;
                for_each_met(side, REACH, grid, all, |x, y| {
                    expected[y as usize][x as usize] = false;
                });
            }
            for (y, row) in (0..).zip(expected) {
                for (x, expected) in (0..).zip(row) {
                    let [x, y] = [x, y].map(|place| grid.centre(place));
                    for (k, [dx, dy]) in QUARTERS.into_iter().enumerate() {
                        let sides = Sides::new(&corners, [x - 64 * dx, y - 64 * dy]);
                        let inside = sides.around(64, UNITS / 2 + REACH).1[k];
                        assert!(expected || !inside, "{corners:?} {x} {y}");
                        agreed[usize::from(expected)] += u32::from(inside == expected);
                        asked[usize::from(expected)] += 1;
                    }
                }
            }
            for (reach, expected) in [(Some(REACH), expected), (None, found)] {
                let mut inside = [[false; 4]; 4];
                for_each_run_inside([a, b, c], grid, reach, |[first, last], y| {
                    (first..=last).for_each(|x| inside[y as usize][x as usize] = true);
                });
                assert_eq!(inside, expected, "{corners:?} {reach:?}");
                whole += inside.as_flattened().iter().filter(|inside| **inside).count();
            }
        }
        assert!(asked[1] > 10_000 && agreed[1] > asked[1] / 100 * 99, "{agreed:?} {asked:?}");
        assert!(covered[1] > 10_000 && whole > covered[1], "{covered:?} {whole}");
    }
}
