//! The rasteriser on the host by itself, without upload and pyramid.

use crate::error::Result;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::occluders::drawing::DrawOptions;
use crate::occluders::host_raster::planted_fault::Planted;
#[cfg(feature = "testing")]
use crate::occluders::host_raster::planted_fault::RasterFault;
use crate::occluders::host_raster::{self, Way};
use crate::occluders::surface::OccluderSurface;

/// An image of the rasteriser on the host, drawn in chosen ways.
#[derive(Debug)]
pub struct HostRaster {
    raster: host_raster::HostRaster,
    size: ImageSize,
}

impl HostRaster {
    /// An image of about so many columns and rows of panes; a thread draws whole panes.
    pub fn new(size: ImageSize, grid: [usize; 2]) -> Self {
        let raster = host_raster::HostRaster::with_fault(size, grid, Planted::default());
        Self { raster, size }
    }

    /// An image in the panes that drawings outside of this module have, by their threads.
    pub fn usual(size: ImageSize) -> Self {
        Self { raster: host_raster::HostRaster::new(size), size }
    }

    /// An image like [`HostRaster::new`], whose rasteriser has a planted fault.
    #[cfg(feature = "testing")]
    pub fn with_fault(size: ImageSize, grid: [usize; 2], fault: Option<RasterFault>) -> Self {
        Self { raster: host_raster::HostRaster::with_fault(size, grid, Planted(fault)), size }
    }

    /// Clears the image and draws `surface` as `camera` sees it.
    ///
    /// `skip` says whether meshlets that are hidden are left out, which changes no pixel.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) for a camera that float32 cannot hold.
    ///
    /// # Panics
    /// If the camera's size is not that of the image.
    pub fn draw(
        &mut self,
        surface: &OccluderSurface,
        camera: &Camera,
        threads: usize,
        skip: bool,
    ) -> Result<()> {
        assert_eq!(camera.size(), self.size, "the camera's size");
        self.raster.clear();
        surface
            .draw_into(
                &mut self.raster,
                camera,
                Way { threads: Some(threads), skip },
                &DrawOptions::default(),
            )
            .map(drop)
    }

    /// Writes the NDC depth of `camera`'s convention, one number per pixel, row 0 on top.
    ///
    /// # Panics
    /// If `out` does not have one number per pixel.
    pub fn write(&self, out: &mut [f32], camera: &Camera, threads: usize) {
        assert_eq!(out.len() as u64, self.size.pixels(), "one number per pixel");
        self.raster.write(out, camera.convention(), Some(threads));
    }
}
