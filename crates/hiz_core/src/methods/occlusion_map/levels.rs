//! The maps: how much of each square of pixels is covered, as whole numbers.
//!
//! Source: Zhang, Manocha, Hudson and Hoff (1997), section 4; Moller and Haines (1999) have the
//! rule of the thresholds.

use crate::error::Result;
use crate::host::memory;
use crate::input::image::ImageSize;
use crate::methods::occlusion_map::fault::{Planted, is_planted};

/// The text's share of a hole: 2x2 of 8x8 pixels.
const SHARE: u64 = 16;

/// The maps from the finest to the coarsest.
#[derive(Debug)]
pub(super) struct Levels {
    size: ImageSize,
    counts: Vec<Vec<u32>>,
}

impl Levels {
    /// The maps of an image, row by row, until the shorter side has `least` pixels.
    pub(super) fn new(
        size: ImageSize,
        least: u32,
        covered: impl Iterator<Item = bool>,
        fault: Planted,
    ) -> Result<Self> {
        let mut finest = memory::list(size.pixels() as usize, "a map")?;
        finest.extend(covered.map(u32::from));
        let mut counts = vec![finest];
        let (mut width, mut height) = (size.width as usize, size.height as usize);
        while width.min(height) > least as usize {
            let below = &counts[counts.len() - 1];
            let mut coarser = Vec::with_capacity(below.len() / 4);
            for (above, row) in below.chunks_exact(2 * width).map(|rows| rows.split_at(width)) {
                let (above, row) = (above.as_chunks::<2>().0, row.as_chunks::<2>().0);
                coarser.extend(above.iter().zip(row).map(|([a, b], [c, d])| {
                    if is_planted!(fault, AChildTwice) { a + b + c + c } else { a + b + c + d }
                }));
            }
            if is_planted!(fault, Bytes) {
                let whole = 1_u32 << (2 * counts.len());
                for count in &mut coarser {
                    *count = (*count * 255 / whole) * whole / 255;
                }
            }
            counts.push(coarser);
            (width, height) = (width / 2, height / 2);
        }
        Ok(Self { size, counts })
    }

    pub(super) fn num_levels(&self) -> u32 {
        self.counts.len() as u32
    }

    pub(super) fn level(&self, level: u32) -> (ImageSize, &[u32]) {
        let ImageSize { width, height } = self.size;
        (ImageSize::new(width >> level, height >> level), &self.counts[level as usize])
    }

    /// How many pixels are covered within one of a level.
    #[inline]
    pub(super) fn at(&self, level: u32, x: u32, y: u32) -> u32 {
        let width = self.size.width >> level;
        self.counts[level as usize][(y * width + x) as usize]
    }

    /// The least count of an opaque pixel by level.
    pub(super) fn least_counts(&self, negligible: u32, fault: Planted) -> Vec<u32> {
        let least = |level: u32| {
            let whole = 1_u64 << (2 * level);
            let mut hole = u64::from(negligible);
            if is_planted!(fault, ShareKept) {
                hole *= whole / SHARE;
            }
            let is_negligible =
                SHARE * u64::from(negligible) <= whole || is_planted!(fault, HoleInAnyLevel);
            if is_negligible { whole.saturating_sub(hole) as u32 } else { whole as u32 }
        };
        (0..self.num_levels()).map(least).collect()
    }
}
