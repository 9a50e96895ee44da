//! The plan of a pyramid: levels, sizes, offsets and dispatches; integers only, no device.
//!
//! Level 0 of a pyramid is the depth image itself.
//! Each further level halves the one before it, rounding up.
//! A texel of level k therefore covers exactly the pixel block `[x << k, (x + 1) << k)`.
//!
//! Stored levels follow each other in one list of texels.
//! Each is padded to whole blocks of the reduction, which stores vectors and checks no edges.
//! The list is cut into chunks that each fit one storage binding.

use crate::error::{Error, Result};
use crate::input::image::ImageSize;
use crate::pyramid::ends::Depths;
use crate::pyramid::levels::{Level, MAX_LEVELS, StoredLevels, stored_levels};

/// Pixels of a row that one texel of the atlas holds.
pub(crate) const PIXELS: u32 = 4;

/// Columns of headers in the atlas; `shaders/pyramid/texels_atlas.wgsl`, `reduction_number`.
pub(crate) const HEADERS: u32 = 2;

/// Where the levels lie in the atlas, in texels of the atlas.
///
/// - Level 0 is on the left.
/// - The stored levels are to its right, below each other.
/// - Where both ends are stored, the nearest depth of a texel follows its farthest.
/// - Two headers have the last two columns: the number of the reduction whose depth image level 0
///   is, and the number of the reduction that made the stored levels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct AtlasLayout {
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Column and row where each level begins, and padding.
    pub(crate) origins: [[u32; 4]; MAX_LEVELS],
}

impl AtlasLayout {
    pub(crate) fn new(levels: &[Level], stored: StoredLevels, depths: Depths) -> Self {
        let texels = |level: &Level| (depths.count() as u32 * level.width).div_ceil(PIXELS);
        let mut origins = [[0; 4]; MAX_LEVELS];
        let column = levels[0].width.div_ceil(PIXELS);
        let (mut width, mut rows) = (0, 0);
        for (k, level) in stored_levels(levels, stored) {
            origins[k] = [column, rows, 0, 0];
            width = width.max(texels(level));
            rows += level.height;
        }
        Self { width: column + width + HEADERS, height: levels[0].height.max(rows), origins }
    }

    /// Whether the device has textures of this size.
    pub(super) fn fits(&self, limits: &wgpu::Limits) -> bool {
        self.width.max(self.height) <= limits.max_texture_dimension_2d
    }
}

/// The most storage bindings that hold a pyramid.
///
/// With level 0 in a texture, 16384 x 16384 pixels need three of 128 MiB.
pub(crate) const PYRAMID_CHUNKS: usize = 3;

/// Columns of blocks come in multiples of this, so that the reduction loads and stores vectors.
pub(crate) const BLOCK_ALIGNMENT: u32 = 4;

/// Rows of every level start at multiples of this many words, as copies into a texture require.
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4;

/// Words before level 1.
///
/// The first one holds the number of the reduction that filled the pyramid.
/// A cull that expects another number keeps everything: its reduction was not submitted before it.
/// Buffers start as 0, which is never a number of a reduction.
pub(crate) const HEADER_WORDS: u64 = 4;

/// The side in texels, as a power of two, of the block that an invocation of the reduction reads.
///
/// The invocation makes up to three levels from the block.
pub(crate) const BLOCK_LOG2: u32 = 3;

/// One dispatch of the reduction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    /// The level that is read.
    pub(crate) source: u32,
    /// The first and the last level that are written.
    pub(crate) first: u32,
    pub(crate) last: u32,
    /// Columns and rows of invocations.
    ///
    /// Each reads a block of 8x8 texels of the source level; in a coarse step it writes a texel.
    pub(crate) blocks: [u32; 2],
}

impl Step {
    /// Whether one workgroup makes all remaining levels: `reduce_tail` in
    /// `shaders/pyramid/reduce.wgsl`.
    pub(crate) fn is_tail(&self) -> bool {
        self.source > 0 && self.last > self.source + BLOCK_LOG2
    }

