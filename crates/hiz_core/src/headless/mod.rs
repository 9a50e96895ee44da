//! A device of its own: for scripts and tests that have no renderer.
//! This is what the Python package drives.
//!
//! Everything here is `Send + Sync`; an [`Engine`] is cheap to clone and may be used from any
//! thread.
//!
//! # The end of a process
//! A driver may still be at work when the last wait for it has returned: Mesa's lavapipe frees
//! pipelines on a thread of its own, which only the destruction of the device joins.
//! A process that ends meanwhile may crash in the driver.
//! So **let go of every device before the process ends**: the last clone of an [`Engine`] waits
//! until its device is idle, and the device is destroyed with the last object on it (instances,
//! pyramids, results, and whatever was made on [`Engine::device`]).
//! Keep none of them in a `static`, which is never dropped; a local of `main` and a `thread_local!`
//! are.
//! The same goes for a device of your own under a [`HizContext`].
//! `std::process::exit` drops nothing: return from `main` instead.
//!
//! # Forks
//! No device works in a fork of the process that made it.
//! There every call of an [`Engine`], [`DepthImage`] or [`Culling`] is [`Error::OtherProcess`],
//! before it takes any lock; dropping an [`Engine`] there lets go of nothing.
//! Other objects on the device (instances, pyramids) are better forgotten in the fork than dropped.

mod adapter;
mod culling;
mod depth_image;
mod explanation;
mod process;

use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Instant;

pub use adapter::{ADAPTER_VARIABLE, AdapterSummary, INSTALL_HINT, adapters};
pub use culling::{Counts, Culling, Timings};
pub use depth_image::DepthImage;
pub use explanation::Explanation;
use process::Process;

use crate::atlas;
use crate::bounds::Bounds;
use crate::camera::Camera;
use crate::context::HizContext;
use crate::cull::{self, CullInputs, CullOptions, Refinement};
use crate::error::{Error, Result};
use crate::gpu::PipelinesMade;
use crate::host;
use crate::instances::{InstanceOptions, Instances};
use crate::layout::StoredLevels;
use crate::occluder_surface::ConservativeDepthOptions;
use crate::occluders::{MeshData, OCCLUDER_DEPTH_FORMAT, OccluderOptions, Occluders};
use crate::pyramid::{self, Pyramid, PyramidOptions};
use crate::readback::{self, BufferRange};
use crate::shader::SourceKind;
use crate::tolerance::DepthTolerance;
use crate::update;
use crate::visible::{Visible, VisibleOptions};
use crate::watch::Watch;

/// A device, its queue and the pipelines on it.
/// The last clone waits until the device is idle, and lets go of it.
#[derive(Debug, Clone)]
pub struct Engine {
    shared: Arc<Shared>,
}

impl Drop for Engine {
    fn drop(&mut self) {
        if self.shared.process.check().is_err() {
            // Destroying the device would join threads that a fork does not have.
            // One more owner keeps it for good.
            std::mem::forget(Arc::clone(&self.shared));
        }
    }
}

#[derive(Debug)]
struct Shared {
    process: Process,
    context: HizContext,
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: AdapterSummary,
    /// Why the device was lost, once it is; and errors that no scope caught.
    lost: Arc<Mutex<Option<String>>>,
    uncaught: Arc<Mutex<Option<String>>>,
}

