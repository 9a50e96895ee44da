//! Depth images on the device.

use super::{Engine, to_u32};
use crate::camera::{Camera, ImageSize};
use crate::error::Result;
use crate::host;
use crate::readback;

/// A depth image on the device and the camera that it was made by.
#[derive(Debug, Clone)]
pub struct DepthImage {
    pub(super) engine: Engine,
    pub(super) texture: wgpu::Texture,
    pub(super) view: wgpu::TextureView,
    pub(super) camera: Camera,
}

impl DepthImage {
    /// The image's size.
    pub fn size(&self) -> ImageSize {
        self.camera.size()
    }

    /// The camera that it was made by.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The texture.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// The depth as given, row 0 on top.
    ///
    /// # Errors
    /// [`Error::DeviceLost`](crate::Error::DeviceLost), [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn read(&self) -> Result<Vec<f32>> {
        let engine = &self.engine;
        let bytes = engine.scoped(|| readback::read_texture(engine.device(), engine.queue(), &self.texture, 4))?;
        host::collected(to_u32(&bytes).map(f32::from_bits), "depth")
    }
}
