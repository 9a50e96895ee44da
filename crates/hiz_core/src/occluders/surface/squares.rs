//! The pixels that are asked about: all of some rows, or the open ones among them.

use crate::occluders::surface::coverage::{Grid, for_each_centre, for_each_met};
use crate::occluders::surface::facets::{Corner, REACH, UNITS};
use crate::occluders::surface::looks::PixelBox;
use crate::occluders::surface::open_pixels::OpenPixels;
use crate::occluders::surface::pixel_bits::PixelBits;

/// One of the pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// In units.
    pub(super) centre: [i32; 2],
    /// Its number in the list of pixels.
    pub(super) number: usize,
}

/// The pixels in some rows of the image.
#[derive(Debug)]
pub(super) struct Squares<'a> {
    grid: Grid,
    kind: Kind<'a>,
}

#[derive(Debug)]
enum Kind<'a> {
    Left {
        left: &'a PixelBits,
    },
    Open {
        open: &'a OpenPixels,
        /// The number of the first open pixel of these rows.
        first: usize,
    },
}

impl<'a> Squares<'a> {
    /// All pixels from the first to the last row, of which some are `left`.
    pub(super) fn left(grid: Grid, left: &'a PixelBits) -> Self {
        Self { grid, kind: Kind::Left { left } }
    }

    /// The open pixels from the first to the last row.
    pub(super) fn open(open: &'a OpenPixels, rows: [i32; 2]) -> Self {
        let grid = grid(open.size().width, rows);
        let first = open.number(0, rows[0]);
        Self { grid, kind: Kind::Open { open, first } }
    }

    /// Half the side of a pixel, and [`REACH`], in units.
    pub(super) const HALF: f64 = (UNITS / 2 + REACH) as f64;

    #[inline]
    fn place(&self, x: i32, y: i32, number: usize) -> Place {
        Place { centre: [self.grid.centre(x), self.grid.centre(y)], number }
    }

    /// Whether any pixel in a box is asked about.
    #[inline]
    pub(super) fn any_of(&self, around: &PixelBox) -> bool {
        let (rows, within) = (around.rows(), self.grid.rows);
        let rows = [rows[0].max(within[0]), rows[1].min(within[1])];
        match self.kind {
            Kind::Left { left } => left.any(around.columns(), rows),
            Kind::Open { open, .. } => open.any(around.columns(), rows),
        }
    }

    /// Whether pixels in a box of units, grown by [`REACH`], are asked about at all.
    #[inline]
    pub(super) fn any(&self, corners: &[Corner]) -> bool {
        let (mut x, mut y) = ([i32::MAX, i32::MIN], [i32::MAX, i32::MIN]);
        for corner in corners {
            x = [x[0].min(corner.x), x[1].max(corner.x)];
            y = [y[0].min(corner.y), y[1].max(corner.y)];
        }
        let (columns, rows) = self.grid.around(x, y);
        match self.kind {
            Kind::Left { left } => left.any(columns, rows),
            Kind::Open { open, .. } => open.any(columns, rows),
        }
    }

    /// The number of a pixel among all of these rows.
    #[inline]
    fn number(&self, x: i32, y: i32) -> usize {
        let line = (y - self.grid.rows[0]) * (self.grid.columns[1] + 1);
        (line + x) as usize
    }

    /// Calls `cover` for the pixels whose centres a triangle covers.
    ///
    /// Pixels are left out where `is_wanted` is false of their numbers.
    #[inline]
    pub(super) fn for_each_covered(
        &self,
        corners: [Corner; 3],
        is_wanted: impl Fn(usize) -> bool,
        mut cover: impl FnMut(Place),
    ) {
        match self.kind {
            Kind::Left { left } => {
                let wanted = |y, columns| left.of_row(y, columns);
                for_each_centre(corners, self.grid, wanted, |x, y| {
                    let number = self.number(x, y);
                    if is_wanted(number) {
                        cover(self.place(x, y, number));
                    }
                });
            }
            Kind::Open { open, first } => {
                let wanted = |y, columns| open.of_row(y, columns).map(|(_, x)| x);
                for_each_centre(corners, self.grid, wanted, |x, y| {
                    let number = open.number(x, y) - first;
                    if is_wanted(number) {
                        cover(self.place(x, y, number));
                    }
                });
            }
        }
    }

    /// Calls `meet` for the pixels that an edge meets, each grown by `reach`.
    #[inline]
    pub(super) fn for_each_met(&self, edge: [Corner; 2], reach: i32, mut meet: impl FnMut(Place)) {
        match self.kind {
            Kind::Left { left } => {
                let wanted = |y, columns| left.of_row(y, columns);
                for_each_met(edge, reach, self.grid, wanted, |x, y| {
                    meet(self.place(x, y, self.number(x, y)));
                });
            }
            Kind::Open { open, first } => {
                let wanted = |y, columns| open.of_row(y, columns).map(|(_, x)| x);
                for_each_met(edge, reach, self.grid, wanted, |x, y| {
                    meet(self.place(x, y, open.number(x, y) - first));
                });
            }
        }
    }
}

/// All pixels of the rows from the first to the last one.
pub(super) fn grid(width: u32, rows: [i32; 2]) -> Grid {
    Grid { log2: UNITS.ilog2(), columns: [0, width.cast_signed() - 1], rows }
}
