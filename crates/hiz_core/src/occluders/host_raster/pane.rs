//! A pane of the image: a rectangle of whole tiles, which one thread draws.
//!
//! A pane sees every triangle that meets it, in the order of the frame.
//! How a pixel's depth is computed depends on the triangle and on the image alone, so the number of
//! panes changes no pixel.

use std::ops::RangeInclusive;

use crate::host::vectors::{Eight, Linear, Rows, with_eight};
use crate::occluders::host_raster::edges::{Edges, STEP, Segment, Spans, Steps, bits, to_pixels};
use crate::occluders::host_raster::lanes::{greatest, lanes, least, three};
use crate::occluders::host_raster::lens::{Extent, HALF, Image, UNITS};
use crate::occluders::host_raster::planted_fault::is_planted;
#[cfg(feature = "methods")]
use crate::occluders::host_raster::tile::is_covered;
use crate::occluders::host_raster::tile::{
    CLEAR, FULL, Layers, Mask, PIXELS, Pixels, Plane, Rise, SIDE, State, Tile, order, row_of_layers,
};
use crate::occluders::host_raster::tiles::Tiles;
use crate::occluders::host_raster::triangle::Triangle;
use crate::occluders::meshlets::LANES;

/// Coordinates of triangles up to this size along each axis have edge functions of 32 bits.
const SMALL: i32 = 64 * UNITS;

/// Columns of pixels that a pane begins at multiples of: tiles go in groups of [`LANES`].
pub(super) const ACROSS: usize = LANES * SIDE;

/// The depth of a rectangle of tiles.
#[derive(Debug)]
pub(super) struct Pane {
    image: Image,
    /// The first column of pixels, and the one after the last; multiples of [`ACROSS`].
    pub(super) left: i32,
    pub(super) right: i32,
    /// The first row of pixels, and the one after the last; multiples of [`SIDE`].
    pub(super) top: i32,
    pub(super) bottom: i32,
    /// Tiles in a row: a multiple of [`LANES`], some past the image's edge.
    across: usize,
    /// Pixels in a row, some past the pane's edge.
    stride: usize,
    /// In rows of the pane, [`LANES`] at once.
    tiles: Vec<Tiles>,
    /// By tile: pixels were written since `farthest` was computed.
    is_stale: Vec<bool>,
    /// By tile: a pixel of it that was the farthest one.
    witnesses: Vec<u8>,
    /// The tiles that are stale, and some that no longer are.
    stale: Vec<u32>,
    /// By cell of 8x8 tiles: no pixel is farther than this.
    cells: Vec<f32>,
    /// By cell: a tile's `farthest` has changed since that of the cell was computed.
    is_cell_stale: Vec<bool>,
    /// By triangle that was drawn by tiles.
    rises: Vec<Rise>,
    /// By tile: where its layers are in `layers`; 0 until it needs them.
    slots: Vec<u32>,
    /// Few tiles have layers, so theirs lie close together and stay in the caches.
    layers: Vec<Layers>,
    /// How many of `layers` are in use; the others are left from images before.
    used_layers: usize,
    pixels: Vec<f32>,
}

impl Pane {
    pub(super) fn new(image: Image, [left, right]: [i32; 2], [top, bottom]: [i32; 2]) -> Self {
        let across = (right - left) as usize / SIDE;
        let rows = (bottom - top) as usize / SIDE;
        let count = across * rows;
        let cells = across / LANES * rows.div_ceil(LANES);
        // A segment of a row may begin at the last pixel, and the last one has to fit, too.
        let stride = (across + 1) * SIDE;
        Self {
            image,
            left,
            right,
            top,
            bottom,
            across,
            stride,
            tiles: vec![Tiles::default(); count / LANES],
            is_stale: vec![false; count],
            witnesses: vec![0; count],
            stale: Vec::new(),
            cells: vec![0.0; cells],
            is_cell_stale: vec![false; cells],
            rises: Vec::new(),
            slots: vec![0; count],
            layers: vec![Layers::default()],
            used_layers: 1,
            pixels: vec![0.0; stride * (bottom - top) as usize],
        }
    }

