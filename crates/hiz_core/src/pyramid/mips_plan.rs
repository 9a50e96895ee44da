//! The plan of a mip texture: levels, places and dispatches; integers only, no device.
//!
//! Sizes are halved and rounded down, as those of mip levels are.
//! The levels above 0 follow each other in one list of texels, whose rows can be copied into a
//! texture.
//! Level 0 goes through the same list before them, in bands of rows.

use crate::error::{Error, Result};
use crate::input::image::ImageSize;
use crate::pyramid::layout::BLOCK_LOG2;
use crate::pyramid::levels::{Level, MAX_LEVELS};

/// One dispatch that makes levels of the one before them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MipStep {
    /// The level that is read.
    pub(crate) source: u32,
    /// The last level that is made; the first one is `source + 1`.
    pub(crate) last: u32,
    /// Whether the level that is read has an odd size above 1 along each axis.
    pub(crate) odd: [bool; 2],
    /// Whether one workgroup makes all of them.
    pub(crate) is_tail: bool,
}

/// Rows of level 0 that the list takes at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MipBand {
    pub(crate) first: u32,
    pub(crate) rows: u32,
}

/// Levels, their places in the list, and the dispatches that fill it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct MipPlan {
    /// All levels; the offset of level 0 is 0.
    pub(crate) levels: Vec<Level>,
    pub(crate) steps: Vec<MipStep>,
    /// The bands of level 0; none if it is left out.
    pub(crate) bands: Vec<MipBand>,
    /// Bytes of the list.
    pub(crate) bytes: u64,
}

/// A level of at most this many texels begins the tail; as `TAIL_TEXELS` in `layout.rs`.
const TAIL_TEXELS: u32 = 1 << 15;

/// The size of a level, counted from the image.
pub(crate) fn level_size(size: ImageSize, level: u32) -> ImageSize {
    let halved = |side: u32| side.checked_shr(level).unwrap_or(0).max(1);
    ImageSize::new(halved(size.width), halved(size.height))
}

/// How many levels an image has, level 0 included.
pub(crate) fn level_count(size: ImageSize) -> u32 {
    size.width.max(size.height).ilog2() + 1
}

impl MipPlan {
    /// The plan for an image of `size` with texels of so many bytes, in a list of at most `most`
    /// bytes.
    ///
    /// # Errors
    /// [`Error::Limit`] for more than `most` bytes, and for more levels than there may be.
    pub(crate) fn new(
        size: ImageSize,
        texel_bytes: u32,
        with_level_0: bool,
        most: u64,
    ) -> Result<Self> {
        let count = level_count(size);
        if count as usize > MAX_LEVELS {
            return Err(Error::limit("mip levels", count.into(), MAX_LEVELS as u64));
        }
        // Rows of a copy into a texture begin at multiples of 256 bytes.
        let alignment = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / texel_bytes;
        let mut levels = Vec::new();
        let mut texels = 0;
        for k in 0..count {
            let ImageSize { width, height } = level_size(size, k);
            let stride = width.next_multiple_of(alignment);
            let offset = u32::try_from(texels)
                .map_err(|_| Error::limit("mip texels", texels, u64::from(u32::MAX)))?;
            levels.push(Level { offset, stride, width, height });
            texels += if k == 0 { 0 } else { u64::from(stride) * u64::from(height) };
        }
        let row_bytes = u64::from(levels[0].stride) * u64::from(texel_bytes);
        let mut bytes = texels * u64::from(texel_bytes);
        let mut bands = Vec::new();
        if with_level_0 {
            // As many rows as the other levels have room for; an invocation takes two.
            let rows = (bytes / row_bytes).next_multiple_of(2).clamp(2, 1 << 30) as u32;
            bands = (0..size.height)
                .step_by(rows as usize)
                .map(|first| MipBand { first, rows: rows.min(size.height - first) })
                .collect();
            bytes = bytes.max(row_bytes * u64::from(bands[0].rows));
        }
        if bytes > most {
            return Err(Error::limit("bytes of a mip texture's levels", bytes, most));
        }
        Ok(Self { steps: steps(&levels), levels, bands, bytes })
    }

