//! The face of occluders: meshes that are drawn into a depth image.

use super::HizContext;
use crate::error::Result;
use crate::input::camera::Camera;
use crate::input::image::ImageSize;
use crate::input::mesh::MeshData;
use crate::occluders::depth::OccluderDepth;
use crate::occluders::device_raster::record_occluders;
use crate::occluders::drawing::{DrawOptions, OccluderOptions, Rasteriser, Touched};
use crate::occluders::uploaded::Occluders;

#[cfg(doc)]
use crate::error::Error;

/// Occluders, drawn into a depth image.
impl HizContext {
    /// Makes occluders from triangle meshes.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for arrays of the wrong length, indices out of range and unusable
    ///   transforms or positions.
    /// - [`Error::Limit`] for meshes larger than the device's buffers.
    /// - [`Error::OutOfMemory`].
    pub fn create_occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Occluders> {
        Occluders::new(&self.gpu, meshes, options)
    }

    /// Makes a depth image that occluders are drawn into.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn create_occluder_depth(
        &self,
        size: ImageSize,
        rasteriser: Rasteriser,
    ) -> Result<OccluderDepth> {
        OccluderDepth::new(&self.gpu, size, rasteriser, false)
    }

    /// Records the drawing of `occluders` into `depth`, which [`record_reduce`](Self::record_reduce)
    /// then takes.
    ///
    /// Returns the rectangle around what was drawn: columns `x0..=x1` and rows `y0..=y1` as
    /// `[x0, y0, x1, y1]`.
    /// No pixel outside of it changes, except by [`DepthLoad::Clear`](crate::DepthLoad::Clear).
    ///
    /// The rasteriser on the host draws in this call, on all cores, and records a copy alone.
    /// With [`DepthLoad::Load`](crate::DepthLoad::Load) it adds to what earlier calls have drawn,
    /// so submit every recording, in their order.
    /// After one that was dropped begin with `Clear`: otherwise rows of an older image remain.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a camera of another size or, with `Load`, of another depth
    ///   convention, and for objects of another context.
    /// - [`Error::Invalid`] for copies that do not exist, and for a camera that float32 cannot hold.
    /// - [`Error::OutOfMemory`].
    pub fn record_occluder_depth(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        depth: &OccluderDepth,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        depth.record(&self.gpu, encoder, occluders, camera, options)
    }

    /// Records the drawing of `occluders` into the caller's own `target`, by the device's
    /// rasteriser.
    ///
    /// `target` is a view of one layer of a 2D `Depth32Float` texture of the camera's size.
    /// The texture has one mip level, one sample per pixel and the usage `RENDER_ATTACHMENT`.
    /// Returns the rectangle around what was drawn, as
    /// [`record_occluder_depth`](Self::record_occluder_depth) does.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a target of another size, format or device, for a destroyed target
    ///   and for occluders of another context.
    /// - [`Error::Invalid`] for a target with other usages, samples or mip levels, for copies that
    ///   do not exist, and for a camera that float32 cannot hold.
    pub fn record_occluders(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        occluders: &Occluders,
        camera: &Camera,
        target: &wgpu::TextureView,
        options: &DrawOptions<'_>,
    ) -> Result<Touched> {
        record_occluders(&self.gpu, encoder, occluders, camera, target, options)
    }
}