impl Drop for Shared {
    fn drop(&mut self) {
        // A lost device has nothing to wait for.
        drop(self.device.poll(wgpu::PollType::wait_indefinitely()));
    }
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Engine {
    /// Opens a Vulkan device: the adapter whose index is, or whose name or driver contains,
    /// `adapter`; without it what the environment variable [`ADAPTER_VARIABLE`] says; without that
    /// the best one, real GPUs first.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where none fits, with the adapters that were seen and how to choose one
    /// of them; where there are none, with the line that installs a software driver.
    pub fn new(adapter: Option<&str>) -> Result<Self> {
        Self::with_planted_faults(adapter, &[])
    }

    /// For tests: see [`HizContext::with_planted_faults`].
    #[doc(hidden)]
    pub fn with_planted_faults(adapter: Option<&str>, faults: &[(&str, &str)]) -> Result<Self> {
        let from_environment = std::env::var(ADAPTER_VARIABLE).ok().filter(|s| !s.is_empty());
        let request = adapter.map(str::to_owned).or(from_environment);
        let mut found = adapter::enumerate();
        let seen: Vec<AdapterSummary> = found.iter().map(|(summary, _)| summary.clone()).collect();
        if let Some(request) = &request {
            found.retain(|(summary, _)| summary.matches(request));
        }
        let Some((summary, adapter)) =
            found.into_iter().min_by_key(|(summary, _)| (summary.rank(), summary.index))
        else {
            let request =
                request.map_or_else(|| "was found".to_owned(), |r| format!("matches {r:?}"));
            return Err(adapter::no_adapter(request, &seen));
        };
        let features = adapter.features() & wgpu::Features::INDIRECT_FIRST_INSTANCE;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hiz.device"),
            required_features: features,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|e| adapter::no_adapter(format!("would open: {summary}: {e}"), &seen))?;
        let lost = Arc::new(Mutex::new(None));
        let uncaught = Arc::new(Mutex::new(None));
        let (lost_to, uncaught_to) = (Arc::clone(&lost), Arc::clone(&uncaught));
        device.set_device_lost_callback(move |reason, message| {
            locked(&lost_to).get_or_insert(format!("{reason:?}: {message}"));
        });
        // The default handler panics; every call below asks for what was left here instead.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            locked(&uncaught_to).get_or_insert(error.to_string());
        }));
        let context = HizContext::with_planted_faults(&device, faults)?;
        let process = Process::this();
        Ok(Self {
            shared: Arc::new(Shared {
                process,
                context,
                device,
                queue,
                adapter: summary,
                lost,
                uncaught,
            }),
        })
    }

    /// Refuses to go on in a fork of the process that made the device.
    /// To be asked before any lock is taken: one that another thread held at the fork is never
    /// released there.
    fn check_process(&self) -> Result<()> {
        self.shared.process.check()
    }

    /// The adapter.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.shared.adapter
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.shared.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.shared.queue
    }

    /// The pipelines on the device.
    pub fn context(&self) -> &HizContext {
        &self.shared.context
    }

    /// The largest side of a depth image.
    pub fn max_image_side(&self) -> u32 {
        self.device().limits().max_texture_dimension_2d.min(crate::camera::MAX_IMAGE_SIDE)
    }

    /// Uploads bounding volumes.
    ///
    /// # Errors
    /// As [`HizContext::record_instances`], and [`Error::OutOfMemory`].
    pub fn instances(
        &self,
        bounds: &Bounds<'_>,
        options: &InstanceOptions,
    ) -> Result<Arc<Instances>> {
        // One piece at a time, so that only one has its copy in a staging area.
        let copy = |copies: &dyn Fn(&mut wgpu::CommandEncoder), more: bool| {
            let mut encoder = self.encoder("hiz.instances.encoder");
            copies(&mut encoder);
            let submission = self.queue().submit([encoder.finish()]);
            if more { readback::wait(self.device(), Some(submission)) } else { Ok(()) }
        };
        self.scoped(|| Instances::new(&self.context().gpu, bounds, options, copy)).map(Arc::new)
    }

    /// Replaces instances `first..first + n`: records and submits.
    /// A cull that was submitted before sees the old bounds, whenever its answer is read.
    /// May be called from any thread; updates of the same instances run in the order in which they
    /// come here.
    ///
    /// # Errors
    /// As [`HizContext::record_update`].
    pub fn update(
        &self,
        instances: &Instances,
        first: u32,
        bounds: &Bounds<'_>,
        strict: bool,
    ) -> Result<()> {
        self.scoped(|| {
            let _in_order = locked(&instances.submitting);
            let gpu = &self.context().gpu;
            let mut encoder = self.encoder("hiz.update.encoder");
            let mut updated = 0..0;
            update::record(gpu, &mut encoder, instances, first, bounds, strict, |_, range| {
                updated = range;
                Ok(())
            })?;
            // Short, so that culls on other threads do not wait for the packing above.
            let watches = instances.watches();
            let mut before = self.encoder("hiz.refine.encoder");
            let before =
                watches.record_refinements(gpu, &mut before, instances)?.then(|| before.finish());
            self.queue().submit(before.into_iter().chain([encoder.finish()]));
            watches.all_refined();
            watches.note(&updated);
            Ok(())
        })
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// As [`HizContext::create_occluders`], and [`Error::OutOfMemory`].
    pub fn occluders(
        &self,
        meshes: &[MeshData<'_>],
        options: &OccluderOptions,
    ) -> Result<Arc<Occluders>> {
        self.scoped(|| self.context().create_occluders(meshes, options)).map(Arc::new)
    }

    /// Draws occluders into a depth image of the camera's size.
    ///
    /// # Errors
    /// [`Error::Limit`] for an image larger than the device's textures, [`Error::OutOfMemory`].
    pub fn render_depth(&self, occluders: &Occluders, camera: &Camera) -> Result<DepthImage> {
        self.scoped(|| {
            let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
                | wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::COPY_SRC;
            let depth = DepthImage::new(self, camera, OCCLUDER_DEPTH_FORMAT, usage)?;
            let mut encoder = self.encoder("hiz.occluders.encoder");
            self.context().record_occluders(&mut encoder, occluders, camera, &depth.view)?;
            self.queue().submit([encoder.finish()]);
            Ok(depth)
        })
    }

    /// Occluder depth that holds for every larger image of the same view
    /// ([`OccluderSurface::conservative_depth`]), made on the host and uploaded.
    ///
    /// # Errors
    /// As [`Engine::upload_depth`] and [`OccluderSurface::conservative_depth`].
    ///
    /// [`OccluderSurface::conservative_depth`]: crate::OccluderSurface::conservative_depth
    pub fn render_depth_conservative(
        &self,
        occluders: &Occluders,
        camera: &Camera,
        options: &ConservativeDepthOptions,
    ) -> Result<DepthImage> {
        self.check_process()?;
        self.context().gpu.check_context("occluders", occluders.context)?;
        self.upload_depth(&occluders.surface().conservative_depth(camera, options)?, camera)
    }

    /// Uploads NDC depth (row 0 on top, the camera's size and convention).
    /// What is no depth becomes far when it is read.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of pixels, [`Error::Limit`] for an image larger than
    /// the device's textures.
    pub fn upload_depth(&self, ndc: &[f32], camera: &Camera) -> Result<DepthImage> {
        DepthImage::uploaded(self, SourceKind::Bits, ndc, camera)
    }

    /// The same of depth that was rounded within `tolerance` before it came here: of half floats
    /// [`DepthTolerance::HALF`].
    ///
    /// # Errors
    /// As [`Engine::upload_depth`], and [`Error::Invalid`] for a tolerance outside 0..=0.5.
    pub fn upload_depth_within(
        &self,
        ndc: &[f32],
        camera: &Camera,
        tolerance: DepthTolerance,
    ) -> Result<DepthImage> {
        let tolerance = tolerance.checked()?;
        Ok(DepthImage { tolerance, ..self.upload_depth(ndc, camera)? })
    }

    /// For tests: the same into a float texture, which is sampled like a depth texture.
    #[doc(hidden)]
    pub fn upload_depth_sampled(&self, ndc: &[f32], camera: &Camera) -> Result<DepthImage> {
        DepthImage::uploaded(self, SourceKind::Float, ndc, camera)
    }

    /// Builds the depth pyramid of an image.
    ///
    /// # Errors
    /// [`Error::Mismatch`] for an image of another device, [`Error::OutOfMemory`].
    pub fn pyramid(&self, depth: &DepthImage) -> Result<Arc<Pyramid>> {
        self.pyramid_with(depth, &PyramidOptions::default())
    }

    /// [`Engine::pyramid`] with options.
    ///
    /// # Errors
    /// As [`Engine::pyramid`].
    pub fn pyramid_with(
        &self,
        depth: &DepthImage,
        options: &PyramidOptions,
    ) -> Result<Arc<Pyramid>> {
        self.context().gpu.check_context("depth", depth.engine.context().gpu.id())?;
        self.scoped(|| {
            let pyramid = self.context().create_pyramid(depth.size(), options)?;
            let mut encoder = self.encoder("hiz.reduce.encoder");
            let DepthImage { view, camera, tolerance, .. } = depth;
            pyramid::record_reduce(
                &self.context().gpu,
                &mut encoder,
                view,
                camera,
                &pyramid,
                *tolerance,
            )?;
            self.queue().submit([encoder.finish()]);
            Ok(Arc::new(pyramid))
        })
    }

    /// Reads a level of a pyramid: sanitised depth, row 0 on top.
    ///
    /// # Errors
    /// [`Error::Invalid`] past the last level and for one that is not stored, [`Error::Mismatch`]
    /// for a pyramid that was never built.
    pub fn read_level(&self, pyramid: &Pyramid, level: u32) -> Result<Vec<f32>> {
        self.check_process()?;
        self.context().gpu.check_context("pyramid", pyramid.context)?;
        let layout = pyramid.layout.levels.get(level as usize).ok_or_else(|| {
            Error::invalid(
                "level",
                format!("expected a level below {}, got {level}", pyramid.num_levels()),
            )
        })?;
        if !pyramid.layout.is_there(level) {
            let StoredLevels { first, last } = pyramid.layout.stored;
            return Err(Error::invalid(
                "level",
                format!("expected 0 or a stored level, {first}..={last}, got {level}"),
            ));
        }
        let built = pyramid.built().ok_or_else(|| {
            Error::mismatch(
                "pyramid",
                "expected one that was built from a depth image, got one that never was",
            )
        })?;
        if level == 0 {
            let format = built.source.texture().format();
            if !atlas::travels(format) {
                return Err(Error::invalid(
                    "level",
                    format!(
                        "expected a level above 0 of a pyramid of {format:?}, which is not read as float32, got 0"
                    ),
                ));
            }
            let row = 4 * u64::from(layout.width);
            let bytes = self.scoped(|| {
                readback::read_texture(self.device(), self.queue(), built.source.texture(), row)
            })?;
            let convention = built.camera.convention();
            return host::collected(
                to_u32(&bytes).map(|bits| crate::depth::sanitized(bits, convention)),
                "level",
            );
        }
        let (width, stride) = (layout.width as usize, layout.stride as usize);
        let (first, count) =
            (u64::from(layout.offset), u64::from(layout.stride) * u64::from(layout.height));
        let chunk = 1_u64 << pyramid.layout.chunk_shift;
        let ranges: Vec<_> = (first / chunk..=(first + count - 1) / chunk)
            .map(|c| {
                let begin = first.max(c * chunk);
                let end = (first + count).min((c + 1) * chunk);
                BufferRange {
                    buffer: &pyramid.chunks[c as usize],
                    offset: 4 * (begin - c * chunk),
                    size: 4 * (end - begin),
                }
            })
            .collect();
        let bytes =
            self.scoped(|| readback::read_buffers(self.device(), self.queue(), &ranges))?.concat();
        let mut texels = host::list(width * layout.height as usize, "level")?;
        for row in bytes.chunks_exact(4 * stride) {
            texels.extend(to_u32(&row[..4 * width]).map(f32::from_bits));
        }
        Ok(texels)
    }

    /// Culls: records and submits; reading the answer waits.
    /// A cull that needs a pipeline that was not made before makes it, and waits until the driver
    /// has compiled it ([`Timings::compile_ms`]).
    ///
    /// # Errors
    /// As [`HizContext::record_cull`], and [`Error::OutOfMemory`].
    pub fn cull(
        &self,
        instances: &Arc<Instances>,
        camera: &Camera,
        pyramid: &Arc<Pyramid>,
        options: &CullOptions,
        output: &VisibleOptions,
    ) -> Result<Culling> {
        self.check_process()?;
        let gpu = &self.context().gpu;
        let attempt = || {
            let (start, made_before) = (Instant::now(), PipelinesMade::so_far());
            let visible = Arc::new(self.context().create_visible(instances, output)?);
            let inputs =
                CullInputs { instances, camera, pyramid, options, certified: true, idle: false };
            let mut encoder = self.encoder("hiz.cull.encoder");
            cull::record(gpu, &mut encoder, &inputs, &visible)?;
            let staged_mask = Culling::stage_mask(self.device(), &mut encoder, instances, &visible);
            let refinement = Refinement::new(instances, camera, pyramid, options, &visible)?;
            let watch = Watch::new(refinement);
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
                output: *output,
                visible,
                staged_mask: Mutex::new(staged_mask),
                later: OnceLock::new(),
                watch,
                submission,
                submitted,
                done,
                timings: Mutex::new(Timings { record_ms, compile_ms, ..Timings::default() }),
            })
        };
        let culling = self.scoped(attempt);
        let Err(error) = &culling else { return culling };
        let had_atlas = pyramid.forget();
        if had_atlas && matches!(error, Error::OutOfMemory(_)) {
            // The depth image and the levels can be read where they are.
            pyramid.do_without_atlas();
            return self.scoped(attempt);
        }
        culling
    }

    /// Lets the driver compile what it leaves to the first dispatch of a pipeline: submits the same
    /// work of no workgroups, and waits.
    /// How many milliseconds that took, what was submitted before not counted.
    fn compile(&self, inputs: &CullInputs<'_>, visible: &Visible) -> Result<f64> {
        readback::wait(self.device(), None)?;
        let start = Instant::now();
        let mut encoder = self.encoder("hiz.cull.compile");
        cull::record(&self.context().gpu, &mut encoder, inputs, visible)?;
        let submission = self.queue().submit([encoder.finish()]);
        readback::wait(self.device(), Some(submission))?;
        Ok(milliseconds(start, Instant::now()))
    }

    /// Waits for everything that was submitted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<()> {
        self.scoped(|| readback::wait(self.device(), None))
    }

    fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Runs `work` so that what the device finds wrong comes back as an error and nothing panics.
    fn scoped<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        self.check_process()?;
        let device = self.device();
        if let Some(reason) = locked(&self.shared.lost).clone() {
            return Err(Error::DeviceLost(reason));
        }
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        if result.is_err() {
            // A loss is told by a callback, which runs when the device is polled; what it broke may
            // be reported as anything.
            drop(device.poll(wgpu::PollType::wait_indefinitely()));
        }
        // The innermost scope goes first.
        let internal = pollster::block_on(internal.pop());
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        if let Some(reason) = locked(&self.shared.lost).clone() {
            return Err(Error::DeviceLost(reason));
        }
        if let Some(error) = memory {
            return Err(Error::OutOfMemory(error.to_string()));
        }
        let uncaught = locked(&self.shared.uncaught).take();
        if let Some(error) = internal.or(validation).map(|e| e.to_string()).or(uncaught) {
            return Err(Error::Device(error));
        }
        result
    }
}

fn milliseconds(start: Instant, end: Instant) -> f64 {
    end.duration_since(start).as_secs_f64() * 1e3
}

fn to_u32(bytes: &[u8]) -> impl ExactSizeIterator<Item = u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}
