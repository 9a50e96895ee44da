//! How far every ray through a square of the image can get, in float64.
//!
//! This is for vertices that are too uncertain for integers, and for tests; see `search`.
//!
//! A square is covered by sheets of neighbouring cells that leave no gap in it.
//! The proof is in the documentation of the module above.

use crate::occluders::surface::cells::{Cells, FOLD, NO_MATE};
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::square::{Side, Square, farthest, side};

/// The side in pixels of the blocks that are tested as a whole first.
const BLOCK: u32 = 8;

/// A cell that touches the square, as a member of a sheet.
#[derive(Debug, Clone, Copy)]
struct Member {
    cell: u32,
    /// Index of the parent among the members, for union-find; a head is its own parent.
    parent: u32,
    sides: [Side; 3],
    sums: Sums,
}

/// What decides about a sheet, for one member or summed over all of them.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// How often the borders that miss the square wind about it.
    winding: i32,
    /// Whether a border may meet the square, where cells may be missing.
    open: bool,
    /// Whether a fold may meet the square.
    folded: bool,
    /// The farthest depth that the members reach in the square.
    far: f64,
}

/// Searches the open pixels of some rows: every ray through the closed square of one is blocked at
/// this value of `far` or before.
///
/// `best` are the values known for all pixels of the rows.
/// They are left as they are where nothing better can be shown.
/// `refinement` is how often a pixel is quartered where it cannot be shown for the whole pixel.
pub(super) fn search(
    cells: &Cells,
    open: &OpenPixels,
    rows: [i32; 2],
    refinement: u32,
    fault: Planted,
    best: &mut [f64],
) {
    let mut sheets = Sheets::new(cells, fault);
    let touched = sheets.scatter(open, rows, best);
    // The lists of cells by pixel are made in three steps: count, sum up, fill.
    let still =
        |best: &[f64], pixel: u32, cell: u32| cells.nearest[cell as usize] < best[pixel as usize];
    let mut first = vec![0_u32; best.len() + 1];
    for (pixel, cell) in &touched {
        first[*pixel as usize + 1] += u32::from(still(best, *pixel, *cell));
    }
    for i in 1..first.len() {
        first[i] += first[i - 1];
    }
    let mut lists = vec![0; first[best.len()] as usize];
    let mut next = first.clone();
    for (pixel, cell) in &touched {
        if still(best, *pixel, *cell) {
            lists[next[*pixel as usize] as usize] = *cell;
            next[*pixel as usize] += 1;
        }
    }
    drop(touched);
    let width = open.size().width;
    for pixel in open.of_rows(rows) {
        let (column, row) = (pixel % width, pixel / width);
        let place = (pixel - rows[0].cast_unsigned() * width) as usize;
        let list = &lists[first[place] as usize..first[place + 1] as usize];
        if !list.is_empty() {
            best[place] = sheets.blocked(list, pixel_square(column, row), best[place], refinement);
        }
    }
}

/// The state of the search in a part of an image.
struct Sheets<'a> {
    cells: &'a Cells,
    /// By cell: its index in the list of members, valid where `stamps` has the current stamp.
    places: Vec<u32>,
    stamps: Vec<u64>,
    stamp: u64,
    fault: Planted,
}

impl<'a> Sheets<'a> {
    fn new(cells: &'a Cells, fault: Planted) -> Self {
        let count = cells.corners.len();
        Self { cells, places: vec![0; count], stamps: vec![0; count], stamp: 0, fault }
    }