    /// A pane that is all of an image.
    #[cfg(feature = "methods")]
    pub(super) fn of_image(image: Image) -> Self {
        let right = (image.width as usize).next_multiple_of(ACROSS) as i32;
        let bottom = (image.height as usize).next_multiple_of(SIDE) as i32;
        Self::new(image, [0, right], [0, bottom])
    }

    /// Bytes of its arrays.
    #[cfg(feature = "methods")]
    pub(super) fn bytes(&self) -> u64 {
        let floats = size_of_val(&self.cells[..]) + size_of_val(&self.pixels[..]);
        let tiles = size_of_val(&self.tiles[..])
            + size_of_val(&self.is_stale[..])
            + size_of_val(&self.witnesses[..])
            + size_of_val(&self.is_cell_stale[..])
            + size_of_val(&self.slots[..]);
        let lists = size_of_val(&self.stale[..])
            + size_of_val(&self.rises[..])
            + size_of_val(&self.layers[..]);
        (floats + tiles + lists) as u64
    }

    pub(super) fn clear(&mut self) {
        self.tiles.fill(Tiles::default());
        self.is_stale.fill(false);
        self.stale.clear();
        self.cells.fill(0.0);
        self.is_cell_stale.fill(false);
        self.rises.clear();
        self.slots.fill(0);
        self.used_layers = 1;
    }

    /// Whether an extent reaches into this pane.
    #[inline(always)]
    pub(super) fn meets(&self, extent: &Extent) -> bool {
        let Extent { columns, rows, .. } = extent;
        (rows.1 >= self.top)
            & (rows.0 < self.bottom)
            & (columns.1 >= self.left)
            & (columns.0 < self.right)
    }

    /// The first and the last column, and the first and the last row of its pixels in the image.
    pub(super) fn pixels(&self) -> [(i32, i32); 2] {
        let Image { width, height, .. } = self.image;
        [(self.left, self.right.min(width) - 1), (self.top, self.bottom.min(height) - 1)]
    }

    /// Whether nothing within `extent` would show in this pane.
    ///
    /// Cells are asked first, tiles where a cell cannot tell, and pixels where a tile cannot.
    pub(super) fn hides(&mut self, extent: &Extent) -> bool {
        let Some((rows, columns)) = self.tiles_of(extent) else { return true };
        for cell_row in rows.start() / LANES..=rows.end() / LANES {
            for cell in columns.start() / LANES..=columns.end() / LANES {
                if self.cell(cell_row, cell) >= extent.nearest {
                    continue;
                }
                let within = |range: &RangeInclusive<usize>, cell: usize| {
                    let first = cell * LANES;
                    *range.start().max(&first)..=*range.end().min(&(first + LANES - 1))
                };
                let columns = within(&columns, cell);
                for row in within(&rows, cell_row) {
                    for column in columns.clone() {
                        if self.farthest(row * self.across + column) < extent.nearest
                            && !self.pixels_hide(column, row, extent)
                        {
                            return false;
                        }
                    }
                }
            }
        }
        true
    }

    /// Whether the pixels of a tile hide the part of `extent` that lies in it.
    #[inline(never)]
    fn pixels_hide(&self, column: usize, row: usize, extent: &Extent) -> bool {
        if self.state(row * self.across + column) == CLEAR {
            return false;
        }
        let within = |(first, last): (i32, i32), begin: i32| {
            ((first - begin).max(0) as usize, (last - begin).min(STEP - 1) as usize)
        };
        let (left, right) = within(extent.columns, self.left + (column * SIDE) as i32);
        let (top, bottom) = within(extent.rows, self.top + (row * SIDE) as i32);
        (top..=bottom).all(|y| {
            let pixels = self.row_of_tile(column, row, y);
            pixels[left..=right].iter().all(|nearness| *nearness >= extent.nearest)
        })
    }

    /// The farthest depth of a cell, in rows and columns of cells.
    #[inline(always)]
    fn cell(&mut self, row: usize, column: usize) -> f32 {
        let cell = row * (self.across / LANES) + column;
        if self.is_cell_stale[cell] {
            self.renew_cell(cell, row, column);
        }
        self.cells[cell]
    }