    /// Whether a texel takes more than one block.
    ///
    /// `shaders/pyramid/reduce_coarse.wgsl` makes such a level.
    pub(crate) fn is_coarse(&self) -> bool {
        self.first > self.source + BLOCK_LOG2
    }

    /// Texels of level `k` along a side that one block makes.
    fn texels_a_block(&self, k: u32) -> u32 {
        if self.is_coarse() { 1 } else { 1 << BLOCK_LOG2 >> (k - self.source) }
    }
}

/// Sizes and places of all levels of a pyramid, and the dispatches that fill them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PyramidLayout {
    pub(crate) size: ImageSize,
    /// All levels; offset and stride are 0 for a level that is not stored.
    pub(crate) levels: Vec<Level>,
    /// Which levels are stored, limited to those that exist; none if `first` is past `last`.
    pub(crate) stored: StoredLevels,
    pub(crate) steps: Vec<Step>,
    /// Which depths are stored.
    pub(crate) depths: Depths,
    /// How many words behind a farthest depth the nearest one lies; 0 where one of them is stored
    /// alone.
    pub(crate) nearest: u32,
    /// Words of the header and of the stored levels, padding included.
    pub(crate) texels: u64,
    /// A chunk holds `1 << chunk_shift` words.
    pub(crate) chunk_shift: u32,
    /// Where the levels lie in an atlas.
    pub(crate) atlas: AtlasLayout,
}

impl PyramidLayout {
    /// The layout for an image of `size`, with chunks of `1 << chunk_shift` words.
    ///
    /// # Errors
    /// [`Error::Invalid`] for levels out of range;
    /// [`Error::Limit`] for more texels than [`PYRAMID_CHUNKS`] chunks or 32-bit offsets can hold.
    pub(crate) fn new(
        size: ImageSize,
        stored: StoredLevels,
        depths: Depths,
        chunk_shift: u32,
    ) -> Result<Self> {
        debug_assert!(
            1 << chunk_shift >= BLOCK_ALIGNMENT,
            "a vector store must not straddle chunks"
        );
        let stored = stored.checked()?;
        let mut levels =
            vec![Level { offset: 0, stride: 0, width: size.width, height: size.height }];
        let (mut width, mut height) = (size.width, size.height);
        while width > 1 || height > 1 {
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
            levels.push(Level { offset: 0, stride: 0, width, height });
        }
        // An image of one pixel stores nothing: first is 1, last is 0.
        let coarsest = levels.len() as u32 - 1;
        let stored = StoredLevels {
            first: stored.first.min(coarsest.max(1)),
            last: stored.last.min(coarsest),
        };
        let steps = passes(&levels, stored);
        let ends = depths.count() as u32;
        let mut texels = HEADER_WORDS;
        let offset = |texels: u64| {
            u32::try_from(texels)
                .map_err(|_| Error::limit("pyramid texels", texels, u64::from(u32::MAX)))
        };
        for step in &steps {
            for k in step.first..=step.last {
                let level = &mut levels[k as usize];
                let [stride, rows] = step.blocks.map(|n| n * step.texels_a_block(k));
                level.stride = (ends * stride).next_multiple_of(ROW_ALIGNMENT);
                level.offset = offset(texels)?;
                texels += u64::from(level.stride) * u64::from(rows);
            }
        }
        let steps = with_tail(&levels, steps);
        let nearest = ends - 1;
        offset(texels)?;
        let atlas = AtlasLayout::new(&levels, stored, depths);
        let layout =
            Self { size, levels, stored, steps, depths, nearest, texels, chunk_shift, atlas };
        if layout.chunk_sizes().len() > PYRAMID_CHUNKS {
            return Err(Error::limit(
                "pyramid texels",
                texels,
                (PYRAMID_CHUNKS as u64) << chunk_shift,
            ));
        }
        Ok(layout)
    }

    /// Whether a level can be read: level 0, or a stored one.
    pub(crate) fn is_there(&self, level: u32) -> bool {
        level == 0 || (self.stored.first..=self.stored.last).contains(&level)
    }

