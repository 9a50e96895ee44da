//! How an occlusion map is made.

use crate::error::{Error, Result};
use crate::input::image::ImageSize;

/// How an occlusion map is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapOptions {
    /// The shorter side of the coarsest map, a power of two.
    pub least: u32,
    /// Regions along each side of the depth-estimation buffer: a power of two, at most the
    /// shorter side of the finest map.
    pub regions: u32,
    /// At most so many triangles are drawn; `None`: all in the frustum.
    pub max_triangles: Option<u64>,
    /// At most so many copies of meshes are drawn; `None`: all in the frustum.
    pub max_copies: Option<u64>,
}

impl Default for MapOptions {
    /// Those of the text: maps down to 4x4, and 64x64 regions.
    fn default() -> Self {
        Self { least: 4, regions: 64, max_triangles: None, max_copies: None }
    }
}

impl MapOptions {
    pub(super) fn check(&self, size: ImageSize) -> Result<()> {
        let ImageSize { width, height } = size;
        if !width.is_power_of_two() || !height.is_power_of_two() {
            return Err(Error::invalid("size", format!("expected powers of two, got {size}")));
        }
        let shorter = width.min(height);
        for (name, value) in [("least", self.least), ("regions", self.regions)] {
            if !value.is_power_of_two() || value > shorter {
                let message = format!("expected a power of two up to {shorter}, got {value}");
                return Err(Error::invalid(name, message));
            }
        }
        Ok(())
    }
}
