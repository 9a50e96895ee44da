//! The pyramid that is kept while meshlets are drawn: the farthest depth of every block of pixels.
//!
//! Its finest level holds the tiles of the rasteriser, 8x8 pixels each.
//! A tile that gets nearer is propagated upward until a level does not change.
//! Levels 1 and 2 lie within a tile, which may hold planes in place of pixels.
//! So a test that comes down to a tile reads the tile's pixels, and these levels are formed when
//! the image is finished.

use crate::input::image::{DepthConvention, ImageSize};
use crate::methods::hierarchy::planted_fault::{Planted, is_planted};
use crate::occluders::host_raster::one_by_one::{Extent, OneByOne, TILE_LOG2};

/// One level: nearness, which is 0 on the far plane.
#[derive(Debug, Clone)]
struct Level {
    width: u32,
    height: u32,
    farthest: Vec<f32>,
}

impl Level {
    fn at(&self, column: u32, row: u32) -> usize {
        (row * self.width + column) as usize
    }
}

/// The levels from the tiles to the one of a single texel.
#[derive(Debug, Clone)]
pub(super) struct ZPyramid {
    size: ImageSize,
    levels: Vec<Level>,
    fault: Planted,
}

impl ZPyramid {
    pub(super) fn new(size: ImageSize, fault: Planted) -> Self {
        let mut levels = Vec::new();
        let [mut width, mut height] = [size.width, size.height].map(|s| s.div_ceil(1 << TILE_LOG2));
        loop {
            levels.push(Level { width, height, farthest: vec![0.0; (width * height) as usize] });
            if width * height == 1 {
                return Self { size, levels, fault };
            }
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
        }
    }

    pub(super) fn size(&self) -> ImageSize {
        self.size
    }

    pub(super) fn clear(&mut self) {
        self.levels.iter_mut().for_each(|level| level.farthest.fill(0.0));
    }

    /// Renews the tiles that the last meshlet may have changed.
    pub(super) fn renew(&mut self, image: &OneByOne) {
        let (tiles, nearest) = image.changed();
        for (column, row) in tiles.iter().copied() {
            let index = self.levels[0].at(column, row);
            let before = self.levels[0].farthest[index];
            // What is no nearer than this changes no pixel of the tile.
            if before >= nearest {
                continue;
            }
            let now = self.of_tile(image, column, row);
            if now != before {
                self.levels[0].farthest[index] = now;
                self.propagate(column, row);
            }
        }
    }

    /// The farthest depth of the image's pixels in a tile.
    fn of_tile(&self, image: &OneByOne, column: u32, row: u32) -> f32 {
        let [width, height] = self.pixels_of_tile(column, row);
        let is_whole = width.min(height) == 1 << TILE_LOG2;
        let is_planted = is_planted!(self.fault, TileTooNear);
        let known = image.known_farthest(column, row).filter(|_| is_whole && !is_planted);
        if let Some(farthest) = known {
            return farthest;
        }
        let end = |a: f32, b: f32| if (a < b) != is_planted { a } else { b };
        let mut columns = image.row_of_tile(column, row, 0);
        for y in 1..height {
            let pixels = image.row_of_tile(column, row, y);
            columns = std::array::from_fn(|l| end(columns[l], pixels[l]));
        }
        columns.into_iter().take(width as usize).reduce(end).unwrap_or(0.0)
    }

    /// Columns and rows of a tile that lie in the image.
    fn pixels_of_tile(&self, column: u32, row: u32) -> [u32; 2] {
        let within = |side: u32, tile: u32| (side - (tile << TILE_LOG2)).min(1 << TILE_LOG2);
        [within(self.size.width, column), within(self.size.height, row)]
    }

    /// Tells the coarser levels that a tile has changed, until one of them does not change.
    fn propagate(&mut self, mut column: u32, mut row: u32) {
        let stop = usize::from(is_planted!(self.fault, PropagationStopsEarly));
        for k in 1..self.levels.len() - stop {
            let (fine, coarse) = self.levels.split_at_mut(k);
            let (fine, coarse) = (&fine[k - 1], &mut coarse[0]);
            (column, row) = (column / 2, row / 2);
            let mut farthest = f32::MAX;
            for y in 2 * row..(2 * row + 2).min(fine.height) {
                for x in 2 * column..(2 * column + 2).min(fine.width) {
                    farthest = farthest.min(fine.farthest[fine.at(x, y)]);
                }
            }
            let index = coarse.at(column, row);
            if coarse.farthest[index] == farthest {
                return;
            }
            coarse.farthest[index] = farthest;
        }
    }

