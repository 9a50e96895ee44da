//! Planning: levels, sizes, offsets and pieces; integers only, no device.
//!
//! Level 0 of a pyramid is the depth image itself. Levels 1 and up are ceil-halved, so a texel of level k covers exactly the
//! pixel block `[x << k, (x + 1) << k)`; they lie one after the other in one list of texels whose rows are padded to 4 (for
//! vector stores), cut into chunks that each fit one storage binding.

use crate::camera::ImageSize;
use crate::error::{Error, Result};

/// The most levels a pyramid has: 32768 pixels a side.
pub const MAX_LEVELS: usize = 16;

/// How many storage bindings hold a pyramid: with level 0 in a texture, 16384 x 16384 pixels need three of 128 MiB.
pub(crate) const PYRAMID_CHUNKS: usize = 3;

/// Rows start at multiples of this many texels.
const ROW_ALIGNMENT: u32 = 4;

/// Texels before level 1. The first holds the number of the reduction that filled the pyramid: a cull that expects another one
/// (recorded, but not submitted before it) keeps everything. 0, as buffers begin, is never a number.
const HEADER_TEXELS: u64 = 4;

/// Where a level lies in the list of texels. Level 0 lies in the depth texture: offset and stride are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Level {
    pub(crate) offset: u32,
    pub(crate) stride: u32,
    pub(crate) width: u32,
    pub(crate) height: u32,
}

/// Sizes and places of all levels of a pyramid.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PyramidLayout {
    pub(crate) size: ImageSize,
    pub(crate) levels: Vec<Level>,
    /// Texels of the header and of levels 1 and up, padding included.
    pub(crate) texels: u64,
    /// A chunk holds `1 << chunk_shift` texels.
    pub(crate) chunk_shift: u32,
}

impl PyramidLayout {
    /// The layout for an image of `size`, with chunks of `1 << chunk_shift` texels.
    pub(crate) fn new(size: ImageSize, chunk_shift: u32) -> Result<Self> {
        debug_assert!(1 << chunk_shift >= ROW_ALIGNMENT, "a vector store must not straddle chunks");
        let mut levels = vec![Level { offset: 0, stride: 0, width: size.width, height: size.height }];
        let mut texels = HEADER_TEXELS;
        let (mut width, mut height) = (size.width, size.height);
        while width > 1 || height > 1 {
            (width, height) = (width.div_ceil(2), height.div_ceil(2));
            let stride = width.next_multiple_of(ROW_ALIGNMENT);
            let offset =
                u32::try_from(texels).map_err(|_| Error::limit("pyramid texels", texels, u64::from(u32::MAX)))?;
            levels.push(Level { offset, stride, width, height });
            texels += u64::from(stride) * u64::from(height);
        }
        let layout = Self { size, levels, texels, chunk_shift };
        if layout.chunk_sizes().len() > PYRAMID_CHUNKS {
            return Err(Error::limit("pyramid texels", texels, (PYRAMID_CHUNKS as u64) << chunk_shift));
        }
        Ok(layout)
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

/// How many texels one storage binding may hold, as a power of two.
pub(crate) fn chunk_shift(limits: &wgpu::Limits) -> u32 {
    let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size).max(4);
    (bytes / 4).ilog2().min(30)
}

/// Invocations of one workgroup of the cull; `shaders/cull.wgsl`, `WORKGROUP`.
pub(crate) const CULL_WORKGROUP: u32 = 128;

/// How many instances one piece may hold: its records in one binding, its workgroups in one dimension of a dispatch.
pub(crate) fn piece_capacity(record_bytes: u64, limits: &wgpu::Limits) -> u32 {
    let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / record_bytes;
    let dispatch = u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(CULL_WORKGROUP);
    // Whole workgroups, so that the bit masks of the pieces join without shifting.
    let whole = binding.min(dispatch).min(1 << 24) / u64::from(CULL_WORKGROUP) * u64::from(CULL_WORKGROUP);
    u32::try_from(whole).unwrap_or(1 << 24)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(width: u32, height: u32) -> Vec<(u32, u32)> {
        let layout = PyramidLayout::new(ImageSize::new(width, height), 25).unwrap();
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
            let layout = PyramidLayout::new(ImageSize::new(w, h), 25).unwrap();
            let mut end = 4;
            for level in &layout.levels[1..] {
                assert_eq!((level.offset, level.stride % 4), (end, 0));
                assert!(level.stride >= level.width);
                end = level.offset + level.stride * level.height;
            }
            assert_eq!(u64::from(end), layout.texels);
        }
    }

    #[test]
    fn the_largest_image_of_lavapipe_fits_three_bindings() {
        let layout = PyramidLayout::new(ImageSize::new(16_384, 16_384), 25).unwrap();
        assert_eq!(layout.chunk_sizes().len(), 3);
        assert!(layout.chunk_sizes().iter().sum::<u64>() >= layout.texels);
        let error = PyramidLayout::new(ImageSize::new(64, 64), 4).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }));
    }

    #[test]
    fn pieces_fit_the_binding_and_the_dispatch() {
        let limits = wgpu::Limits::default();
        for bytes in [32, 48, 64] {
            let piece = u64::from(piece_capacity(bytes, &limits));
            assert!(piece * bytes <= 128 << 20 && piece.is_multiple_of(128) && piece / 128 <= 65_535);
            assert!(piece > 2_000_000);
        }
    }
}
