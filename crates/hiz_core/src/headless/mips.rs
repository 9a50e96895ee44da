//! Mip textures of pyramids, and their levels as arrays.

use std::sync::atomic::Ordering;

use crate::error::{Error, Result};
use crate::headless::engine::Engine;
use crate::headless::readback::{self, to_u32};
use crate::host::memory;
use crate::input::image::ImageSize;
use crate::pyramid::Pyramid;
use crate::pyramid::mips::{MipDepths, MipOptions, MipTexture};
use crate::pyramid::mips_passes::record_mips;
use crate::pyramid::source::DepthSource;

impl Engine {
    /// Makes a mip texture of the depth image that a pyramid was built from.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for a pyramid of another device, and for one that was never built.
    /// - [`Error::Mismatch`] for the nearest depths of a converted image that was uploaded for
    ///   [`Depths::Farthest`](crate::Depths::Farthest), if pixels became far that may have no depth.
    /// - Those of [`HizContext::create_mip_texture`](crate::HizContext::create_mip_texture) and
    ///   [`HizContext::record_mips`](crate::HizContext::record_mips).
    pub fn mips(&self, pyramid: &Pyramid, options: &MipOptions) -> Result<MipTexture> {
        self.check_process()?;
        let gpu = &self.context().gpu;
        gpu.check_context("pyramid", pyramid.context)?;
        let built = pyramid.built().ok_or_else(|| {
            Error::mismatch(
                "pyramid",
                "expected one that was built from a depth image, got one that never was",
            )
        })?;
        if options.depths != MipDepths::Farthest && pyramid.no_data_is_far.load(Ordering::Relaxed) {
            return Err(Error::mismatch(
                "depths",
                format!(
                    "expected MipDepths::Farthest, got {:?}: the conversion of this depth image \
                     has made pixels without a depth far, and to the nearest depth they are near; \
                     build the pyramid with depths both",
                    options.depths
                ),
            ));
        }
        let of = &built.part.subresource;
        // Without the farthest depths the image is that of the nearest samples.
        let has_nearest_alone = built.part.samples > 1 && !pyramid.depths().has_farthest();
        let nearest = built.part.nearest.as_ref().or(has_nearest_alone.then_some(&of.texture));
        let depth = DepthSource {
            mip_level: Some(of.mip_level),
            array_layer: Some(of.array_layer),
            origin: built.part.origin,
            size: Some(pyramid.size()),
            samples: built.part.samples,
            nearest,
            ..DepthSource::from(&of.texture)
        };
        self.scoped(|| {
            self.bring_image_of(pyramid);
            let mips = MipTexture::new(gpu, pyramid.size(), options)?;
            let _in_order = pyramid.submitting.lock();
            let mut encoder = self.encoder("hiz.mips.encoder");
            record_mips(gpu, &mut encoder, &depth, built.camera.convention(), &mips)?;
            self.queue().submit([encoder.finish()]);
            Ok(mips)
        })
    }

    /// Reads a level of a mip texture, counted from the depth image: row by row, row 0 on top.
    ///
    /// There is one float32 per texel, or the farthest depth and the nearest one after the other
    /// with [`MipDepths::Both`](crate::MipDepths::Both).
    ///
    /// # Errors
    /// - [`Error::Invalid`] for a level that is not there.
    /// - [`Error::Mismatch`] for a texture of another device.
    /// - [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read_mip(&self, mips: &MipTexture, level: u32) -> Result<Vec<f32>> {
        self.check_process()?;
        self.context().gpu.check_context("mips", mips.context())?;
        let (place, size) = mips.place_of(level).zip(mips.level_size(level)).ok_or_else(|| {
            let (first, end) = (mips.first_level(), mips.num_levels());
            Error::invalid("level", format!("expected {first} <= level < {end}, got {level}"))
        })?;
        let texel = u64::from(mips.options().format().block_copy_size(None).unwrap_or(4));
        // Only whole textures of depth have to be copied as a whole, but it is simple.
        let whole = ImageSize::new(
            (mips.texture().width() >> place.mip_level).max(1),
            (mips.texture().height() >> place.mip_level).max(1),
        );
        let crop = readback::Crop {
            skip: texel * u64::from(place.origin.x),
            row: texel * u64::from(size.width),
            first: u64::from(place.origin.y),
            rows: u64::from(size.height),
        };
        let copied = wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d::ZERO, ..place };
        let bytes = self.scoped(|| {
            readback::read_texels(self.device(), self.queue(), (copied, whole), &crop)
        })?;
        memory::collected(to_u32(&bytes).map(f32::from_bits), "level")
    }
}
