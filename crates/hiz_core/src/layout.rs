//! Planning: levels, sizes, offsets and pieces; integers only, no device.
//!
//! Level 0 of a pyramid is the depth image itself.
//! Levels 1 and up are ceil-halved, so a texel of level k covers exactly the pixel block `[x << k,
//! (x + 1) << k)`; those that are stored lie one after the other in one list of texels, padded to
//! the whole blocks of the reduction (which stores vectors and asks for no edge), cut into chunks
//! that each fit one storage binding.

use crate::atlas::AtlasLayout;
use crate::camera::ImageSize;
use crate::error::{Error, Result};
use crate::records::RECORDS_PER_ROW;

/// The most levels a pyramid has: 32768 pixels a side.
pub const MAX_LEVELS: usize = 16;

/// How many storage bindings hold a pyramid: with level 0 in a texture, 16384 x 16384 pixels need
/// three of 128 MiB.
pub(crate) const PYRAMID_CHUNKS: usize = 3;

/// Blocks of a row come in multiples of this many, so that the reduction stores and loads vectors.
const BLOCK_ALIGNMENT: u32 = 4;

/// Rows of every level start at multiples of this many texels, as copies into a texture ask for.
const ROW_ALIGNMENT: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4;

/// Texels before level 1.
/// The first holds the number of the reduction that filled the pyramid: a cull that expects another
/// one (recorded, but not submitted before it) keeps everything.
/// 0, as buffers begin, is never a number.
const HEADER_TEXELS: u64 = 4;

/// Where a level lies in the list of texels; offset and stride are 0 where it does not, as level 0,
/// the depth texture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) offset: u32,
    pub(crate) stride: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Which levels of a pyramid are stored.
/// Level 0, the depth image itself, is always there.
///
/// Fewer levels are built faster and keep more: a test goes on to the next coarser stored level,
/// and a rectangle that is too large for the coarsest one is kept visible unless a descent is
/// allowed.
/// Numbers past an image's coarsest level mean that level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StoredLevels {
    /// The finest stored level, 1..=15.
    pub first: u32,
    /// The coarsest stored level, `first..=15`.
    pub last: u32,
}

impl StoredLevels {
    /// All levels.
    pub const ALL: Self = Self { first: 1, last: MAX_LEVELS as u32 - 1 };

    /// Level `first` and all coarser ones.
    /// Without level 1 the reduction writes a quarter as much, without level 2 a sixteenth.
    #[must_use]
    pub const fn from(first: u32) -> Self {
        Self { first, ..Self::ALL }
    }

    /// One level alone, made in one dispatch.
    #[must_use]
    pub const fn only(level: u32) -> Self {
        Self { first: level, last: level }
    }

    fn checked(self) -> Result<Self> {
        let most = Self::ALL.last;
        if (1..=most).contains(&self.first) && (self.first..=most).contains(&self.last) {
            return Ok(self);
        }
        let (first, last) = (self.first, self.last);
        Err(Error::invalid(
            "levels",
            format!("expected 1 <= first <= last <= {most}, got first {first} and last {last}"),
        ))
    }
}

impl Default for StoredLevels {
    fn default() -> Self {
        Self::ALL
    }
}

/// Pixels or texels that an invocation of the reduction reads along a side, as a power of two: it
/// makes up to three levels.
const BLOCK_LOG2: u32 = 3;

/// One dispatch of the reduction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Step {
    /// The level that is read.
    pub(crate) source: u32,
    /// The levels that are written.
    pub(crate) first: u32,
    pub(crate) last: u32,
    /// Blocks of 8x8 texels of the level that is read, one an invocation; of a coarse step the
    /// texels that are written.
    pub(crate) blocks: [u32; 2],
}

impl Step {
    /// Whether one workgroup makes all levels that are left: `reduce_tail` of
    /// `shaders/reduce.wgsl`.
    pub(crate) fn is_tail(&self) -> bool {
        self.source > 0 && self.last > self.source + BLOCK_LOG2
    }

    /// Whether a texel takes more than one block: `shaders/reduce_coarse.wgsl` makes such a level.
    pub(crate) fn is_coarse(&self) -> bool {
        self.first > self.source + BLOCK_LOG2
    }

    /// Texels along a side that a block makes of level `k`.
    fn texels_a_block(&self, k: u32) -> u32 {
        if self.is_coarse() { 1 } else { 1 << BLOCK_LOG2 >> (k - self.source) }
    }
}

/// Sizes and places of all levels of a pyramid, and the dispatches that fill them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PyramidLayout {
    pub(crate) size: ImageSize,
    /// All levels; offset and stride are 0 where one is not stored.
    pub(crate) levels: Vec<Level>,
    /// Which are stored, cut to those that there are; `first` past the last: none.
    pub(crate) stored: StoredLevels,
    pub(crate) steps: Vec<Step>,
    /// Texels of the header and of the stored levels, padding included.
    pub(crate) texels: u64,
    /// A chunk holds `1 << chunk_shift` texels.
    pub(crate) chunk_shift: u32,
    /// Where the levels lie in an atlas.
    pub(crate) atlas: AtlasLayout,
}

