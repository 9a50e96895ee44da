//! Records and submits a cull.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use crate::cull::among::{Among, AmongMask};
use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::cull::refine::Refinement;
use crate::error::{Error, Result};
use crate::gpu::pipelines::PipelinesMade;
use crate::headless::ahead::Ahead;
use crate::headless::answers::AnswerBuffers;
use crate::headless::clock::Timed;
use crate::headless::counts::{Timings, milliseconds};
use crate::headless::culling::Culling;
use crate::headless::engine::Engine;
use crate::headless::readback::{self, Staged};
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::watch::{Refine, Watch};
use crate::output::outputs::Outputs;
use crate::pyramid::Pyramid;

/// What a cull is asked.
#[derive(Clone, Copy)]
pub(super) struct Question<'a> {
    pub(super) instances: &'a Arc<Instances>,
    pub(super) camera: &'a Camera,
    pub(super) pyramid: &'a Arc<Pyramid>,
    pub(super) options: &'a CullOptions,
    pub(super) among: Option<&'a Arc<Among>>,
}

/// How the answer comes to the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reading {
    /// The mask is staged unless it is large; the rest is copied when it is read.
    Staged,
    /// Everything that was asked for is staged.
    Ahead,
    /// Everything is copied when it is read.
    Later,
}

/// What a cull may be given beside its options; nothing by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct CullExtras<'a> {
    /// The instances that are asked for ([`Engine::among`]); `None`: all.
    pub among: Option<&'a Arc<Among>>,
    /// The same for this cull alone: its own submission brings the mask to the device.
    /// [`AmongSource::mask`](crate::headless::AmongSource::mask) makes it.
    pub mask: Option<AmongMask<'a>>,
    /// Whether the cull's own submission copies the answer, as [`Engine::cull_ahead`] says.
    pub ahead: bool,
}

/// What follows a cull in its encoder, up to the submit.
pub(super) struct Recorded {
    buffers: Arc<AnswerBuffers>,
    staged_mask: Option<Staged>,
    staged_pixels: Option<Staged>,
    ahead: Option<Ahead>,
    pub(super) watch: Arc<Watch>,
}

/// When a submission was made, and how to see that it is done.
#[derive(Clone)]
pub(super) struct Submission {
    pub(super) index: wgpu::SubmissionIndex,
    pub(super) at: Instant,
    pub(super) done: Arc<OnceLock<Instant>>,
    pub(super) timings: Timings,
    pub(super) times: Option<Timed>,
}

impl Question<'_> {
    /// Records what reads the answer of a cull, behind the cull itself.
    pub(super) fn record_reading(
        &self,
        engine: &Engine,
        encoder: &mut wgpu::CommandEncoder,
        buffers: Arc<AnswerBuffers>,
        reading: Reading,
    ) -> Result<Recorded> {
        let Self { instances, camera, pyramid, options, among } = *self;
        let visible = &buffers.visible;
        let mut refinement = Refinement::new(instances, camera, pyramid, options, visible, among)?;
        let (mut staged_mask, mut staged_pixels, mut ahead) = (None, None, None);
        match reading {
            Reading::Ahead => {
                if let Some(refinement) = refinement.take() {
                    refinement.record(&engine.context().gpu, encoder)?;
                }
                ahead = Some(Ahead::record(engine, encoder, instances, visible, options)?);
            }
            Reading::Staged => {
                staged_mask = Culling::stage_mask(encoder, instances, &buffers);
                staged_pixels = Culling::stage_pixels(encoder, instances, &buffers);
            }
            Reading::Later => {}
        }
        let watch = Watch::new(refinement.map(|left| Box::new(left) as Box<dyn Refine>));
        Ok(Recorded { buffers, staged_mask, staged_pixels, ahead, watch })
    }

    /// The cull, once it is submitted.
    pub(super) fn submitted(
        &self,
        engine: &Engine,
        recorded: Recorded,
        submission: &Submission,
    ) -> Culling {
        let Recorded { buffers, staged_mask, staged_pixels, ahead, watch } = recorded;
        let Submission { index, at, done, timings, times } = submission.clone();
        Culling {
            engine: engine.clone(),
            instances: Arc::clone(self.instances),
            pyramid: Arc::clone(self.pyramid),
            camera: self.camera.clone(),
            options: self.options.clone(),
            among: self.among.cloned(),
            visible: Arc::clone(&buffers.visible),
            buffers,
            staged_mask: Locked::new(staged_mask),
            staged_pixels: Locked::new(staged_pixels),
            ahead,
            later: OnceLock::new(),
            watch,
            submission: index,
            submitted: at,
            done,
            timings: Locked::new(timings),
            times,
        }
    }
}

