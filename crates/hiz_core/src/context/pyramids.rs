//! The face of depth and pyramids: what is made of a depth image.

use super::HizContext;
use crate::error::Result;
use crate::input::camera::Camera;
use crate::input::image::{DepthConvention, ImageSize};
use crate::pyramid::mips::{MipOptions, MipTexture};
use crate::pyramid::mips_passes::record_mips;
use crate::pyramid::receiver_mask::{ReceiverMask, ReceiverMaskOptions, record_receiver_mask};
use crate::pyramid::reduce::record_reduce;
use crate::pyramid::region::record_reduce_region;
use crate::pyramid::resolve::{DepthResolve, ResolveOptions, record_resolve};
use crate::pyramid::source::DepthSource;
use crate::pyramid::{Pyramid, PyramidOptions};

#[cfg(doc)]
use crate::cull::options::CullOptions;
#[cfg(doc)]
use crate::error::Error;

/// Depth pyramids, and what else is made of a depth image.
impl HizContext {
    /// Makes an empty pyramid for depth images of `size` pixels.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0 and for options out of range.
    /// - [`Error::Limit`] for a size beyond the device's textures or bindings.
    /// - [`Error::OutOfMemory`].
    pub fn create_pyramid(&self, size: ImageSize, options: &PyramidOptions) -> Result<Pyramid> {
        Pyramid::new(&self.gpu, size, options)
    }

