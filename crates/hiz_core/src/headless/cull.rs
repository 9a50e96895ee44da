//! Records and submits a cull.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

use crate::cull::inputs::CullInputs;
use crate::cull::options::CullOptions;
use crate::cull::record::record_cull;
use crate::cull::refine::Refinement;
use crate::error::{Error, Result};
use crate::gpu::pipelines::PipelinesMade;
use crate::headless::ahead::Ahead;
use crate::headless::counts::{Timings, milliseconds};
use crate::headless::culling::Culling;
use crate::headless::engine::Engine;
use crate::headless::readback;
use crate::host::threads::Locked;
use crate::input::camera::Camera;
use crate::instances::Instances;
use crate::instances::watch::{Refine, Watch};
use crate::output::outputs::Outputs;
use crate::output::visible::Visible;
use crate::pyramid::Pyramid;

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
        self.cull_with(instances, camera, pyramid, options, outputs, false)
    }

    /// [`Engine::cull`]; `ahead`: its submission also copies the answer ([`Engine::cull_ahead`]).
    pub(super) fn cull_with(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        outputs: &Outputs,
        ahead: bool,
    ) -> Result<Culling> {
        self.check_process()?;
        let gpu = &self.context().gpu;
        let attempt = || {
            let (start, made_before) = (Instant::now(), PipelinesMade::so_far());
            let buffers = self.answers().lend(self.context(), instances, outputs)?;
            let visible = Arc::clone(&buffers.visible);
            let inputs = CullInputs::new(instances, camera, pyramid, options);
            let mut encoder = self.encoder("hiz.cull.encoder");
            record_cull(gpu, &mut encoder, &inputs, &visible)?;
            let mut refinement = Refinement::new(instances, camera, pyramid, options, &visible)?;
            let (mut staged_mask, mut copied) = (None, None);
            if ahead {
                if let Some(refinement) = refinement.take() {
                    refinement.record(gpu, &mut encoder)?;
                }
                copied = Some(Ahead::record(self, &mut encoder, instances, &visible, options)?);
            } else {
                staged_mask = Culling::stage_mask(&mut encoder, instances, &buffers);
            }
            let watch = Watch::new(refinement.map(|left| Box::new(left) as Box<dyn Refine>));
            let done = Arc::new(OnceLock::new());
            let when_done = Arc::clone(&done);
            encoder.on_submitted_work_done(move || {
                when_done.get_or_init(Instant::now);
            });
            let made = PipelinesMade::so_far().since(made_before);
            let mut record_ms = milliseconds(start, Instant::now());
            let mut compile_ms = 0.0;
            if made.count > 0 {
                let making_ms = 1e3 * made.time.as_secs_f64();
                record_ms -= making_ms;
                compile_ms =
                    making_ms + self.compile(&CullInputs { idle: true, ..inputs }, &visible)?;
            }
            let watches = &mut instances.watches();
            let submitted = Instant::now();
            let submission = self.queue().submit([encoder.finish()]);
            watches.add(&watch);
            Ok(Culling {
                engine: self.clone(),
                instances: Arc::clone(instances),
                pyramid: Arc::clone(pyramid),
                camera: camera.clone(),
                options: options.clone(),
                buffers,
                visible,
                staged_mask: Locked::new(staged_mask),
                ahead: copied,
                later: OnceLock::new(),
                watch,
                submission,
                submitted,
                done,
                timings: Locked::new(Timings { record_ms, compile_ms, ..Timings::default() }),
            })
        };
        let culling = self.scoped(attempt);
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

    /// Makes the driver compile what it would leave to the first dispatch of a pipeline.
    ///
    /// Submits the same work with no workgroups, and waits.
    /// Returns the milliseconds that this took, without the wait for earlier submissions.
    fn compile(&self, inputs: &CullInputs<'_>, visible: &Visible) -> Result<f64> {
        readback::wait(self.device(), None)?;
        let start = Instant::now();
        let mut encoder = self.encoder("hiz.cull.compile");
        record_cull(&self.context().gpu, &mut encoder, inputs, visible)?;
        let submission = self.queue().submit([encoder.finish()]);
        readback::wait(self.device(), Some(submission))?;
        Ok(milliseconds(start, Instant::now()))
    }
}
