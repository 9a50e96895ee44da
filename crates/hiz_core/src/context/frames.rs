//! The face of what stands around a frame's stages: warm-up, times and answers.

use super::HizContext;
use crate::cull::warm_up::{WarmUp, record_warm_up};
use crate::error::Result;
use crate::gpu::stage_times::{StageTimer, StageTimesInFlight, record_stage_times};
use crate::output::readback::{AnswerInFlight, ReadbackRing, record_readback};
use crate::output::visible::Visible;

#[cfg(doc)]
use crate::error::Error;

/// What stands around a frame's stages: warm-up, times and answers.
impl HizContext {
    /// Makes everything that frames like this one need, and records work that makes the driver
    /// compile it.
    ///
    /// Submit it and wait for it before the first frame.
    /// Then the frame's `record_*` calls make no pipeline, and no bind group, texture or buffer of
    /// their own.
    /// Call it once for each kind of frame: for each cull and each of several depth images.
    ///
    /// Drivers compile at two times, when a pipeline is made and when it is first dispatched.
    /// So the recorded dispatches have no workgroups, and reduce, cull and update nothing.
    /// Two things do change:
    ///
    /// - The occluders are drawn into the depth image, as they are in a frame.
    /// - The mask, the lists' lengths and the counts in `visible` are cleared.
    ///
    /// # Errors
    /// Those of [`HizContext::record_occluders`], [`HizContext::record_reduce`],
    /// [`HizContext::record_cull`] and [`HizContext::record_update`].
    pub fn record_warm_up(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &WarmUp<'_>,
    ) -> Result<()> {
        record_warm_up(&self.gpu, encoder, frame)
    }

    /// Makes a timer of stages.
    ///
    /// It needs a device with the feature `TIMESTAMP_QUERY`, and `queue`, whose period the
    /// timestamps count in.
    /// Without the feature it names the stages, and every time is `None`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn create_stage_timer(&self, queue: &wgpu::Queue) -> Result<StageTimer> {
        StageTimer::new(&self.gpu, queue.get_timestamp_period())
    }

    /// Records the copies of what `timer` has timed since the last call.
    ///
    /// Record it in the encoder of the stages, behind them.
    /// The times arrive with a poll of the device after the submit.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for a timer of another context, and [`Error::OutOfMemory`].
    pub fn record_stage_times(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &StageTimer,
    ) -> Result<StageTimesInFlight> {
        record_stage_times(&self.gpu, encoder, timer)
    }

    /// Makes a ring of `slots` (1..=64) for answers on their way to the host.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of slots.
    pub fn create_readback(&self, slots: usize) -> Result<ReadbackRing> {
        ReadbackRing::new(&self.gpu, slots)
    }

    /// Records the copies of what a cull leaves in `visible`: mask, list and draw arguments.
    ///
    /// Record it behind the cull.
    /// After the submit the answer arrives with a poll of the device
    /// ([`AnswerInFlight::is_ready`]); nothing here submits, polls or waits.
    /// The whole capacity of the lists is copied.
    /// If the encoder is never submitted, drop the answer.
    ///
    /// # Errors
    /// - [`Error::Invalid`] if all slots are taken: read or drop one of their answers first.
    /// - [`Error::Mismatch`] for objects of another context.
    /// - [`Error::OutOfMemory`].
    pub fn record_readback(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        visible: &Visible,
        ring: &ReadbackRing,
    ) -> Result<AnswerInFlight> {
        record_readback(&self.gpu, encoder, visible, ring)
    }
}
