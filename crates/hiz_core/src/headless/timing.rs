//! Times of the stages on the device, beside the wall-clock times.

use std::sync::Arc;
use std::time::Instant;

use crate::error::{Error, Result};
use crate::gpu::clock_check::{ClockCheck, are_plausible};
use crate::gpu::stage_times::{StageTime, StageTimer, StageTimesInFlight, record_stage_times};
use crate::headless::clock::{Timed, Timing};
use crate::headless::counts::milliseconds;
use crate::headless::culling::Culling;
use crate::headless::engine::Engine;
use crate::headless::readback;
use crate::headless::views::ViewsCulling;

/// How often the timestamps are checked until they are given up: another process may disturb one.
const ATTEMPTS: usize = 3;

impl Engine {
    /// Times the stages of everything that this engine submits, until [`Engine::stop_timing`].
    ///
    /// The first call checks the device's timestamps: two passes of known work behind a render
    /// pass have to take times that fit each other and the host's clock.
    /// Where they do not, the stages are named, and their times are `None`.
    ///
    /// # Errors
    /// - [`Error::Invalid`] if times are being taken already.
    /// - [`Error::OutOfMemory`] and [`Error::DeviceLost`].
    pub fn start_timing(&self) -> Result<()> {
        self.check_process()?;
        let is_right = self.clock_is_right()?;
        let mut timing = self.timing().lock();
        if timing.is_some() {
            return Err(Error::invalid("timing", "expected one at a time, got a second one"));
        }
        *timing = Some(Timing::new(is_right));
        Ok(())
    }

    /// Ends the timing, waits for the device, and returns the stages in the order in which they
    /// began.
    ///
    /// # Errors
    /// - [`Error::Invalid`] if no times are being taken.
    /// - [`Error::DeviceLost`].
    pub fn stop_timing(&self) -> Result<Vec<StageTime>> {
        self.check_process()?;
        let Some(timing) = self.timing().lock().take() else {
            return Err(Error::invalid("timing", "expected start_timing before, got none"));
        };
        self.wait()?;
        let mut all: Vec<StageTime> = Vec::new();
        for times in timing.collected() {
            for stage in self.stages_of(times, timing.is_right)? {
                match all.iter_mut().find(|known| known.stage == stage.stage) {
                    Some(known) => {
                        known.passes += stage.passes;
                        known.gpu_ms = known.gpu_ms.zip(stage.gpu_ms).map(|(a, b)| a + b);
                    }
                    None => all.push(stage),
                }
            }
        }
        Ok(all)
    }

    /// Whether the timestamps of this device can be trusted; checked by the first call.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] and [`Error::DeviceLost`].
    pub fn clock_is_right(&self) -> Result<bool> {
        if let Some(known) = self.clock().get() {
            return Ok(*known);
        }
        let right = self.scoped(|| {
            let gpu = &self.context().gpu;
            let timer = StageTimer::new(gpu, self.queue().get_timestamp_period())?;
            let check = ClockCheck::new(gpu)?;
            for _ in 0..ATTEMPTS {
                readback::wait(self.device(), None)?;
                let start = Instant::now();
                let mut encoder = self.encoder("hiz.clock_check.encoder");
                timer.time(|| check.record(&mut encoder));
                let times = record_stage_times(gpu, &mut encoder, &timer)?;
                let submission = self.queue().submit([encoder.finish()]);
                readback::wait(self.device(), Some(submission))?;
                let wall_ms = milliseconds(start, Instant::now());
                self.await_times(&times)?;
                if are_plausible(&times.stages()?, wall_ms) {
                    return Ok(true);
                }
            }
            Ok(false)
        })?;
        Ok(*self.clock().get_or_init(|| right))
    }

    /// Records, with timestamps around the stages if times are being taken.
    pub(super) fn timed<T>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<T>,
    ) -> Result<(T, Option<Timed>)> {
        let lent = self.timing().lock().as_mut().map(|timing| (timing.lend(), timing.is_right));
        let Some((lent, is_right)) = lent else { return Ok((record(encoder)?, None)) };
        let gpu = &self.context().gpu;
        let timer = match lent {
            Some(timer) => timer,
            None => StageTimer::new(gpu, self.queue().get_timestamp_period())?,
        };
        let recorded = timer.time(|| record(encoder));
        let times = record_stage_times(gpu, encoder, &timer)?;
        let recorded = recorded?;
        let times = Arc::new(times);
        if let Some(timing) = self.timing().lock().as_mut() {
            timing.give(timer, Arc::clone(&times));
        }
        Ok((recorded, Some((times, is_right))))
    }

    /// The stages of times whose submission is done.
    fn stages_of(&self, times: &StageTimesInFlight, is_right: bool) -> Result<Vec<StageTime>> {
        self.await_times(times)?;
        let mut stages = times.stages()?;
        if !is_right {
            stages.iter_mut().for_each(|stage| stage.gpu_ms = None);
        }
        Ok(stages)
    }

    fn await_times(&self, times: &StageTimesInFlight) -> Result<()> {
        self.await_callback(|| times.is_ready())
    }
}

impl Culling {
    /// What the stages of this cull took on the device; waits for it.
    /// `None` if no times were being taken ([`Engine::start_timing`]).
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn stage_times(&self) -> Result<Option<Vec<StageTime>>> {
        let Some((times, is_right)) = &self.times else { return Ok(None) };
        self.wait()?;
        self.engine.stages_of(times, *is_right).map(Some)
    }
}

impl ViewsCulling {
    /// What the stages of the culls of all views took on the device; as
    /// [`Culling::stage_times`].
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn stage_times(&self) -> Result<Option<Vec<StageTime>>> {
        self.view(0).stage_times()
    }
}