    /// Records the reduction of a depth image of `camera` into `pyramid`.
    ///
    /// `depth` is a 2D texture with one sample per pixel, or a view of one, or a part of one as
    /// [`DepthSource`] describes it.
    /// A view does not say which part of its texture it shows, so the depth of all of it is read.
    /// So the default view of a texture with a stencil will do, and a texture of several layers or
    /// mip levels needs a [`DepthSource`].
    /// Multisampled depth goes through [`record_resolve`](Self::record_resolve) first.
    /// These formats and usages are accepted:
    ///
    /// - Any depth format, `R32Float` or `R16Float`, with `TEXTURE_BINDING`.
    /// - `Rgba32Uint` with `STORAGE_BINDING`.
    ///   Each texel holds the float bits of four neighbouring pixels of a row.
    ///   The texture is `width.div_ceil(4)` texels wide.
    ///   Pixels past the width count as depth at the end of the row, so repeat the last pixel
    ///   there.
    ///
    /// Add the usage `COPY_SRC`, and large culls read faster ([`AtlasUse`](crate::AtlasUse)).
    /// The texture must neither change nor be destroyed before the culls that use it have run.
    /// Submit the reduction before these culls or with them.
    /// A cull that runs before its reduction keeps everything.
    ///
    /// Some formats round depth, and the pyramid keeps this slack ([`Pyramid::tolerance`]).
    /// Every cull counts it in addition to the slack of its [`CullOptions`].
    /// It is one step of `Depth16Unorm`, `Depth24Plus`, `Depth24PlusStencil8` and `R16Float`, and
    /// nothing for float32.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for other formats and usages, and for several layers, mip levels or
    ///   samples of which none is named.
    /// - [`Error::OutOfMemory`].
    pub fn record_reduce<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        pyramid: &Pyramid,
    ) -> Result<()> {
        record_reduce(&self.gpu, encoder, &depth.into(), camera, pyramid)
    }

    /// Records the reduction of a changed rectangle of a depth image into `pyramid`.
    ///
    /// The pyramid must have been built from `depth`, by [`record_reduce`](Self::record_reduce) or
    /// by this method, and no pixel may have changed since except those of the rectangle.
    /// `rectangle` is `[x0, y0, x1, y1]`: columns `x0..=x1` and rows `y0..=y1` of the image, row 0
    /// on top.
    /// It is what [`record_occluder_depth`](Self::record_occluder_depth) returns.
    /// The levels are then what a reduction of the whole image makes, bit for bit.
    ///
    /// Submit it after the reduction that came before.
    /// If that one never ran, culls keep everything until the whole image is reduced again.
    /// So do culls that were recorded before this reduction and run after it.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a pyramid that was never built, for another depth image and for a
    ///   destroyed texture.
    /// - [`Error::Invalid`] for a rectangle that is empty or reaches past the image.
    /// - [`Error::OutOfMemory`].
    pub fn record_reduce_region<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        rectangle: [u32; 4],
        pyramid: &Pyramid,
    ) -> Result<()> {
        record_reduce_region(&self.gpu, encoder, &depth.into(), rectangle, pyramid)
    }

    /// Makes what multisampled depth of `size` pixels is resolved into.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures.
    /// - [`Error::OutOfMemory`].
    pub fn create_depth_resolve(
        &self,
        size: ImageSize,
        options: &ResolveOptions,
    ) -> Result<DepthResolve> {
        DepthResolve::new(&self.gpu, size, options)
    }

    /// Records the resolve of multisampled depth of `camera`: one depth per pixel, the farthest of
    /// its samples, the nearest or both ([`ResolveOptions`]).
    ///
    /// `depth` is a texture with several samples per pixel, or a view or a part of one as
    /// [`DepthSource`] describes it.
    /// It has the usage `TEXTURE_BINDING`, and a depth format, `R32Float` or `R16Float`.
    /// The result is [`DepthResolve::farthest`], for [`record_reduce`](Self::record_reduce).
    ///
    /// Samples without a depth (NaN, outside of 0..=1) count as the reduction treats them: as far.
    /// For the nearest depth they count as near.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for one sample per pixel, and for other formats and usages.
    /// - [`Error::OutOfMemory`].
    pub fn record_resolve<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        resolve: &DepthResolve,
    ) -> Result<()> {
        record_resolve(&self.gpu, encoder, &depth.into(), camera, resolve)
    }

    /// Makes a receiver mask for the light's images of `size` pixels.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures or buffers.
    /// - [`Error::OutOfMemory`].
    pub fn create_receiver_mask(&self, size: ImageSize) -> Result<ReceiverMask> {
        ReceiverMask::new(&self.gpu, size)
    }

    /// Records the depth image of `light` that holds the farthest receivers which `camera` sees.
    ///
    /// It is for spot lights and the faces of point lights.
    /// [`ReceiverMask::image`] is reduced with the light's camera, and casters are culled by that
    /// pyramid as anything is.
    /// A culled caster shadows no receiver in `depth`.
    /// `docs/shadows.md` says what is promised.
    ///
    /// `depth` is as in [`record_reduce`](Self::record_reduce), with one sample per pixel.
    /// A pixel of exactly far is background.
    /// An invalid pixel (NaN, outside of 0..=1) keeps every caster.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for options out of range, cameras that float32 cannot hold, and textures
    ///   as in [`record_reduce`](Self::record_reduce).
    /// - [`Error::OutOfMemory`].
    pub fn record_receiver_mask<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        camera: &Camera,
        light: &Camera,
        mask: &ReceiverMask,
        options: &ReceiverMaskOptions,
    ) -> Result<()> {
        record_receiver_mask(&self.gpu, encoder, &depth.into(), [camera, light], mask, options)
    }

    /// Makes a texture with mip levels of depth, for depth images of `size` pixels.
    ///
    /// It is for shaders of the caller's own, such as screen-space reflections.
    /// No cull of this crate reads it.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a size of 0.
    /// - [`Error::Limit`] for a size beyond the device's textures, and for levels beyond one
    ///   storage binding.
    /// - [`Error::OutOfMemory`].
    pub fn create_mip_texture(&self, size: ImageSize, options: &MipOptions) -> Result<MipTexture> {
        MipTexture::new(&self.gpu, size, options)
    }

    /// Records the passes that fill `mips` from a depth image of its size.
    ///
    /// `depth` is what [`record_reduce`](Self::record_reduce) takes: the same formats, usages and
    /// parts of textures.
    /// Level 0 is the depth as given; no tolerance of its format is added.
    /// Shaders that run in later passes of the same encoder read the new levels.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for sizes or devices that disagree and for a destroyed texture.
    /// - [`Error::Invalid`] for other formats and usages, and for several layers, mip levels or
    ///   samples of which none is named.
    /// - [`Error::OutOfMemory`].
    pub fn record_mips<'a>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        depth: impl Into<DepthSource<'a>>,
        convention: DepthConvention,
        mips: &MipTexture,
    ) -> Result<()> {
        record_mips(&self.gpu, encoder, &depth.into(), convention, mips)
    }
}
