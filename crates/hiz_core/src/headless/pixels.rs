//! The counts of pixels of a submitted cull, on the host.

use crate::error::Result;
use crate::headless::answers::AnswerBuffers;
use crate::headless::culling::Culling;
use crate::headless::ranges::pixel_ranges;
use crate::headless::readback::Staged;
use crate::host::memory;
use crate::instances::Instances;
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
        let mut counts = memory::list(self.instances.len() as usize, "pixels")?;
        counts.resize(self.instances.len() as usize, PixelCounts::default());
        let ranges = || pixel_ranges(&self.instances, &self.visible);
        self.with_staged(&self.staged_pixels, ranges, |parts| {
            let mut rest = bytemuck::cast_slice_mut(&mut counts);
            for part in parts {
                let (here, behind) = std::mem::take(&mut rest).split_at_mut(part.len());
                here.copy_from_slice(part);
                rest = behind;
            }
        })?;
        Ok(counts)
    }

    /// Records the copy of the counts into `buffers`, as [`Culling::stage_mask`] does.
    pub(super) fn stage_pixels(
        encoder: &mut wgpu::CommandEncoder,
        instances: &Instances,
        buffers: &AnswerBuffers,
    ) -> Option<Staged> {
        let staging = buffers.staging_pixels.clone()?;
        Some(Staged::record(encoder, staging, &pixel_ranges(instances, &buffers.visible)))
    }
}
