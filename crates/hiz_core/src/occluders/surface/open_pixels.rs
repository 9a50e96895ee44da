//! A set of pixels, with quick answers about rectangles.

use crate::input::image::ImageSize;

/// Pixels of which more is to be shown.
#[derive(Debug)]
pub(super) struct OpenPixels {
    size: ImageSize,
    pixels: Vec<u32>,
    is_open: Vec<bool>,
    /// By pixel: how many open ones come before it; one more entry for all of them.
    before: Vec<u32>,
    /// Corner (x, y) of a grid with one line more each way: how many are left of x and above y.
    sums: Vec<u32>,
}

impl OpenPixels {
    pub(super) fn new(size: ImageSize, is_open: Vec<bool>) -> Self {
        let line = size.width as usize + 1;
        let mut sums = vec![0; line * (size.height as usize + 1)];
        let (mut pixels, mut before) = (Vec::new(), Vec::with_capacity(is_open.len() + 1));
        for (y, row) in is_open.chunks_exact(size.width as usize).enumerate() {
            let mut count = 0;
            for (x, is_open) in row.iter().enumerate() {
                before.push(pixels.len() as u32);
                count += u32::from(*is_open);
                sums[(y + 1) * line + x + 1] = sums[y * line + x + 1] + count;
                if *is_open {
                    pixels.push((y * row.len() + x) as u32);
                }
            }
        }
        before.push(pixels.len() as u32);
        Self { size, pixels, is_open, before, sums }
    }

    #[inline]
    pub(super) fn is_open(&self, pixel: usize) -> bool {
        self.is_open[pixel]
    }

    /// How many open pixels come before a pixel, in rows from top to bottom.
    #[inline]
    pub(super) fn number(&self, x: i32, y: i32) -> usize {
        self.before[y as usize * self.size.width as usize + x as usize] as usize
    }

    /// The open pixels of the rows from the first to the last one.
    pub(super) fn of_rows(&self, [first, last]: [i32; 2]) -> &[u32] {
        let width = self.size.width as usize;
        let at = |row: usize| self.before[row * width] as usize;
        &self.pixels[at(first as usize)..at(last as usize + 1)]
    }

    /// The open pixels of a row from the first to the last column: their numbers and columns.
    #[inline]
    pub(super) fn of_row(
        &self,
        y: i32,
        [first, last]: [i32; 2],
    ) -> impl Iterator<Item = (usize, i32)> {
        let row = y as usize * self.size.width as usize;
        let at = |x: i32| self.before[row + x as usize] as usize;
        let numbers = if first > last { 0..0 } else { at(first)..at(last + 1) };
        numbers.map(move |number| (number, self.pixels[number].cast_signed() - row as i32))
    }

    #[inline]
    pub(super) fn is_open_at(&self, x: i32, y: i32) -> bool {
        self.is_open[y as usize * self.size.width as usize + x as usize]
    }

    pub(super) fn size(&self) -> ImageSize {
        self.size
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pixels.is_empty()
    }

    /// Whether any of the pixels from the first to the last column and row is open.
    ///
    /// All of them are within the image; the first is after the last if there are none.
    pub(super) fn any(&self, columns: [i32; 2], rows: [i32; 2]) -> bool {
        if columns[0] > columns[1] || rows[0] > rows[1] {
            return false;
        }
        let line = self.size.width as usize + 1;
        let at = |x: i32, y: i32| self.sums[y as usize * line + x as usize];
        let [x0, x1, y0, y1] = [columns[0], columns[1] + 1, rows[0], rows[1] + 1];
        at(x1, y1) + at(x0, y0) > at(x0, y1) + at(x1, y0)
    }
}