/// Lets `done` tell when the submission of `encoder` was first seen to be done.
pub(super) fn tell_when_done(encoder: &wgpu::CommandEncoder) -> Arc<OnceLock<Instant>> {
    let done = Arc::new(OnceLock::new());
    let when_done = Arc::clone(&done);
    encoder.on_submitted_work_done(move || {
        when_done.get_or_init(Instant::now);
    });
    done
}

impl Engine {
    /// Culls: it records and submits, and reading an answer waits.
    ///
    /// If the cull needs a pipeline that was not made before, this call makes it.
    /// It then waits until the driver has compiled the pipeline ([`Timings::compile_ms`]).
    ///
    /// # Errors
    /// Those of [`HizContext::record_cull`](crate::HizContext::record_cull), [`Error::OutOfMemory`]
    /// and [`Error::DeviceLost`].
    pub fn cull(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        outputs: &Outputs,
    ) -> Result<Culling> {
        let question = Question { instances, camera, pyramid, options, among: None };
        self.cull_with(&question, outputs, Reading::Staged, &CullExtras::default())
    }

    pub(super) fn cull_with(
        &self,
        question: &Question<'_>,
        outputs: &Outputs,
        reading: Reading,
        extras: &CullExtras<'_>,
    ) -> Result<Culling> {
        self.cull_after(Vec::new(), question, outputs, reading, extras)
    }

    /// [`Engine::cull_with`], whose submission begins with the commands `before`.
    pub(super) fn cull_after(
        &self,
        mut before: Vec<wgpu::CommandBuffer>,
        question: &Question<'_>,
        outputs: &Outputs,
        reading: Reading,
        extras: &CullExtras<'_>,
    ) -> Result<Culling> {
        self.check_process()?;
        let Question { instances, camera, pyramid, options, .. } = *question;
        let gpu = &self.context().gpu;
        let mut attempt = || {
            if outputs.pixels {
                self.bring_image_of(pyramid);
            }
            let (start, made_before) = (Instant::now(), PipelinesMade::so_far());
            let buffers = self.answers().lend(self.context(), instances, outputs)?;
            let visible = Arc::clone(&buffers.visible);
            let mut encoder = self.encoder("hiz.cull.encoder");
            let inputs = CullInputs::new(instances, camera, pyramid, options);
            let (among, times) = self.timed(&mut encoder, |encoder| {
                let among = self.record_mask(encoder, instances, extras)?;
                let inputs = CullInputs { among: among.as_deref(), ..inputs };
                record_cull(gpu, encoder, &inputs, &visible)?;
                Ok(among)
            })?;
            let inputs = CullInputs { among: among.as_deref(), ..inputs };
            let question = Question { among: among.as_ref(), ..*question };
            let recorded = question.record_reading(self, &mut encoder, buffers, reading)?;
            let done = tell_when_done(&encoder);
            let timings = self.compiled((start, made_before), |encoder| {
                record_cull(gpu, encoder, &CullInputs { idle: true, ..inputs }, &visible)
            })?;
            let watches = &mut instances.watches();
            let at = Instant::now();
            let index = self.queue().submit(before.drain(..).chain([encoder.finish()]));
            watches.add(&recorded.watch);
            Ok(question.submitted(self, recorded, &Submission { index, at, done, timings, times }))
        };
        let culling = self.scoped(&mut attempt);
        let Err(error) = &culling else { return culling };
        self.answers().forget();
        let had_atlas = pyramid.forget();
        if had_atlas && matches!(error, Error::OutOfMemory(_)) {
            // Without the atlas, the depth image and the levels are read in place.
            pyramid.do_without_atlas();
            return self.scoped(attempt);
        }
        culling
    }

    /// The times of a recording that began at `start`, when so many pipelines had been made.
    ///
    /// If it has made any, the driver compiles what it would leave to their first dispatch:
    /// `record_idle` records the same work with no workgroups, which is submitted and waited for.
    pub(super) fn compiled(
        &self,
        (start, made_before): (Instant, PipelinesMade),
        record_idle: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
    ) -> Result<Timings> {
        let made = PipelinesMade::so_far().since(made_before);
        let mut record_ms = milliseconds(start, Instant::now());
        let mut compile_ms = 0.0;
        if made.count > 0 {
            let making_ms = 1e3 * made.time.as_secs_f64();
            record_ms -= making_ms;
            // Without the wait for earlier submissions.
            readback::wait(self.device(), None)?;
            let start = Instant::now();
            let mut encoder = self.encoder("hiz.cull.compile");
            record_idle(&mut encoder)?;
            let submission = self.queue().submit([encoder.finish()]);
            readback::wait(self.device(), Some(submission))?;
            compile_ms = making_ms + milliseconds(start, Instant::now());
        }
        Ok(Timings { record_ms, compile_ms, ..Timings::default() })
    }
}
