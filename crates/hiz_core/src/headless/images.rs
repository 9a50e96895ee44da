//! The depth images of occluders, lent from drawing to drawing.
//!
//! An image of 1080p takes milliseconds to be made: its memory is touched for the first time.
//! So an image that was dropped serves the next drawing of the same size.
//! An image that is alive stays as it is, and so does one that a pyramid or a cull still reads, or
//! whose texture the caller has seen.

use std::sync::Arc;

use crate::context::HizContext;
use crate::error::Result;
use crate::host::threads::Locked;
use crate::input::image::ImageSize;
use crate::occluders::depth::OccluderDepth;
use crate::occluders::drawing::Rasteriser;

/// Pixels of all kept images at most: one of 4K, or four of 1080p.
///
/// A pixel takes 4 bytes in the texture, and about 6 on the host where that one draws.
/// It takes 4 more in a buffer through which rows come to the texture, or up to 6 in one that has
/// levels, too; of each kind two are kept per image at most.
const MOST_PIXELS: u64 = 1 << 23;

/// The images of an engine that may be lent again, with the rasteriser that was asked for.
#[derive(Debug, Default)]
pub(super) struct Images(Locked<Vec<(Rasteriser, Arc<OccluderDepth>)>>);

impl Images {
    /// An image of `size`: one that is free, or a new one.
    pub(super) fn lend(
        &self,
        context: &HizContext,
        size: ImageSize,
        rasteriser: Rasteriser,
    ) -> Result<Arc<OccluderDepth>> {
        let mut kept = self.0.lock();
        let mut fitting = kept
            .iter_mut()
            .filter(|(asked, image)| *asked == rasteriser && image.size() == size)
            .map(|(_, image)| image);
        if let Some(free) = fitting.find_map(|image| Arc::get_mut(image).is_some().then_some(image))
        {
            return Ok(Arc::clone(free));
        }
        drop(kept);
        let image = Arc::new(OccluderDepth::new(&context.gpu, size, rasteriser, true)?);
        let mut kept = self.0.lock();
        let pixels = |kept: &[(Rasteriser, Arc<OccluderDepth>)]| -> u64 {
            kept.iter().map(|(_, image)| image.size().pixels()).sum()
        };
        // Images that are free and of no use now give way.
        if pixels(&kept) + size.pixels() > MOST_PIXELS {
            kept.retain_mut(|(_, image)| Arc::get_mut(image).is_none());
        }
        if pixels(&kept) + size.pixels() <= MOST_PIXELS {
            kept.push((rasteriser, Arc::clone(&image)));
        }
        Ok(image)
    }

    /// Lends this image never again: the caller may hold a handle of its texture.
    pub(super) fn keep_apart(&self, image: &Arc<OccluderDepth>) {
        self.0.lock().retain(|(_, kept)| !Arc::ptr_eq(kept, image));
    }

    /// Lends none of the images so far again, after an error on the device.
    pub(super) fn forget(&self) {
        self.0.lock().clear();
    }
}
