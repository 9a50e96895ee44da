//! A set of pixels, with quick answers about rectangles.

use crate::input::image::ImageSize;

/// Pixels of which more is to be shown.
#[derive(Debug)]
pub(super) struct OpenPixels {
    size: ImageSize,
    pixels: Vec<u32>,
    /// By pixel: how many open ones come before it; one more entry for all of them.
    before: Vec<u32>,
    /// Corner (x, y) of a grid with one line more each way: how many are left of x and above y.
    sums: Vec<u32>,
}

impl OpenPixels {
    pub(super) fn new(size: ImageSize, is_open: Vec<bool>) -> Self {
        let width = size.width as usize;
        let line = width + 1;
        let mut sums = vec![0_u32; line * (size.height as usize + 1)];
        let (mut pixels, mut before) = (Vec::new(), vec![0; is_open.len() + 1]);
        for (y, row) in is_open.chunks_exact(width).enumerate() {
            let (above, own) = sums[y * line..][..2 * line].split_at_mut(line);
            let before = &mut before[y * width..][..width];
            let first = pixels.len();
            let mut begin = 0;
            // Runs up to an open pixel each; all that they hold is the same or grows by the same.
            while begin < width {
                let run = row[begin..].iter().position(|is_open| *is_open);
                let end = run.map_or(width, |run| begin + run + 1);
                let count = pixels.len();
                before[begin..end].fill(count as u32);
                let more = (count - first) as u32;
                for (own, above) in own[begin..=end].iter_mut().zip(&above[begin..=end]) {
                    *own = above + more;
                }
                if run.is_some() {
                    pixels.push((y * width + end - 1) as u32);
                    own[end] += 1;
                }
                begin = end;
            }
        }
        before[is_open.len()] = pixels.len() as u32;
        Self { size, pixels, before, sums }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_are_asked_as_by_looking_at_every_pixel() {
        let size = ImageSize::new(23, 9);
        let is_open = |x: i32, y: i32| (x * 7 + y * 31) % 17 == 0 && y != 4;
        let all = (0..9).flat_map(|y| (0..23).map(move |x| (x, y)));
        let open = OpenPixels::new(size, all.clone().map(|(x, y)| is_open(x, y)).collect());
        let listed: Vec<u32> =
            (0..).zip(all.clone()).filter(|(_, (x, y))| is_open(*x, *y)).map(|(i, _)| i).collect();
        assert_eq!(open.of_rows([0, 8]), listed);
        for (i, (x, y)) in (0..).zip(all) {
            let before = listed.iter().filter(|pixel| **pixel < i).count();
            assert_eq!(open.number(x, y), before, "{x} {y}");
            for (x1, y1) in [(x, y), (x + 1, y), (22, y + 2), (x + 5, 8)] {
                let (x1, y1) = (x1.min(22), y1.min(8));
                let any = (y..=y1).any(|y| (x..=x1).any(|x| is_open(x, y)));
                assert_eq!(open.any([x, x1], [y, y1]), any, "{x} {x1} {y} {y1}");
            }
        }
    }
}