    /// Whether nothing within `extent` would show, and how many depths were compared.
    ///
    /// The test begins with the smallest cell that encloses the rectangle.
    /// A cell that cannot tell is replaced by the cells below it that the rectangle meets, down to
    /// the pixels.
    pub(super) fn hides(&self, image: &OneByOne, extent: &Extent) -> (bool, u64) {
        let Extent { columns: (x0, x1), rows: (y0, y1), .. } = *extent;
        // The bits from the highest one in which first and last differ on are those within a cell.
        let differing = ((x0 ^ x1) | (y0 ^ y1)) as u32;
        let level = (u32::BITS - differing.leading_zeros()).max(TILE_LOG2);
        let mut comparisons = 0;
        let start = (level - TILE_LOG2, x0 as u32 >> level, y0 as u32 >> level);
        (self.hides_in(image, extent, start, &mut comparisons), comparisons)
    }

    /// Whether the part of `extent` in a cell is hidden; the cell is level, column and row.
    fn hides_in(
        &self,
        image: &OneByOne,
        extent: &Extent,
        (k, column, row): (u32, u32, u32),
        comparisons: &mut u64,
    ) -> bool {
        let level = &self.levels[k as usize];
        *comparisons += 1;
        if level.farthest[level.at(column, row)] >= extent.nearest {
            return true;
        }
        if k == 0 {
            return self.pixels_hide(image, extent, (column, row), comparisons);
        }
        let below = k - 1 + TILE_LOG2;
        let range = |(first, last): (i32, i32), cell: u32| {
            (first as u32 >> below).max(2 * cell)..=(last as u32 >> below).min(2 * cell + 1)
        };
        for y in range(extent.rows, row) {
            for x in range(extent.columns, column) {
                if !self.hides_in(image, extent, (k - 1, x, y), comparisons) {
                    return false;
                }
            }
        }
        true
    }

    /// Whether the pixels of a tile hide the part of `extent` in it.
    fn pixels_hide(
        &self,
        image: &OneByOne,
        extent: &Extent,
        (column, row): (u32, u32),
        comparisons: &mut u64,
    ) -> bool {
        let within = |(first, last): (i32, i32), tile: u32| {
            let begin = tile << TILE_LOG2;
            let last = (last as u32 - begin).min((1 << TILE_LOG2) - 1);
            ((first as u32).max(begin) - begin, last)
        };
        let (left, right) = within(extent.columns, column);
        let (top, bottom) = within(extent.rows, row);
        for y in top..=bottom {
            let pixels = &image.row_of_tile(column, row, y)[left as usize..=right as usize];
            *comparisons += pixels.len() as u64;
            if pixels.iter().any(|nearness| *nearness < extent.nearest) {
                return false;
            }
        }
        true
    }

    /// Levels 1 to the coarsest one of the image's pyramid, as NDC depth.
    ///
    /// The levels of tiles and above are those that were kept.
    pub(super) fn written(
        &self,
        depth: &[f32],
        convention: DepthConvention,
    ) -> Vec<(ImageSize, Vec<f32>)> {
        let reversed = convention.is_reversed();
        let farther = |a: f32, b: f32| if reversed { a.min(b) } else { a.max(b) };
        let mut written: Vec<(ImageSize, Vec<f32>)> = Vec::new();
        let (mut size, mut k) = (self.size, 0);
        while size.width.max(size.height) > 1 {
            let half = ImageSize::new(size.width.div_ceil(2), size.height.div_ceil(2));
            k += 1;
            let texels = if k >= TILE_LOG2 {
                let level = &self.levels[(k - TILE_LOG2) as usize];
                let depth = |nearness: &f32| if reversed { *nearness } else { 1.0 - nearness };
                level.farthest.iter().map(depth).collect()
            } else {
                let fine = written.last().map_or(depth, |(_, texels)| texels);
                let texel = |x: u32, y: u32| {
                    let (left, top) = (2 * x, 2 * y);
                    let right = (left + 1).min(size.width - 1);
                    let bottom = (top + 1).min(size.height - 1);
                    let at = |x: u32, y: u32| fine[(y * size.width + x) as usize];
                    let (a, b) = (farther(at(left, top), at(right, top)), at(left, bottom));
                    farther(a, farther(b, at(right, bottom)))
                };
                (0..half.height)
                    .flat_map(|y| (0..half.width).map(move |x| (x, y)))
                    .map(|(x, y)| texel(x, y))
                    .collect()
            };
            written.push((half, texels));
            size = half;
        }
        written
    }
}