    /// Lowers `best` where a single cell covers an open pixel of some rows.
    ///
    /// Returns the other cells that touch an open pixel, as (place in `best`, cell).
    fn scatter(
        &self,
        open: &OpenPixels,
        [first, last]: [i32; 2],
        best: &mut [f64],
    ) -> Vec<(u32, u32)> {
        let (first, end) = (first.cast_unsigned(), last.cast_unsigned() + 1);
        // The nearest cells come first, since they leave little to do for the others.
        let nearest = &self.cells.nearest;
        let mut order: Vec<u32> = (0..nearest.len() as u32).collect();
        order.sort_unstable_by(|a, b| nearest[*a as usize].total_cmp(&nearest[*b as usize]));
        let mut touched = Vec::new();
        for cell in order {
            let columns = self.reach(cell, 0, open.size().width);
            let rows = self.reach(cell, 2, open.size().height);
            let rows = rows.start.max(first)..rows.end.min(end);
            for block_row in (rows.start..rows.end).step_by(BLOCK as usize) {
                for block_column in (columns.start..columns.end).step_by(BLOCK as usize) {
                    let end_row = rows.end.min(block_row + BLOCK);
                    let end_column = columns.end.min(block_column + BLOCK);
                    if !open.any(
                        [block_column, end_column - 1].map(u32::cast_signed),
                        [block_row, end_row - 1].map(u32::cast_signed),
                    ) {
                        continue;
                    }
                    let half = f64::from(BLOCK) / 2.0;
                    let block = Square {
                        x: f64::from(block_column) + half,
                        y: f64::from(block_row) + half,
                        half,
                    };
                    let large = columns.len() > 2 || rows.len() > 2;
                    if large && matches!(self.relation(cell, block).0, Relation::Apart) {
                        continue;
                    }
                    let columns = [block_column, end_column - 1].map(u32::cast_signed);
                    for row in block_row..end_row {
                        for (_, column) in open.of_row(row.cast_signed(), columns) {
                            let column = column.cast_unsigned();
                            let place = (row - first) * open.size().width + column;
                            let known = &mut best[place as usize];
                            if nearest[cell as usize] >= *known {
                                continue;
                            }
                            let square = pixel_square(column, row);
                            match self.relation(cell, square).0 {
                                Relation::Apart => {}
                                Relation::Covers => *known = known.min(self.far(cell, square)),
                                Relation::Touches => touched.push((place, cell)),
                            }
                        }
                    }
                }
            }
        }
        touched
    }

    /// The columns (axis 0) or rows (axis 2) of the image that the bounds of a cell meet.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to the image first"
    )]
    fn reach(&self, cell: u32, axis: usize, side: u32) -> std::ops::Range<u32> {
        let bounds = self.cells.bounds[cell as usize];
        // Pixels are closed: a bound on a border reaches the pixel before it, too.
        let first = (bounds[axis].ceil() - 1.0).clamp(0.0, f64::from(side)) as u32;
        let end = (bounds[axis + 1].floor() + 1.0).clamp(0.0, f64::from(side)) as u32;
        first..end.max(first)
    }

    fn relation(&self, cell: u32, square: Square) -> (Relation, [Side; 3]) {
        let [a, b, c] = self.cells.corners_of(cell);
        let sides = [side(a, b, &square), side(b, c, &square), side(c, a, &square)];
        let relation = if sides.iter().any(|s| s.meets) {
            Relation::Touches
        } else if sides.iter().map(|s| s.crossing).sum::<i32>() != 0 {
            Relation::Covers
        } else {
            Relation::Apart
        };
        (relation, sides)
    }

    fn far(&self, cell: u32, square: Square) -> f64 {
        let half = if is_planted!(self.fault, DepthAtCentre) { 0.0 } else { square.half };
        farthest(self.cells.corners_of(cell), &Square { half, ..square }, self.fault)
    }

    /// The value of `far` at or before which every ray through `square` is blocked.
    ///
    /// It is at most `bound`, which the caller knows to hold.
    fn blocked(&mut self, candidates: &[u32], square: Square, bound: f64, refinement: u32) -> f64 {
        let mut best = bound;
        let mut members: Vec<Member> = Vec::with_capacity(candidates.len());
        for &cell in candidates {
            let bounds = self.cells.bounds[cell as usize];
            let apart = bounds[0] > square.x + square.half
                || bounds[1] < square.x - square.half
                || bounds[2] > square.y + square.half
                || bounds[3] < square.y - square.half;
            if apart || self.cells.nearest[cell as usize] >= best {
                continue;
            }
            match self.relation(cell, square) {
                (Relation::Apart, _) => {}
                (Relation::Covers, _) => best = best.min(self.far(cell, square)),
                (Relation::Touches, sides) => {
                    let parent = members.len() as u32;
                    members.push(Member { cell, parent, sides, sums: Sums::default() });
                }
            }
        }
        self.link(&mut members, square);
        let folds = self.folds(&members);
        let mut covering = vec![false; members.len()];
        best = best.min(nearest_sheet(&members, &mut covering, |s| {
            !s.open && !s.folded && s.winding != 0
        }));
        if !folds.is_empty() {
            for (a, b) in folds {
                unite(&mut members, a, b);
            }
            // Across folds orientations disagree, so only the winding's parity is constant.
            best =
                best.min(nearest_sheet(&members, &mut covering, |s| !s.open && s.winding % 2 != 0));
        }
        let nearest = &self.cells.nearest;
        let hopeful = members
            .iter()
            .zip(&covering)
            .any(|(m, covers)| !covers && nearest[m.cell as usize] < best);
        if refinement == 0 || !hopeful {
            return best;
        }
        let list: Vec<u32> =
            members.iter().map(|m| m.cell).filter(|c| nearest[*c as usize] < best).collect();
        let mut most = f64::NEG_INFINITY;
        for quarter in square.quarters() {
            let far = self.blocked(&list, quarter, best, refinement - 1);
            if far >= best {
                return best;
            }
            most = most.max(far);
        }
        most
    }

    /// Unites members on different sides of a shared edge, if the edge may meet the square.
    ///
    /// Notes borders and folds in their sums.
    fn link(&mut self, members: &mut [Member], square: Square) {
        self.stamp += 1;
        for (i, member) in members.iter().enumerate() {
            self.places[member.cell as usize] = i as u32;
            self.stamps[member.cell as usize] = self.stamp;
        }
        for i in 0..members.len() {
            let Member { cell, sides, .. } = members[i];
            let mut sums = Sums { far: self.far(cell, square), ..Sums::default() };
            for (k, side) in sides.iter().enumerate() {
                let crossing = side.crossing * i32::from(self.cells.signs[cell as usize]);
                if !side.meets {
                    sums.winding += crossing;
                    continue;
                }
                match self.mate(3 * cell + k as u32) {
                    Some((_, true)) => sums.folded = true,
                    Some((other, false)) => unite(members, i as u32, other),
                    None if is_planted!(self.fault, ContoursIgnored) => sums.winding += crossing,
                    None => sums.open = true,
                }
            }
            members[i].sums = sums;
        }
    }

    /// The member across a half-edge, if it is listed, and whether it lies on the same side.
    fn mate(&self, half: u32) -> Option<(u32, bool)> {
        let mate = self.cells.mates[half as usize];
        let other = ((mate & !FOLD) / 3) as usize;
        let fold = mate & FOLD != 0 && !is_planted!(self.fault, FoldsIgnored);
        (mate != NO_MATE && self.stamps[other] == self.stamp).then(|| (self.places[other], fold))
    }

    /// The pairs of members that meet in a fold which may meet the square.
    fn folds(&self, members: &[Member]) -> Vec<(u32, u32)> {
        let mut folds = Vec::new();
        for (i, member) in members.iter().enumerate().filter(|(_, m)| m.sums.folded) {
            for k in 0..3 {
                if let (true, Some((other, true))) =
                    (member.sides[k].meets, self.mate(3 * member.cell + k as u32))
                {
                    folds.push((i as u32, other));
                }
            }
        }
        folds
    }
}