    /// The stored levels with their numbers.
    pub(crate) fn stored_levels(&self) -> impl Iterator<Item = (usize, &Level)> {
        stored_levels(&self.levels, self.stored)
    }

    /// Words of each chunk.
    pub(crate) fn chunk_sizes(&self) -> Vec<u64> {
        let chunk = 1_u64 << self.chunk_shift;
        let count = self.texels.div_ceil(chunk);
        (0..count).map(|i| (self.texels - i * chunk).min(chunk)).collect()
    }

    /// Where the depth image lies in a buffer that holds it, too, behind the levels.
    ///
    /// `None` where one binding does not hold all of that.
    pub(crate) fn image(&self) -> Option<Level> {
        let Level { width, height, .. } = self.levels[0];
        let stride = width.next_multiple_of(ROW_ALIGNMENT);
        let end = self.texels + u64::from(stride) * u64::from(height);
        let offset = u32::try_from(self.texels).ok()?;
        (end <= 1 << self.chunk_shift).then_some(Level { offset, stride, width, height })
    }

    /// The number of levels, level 0 included.
    pub(crate) fn num_levels(&self) -> u32 {
        self.levels.len() as u32
    }
}

/// One workgroup reads this many texels faster than another dispatch starts
/// (`docs/performance.md`).
const TAIL_TEXELS: u32 = 1 << 15;

/// The same passes, where the last ones become one dispatch if they are small.
fn with_tail(levels: &[Level], mut passes: Vec<Step>) -> Vec<Step> {
    let texels =
        |step: &Step| levels[step.source as usize].width * levels[step.source as usize].height;
    if let Some(i) = passes.iter().position(|step| step.source > 0 && texels(step) <= TAIL_TEXELS) {
        let last = passes[passes.len() - 1].last;
        passes.truncate(i + 1);
        passes[i].last = last;
    }
    passes
}

/// The passes that fill the stored levels.
///
/// There is at least one, since a pass writes the header.
fn passes(levels: &[Level], stored: StoredLevels) -> Vec<Step> {
    let StoredLevels { first, last } = stored;
    let mut steps = Vec::new();
    let columns = |texels: u32| texels.next_multiple_of(BLOCK_ALIGNMENT);
    let (mut source, mut first) = (0, first);
    if first > last {
        return vec![Step { source, first, last, blocks: [0, 0] }];
    }
    if first > BLOCK_LOG2 {
        // A texel of this level takes several blocks, so a shader of its own makes the level.
        let Level { width, height, .. } = levels[first as usize];
        steps.push(Step { source, first, last: first, blocks: [columns(width), height] });
        (source, first) = (first, first + 1);
    }
    while first <= last {
        let Level { width, height, .. } = levels[source as usize];
        let [x, y] = [width, height].map(|n| n.div_ceil(1 << BLOCK_LOG2));
        let written = last.min(source + BLOCK_LOG2);
        steps.push(Step { source, first, last: written, blocks: [columns(x), y] });
        (source, first) = (written, written + 1);
    }
    steps
}