    /// Where a level begins in a texture that holds all levels beside each other.
    /// Twin: `mip_origin` in `shaders/snippets/mip_lookup.wgsl`.
    pub(crate) fn atlas_origin(&self, level: u32) -> [u32; 2] {
        let ImageSize { width, height } = self.size();
        if level == 0 { [0, 0] } else { [width, height - (height >> (level - 1)) + level - 1] }
    }

    /// The size of such a texture.
    pub(crate) fn atlas_size(&self) -> ImageSize {
        let mut size = self.size();
        for (k, level) in (0..).zip(&self.levels) {
            let [x, y] = self.atlas_origin(k);
            size.width = size.width.max(x + level.width);
            size.height = size.height.max(y + level.height);
        }
        size
    }

    fn size(&self) -> ImageSize {
        ImageSize::new(self.levels[0].width, self.levels[0].height)
    }
}

/// The dispatches that make all levels above 0.
///
/// A step makes another level where the one before it has even sizes, or a size of 1.
fn steps(levels: &[Level]) -> Vec<MipStep> {
    let last = levels.len() as u32 - 1;
    let is_odd = |side: u32| side > 1 && side % 2 == 1;
    let mut steps = Vec::new();
    let mut source = 0;
    while source < last {
        let Level { width, height, .. } = levels[source as usize];
        let odd = [is_odd(width), is_odd(height)];
        if source > 0 && width * height <= TAIL_TEXELS {
            steps.push(MipStep { source, last, odd, is_tail: true });
            break;
        }
        let halves = |k: u32| {
            let Level { width, height, .. } = levels[k as usize];
            !is_odd(width) && !is_odd(height)
        };
        let mut made = source + 1;
        while made < last && made < source + BLOCK_LOG2 && halves(made) {
            made += 1;
        }
        steps.push(MipStep { source, last: made, odd, is_tail: false });
        source = made;
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(width: u32, height: u32, level_0: bool) -> MipPlan {
        MipPlan::new(ImageSize::new(width, height), 4, level_0, 1 << 27).unwrap()
    }

    #[test]
    fn a_screen_takes_two_dispatches_and_odd_sizes_take_one_more_each() {
        let steps = |w, h| {
            let made = plan(w, h, false).steps;
            made.iter().map(|s| (s.source, s.last, s.odd, s.is_tail)).collect::<Vec<_>>()
        };
        let (even, tall) = ([false; 2], [false, true]);
        assert_eq!(steps(1920, 1080), [(0, 3, even, false), (3, 10, tall, true)]);
        let both = [true; 2];
        let passes =
            [(0, 1, even, false), (1, 2, both, false), (2, 3, both, false), (3, 10, tall, true)];
        assert_eq!(steps(1366, 766), passes);
        assert_eq!(steps(1, 1), []);
    }

    #[test]
    fn levels_and_bands_do_not_overlap() {
        for (w, h) in [(1, 1), (1, 9), (5, 3), (1023, 769), (640, 360), (4000, 1)] {
            let plan = plan(w, h, true);
            let mut end = 0;
            for level in &plan.levels[1..] {
                assert!(level.offset >= end && level.offset % 64 == 0 && level.stride % 64 == 0);
                end = level.offset + level.stride * level.height;
            }
            assert!(u64::from(4 * end) <= plan.bytes);
            let mut row = 0;
            for MipBand { first, rows } in &plan.bands {
                assert_eq!(*first, row);
                row += rows;
                assert!(u64::from(4 * rows * plan.levels[0].stride) <= plan.bytes);
            }
            assert_eq!(row, h);
        }
    }

    #[test]
    fn levels_lie_beside_each_other() {
        for (w, h) in [(1, 1), (1, 64), (64, 1), (7, 5), (130, 129), (1920, 1080), (1366, 767)] {
            let plan = plan(w, h, false);
            let size = plan.atlas_size();
            let mut taken = vec![false; size.pixels() as usize];
            for (k, level) in (0..).zip(&plan.levels) {
                let [x, y] = plan.atlas_origin(k);
                for row in y..y + level.height {
                    let from = (row * size.width + x) as usize;
                    for texel in &mut taken[from..from + level.width as usize] {
                        assert!(!std::mem::replace(texel, true), "{w}x{h}, level {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_list_past_the_limit_is_refused() {
        let error = MipPlan::new(ImageSize::new(64, 64), 8, false, 4095).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }), "{error}");
    }
}
