//! A receiver mask on the engine's own device.

use crate::error::Result;
use crate::headless::depth_image::DepthImage;
use crate::headless::engine::Engine;
use crate::input::camera::Camera;
use crate::pyramid::ends::Depths;
use crate::pyramid::receiver_mask::{ReceiverMask, ReceiverMaskOptions, record_receiver_mask};

impl Engine {
    /// The depth image of `light` that holds the farthest receivers in `depth`.
    ///
    /// # Errors
    /// Those of [`HizContext::record_receiver_mask`](crate::HizContext::record_receiver_mask).
    pub fn receiver_mask(
        &self,
        depth: &DepthImage,
        light: &Camera,
        options: &ReceiverMaskOptions,
    ) -> Result<DepthImage> {
        self.check_process()?;
        depth.check_depths(Depths::Receivers)?;
        let gpu = &self.context().gpu;
        self.scoped(|| {
            let mask = ReceiverMask::new(gpu, light.size())?;
            let mut encoder = self.encoder("hiz.receiver_mask.encoder");
            let (source, cameras) = (depth.source(), [depth.camera(), light]);
            record_receiver_mask(gpu, &mut encoder, &source, cameras, &mask, options)?;
            self.queue().submit([encoder.finish()]);
            DepthImage::of_texture(self, mask.texture(), light)
        })
    }
}