    #[inline(never)]
    fn renew_cell(&mut self, cell: usize, row: usize, column: usize) {
        let rows = self.tiles.chunks_exact(self.across / LANES).skip(row * LANES).take(LANES);
        let farthest = rows.fold([f32::MAX; LANES], |farthest, row| {
            let row = &row[column].farthest;
            lanes(|l| least(row[l], farthest[l]))
        });
        let all = if is_planted!(self.image.fault, CellOfOneTile) { 1 } else { LANES };
        self.cells[cell] = farthest.into_iter().take(all).fold(f32::MAX, least);
        self.is_cell_stale[cell] = false;
    }

    /// The rows and the columns of tiles that an extent meets.
    fn tiles_of(&self, extent: &Extent) -> Option<(RangeInclusive<usize>, RangeInclusive<usize>)> {
        let tiles = |(first, last): (i32, i32), begin: i32, end: i32| {
            let tile = |pixel: i32| (pixel - begin) as usize / SIDE;
            tile(first.max(begin))..=tile(last.min(end - 1))
        };
        self.meets(extent).then(|| {
            let rows = tiles(extent.rows, self.top, self.bottom);
            (rows, tiles(extent.columns, self.left, self.right))
        })
    }

    #[inline(always)]
    fn farthest(&self, index: usize) -> f32 {
        self.tiles[index / LANES].farthest[index % LANES]
    }

    #[inline(always)]
    fn state(&self, index: usize) -> State {
        self.tiles[index / LANES].states[index % LANES]
    }

