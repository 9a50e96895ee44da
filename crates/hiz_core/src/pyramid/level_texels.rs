//! Where the texels of a level lie on the device, for shaders that show or read them.

use crate::input::image::ImageSize;
use crate::pyramid::Pyramid;

/// The texels of one stored level in a buffer on the device.
///
/// Each is a float32 of NDC depth: the farthest of a block of `2^level` by `2^level` pixels, or the
/// nearest ([`Pyramid::nearest_texels`]).
/// Texel `(x, y)` is word `first + y * stride + step * x` of the buffer, with row 0 on top.
/// The words are those of the last reduction that has run.
///
/// # Examples
/// ```
/// use hiz_core::headless::Engine;
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let engine = Engine::new(None)?;
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(16, 8))?;
///
/// let pyramid = engine.pyramid(&engine.upload_depth(&[0.5; 16 * 8], &camera)?)?;
/// let level = pyramid.level_texels(1).expect("it is stored");
/// assert_eq!((level.size.width, level.size.height), (8, 4));
/// assert!(level.stride >= 8 && level.step == 1);
/// assert!(pyramid.level_texels(0).is_none()); // the depth image itself
/// assert!(pyramid.nearest_texels(1).is_none()); // `Depths::Both` stores them, too
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct LevelTexels<'a> {
    /// The buffer, with the usages `STORAGE` and `COPY_SRC`; do not write to it.
    pub buffer: &'a wgpu::Buffer,
    /// The word of the level's first texel.
    pub first: u32,
    /// Words from row to row.
    pub stride: u32,
    /// Words from texel to texel of a row: 2 where the pyramid has both ends, which lie side by
    /// side, and otherwise 1.
    pub step: u32,
    /// Columns and rows.
    pub size: ImageSize,
}

impl Pyramid {
    /// The texels of a level on the device, for a shader that shows them.
    /// They have the farthest depths, or the nearest where the pyramid has these alone.
    ///
    /// `None` for these levels:
    ///
    /// - level 0, which is the depth image;
    /// - a level that is not stored, or past the last one;
    /// - a level that needs more than one storage binding of this device.
    pub fn level_texels(&self, level: u32) -> Option<LevelTexels<'_>> {
        self.texels_of(level, 0)
    }

    /// As [`Pyramid::level_texels`], of the nearest depths of each block.
    ///
    /// `None` also where the pyramid does not store these ([`Pyramid::has_nearest`]).
    pub fn nearest_texels(&self, level: u32) -> Option<LevelTexels<'_>> {
        if !self.has_nearest() {
            return None;
        }
        self.texels_of(level, self.layout.nearest)
    }

    /// The texels of a level that lie `behind` words behind its first ones.
    fn texels_of(&self, level: u32, behind: u32) -> Option<LevelTexels<'_>> {
        if level == 0 || !self.layout.is_there(level) {
            return None;
        }
        let found = self.layout.levels.get(level as usize)?;
        let first = found.offset + behind;
        let last = found.offset + found.stride * found.height - 1;
        let [chunk, other] = [first, last].map(|word| word >> self.layout.chunk_shift);
        if chunk != other {
            return None;
        }
        Some(LevelTexels {
            buffer: &self.chunks[chunk as usize],
            first: first - (chunk << self.layout.chunk_shift),
            stride: found.stride,
            step: self.layout.depths.count() as u32,
            size: ImageSize::new(found.width, found.height),
        })
    }
}
