//! The pyramid of coverage bits.
//!
//! Source: Greene (1996), section 3.
//! Level 0 has a word of 64 bits for each tile of 8x8 pixels.
//! A bit of a coarser level says that a square below is full.

use crate::input::image::ImageSize;
use crate::methods::tiling::fault::{Planted, is_planted};

/// Squares along a side of the next coarser one.
pub(super) const SIDE: i32 = 8;

/// One level: a word for each square of 8x8 parts.
#[derive(Debug)]
struct Level {
    across: i32,
    words: Vec<u64>,
}

/// Which pixels are covered.
#[derive(Debug)]
pub(super) struct Cover {
    levels: Vec<Level>,
    fault: Planted,
}

/// The bit of column `x` and row `y` of a word, which are below 8.
#[inline]
pub(super) fn bit(x: i32, y: i32) -> u64 {
    1 << (8 * y + x)
}

impl Cover {
    /// Nothing is covered; what lies past the image's edge counts as full.
    pub(super) fn new(size: ImageSize, fault: Planted) -> Self {
        let (mut width, mut height) = (size.width as i32, size.height as i32);
        let mut levels = Vec::new();
        loop {
            let up = |side: i32| (side + SIDE - 1) / SIDE;
            let (across, down) = (up(width), up(height));
            let mut words = vec![0; (across * down) as usize];
            for (number, word) in (0..).zip(&mut words) {
                let (x, y) = (number % across * SIDE, number / across * SIDE);
                if x + SIDE > width || y + SIDE > height {
                    *word = (0..64)
                        .map(|k| (k % SIDE, k / SIDE))
                        .filter(|(dx, dy)| x + dx >= width || y + dy >= height)
                        .fold(0, |word, (dx, dy)| word | bit(dx, dy));
                }
            }
            levels.push(Level { across, words });
            if across == 1 && down == 1 {
                return Self { levels, fault };
            }
            (width, height) = (across, down);
        }
    }

    /// The coarsest level, which is one word.
    pub(super) fn top(&self) -> usize {
        self.levels.len() - 1
    }

    pub(super) fn word(&self, level: usize, x: i32, y: i32) -> u64 {
        let level = &self.levels[level];
        level.words[(y * level.across + x) as usize]
    }

    /// Covers pixels of a tile, and fills coarser levels as far as squares become full.
    pub(super) fn add(&mut self, x: i32, y: i32, mask: u64) {
        let (mut x, mut y, mut mask) = (x, y, mask);
        for level in &mut self.levels {
            let word = &mut level.words[(y * level.across + x) as usize];
            *word |= mask;
            let is_full = *word == u64::MAX || (is_planted!(self.fault, FullByOnePart) && x > 0);
            if !is_full {
                return;
            }
            mask = bit(x % SIDE, y % SIDE);
            (x, y) = (x / SIDE, y / SIDE);
        }
    }

    /// Whether all pixels of a rectangle are covered, `[x0, y0, x1, y1]` with both ends.
    pub(super) fn hides(&self, rectangle: [i32; 4]) -> bool {
        self.is_full(self.top(), 0, 0, rectangle)
    }

    fn is_full(&self, level: usize, x: i32, y: i32, rectangle: [i32; 4]) -> bool {
        let word = self.word(level, x, y);
        if word == u64::MAX {
            return true;
        }
        let shift = 3 * level as i32;
        let [x0, y0, x1, y1] = rectangle.map(|v| v >> shift);
        for py in (SIDE * y).max(y0)..=(SIDE * y + SIDE - 1).min(y1) {
            for px in (SIDE * x).max(x0)..=(SIDE * x + SIDE - 1).min(x1) {
                let is_set = word & bit(px % SIDE, py % SIDE) != 0;
                if !is_set && (level == 0 || !self.is_full(level - 1, px, py, rectangle)) {
                    return false;
                }
            }
        }
        true
    }

    pub(super) fn bytes(&self) -> u64 {
        self.levels.iter().map(|level| size_of_val(&level.words[..]) as u64).sum()
    }
}