impl PyramidLayout {
    /// The layout for an image of `size`, with chunks of `1 << chunk_shift` texels.
    pub(crate) fn new(size: ImageSize, stored: StoredLevels, chunk_shift: u32) -> Result<Self> {
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
        // An image of one pixel stores nothing: first 1, last 0.
        let coarsest = levels.len() as u32 - 1;
        let stored = StoredLevels {
            first: stored.first.min(coarsest.max(1)),
            last: stored.last.min(coarsest),
        };
        let steps = passes(&levels, stored);
        let mut texels = HEADER_TEXELS;
        for step in &steps {
            for k in step.first..=step.last {
                let level = &mut levels[k as usize];
                let [stride, rows] = step.blocks.map(|n| n * step.texels_a_block(k));
                level.stride = stride.next_multiple_of(ROW_ALIGNMENT);
                level.offset = u32::try_from(texels)
                    .map_err(|_| Error::limit("pyramid texels", texels, u64::from(u32::MAX)))?;
                texels += u64::from(level.stride) * u64::from(rows);
            }
        }
        let steps = with_tail(&levels, steps);
        let atlas = AtlasLayout::new(&levels, stored);
        let layout = Self { size, levels, stored, steps, texels, chunk_shift, atlas };
        if layout.chunk_sizes().len() > PYRAMID_CHUNKS {
            return Err(Error::limit(
                "pyramid texels",
                texels,
                (PYRAMID_CHUNKS as u64) << chunk_shift,
            ));
        }
        Ok(layout)
    }

    /// Whether a level, 0 among them, can be read.
    pub(crate) fn is_there(&self, level: u32) -> bool {
        level == 0 || (self.stored.first..=self.stored.last).contains(&level)
    }

    /// The stored levels and their numbers.
    pub(crate) fn stored_levels(&self) -> impl Iterator<Item = (usize, &Level)> {
        stored_levels(&self.levels, self.stored)
    }

    /// Texels of each chunk.
    pub(crate) fn chunk_sizes(&self) -> Vec<u64> {
        let chunk = 1_u64 << self.chunk_shift;
        let count = self.texels.div_ceil(chunk);
        (0..count).map(|i| (self.texels - i * chunk).min(chunk)).collect()
    }

    /// The number of levels, level 0 included.
    pub(crate) fn num_levels(&self) -> u32 {
        self.levels.len() as u32
    }
}

/// Those of `levels` that are stored, and their numbers.
pub(crate) fn stored_levels(
    levels: &[Level],
    stored: StoredLevels,
) -> impl Iterator<Item = (usize, &Level)> {
    let is_stored = move |k: usize| (stored.first..=stored.last).contains(&(k as u32));
    levels.iter().enumerate().filter(move |(k, _)| is_stored(*k))
}

/// One workgroup reads so many texels faster than a dispatch starts (docs/performance.md).
const TAIL_TEXELS: u32 = 1 << 15;

/// The passes, the last of them made one dispatch where they are small.
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

