//! Culls whose answers come to the host while the caller does something else.
//!
//! The cull's own submission also makes and copies everything that was asked for.
//! So a later read submits nothing, and waits for nothing once [`Culling::is_ready`] says so.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::cull::options::CullOptions;
use crate::error::{Error, Result};
use crate::gpu::copies::Copies;
use crate::headless::ahead::Ahead;
use crate::headless::cull::{CullExtras, Question, Reading};
use crate::headless::culling::Culling;
use crate::headless::engine::Engine;
use crate::headless::readback;
use crate::headless::slots::Taken;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::output::outputs::Outputs;
use crate::pyramid::Pyramid;

/// How long a callback of a submission that is done may take on another thread.
const CALLBACK: Duration = Duration::from_secs(60);

impl Engine {
    /// [`Engine::cull`] whose answer comes to the host by itself.
    ///
    /// The cull's own submission copies everything that `outputs` asks for.
    /// [`Culling::is_ready`] says without waiting whether it has arrived, and then no read of it
    /// waits.
    /// Lists and draw arguments that were not asked for are made when they are read.
    ///
    /// At most [`CULLS_IN_FLIGHT`] such culls of an engine are unfinished at a time.
    /// One more waits in this call until the oldest of them is done.
    /// A cull whose [`Culling`] was dropped counts no more.
    ///
    /// [`CULLS_IN_FLIGHT`]: crate::headless::CULLS_IN_FLIGHT
    ///
    /// # Errors
    /// Those of [`Engine::cull`].
    ///
    /// # Examples
    /// ```
    /// # use hiz_core::headless::Engine;
    /// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
    /// # use hiz_core::{InstanceOptions, Outputs, Pose, Projection};
    /// # let engine = Engine::new(None)?;
    /// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    /// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
    /// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    /// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
    /// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], &camera)?)?;
    /// # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
    /// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    /// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
    /// let (options, outputs) = (CullOptions::default(), Outputs::default());
    /// let culling = engine.cull_ahead(&instances, &camera, &pyramid, &options, &outputs)?;
    /// while !culling.is_ready()? {
    ///     std::thread::yield_now(); // work of the caller's own
    /// }
    /// assert_eq!(culling.mask()?, [true, false]);
    /// # Ok::<(), hiz_core::Error>(())
    /// ```
    pub fn cull_ahead(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        outputs: &Outputs,
    ) -> Result<Culling> {
        let extras = CullExtras { ahead: true, ..CullExtras::default() };
        self.cull_given(instances, camera, pyramid, options, outputs, &extras)
    }

    /// [`Engine::cull`] with extras: a restriction to some instances, or an answer that comes by
    /// itself.
    ///
    /// # Errors
    /// Those of [`Engine::cull`], and [`Error::Mismatch`] for an `among` of other instances.
    pub fn cull_given(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        outputs: &Outputs,
        extras: &CullExtras<'_>,
    ) -> Result<Culling> {
        let question = Question { instances, camera, pyramid, options, among: None };
        if !extras.ahead {
            return self.cull_with(&question, outputs, Reading::Staged, extras);
        }
        self.in_a_slot(
            || self.cull_with(&question, outputs, Reading::Ahead, extras),
            |culling| culling.ahead.as_ref().map(|ahead| culling.taken(&ahead.slot)),
        )
    }

    /// Waits for a free slot, submits, and takes the slot for what was submitted.
    pub(super) fn in_a_slot<T>(
        &self,
        submit: impl FnOnce() -> Result<T>,
        taken: impl FnOnce(&T) -> Option<Taken>,
    ) -> Result<T> {
        self.check_process()?;
        // Held until the cull is noted, so that threads do not submit one too many.
        let mut slots = self.slots().lock();
        slots.make_room(|oldest| self.scoped(|| readback::wait(self.device(), Some(oldest))))?;
        let submitted = submit()?;
        if let Some(taken) = taken(&submitted) {
            slots.take(taken);
        }
        Ok(submitted)
    }

    /// Waits until the callback of copies has run whose submission is done.
    pub(super) fn await_copies(&self, copies: &Copies) -> Result<()> {
        self.await_callback(|| copies.is_ready())
    }

    /// Polls until a callback of a submission that is done has run.
    pub(super) fn await_callback(&self, has_run: impl Fn() -> bool) -> Result<()> {
        let start = Instant::now();
        // Another thread's poll may be running the callback at this moment.
        while !has_run() {
            if start.elapsed() > CALLBACK {
                let why = "hiz.readback.staging was not mapped within a minute".to_owned();
                return Err(Error::Device(why));
            }
            readback::look(self.device())?;
            std::thread::yield_now();
        }
        Ok(())
    }
}

impl Culling {
    /// Whether the device has run the cull; for a cull of [`Engine::cull_ahead`], whether
    /// everything that it was asked for is on the host.
    /// This asks the device and never waits.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn is_ready(&self) -> Result<bool> {
        self.engine.check_process()?;
        if !self.is_known_to_be_ready() {
            self.engine.scoped(|| readback::look(self.engine.device()))?;
        }
        Ok(self.is_known_to_be_ready())
    }

    fn is_known_to_be_ready(&self) -> bool {
        match &self.ahead {
            Some(ahead) => ahead.copies.is_ready(),
            None => self.done.get().is_some(),
        }
    }

    /// The slot that this cull takes as long as `answer` lives.
    pub(super) fn taken(&self, answer: &Arc<()>) -> Taken {
        let (done, submission) = (Arc::clone(&self.done), self.submission.clone());
        Taken { answer: Arc::downgrade(answer), done, submission }
    }

    /// What was copied ahead, once it has arrived; `None` for another cull.
    /// The cull itself must be done.
    pub(super) fn arrived(&self) -> Result<Option<&Ahead>> {
        let Some(ahead) = &self.ahead else { return Ok(None) };
        self.engine.await_copies(&ahead.copies)?;
        Ok(Some(ahead))
    }
}
