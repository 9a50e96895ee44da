//! The library's own rasteriser on one thread, to be timed beside tiling without depths.

use crate::error::Result;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::occluders::drawing::DrawOptions;
use crate::occluders::host_raster::{HostRaster, Way};
use crate::occluders::surface::OccluderSurface;

/// Tiles with depth.
#[derive(Debug)]
pub struct DepthTiles {
    raster: HostRaster,
    size: ImageSize,
}

impl DepthTiles {
    /// An empty image.
    pub fn new(size: ImageSize) -> Self {
        Self { raster: HostRaster::new(size), size }
    }

    /// Clears the image and draws all triangles, without those that are hidden.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold.
    ///
    /// # Panics
    /// If the camera's size is not that of the image.
    pub fn draw(&mut self, surface: &OccluderSurface, camera: &Camera) -> Result<()> {
        assert_eq!(camera.size(), self.size, "the camera's size");
        self.raster.clear();
        let way = Way { threads: Some(1), skip: true };
        surface.draw_into(&mut self.raster, camera, way, &DrawOptions::default()).map(drop)
    }

    /// Whether each pixel is covered, row 0 on top.
    pub fn coverage(&self) -> Vec<bool> {
        let mut depth = vec![0.0; self.size.pixels() as usize];
        // Reversed depth is above 0 wherever something was drawn, however far.
        self.raster.write(&mut depth, DepthConvention::Reversed, Some(1));
        depth.into_iter().map(|depth| depth > 0.0).collect()
    }

    /// Bytes of the image.
    pub fn bytes(&self) -> u64 {
        self.raster.bytes()
    }
}