    #[inline(always)]
    fn tile(&mut self, index: usize) -> Tile<'_> {
        let (tiles, l) = (&mut self.tiles[index / LANES], index % LANES);
        Tile {
            farthest: &mut tiles.farthest[l],
            nearest: &mut tiles.nearest[l],
            state: &mut tiles.states[l],
            layers: &mut self.layers[self.slots[index] as usize],
            fault: self.image.fault,
        }
    }

    /// The layers of a tile, if its state says that it has some.
    #[inline(always)]
    fn layers_of(&self, index: usize) -> &Layers {
        &self.layers[self.slots[index] as usize]
    }

    /// The plane of a tile that is [`FULL`].
    #[inline(always)]
    fn full_plane(&self, index: usize) -> Plane {
        let (tiles, l) = (&self.tiles[index / LANES], index % LANES);
        Plane::at(tiles.first[l], &self.rises[(tiles.states[l] - FULL) as usize])
    }

    /// Gives a tile room for layers, and makes the plane of one that is [`FULL`] a layer.
    #[inline(always)]
    fn settle(&mut self, index: usize) {
        if self.slots[index] == 0 {
            if self.used_layers == self.layers.len() {
                self.more_layers();
            }
            self.layers[self.used_layers].clear();
            self.slots[index] = self.used_layers as u32;
            self.used_layers += 1;
        }
        if self.state(index) >= FULL {
            let plane = self.full_plane(index);
            self.tile(index).settle(plane);
        }
    }

    #[cold]
    #[inline(never)]
    fn more_layers(&mut self) {
        self.layers.resize(2 * self.used_layers, Layers::default());
    }

    /// Turns whatever the tile in this column and row of the pane's is into pixels.
    #[inline(never)]
    fn expand(&mut self, (column, row): (usize, usize)) {
        let index = row * self.across + column;
        let mut pixels = Pixels::new(&mut self.pixels, self.stride, (column, row));
        let (tiles, l) = (&mut self.tiles[index / LANES], index % LANES);
        match tiles.states[l] {
            CLEAR => pixels.fill(|_| [0.0; SIDE]),
            PIXELS => {}
            state @ FULL.. => {
                let plane = Plane::at(tiles.first[l], &self.rises[(state - FULL) as usize]);
                pixels.fill(|y| plane.row(y));
            }
            state => {
                let layers = &self.layers[self.slots[index] as usize];
                pixels.fill(|y| row_of_layers(state, layers, y, self.image.fault));
            }
        }
        tiles.states[l] = PIXELS;
    }

    /// Draws the parts of triangles that lie in this pane.
    #[inline(never)]
    pub(super) fn draw(&mut self, triangles: &[Triangle]) {
        with_eight!(eight => for t in triangles {
            self.draw_triangle(eight, t);
        });
    }

    /// Draws the part of a triangle that lies in this pane.
    ///
    /// In which way is chosen by its part in the image, because their roundings differ.
    #[inline(always)]
    fn draw_triangle(&mut self, eight: impl Eight, t: &Triangle) {
        let bounds = |v: &[i32; 3]| (v[0].min(v[1]).min(v[2]), v[0].max(v[1]).max(v[2]));
        let (left, right) = bounds(&t.x);
        let (up, down) = bounds(&t.y);
        let columns =
            (((left + HALF - 1) >> 8).max(0), ((right - HALF) >> 8).min(self.image.width - 1));
        let rows =
            (((up + HALF - 1) >> 8).max(self.top), ((down - HALF) >> 8).min(self.bottom - 1));
        let own = (columns.0.max(self.left), columns.1.min(self.right - 1));
        let columns = if is_planted!(self.image.fault, WayByPane) { own } else { columns };
        let is_narrow = columns.1 - columns.0 < LANES as i32;
        let columns = own;
        if columns.0 > columns.1 || rows.0 > rows.1 {
            return;
        }
        let edges = Edges::new(t, self.image.fault);
        if is_narrow && right - left <= SMALL && down - up <= SMALL {
            self.draw_by_rows(eight, t, &edges, columns, rows);
        } else {
            self.draw_by_tiles(eight, t, &edges, columns, rows);
        }
    }

    /// Draws a triangle of at most [`LANES`] columns, one segment for each row.
    #[inline(always)]
    fn draw_by_rows(
        &mut self,
        eight: impl Eight,
        t: &Triangle,
        edges: &Edges,
        columns: (i32, i32),
        rows: (i32, i32),
    ) {
        let tile_row = |row: i32| (row - self.top) as usize / SIDE;
        let tile_column = |column: i32| (column - self.left) as usize / SIDE;
        let (begin, end) = (tile_column(columns.0), tile_column(columns.1));
        let mut is_hidden = true;
        for row in tile_row(rows.0)..=tile_row(rows.1) {
            for column in begin..=end {
                let tile = row * self.across + column;
                let (tiles, l) = (&mut self.tiles[tile / LANES], tile % LANES);
                if tiles.farthest[l] >= t.nearest {
                    continue;
                }
                is_hidden = false;
                tiles.nearest[l] = greatest(tiles.nearest[l], t.nearest);
                if !self.is_stale[tile] {
                    self.is_stale[tile] = true;
                    self.stale.push(tile as u32);
                }
                if self.state(tile) != PIXELS {
                    self.expand((column, row));
                }
            }
        }
        if is_hidden {
            return;
        }
        // Pixels of tiles that hide it stay as they are, and those of tiles that have none are not
        // looked at before they are written again.
        let at = edges.at_small(t, columns.0, rows.0);
        let x = to_pixels(columns.0 * UNITS + HALF - t.x[0]);
        let y = to_pixels(rows.0 * UNITS + HALF - t.y[0]);
        // `x + l` is exact, so the first column changes nothing.
        let along = lanes(|l| t.nearness + t.slope[0] * (x + l as f32));
        let first = (rows.0 - self.top) as usize * self.stride + (columns.0 - self.left) as usize;
        let pixels = Rows {
            numbers: &mut self.pixels[first..],
            stride: self.stride,
            columns: (columns.1 - columns.0) as usize + 1,
            rows: (rows.1 - rows.0) as usize + 1,
        };
        let linear = Linear { at, along: &edges.along(), down: &edges.down };
        eight.raise(
            pixels,
            &linear,
            &along,
            #[inline(always)]
            |row| t.slope[1] * (y + row as f32),
            t.nearest,
        );
    }

    /// Draws a triangle tile by tile.
    #[inline(always)]
    fn draw_by_tiles(
        &mut self,
        eight: impl Eight,
        t: &Triangle,
        edges: &Edges,
        columns: (i32, i32),
        rows: (i32, i32),
    ) {
        let (begin, end) = (columns.0 / STEP, columns.1 / STEP);
        let (first, last) = (rows.0 / STEP, rows.1 / STEP);
        let tiles = (end - begin + 1) * (last - first + 1);
        let is_large = tiles >= LAYERS_FROM;
        if is_large && self.hides_all(t.nearest, (begin, end), rows) {
            return;
        }
        self.rises.push(Rise { slope: t.slope, nearest: t.nearest });
        let steps = Steps::new(t, edges, self.image.fault);
        if end - begin < NARROW {
            for row in first..=last {
                self.draw_narrow(eight, t, edges, &steps, row, (begin, end), is_large);
            }
        } else {
            self.draw_wide(eight, t, edges, &steps, (begin, end), (first, last));
        }
    }

    /// Draws a triangle into the tiles `begin..=end` of the rows `first..=last`, which are many in a
    /// row.
    #[inline(always)]
    fn draw_wide(
        &mut self,
        eight: impl Eight,
        t: &Triangle,
        edges: &Edges,
        steps: &Steps,
        (begin, end): (i32, i32),
        (first, last): (i32, i32),
    ) {
        const MANY: i32 = LANES as i32;
        let mut at_begin = edges.at(t, begin * STEP, first * STEP);
        let mut spans = Spans::new(&at_begin, edges, steps, (begin, end), self.image.fault);
        for row in first..=last {
            let [met, covered] = spans.row();
            let at_row = at_begin;
            for k in 0..3 {
                at_begin[k] += i64::from(STEP * edges.down[k]);
            }
            spans.step_down();
            if met.0 >= met.1 {
                continue;
            }
            for group in met.0 / MANY..=(met.1 - 1) / MANY {
                let column = group * MANY;
                let at = || {
                    steps.along_tiles(&three(|k| {
                        at_row[k] + i64::from(column - begin) * i64::from(STEP * edges.right[k])
                    }))
                };
                let which = (bits(met, column), bits(covered, column));
                self.draw_group(eight, t, edges, steps, (column, row), at, which, true);
            }
        }
    }

    /// Whether the cells that these tiles and rows of pixels meet hide what is no nearer than
    /// `nearest`.
    #[inline(always)]
    fn hides_all(&mut self, nearest: f32, (begin, end): (i32, i32), rows: (i32, i32)) -> bool {
        let cell = |row: i32| (row - self.top) as usize / SIDE / LANES;
        let own = |column: i32| (column - self.left / STEP) as usize / LANES;
        let (begin, end) = (own(begin), own(end));
        for row in cell(rows.0)..=cell(rows.1) {
            for column in begin..=end {
                if self.cell(row, column) < nearest {
                    return false;
                }
            }
        }
        true
    }

    /// Draws a triangle into the tiles `begin..=end` of a row, which are few.
    #[expect(clippy::too_many_arguments, reason = "the inner loop, where each is at hand")]
    #[inline(always)]
    fn draw_narrow(
        &mut self,
        eight: impl Eight,
        t: &Triangle,
        edges: &Edges,
        steps: &Steps,
        row: i32,
        (begin, end): (i32, i32),
        is_large: bool,
    ) {
        const MANY: i32 = LANES as i32;
        for group in begin / MANY..=end / MANY {
            let column = group * MANY;
            let at = steps.along_tiles(&edges.at(t, column * STEP, row * STEP));
            let met = bits((begin, end + 1), column) & !eight.any_negative(&at, &steps.gain);
            if met != 0 {
                let covered = met & !eight.any_negative(&at, &steps.loss);
                let which = (met, covered);
                self.draw_group(eight, t, edges, steps, (column, row), || at, which, is_large);
            }
        }
    }

    /// Draws a triangle into [`LANES`] tiles in a row, of which the first one is in this column and
    /// row of the image's tiles.
    ///
    /// `at` are the edges' functions at their first pixels, and bits say which tiles the triangle
    /// meets and which it covers.
    #[expect(clippy::too_many_arguments, reason = "the inner loop, where each is at hand")]
    #[inline(always)]
    fn draw_group(
        &mut self,
        eight: impl Eight,
        t: &Triangle,
        edges: &Edges,
        steps: &Steps,
        (column, row): (i32, i32),
        at: impl FnOnce() -> [[i32; LANES]; 3],
        (met, covered): (u32, u32),
        is_large: bool,
    ) {
        let x = to_pixels(column * STEP * UNITS + HALF - t.x[0]);
        let y = to_pixels(row * STEP * UNITS + HALF - t.y[0]);
        let segment = Segment::new(t, steps, (x, y));
        let own_row = (row - self.top / STEP) as usize;
        let own_group = (column * STEP - self.left) as usize / ACROSS;
        let tiles = own_row * (self.across / LANES) + own_group;
        let state = FULL + self.rises.len() as State - 1;
        let Some(mut open) = self.tiles[tiles].replace(eight, &segment, met, covered, state) else {
            return;
        };
        let cell = own_row / LANES * (self.across / LANES) + own_group;
        self.is_cell_stale[cell] = true;
        if open == 0 {
            return;
        }
        let at = at();
        while open != 0 {
            let l = open.trailing_zeros() as usize % LANES;
            open &= open - 1;
            let plane = Plane { nearness: segment.nearness[l], slope: t.slope, nearest: t.nearest };
            let range = (segment.low[l], segment.high[l]);
            let is_full = covered >> l & 1 == 1;
            let place = (own_group * LANES + l, own_row);
            let at = three(|k| at[k][l]);
            self.draw_tile(eight, place, edges, steps, at, plane, range, is_full, is_large);
        }
    }

    /// Draws a triangle into one tile: as a layer, or into pixels.
    ///
    /// `place` is its column and row in the pane, and `at` are the edges' functions at its first
    /// pixel.
    #[expect(clippy::too_many_arguments, reason = "the inner loop, where each is at hand")]
    #[inline(always)]
    fn draw_tile(
        &mut self,
        eight: impl Eight,
        place: (usize, usize),
        edges: &Edges,
        steps: &Steps,
        at: [i32; 3],
        plane: Plane,
        (low, high): (f32, f32),
        is_full: bool,
        is_large: bool,
    ) {
        let index = place.1 * self.across + place.0;
        let l = index % LANES;
        let before = &self.tiles[index / LANES];
        let mut is_front = low >= before.nearest[l];
        if !is_front && before.states[l] >= FULL {
            let other = self.full_plane(index);
            match order((&plane, high), (&other, before.nearest[l]), self.image.fault) {
                Some(false) => return,
                Some(true) => is_front = true,
                None => {}
            }
        }
        if is_full && is_front {
            let state = FULL + self.rises.len() as State - 1;
            self.tiles[index / LANES].put(l, &plane, (low, high), state);
            return;
        }
        let mask = if is_full { Mask::MAX } else { edges.mask(eight, steps, at) };
        let shifted = if is_planted!(self.image.fault, MasksShifted) { SIDE } else { 0 };
        let mask = mask << shifted;
        if mask == 0 {
            return;
        }
        if self.state(index) != PIXELS && (is_large || is_full) {
            self.settle(index);
            let mut tile = self.tile(index);
            if *tile.state == CLEAR {
                tile.first_layer(mask, &plane, (low, high));
                return;
            }
            if tile.add_layer(mask, &plane, (low, high)) {
                return;
            }
        }
        if self.state(index) != PIXELS {
            self.expand(place);
        }
        let tiles = &mut self.tiles[index / LANES];
        tiles.nearest[l] = greatest(tiles.nearest[l], high);
        self.is_stale[index] = false;
        let mut pixels = Pixels::new(&mut self.pixels, self.stride, place);
        pixels.draw(&plane, mask);
        tiles.farthest[l] = pixels.farthest(tiles.farthest[l], &mut self.witnesses[index]);
    }

    /// Computes the farthest depths again of the tiles whose pixels were written.
    pub(super) fn renew(&mut self) {
        let mut stale = std::mem::take(&mut self.stale);
        for index in stale.drain(..).map(|index| index as usize) {
            let is_stale = std::mem::take(&mut self.is_stale[index]);
            if is_stale && self.state(index) == PIXELS {
                let (row, column) = (index / self.across, index % self.across);
                let cell = row / LANES * (self.across / LANES) + column / LANES;
                self.is_cell_stale[cell] = true;
                let (tiles, l) = (&mut self.tiles[index / LANES], index % LANES);
                let mut pixels = Pixels::new(&mut self.pixels, self.stride, (column, row));
                let farthest = pixels.farthest(tiles.farthest[l], &mut self.witnesses[index]);
                let is_wrong = is_planted!(self.image.fault, RenewedTooNear);
                tiles.farthest[l] = if is_wrong { tiles.nearest[l] } else { farthest };
            }
        }
        self.stale = stale;
    }

    /// The farthest depth of a tile's pixels, those past the image's edge included; `None` where
    /// it is known as a bound alone.
    #[cfg(feature = "methods")]
    pub(super) fn exact_farthest(&self, column: usize, row: usize) -> Option<f32> {
        let tile = row * self.across + column;
        match self.state(tile) {
            CLEAR | PIXELS | FULL.. => Some(self.farthest(tile)),
            state => (!is_covered(state, self.layers_of(tile))).then_some(0.0),
        }
    }

    /// Nearness in row `y` of a tile, as it is now.
    #[inline(always)]
    pub(super) fn row_of_tile(&self, column: usize, row: usize, y: usize) -> [f32; SIDE] {
        let tile = row * self.across + column;
        match self.state(tile) {
            PIXELS => {
                let first = (row * SIDE + y) * self.stride + column * SIDE;
                self.pixels[first..].as_chunks().0[0]
            }
            FULL.. => self.full_plane(tile).row(y),
            state => row_of_layers(state, self.layers_of(tile), y, self.image.fault),
        }
    }

    /// Writes a row of its tiles as depth into rows of numbers that are `wide` apart, up to the
    /// last tile that the image has.
    ///
    /// `lines` begins at the image's first column.
    #[inline(always)]
    pub(super) fn write_tiles(
        &self,
        row: usize,
        lines: &mut [f32],
        wide: usize,
        depth_of: impl Fn(f32) -> f32 + Copy,
    ) {
        let shifted = if is_planted!(self.image.fault, PanesShifted) { 1 } else { 0 };
        let first = self.left as usize / SIDE;
        for own_column in 0..self.across.min(wide / SIDE - first) {
            let tile = row * self.across + own_column;
            let column = if self.left > 0 { first + own_column - shifted } else { own_column };
            let block = (&mut *lines, wide, column);
            match self.state(tile) {
                CLEAR => fill(block, depth_of, |_| [0.0; SIDE]),
                PIXELS => {
                    let first = row * SIDE * self.stride + own_column * SIDE;
                    fill(
                        block,
                        depth_of,
                        #[inline(always)]
                        |y| self.pixels[first + y * self.stride..].as_chunks().0[0],
                    );
                }
                FULL.. => {
                    let plane = self.full_plane(tile);
                    fill(block, depth_of, |y| plane.row(y));
                }
                state => {
                    let (layers, fault) = (self.layers_of(tile), self.image.fault);
                    fill(block, depth_of, |y| row_of_layers(state, layers, y, fault));
                }
            }
        }
    }
}

/// Fills the place of a tile in a row of tiles: `(numbers, numbers in a row, column of tiles)`.
#[inline(always)]
fn fill(
    (lines, wide, column): (&mut [f32], usize, usize),
    depth_of: impl Fn(f32) -> f32,
    row: impl Fn(usize) -> [f32; SIDE],
) {
    for (y, line) in lines.chunks_exact_mut(wide).enumerate() {
        let nearness = row(y);
        line.as_chunks_mut().0[column] = lanes(|l| depth_of(nearness[l]));
    }
}

/// Triangles of fewer columns of tiles are drawn tile by tile.
const NARROW: i32 = 6;

/// Triangles that meet fewer tiles are drawn into pixels.
const LAYERS_FROM: i32 = 9;
