//! The size of an image, and its depth convention.

use crate::error::{Error, Result};

/// The largest image side in pixels: 32768.
///
/// The certificates are derived for it: pixel edges times 2^16 stay inside float32.
pub const MAX_IMAGE_SIDE: u32 = 32_768;

/// Which end of the NDC depth range `0..1` is far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum DepthConvention {
    /// Near 0, far 1.
    Standard,
    /// Near 1, far 0, also called reversed Z.
    ///
    /// With float depth this spreads the precision evenly over the distance.
    Reversed,
}

impl DepthConvention {
    /// Whether depth 1 is near.
    pub fn is_reversed(self) -> bool {
        self == Self::Reversed
    }

    /// The depth where nothing is drawn: 1 (standard) or 0 (reversed).
    pub fn far(self) -> f32 {
        match self {
            Self::Standard => 1.0,
            Self::Reversed => 0.0,
        }
    }

    /// The nearest depth, which nothing is in front of.
    pub(crate) fn near(self) -> f32 {
        1.0 - self.far()
    }
}

/// The size of an image in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ImageSize {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl ImageSize {
    /// A size of `width` columns and `height` rows.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height }
    }

    /// The number of pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

impl std::fmt::Display for ImageSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "(height {}, width {})", self.height, self.width)
    }
}

pub(crate) fn check_size(size: ImageSize) -> Result<()> {
    if size.width == 0 || size.height == 0 {
        return Err(Error::invalid(
            "size",
            format!("expected at least one pixel a side, got {size}"),
        ));
    }
    let side = size.width.max(size.height);
    if side > MAX_IMAGE_SIDE {
        return Err(Error::limit(
            "image side in pixels",
            u64::from(side),
            u64::from(MAX_IMAGE_SIDE),
        ));
    }
    Ok(())
}