/// The passes that fill the stored levels; one at least, for it writes the header.
fn passes(levels: &[Level], stored: StoredLevels) -> Vec<Step> {
    let StoredLevels { first, last } = stored;
    let mut steps = Vec::new();
    let columns = |texels: u32| texels.next_multiple_of(BLOCK_ALIGNMENT);
    let (mut source, mut first) = (0, first);
    if first > last {
        return vec![Step { source, first, last, blocks: [0, 0] }];
    }
    if first > BLOCK_LOG2 {
        // More than a block a texel: a shader of its own makes this level alone.
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

/// How many texels one storage binding may hold, as a power of two.
pub(crate) fn chunk_shift(limits: &wgpu::Limits) -> u32 {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).max(4);
    (bytes / 4).ilog2().min(30)
}

/// Invocations of one workgroup of the cull of groups and of updates; `shaders/cull_groups.wgsl`,
/// `WORKGROUP`, and `update.wgsl`.
pub(crate) const CULL_WORKGROUP: u32 = 128;

/// How many instances one piece may hold: its records in one texture and one staging buffer, its
/// verdicts in one binding, its workgroups in one dimension of a dispatch.
pub(crate) fn piece_capacity(record_bytes: u64, limits: &wgpu::Limits) -> u32 {
    let rows = u64::from(limits.max_texture_dimension_2d) * u64::from(RECORDS_PER_ROW);
    let staging = limits.max_buffer_size / record_bytes;
    // A word of a verdict, and a bit of the mask.
    let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 5;
    let dispatch =
        u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(CULL_WORKGROUP);
    // Whole rows, so that a staging area is not padded past the limit.
    let whole =
        rows.min(staging).min(binding).min(dispatch).min(1 << 24) / u64::from(RECORDS_PER_ROW);
    u32::try_from(whole * u64::from(RECORDS_PER_ROW)).unwrap_or(1 << 24)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(width: u32, height: u32) -> Vec<(u32, u32)> {
        let layout =
            PyramidLayout::new(ImageSize::new(width, height), StoredLevels::ALL, 25).unwrap();
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
        for (w, h) in [(7, 5), (1023, 769), (1, 17), (640, 360)] {
            let layout = PyramidLayout::new(ImageSize::new(w, h), StoredLevels::ALL, 25).unwrap();
            let mut end = 4;
            for level in &layout.levels[1..] {
                assert!(
                    level.offset >= end
                        && level.offset.is_multiple_of(4)
                        && level.stride.is_multiple_of(64)
                );
                assert!(level.stride >= level.width);
                end = level.offset + level.stride * level.height;
            }
            assert!(u64::from(end) <= layout.texels);
        }
    }

    #[test]
    fn a_level_alone_takes_one_dispatch_and_all_of_a_screen_take_two() {
        let steps = |size, levels| PyramidLayout::new(size, levels, 25).unwrap().steps;
        let (screen, pixel) = (ImageSize::new(1920, 1080), ImageSize::new(1, 1));
        for level in 1..=15 {
            let alone = steps(screen, StoredLevels::only(level));
            assert_eq!(alone.len(), 1, "level {level}");
            let made = level.min(11);
            assert_eq!((alone[0].source, alone[0].first, alone[0].last), (0, made, made));
        }
        let all = steps(screen, StoredLevels::ALL);
        assert_eq!(all.iter().map(|s| (s.source, s.last)).collect::<Vec<_>>(), [(0, 3), (3, 11)]);
        // The header alone: no block may be written where nothing is stored.
        assert_eq!(
            steps(pixel, StoredLevels::ALL),
            [Step { source: 0, first: 1, last: 0, blocks: [0, 0] }]
        );
    }

    #[test]
    fn the_largest_image_of_lavapipe_fits_three_bindings() {
        let layout =
            PyramidLayout::new(ImageSize::new(16_384, 16_384), StoredLevels::ALL, 25).unwrap();
        assert_eq!(layout.chunk_sizes().len(), 3);
        assert!(layout.chunk_sizes().iter().sum::<u64>() >= layout.texels);
        let error = PyramidLayout::new(ImageSize::new(64, 64), StoredLevels::ALL, 4).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }));
    }

    /// Each limit alone, worked out by hand: what only twenty million instances meet on a device.
    #[test]
    fn every_limit_makes_pieces_smaller() {
        let large = wgpu::Limits {
            max_texture_dimension_2d: 1 << 20,
            max_buffer_size: 1 << 40,
            max_storage_buffer_binding_size: 1 << 40,
            max_compute_workgroups_per_dimension: 1 << 30,
            ..wgpu::Limits::default()
        };
        // Indices of a piece are exact as float32.
        assert_eq!(piece_capacity(64, &large), 1 << 24);
        let rows = wgpu::Limits { max_texture_dimension_2d: 8, ..large.clone() };
        assert_eq!(piece_capacity(64, &rows), 8 * 1024);
        // 2^20 bytes are 16384 records of 64 bytes.
        // Of 32 bytes they would be 32768.
        let buffer = wgpu::Limits { max_buffer_size: 1 << 20, ..large.clone() };
        assert_eq!((piece_capacity(64, &buffer), piece_capacity(32, &buffer)), (16_384, 32_768));
        // A word of a verdict and a bit of the mask, 5 bytes with room: 209715, in whole rows.
        let binding = wgpu::Limits { max_storage_buffer_binding_size: 1 << 20, ..large.clone() };
        assert_eq!(piece_capacity(64, &binding), 204 * 1024);
        // Workgroups of 128.
        let dispatch = wgpu::Limits { max_compute_workgroups_per_dimension: 100, ..large };
        assert_eq!(piece_capacity(64, &dispatch), 12 * 1024);
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

    #[test]
    fn pieces_fit_the_binding_and_the_dispatch() {
        let limits = wgpu::Limits::default();
        for bytes in [32, 48, 64] {
            let piece = u64::from(piece_capacity(bytes, &limits));
            assert!(piece * bytes <= 256 << 20, "records wait in one buffer");
            assert!(piece / 1024 <= 8192, "and lie in the rows of one texture");
            assert!(4 * piece + piece / 8 <= 128 << 20, "verdicts and the mask are one binding");
            assert!(piece.is_multiple_of(128) && piece / 128 <= 65_535);
            assert!(piece > 2_000_000);
        }
    }
}
