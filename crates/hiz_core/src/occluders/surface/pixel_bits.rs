//! A set of pixels of some rows, as bits.

/// Pixels of which something is asked.
#[derive(Debug)]
pub(super) struct PixelBits {
    /// The first and the last row.
    rows: [i32; 2],
    width: usize,
    /// Words of 64 pixels per row.
    words: usize,
    bits: Vec<u64>,
}

impl PixelBits {
    /// The pixels of rows of so many `pixels`, from a first one on, for which `is_in` holds.
    #[inline(always)]
    pub(super) fn new<T>(width: u32, first: i32, pixels: &[T], is_in: impl Fn(&T) -> bool) -> Self {
        let (width, words) = (width as usize, width.div_ceil(64) as usize);
        let mut bits = Vec::with_capacity(words * pixels.len() / width);
        for row in pixels.chunks_exact(width) {
            bits.extend(row.chunks(64).map(|pixels| {
                let bit = |(i, pixel)| u64::from(is_in(pixel)) << i;
                pixels.iter().enumerate().map(bit).fold(0, |bits, bit| bits | bit)
            }));
        }
        let count = (pixels.len() / width) as i32;
        Self { rows: [first, first + count - 1], width, words, bits }
    }

    /// Whether any of the pixels from the first to the last column and row is in the set.
    ///
    /// The columns are within the image; the first is after the last if there are none.
    #[inline]
    pub(super) fn any(&self, [x0, x1]: [i32; 2], rows: [i32; 2]) -> bool {
        let [first, last] = [rows[0].max(self.rows[0]), rows[1].min(self.rows[1])];
        if x0 > x1 || first > last {
            return false;
        }
        let [begin, end] = [x0, x1].map(|x| x.cast_unsigned() as usize / 64);
        let from = u64::MAX << (x0 & 63);
        let to = u64::MAX >> (63 - (x1 & 63));
        (first..=last).any(|y| {
            let line = &self.bits[self.line(y)..][..self.words];
            if begin == end {
                return line[begin] & from & to != 0;
            }
            line[begin] & from != 0
                || line[end] & to != 0
                || line[begin + 1..end].iter().any(|word| *word != 0)
        })
    }

    /// The pixels of a row of the set from the first to the last column.
    #[inline]
    pub(super) fn of_row(&self, y: i32, [first, last]: [i32; 2]) -> impl Iterator<Item = i32> {
        let line = &self.bits[self.line(y)..][..self.words];
        let (mut word, end) = (first >> 6, last >> 6);
        let bits = move |word: i32| {
            let from = if word == first >> 6 { u64::MAX << (first & 63) } else { u64::MAX };
            let to = if word == end { u64::MAX >> (63 - (last & 63)) } else { u64::MAX };
            if first > last { 0 } else { line[word.cast_unsigned() as usize] & from & to }
        };
        let mut left = bits(word);
        std::iter::from_fn(move || {
            while left == 0 {
                word += 1;
                if word > end {
                    return None;
                }
                left = bits(word);
            }
            let x = word * 64 + left.trailing_zeros().cast_signed();
            left &= left - 1;
            Some(x)
        })
    }

    /// Calls `each` with the numbers of the pixels, in rows from the first one.
    pub(super) fn for_each(&self, mut each: impl FnMut(usize)) {
        for (y, line) in self.bits.chunks_exact(self.words).enumerate() {
            for (word, bits) in line.iter().enumerate() {
                let mut left = *bits;
                while left != 0 {
                    each(y * self.width + 64 * word + left.trailing_zeros() as usize);
                    left &= left - 1;
                }
            }
        }
    }

    #[inline]
    fn line(&self, y: i32) -> usize {
        (y - self.rows[0]).cast_unsigned() as usize * self.words
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_are_asked_as_by_looking_at_every_pixel() {
        let (width, rows) = (150, [3, 6]);
        let is_in = |x: i32, y: i32| (x * 7 + y * 31) % 97 == 0 || (y == 5 && x == 149);
        let pixels = (rows[0]..=rows[1]).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels: Vec<(i32, i32)> = pixels.collect();
        let bits = PixelBits::new(width as u32, rows[0], &pixels, |(x, y)| is_in(*x, *y));
        let mut numbers = Vec::new();
        bits.for_each(|number| numbers.push(pixels[number]));
        let all = pixels.iter().copied().filter(|(x, y)| is_in(*x, *y));
        assert_eq!(numbers, all.collect::<Vec<_>>());
        let mut found = [0; 2];
        for y0 in 2..7 {
            for y1 in y0..8 {
                for x0 in 0..width {
                    for x1 in (x0 - 1..width).step_by(5) {
                        let within = y0.max(rows[0])..=y1.min(rows[1]);
                        let any = within.into_iter().any(|y| (x0..=x1).any(|x| is_in(x, y)));
                        assert_eq!(bits.any([x0, x1], [y0, y1]), any, "{x0} {x1} {y0} {y1}");
                        found[usize::from(any)] += 1;
                    }
                }
            }
        }
        assert!(found[0] > 1000 && found[1] > 1000, "{found:?}");
        for y in 3..=6 {
            for x0 in 0..width {
                for x1 in x0 - 1..width {
                    let found: Vec<i32> = bits.of_row(y, [x0, x1]).collect();
                    assert_eq!(found, (x0..=x1).filter(|x| is_in(*x, y)).collect::<Vec<_>>());
                }
            }
        }
    }
}
