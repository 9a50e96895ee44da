//! The squares of the image that are proved: whole pixels, or parts of open pixels.

use crate::occluders::surface::coverage::{EdgeFunctions, Grid, for_each_centre, for_each_met};
use crate::occluders::surface::facets::{Corner, Facet, REACH, UNITS};
use crate::occluders::surface::looks::Tiles;
use crate::occluders::surface::open_pixels::OpenPixels;

/// One of the squares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// In units.
    pub(super) centre: [i32; 2],
    /// Its number in the list of squares.
    pub(super) number: usize,
}

/// The squares in some rows of the image.
#[derive(Debug)]
pub(super) struct Squares<'a> {
    /// The pixels.
    grid: Grid,
    kind: Kind<'a>,
}

#[derive(Debug)]
enum Kind<'a> {
    Whole(&'a Tiles),
    Parts {
        open: &'a OpenPixels,
        /// A pixel has 4^finer parts.
        finer: u32,
        /// The number of the first open pixel of these rows.
        first: usize,
        /// By open pixel of these rows: what is nearest to the eye in a facet and beyond this is in
        /// no slab of any part.
        last: &'a [f32],
    },
}

impl<'a> Squares<'a> {
    /// All pixels from the first to the last row.
    pub(super) fn pixels(width: u32, rows: [i32; 2], tiles: &'a Tiles) -> Self {
        Self { grid: pixel_grid(width, rows), kind: Kind::Whole(tiles) }
    }

    /// The parts of the open pixels from the first to the last row.
    pub(super) fn parts(open: &'a OpenPixels, rows: [i32; 2], finer: u32, last: &'a [f32]) -> Self {
        let grid = pixel_grid(open.size().width, rows);
        let first = open.number(0, rows[0]);
        Self { grid, kind: Kind::Parts { open, finer, first, last } }
    }

    /// The first and the last row of pixels.
    pub(super) fn rows(&self) -> [i32; 2] {
        self.grid.rows
    }

    /// Half the side of a square, and [`REACH`], in units.
    pub(super) fn half(&self) -> f64 {
        let finer = match self.kind {
            Kind::Whole(_) => 0,
            Kind::Parts { finer, .. } => finer,
        };
        f64::from((UNITS >> finer) / 2 + REACH)
    }

    #[inline]
    fn pixel(&self, x: i32, y: i32) -> Place {
        let line = (y - self.grid.rows[0]) * (self.grid.columns[1] + 1);
        Place { centre: [self.grid.centre(x), self.grid.centre(y)], number: (line + x) as usize }
    }

    /// Calls `cover` for the squares whose centres a triangle of `facet` covers.
    ///
    /// Squares may be left out if they are beyond every threshold.
    #[inline]
    pub(super) fn for_each_covered(
        &self,
        facet: &Facet,
        corners: [Corner; 3],
        mut cover: impl FnMut(Place),
    ) {
        match self.kind {
            Kind::Whole(tiles) => {
                let is_hidden = |x, y| facet.nearest > f64::from(tiles.last(x, y));
                for_each_centre(corners, self.grid, is_hidden, |x, y| cover(self.pixel(x, y)));
            }
            Kind::Parts { open, finer, first, last } => {
                let [a, b, c] = corners;
                let (columns, rows) = self.grid.around(
                    [a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x)],
                    [a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y)],
                );
                let functions = EdgeFunctions::new(corners);
                for y in rows[0]..=rows[1] {
                    for (number, x) in open.of_row(y, columns) {
                        if facet.nearest <= f64::from(last[number - first]) {
                            let parts = Parts::new(self.grid, finer, [x, y], number - first);
                            let [x, y] = [self.grid.centre(x), self.grid.centre(y)];
                            functions.for_each_part(parts.grid, x, y, |x, y| {
                                cover(parts.place(x, y));
                            });
                        }
                    }
                }
            }
        }
    }

    /// Calls `meet` for the squares that an edge meets, each grown by `reach`.
    #[inline]
    pub(super) fn for_each_met(&self, edge: [Corner; 2], reach: i32, mut meet: impl FnMut(Place)) {
        for_each_met(edge, reach, self.grid, |x, y| match self.kind {
            Kind::Whole(_) => meet(self.pixel(x, y)),
            Kind::Parts { open, finer, first, .. } => {
                if open.is_open_at(x, y) {
                    let number = open.number(x, y) - first;
                    let parts = Parts::new(self.grid, finer, [x, y], number);
                    for_each_met(edge, reach, parts.grid, |x, y| meet(parts.place(x, y)));
                }
            }
        });
    }
}

fn pixel_grid(width: u32, rows: [i32; 2]) -> Grid {
    Grid { log2: UNITS.ilog2(), columns: [0, width.cast_signed() - 1], rows }
}

/// The parts of an open pixel.
struct Parts {
    grid: Grid,
    finer: u32,
    /// The number of its first part.
    first: usize,
}

impl Parts {
    #[inline]
    fn new(grid: Grid, finer: u32, [x, y]: [i32; 2], pixel: usize) -> Self {
        Self { grid: grid.parts(finer, x, y), finer, first: pixel << (2 * finer) }
    }

    #[inline]
    fn place(&self, x: i32, y: i32) -> Place {
        let Grid { columns, rows, .. } = self.grid;
        let line = (y - rows[0]) << self.finer;
        Place {
            centre: [self.grid.centre(x), self.grid.centre(y)],
            number: self.first + (line + x - columns[0]) as usize,
        }
    }
}
