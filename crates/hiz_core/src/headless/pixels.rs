//! The counts of pixels of a submitted cull, on the host.

use crate::error::Result;
use crate::headless::culling::Culling;
use crate::headless::ranges::pixel_ranges;
use crate::host::memory;
use crate::output::pixels::PixelCounts;

impl Culling {
    /// In how many pixels each instance is hidden, and in how many it may show, by its index.
    ///
    /// # Errors
    /// - [`Error::Mismatch`](crate::Error::Mismatch) for a cull without
    ///   [`Outputs::pixels`](crate::Outputs::pixels).
    /// - [`Error::DeviceLost`](crate::Error::DeviceLost),
    ///   [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub fn pixels(&self) -> Result<Vec<PixelCounts>> {
        self.require("pixels", self.visible.outputs().pixels)?;
        let parts = self.read(&pixel_ranges(&self.instances, &self.visible))?;
        let mut counts = memory::list(self.instances.len() as usize, "pixels")?;
        for part in parts {
            counts.extend(bytemuck::pod_collect_to_vec::<u8, PixelCounts>(&part));
        }
        Ok(counts)
    }
}
