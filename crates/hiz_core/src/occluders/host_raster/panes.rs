//! How an image is cut into panes, and in which order they are drawn.

use std::ops::Range;

use crate::occluders::host_raster::in_view::Candidate;
use crate::occluders::host_raster::lens::Image;
use crate::occluders::host_raster::pane::{ACROSS, Pane};
use crate::occluders::host_raster::tile::SIDE;

/// Columns and rows of panes.
pub(super) type Grid = [usize; 2];

/// Rows of pixels that one thread writes at a time.
const ROWS_AT_ONCE: usize = 8 * SIDE;

/// The panes of an image, in rows of the same number.
#[derive(Debug)]
pub(super) struct Panes {
    list: Vec<Pane>,
    /// What was asked for, and what there is: small images have fewer.
    wanted: Grid,
    grid: Grid,
    /// The smallest parts that an image is cut into, along each axis.
    parts: Grid,
}

/// A grid for drawing with so many threads.
///
/// Most small triangles of a view of a landscape lie in a few rows, so there are columns, too.
/// More panes even out better, and project more meshlets twice.
pub(super) fn grid_for(image: &Image, threads: usize) -> Grid {
    const PANES_A_THREAD: usize = 3;
    /// Rows of tiles of a pane at least.
    const LEAST_ROWS: usize = 8;
    if threads <= 1 {
        return [1, 1];
    }
    // A power of two, so that it seldom changes from view to view.
    let panes = PANES_A_THREAD * threads.next_power_of_two();
    let most = (parts_of(image)[1] / LEAST_ROWS).max(1);
    // Panes that are wider than the image cost less than those of its shape.
    let rows = (panes + panes / 2).isqrt().min(most);
    [panes.div_ceil(rows), rows]
}

/// How many columns of [`ACROSS`] pixels an image has, and how many rows of tiles.
fn parts_of(image: &Image) -> Grid {
    [(image.width as usize).div_ceil(ACROSS), (image.height as usize).div_ceil(SIDE)]
}

impl Panes {
    /// Cuts an image into about so many columns and rows.
    pub(super) fn new(image: Image, wanted: Grid) -> Self {
        let parts = parts_of(&image);
        let grid = [0, 1].map(|axis: usize| wanted[axis].clamp(1, parts[axis]));
        let edge = |axis: usize, k: usize| parts[axis] * k / grid[axis] * [ACROSS, SIDE][axis];
        let edges = |axis: usize, k: usize| [edge(axis, k) as i32, edge(axis, k + 1) as i32];
        let in_row = |row: usize| {
            (0..grid[0]).map(move |column| Pane::new(image, edges(0, column), edges(1, row)))
        };
        Self { list: (0..grid[1]).flat_map(in_row).collect(), wanted, grid, parts }
    }

    /// Cuts an image that is far everywhere anew, if it should have other columns and rows.
    pub(super) fn cut(&mut self, image: Image, grid: Grid) {
        if grid != self.wanted {
            *self = Self::new(image, grid);
        }
    }

    /// All of them.
    pub(super) fn iter_mut(&mut self) -> impl Iterator<Item = &mut Pane> {
        self.list.iter_mut()
    }

    /// Bytes of all of them.
    #[cfg(feature = "methods")]
    pub(super) fn bytes(&self) -> u64 {
        self.list.iter().map(Pane::bytes).sum()
    }

    /// All of them, those with the most triangles first, as far as the candidates' middles tell.
    ///
    /// So the last ones that threads draw are short.
    pub(super) fn by_work(&mut self, candidates: &[Candidate]) -> Vec<&mut Pane> {
        let mut work = vec![0; self.list.len()];
        for candidate in candidates {
            let extent = &candidate.extent;
            let middle = |(first, last): (i32, i32)| (first + last) as usize / 2;
            let column = self.pane_of(0, middle(extent.columns) / ACROSS);
            let row = self.pane_of(1, middle(extent.rows) / SIDE);
            work[row * self.grid[0] + column] += candidate.groups.1 - candidate.groups.0;
        }
        let mut panes: Vec<_> = self.list.iter_mut().zip(work).collect();
        panes.sort_by_key(|(_, work)| std::cmp::Reverse(*work));
        panes.into_iter().map(|(pane, _)| pane).collect()
    }

    /// The column or row of panes that a part lies in: the inverse of the edges in [`Panes::new`].
    fn pane_of(&self, axis: usize, part: usize) -> usize {
        ((part + 1) * self.grid[axis] - 1) / self.parts[axis]
    }

    /// The panes that some rows lie in, side by side, and which of the rows; a few at a time.
    pub(super) fn in_rows(&self, rows: &Range<u32>) -> impl Iterator<Item = (&[Pane], Range<i32>)> {
        let (begin, end) = (rows.start as i32, rows.end as i32);
        self.list
            .chunks(self.grid[0])
            .flat_map(|panes| {
                let Pane { top, bottom, .. } = panes[0];
                let some = move |first: i32| first..bottom.min(first + ROWS_AT_ONCE as i32);
                (top..bottom).step_by(ROWS_AT_ONCE).map(move |first| (panes, some(first)))
            })
            .map(move |(panes, rows)| (panes, rows.start.max(begin)..rows.end.min(end)))
            .filter(|(_, rows)| !rows.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::image::ImageSize;
    use crate::occluders::host_raster::planted_fault::Planted;

    #[test]
    fn grids_by_hand() {
        let image =
            |width, height| Image::of_size(ImageSize::new(width, height), Planted::default());
        let grid = |width, height, threads| grid_for(&image(width, height), threads);
        assert_eq!(grid(640, 360, 1), [1, 1]);
        assert_eq!(grid(640, 360, 2), [2, 3]);
        assert_eq!(grid(320, 180, 2), [3, 2]);
        assert_eq!(grid(640, 360, 9), [10, 5]);
        assert_eq!(grid(640, 360, 16), [10, 5]);
        assert_eq!(grid(1920, 1080, 16), [6, 8]);
        assert_eq!(grid(1, 1, 2), [6, 1]);
    }

    #[test]
    fn a_part_lies_in_the_pane_between_its_edges() {
        for (width, height) in [(1, 1), (640, 360), (1921, 1079), (70, 4000)] {
            let image = Image::of_size(ImageSize::new(width, height), Planted::default());
            for grid in [[1, 1], [3, 7], [5, 4], [1000, 1000]] {
                let panes = Panes::new(image, grid);
                for row in 0..panes.parts[1] {
                    for column in 0..panes.parts[0] {
                        let index =
                            panes.pane_of(1, row) * panes.grid[0] + panes.pane_of(0, column);
                        let pane = &panes.list[index];
                        let (x, y) = ((column * ACROSS) as i32, (row * SIDE) as i32);
                        assert!((pane.left..pane.right).contains(&x), "{grid:?} {x} {y}");
                        assert!((pane.top..pane.bottom).contains(&y), "{grid:?} {x} {y}");
                    }
                }
            }
        }
    }
}