/// How many words of 4 bytes one storage binding may hold, as a power of two of at most 30.
pub(crate) fn chunk_shift(limits: &wgpu::Limits) -> u32 {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).max(4);
    (bytes / 4).ilog2().min(30)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(width: u32, height: u32) -> Vec<(u32, u32)> {
        let layout = PyramidLayout::new(
            ImageSize::new(width, height),
            StoredLevels::ALL,
            Depths::Farthest,
            25,
        )
        .unwrap();
        layout.levels.iter().map(|l| (l.width, l.height)).collect()
    }

    #[test]
    fn levels_are_ceil_halved_down_to_one_texel() {
        assert_eq!(sizes(1, 1), [(1, 1)]);
        assert_eq!(sizes(5, 3), [(5, 3), (3, 2), (2, 1), (1, 1)]);
        assert_eq!(sizes(1, 9), [(1, 9), (1, 5), (1, 3), (1, 2), (1, 1)]);
        assert_eq!(sizes(1920, 1080).len(), 12);
        assert_eq!(sizes(32_768, 1).len(), MAX_LEVELS);
    }

    #[test]
    fn levels_do_not_overlap_and_rows_are_aligned() {
        for ((w, h), (depths, words)) in [(7, 5), (1023, 769), (1, 17), (640, 360)]
            .into_iter()
            .flat_map(|size| [(Depths::Farthest, 1), (Depths::Both, 2)].map(|ends| (size, ends)))
        {
            let layout =
                PyramidLayout::new(ImageSize::new(w, h), StoredLevels::ALL, depths, 25).unwrap();
            let mut end = 4;
            for level in &layout.levels[1..] {
                assert!(
                    level.offset >= end
                        && level.offset.is_multiple_of(4)
                        && level.stride.is_multiple_of(64)
                );
                assert!(level.stride >= words * level.width);
                end = level.offset + level.stride * level.height;
            }
            assert!(u64::from(end) <= layout.texels);
            let image = layout.image().unwrap();
            assert!(u64::from(image.offset) >= layout.texels && image.stride >= w);
            // A copy to a texture begins at a texel of 16 bytes, and its rows at 256.
            assert!(image.offset.is_multiple_of(4) && image.stride.is_multiple_of(64));
        }
    }

    #[test]
    fn the_image_lies_behind_the_levels_where_one_binding_holds_both() {
        let of_shift = |shift| {
            let size = ImageSize::new(640, 360);
            PyramidLayout::new(size, StoredLevels::ALL, Depths::Farthest, shift).unwrap().image()
        };
        let Level { offset, stride, .. } = of_shift(19).unwrap();
        assert!((1 << 18..1 << 19).contains(&(offset + stride * 360)));
        assert_eq!(of_shift(18), None);
    }

    #[test]
    fn a_level_alone_takes_one_dispatch_and_all_of_a_screen_take_two() {
        let steps =
            |size, levels| PyramidLayout::new(size, levels, Depths::Farthest, 25).unwrap().steps;
        let (screen, pixel) = (ImageSize::new(1920, 1080), ImageSize::new(1, 1));
        for level in 1..=15 {
            let alone = steps(screen, StoredLevels::only(level));
            assert_eq!(alone.len(), 1, "level {level}");
            let made = level.min(11);
            assert_eq!((alone[0].source, alone[0].first, alone[0].last), (0, made, made));
        }
        let all = steps(screen, StoredLevels::ALL);
        assert_eq!(all.iter().map(|s| (s.source, s.last)).collect::<Vec<_>>(), [(0, 3), (3, 11)]);
        // The header alone: nothing is stored, so no block may be written.
        assert_eq!(
            steps(pixel, StoredLevels::ALL),
            [Step { source: 0, first: 1, last: 0, blocks: [0, 0] }]
        );
    }

    #[test]
    fn the_largest_image_of_lavapipe_fits_three_bindings() {
        let layout = PyramidLayout::new(
            ImageSize::new(16_384, 16_384),
            StoredLevels::ALL,
            Depths::Farthest,
            25,
        )
        .unwrap();
        assert_eq!(layout.chunk_sizes().len(), 3);
        assert!(layout.chunk_sizes().iter().sum::<u64>() >= layout.texels);
        let error =
            PyramidLayout::new(ImageSize::new(64, 64), StoredLevels::ALL, Depths::Farthest, 4)
                .unwrap_err();
        assert!(matches!(error, Error::Limit { .. }));
    }

    #[test]
    fn a_chunk_fits_a_binding_and_a_buffer() {
        let chunk = |binding, buffer| {
            chunk_shift(&wgpu::Limits {
                max_storage_buffer_binding_size: binding,
                max_buffer_size: buffer,
                ..wgpu::Limits::default()
            })
        };
        assert_eq!(
            (chunk(1 << 27, 1 << 40), chunk(1 << 40, 1 << 27), chunk((1 << 27) - 1, 1 << 40)),
            (25, 25, 24)
        );
        assert_eq!(chunk(1 << 40, 1 << 40), 30);
    }
}