/// Where a cell lies relative to a square.
enum Relation {
    /// The cell certainly misses the square.
    Apart,
    /// The cell certainly covers all of the square.
    Covers,
    /// Neither is certain.
    Touches,
}

fn pixel_square(column: u32, row: u32) -> Square {
    Square { x: f64::from(column) + 0.5, y: f64::from(row) + 0.5, half: 0.5 }
}

fn head(members: &[Member], mut i: u32) -> u32 {
    while members[i as usize].parent != i {
        i = members[i as usize].parent;
    }
    i
}

fn unite(members: &mut [Member], a: u32, b: u32) {
    let (a, b) = (head(members, a), head(members, b));
    // The lower index becomes the head; lists are too short to need ranks.
    members[a.max(b) as usize].parent = a.min(b);
}

/// The least depth among the sheets that cover the square; infinity without one.
///
/// Marks the members of those sheets in `covering`.
fn nearest_sheet(members: &[Member], covering: &mut [bool], covers: impl Fn(&Sums) -> bool) -> f64 {
    let mut total = vec![Sums { far: f64::NEG_INFINITY, ..Sums::default() }; members.len()];
    let heads: Vec<usize> = (0..members.len() as u32).map(|i| head(members, i) as usize).collect();
    for (member, head) in members.iter().zip(&heads) {
        let (own, sum) = (member.sums, &mut total[*head]);
        sum.winding += own.winding;
        sum.open |= own.open;
        sum.folded |= own.folded;
        sum.far = sum.far.max(own.far);
    }
    let mut least = f64::INFINITY;
    for (covering, head) in covering.iter_mut().zip(&heads) {
        if covers(&total[*head]) {
            *covering = true;
            least = least.min(total[*head].far);
        }
    }
    least
}
