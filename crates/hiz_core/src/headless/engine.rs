//! The engine: a device, its queue and its errors.

use std::sync::{Arc, OnceLock};

use crate::context::HizContext;
use crate::cull::among::Among;
use crate::error::{Error, Result};
use crate::gpu::copies::StagingPool;
use crate::gpu::row_staging::RowStaging;
use crate::headless::adapter::{self, ADAPTER_VARIABLE, AdapterSummary};
use crate::headless::answers::Answers;
use crate::headless::clock::Timing;
use crate::headless::images::Images;
use crate::headless::joined::JoinedPool;
use crate::headless::kept_depth::KeptDepth;
use crate::headless::process::Process;
use crate::headless::readback;
use crate::headless::slots::Slots;
use crate::host::threads::Locked;
use crate::input::image::MAX_IMAGE_SIDE;
use crate::instances::InstancesId;

/// Staging buffers of answers that are kept at most.
const STAGING_KEPT: usize = 4;

/// Bytes of a depth staging buffer that is kept: an image of 4K, at four bytes per pixel.
const DEPTH_KEPT_BYTES: u64 = 1 << 25;
/// Sizes of images whose buffers are kept, and how many of each: two frames may be on their way.
const DEPTH_SIZES: usize = 2;
const DEPTH_KEPT: usize = 2;

/// What lavapipe calls itself.
const LAVAPIPE: &str = "llvmpipe";

/// Bytes of a block of memory that wgpu takes from lavapipe, and keeps.
///
/// Records of 4 million boxes fit one.
/// Their pages are then new to the process once, and not at every upload (`docs/performance.md`).
/// It is the most that wgpu takes at once.
const LAVAPIPE_BLOCK_BYTES: u64 = 256 << 20;

/// A device, its queue and the pipelines on it.
/// The last clone waits until the device is idle, and releases it.
///
/// # Examples
/// ```
/// use hiz_core::headless::Engine;
/// use hiz_core::{
///     Bounds, CullOptions, Floats, InstanceOptions, MeshData, OccluderOptions, Outputs,
/// };
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// let engine = Engine::new(None)?;
/// let corners = [-20.0, -20.0, -10.0, 20.0, -20.0, -10.0, 0.0, 40.0, -10.0];
/// let (vertices, triangles) = (Floats::F32(&corners), &[0, 1, 2]);
/// let wall = MeshData { vertices, triangles, transforms: None };
/// let walls = engine.occluders(&[wall], &OccluderOptions::default())?;
/// let pyramid = engine.pyramid(&engine.render_depth(&walls, &camera)?)?;
///
/// let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
/// let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// let (options, outputs) = (CullOptions::default(), Outputs::default());
/// let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs)?;
/// assert_eq!(culling.mask()?, [true, false]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Engine {
    shared: Arc<Shared>,
}

impl Drop for Engine {
    fn drop(&mut self) {
        if self.shared.process.check().is_err() {
            // Destroying the device would join threads that a fork does not have.
            // So one more owner keeps it alive for good.
            std::mem::forget(Arc::clone(&self.shared));
        }
    }
}

#[derive(Debug)]
struct Shared {
    process: Process,
    context: HizContext,
    answers: Answers,
    images: Images,
    slots: Locked<Slots>,
    joined: JoinedPool,
    /// Masks of culls that are kept for later ones, with the instances that they are of.
    amongs: Locked<Vec<(InstancesId, Arc<Among>)>>,
    timing: Locked<Option<Timing>>,
    /// Whether the device's timestamps can be trusted, once that was checked.
    clock: OnceLock<bool>,
    /// For answers that are copied by their cull's own submission.
    staging: StagingPool,
    /// For depth that is converted on its way.
    depth_staging: RowStaging,
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: AdapterSummary,
    /// Why the device was lost, once it was.
    /// `uncaught`: an error that no scope caught.
    lost: Arc<Locked<Option<String>>>,
    uncaught: Arc<Locked<Option<String>>>,
    /// What single culls keep for the next one.
    kept_depth: Locked<Option<KeptDepth>>,
}

impl Drop for Shared {
    fn drop(&mut self) {
        // A lost device has nothing to wait for, so an error here is ignored.
        drop(self.device.poll(wgpu::PollType::wait_indefinitely()));
    }
}

impl Engine {
    /// Opens a device on an adapter.
    ///
    /// `adapter` is an index, or a part of a name or driver in any case, as [`AdapterSummary`]
    /// lists them.
    /// Without it, the environment variable [`ADAPTER_VARIABLE`] says which adapter to take.
    /// Without both, the best adapter is taken: discrete GPUs first, software drivers last.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] if no adapter fits.
    /// It lists the adapters that were found and says how to choose one of them.
    /// If there are none, it names the command that installs a software driver.
    pub fn new(adapter: Option<&str>) -> Result<Self> {
        Self::open(adapter, HizContext::new)
    }

    /// Opens a device whose shaders have planted faults, for tests; see
    /// [`HizContext::with_planted_faults`].
    ///
    /// # Errors
    /// Those of [`Engine::new`].
    #[cfg(feature = "testing")]
    pub fn with_planted_faults(adapter: Option<&str>, faults: &[(&str, &str)]) -> Result<Self> {
        Self::open(adapter, |device| HizContext::with_planted_faults(device, faults))
    }

    fn open(
        adapter: Option<&str>,
        context: impl FnOnce(&wgpu::Device) -> Result<HizContext>,
    ) -> Result<Self> {
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
        let mut wanted = wgpu::Features::INDIRECT_FIRST_INSTANCE | wgpu::Features::TIMESTAMP_QUERY;
        let info = adapter.get_info();
        // What the host draws is read in place there (`Gpu::reads_mapped`).
        // The heaps of other backends may allow no such buffer that is written by the host.
        if info.device_type == wgpu::DeviceType::Cpu && info.backend == wgpu::Backend::Vulkan {
            wanted |= wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        }
        let features = adapter.features() & wanted;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hiz.device"),
            required_features: features,
            required_limits: adapter.limits(),
            memory_hints: memory_hints(&info),
            ..Default::default()
        }))
        .map_err(|e| adapter::no_adapter(format!("would open: {summary}: {e}"), &seen))?;
        let lost = Arc::new(Locked::new(None));
        let uncaught = Arc::new(Locked::new(None));
        let (lost_to, uncaught_to) = (Arc::clone(&lost), Arc::clone(&uncaught));
        device.set_device_lost_callback(move |reason, message| {
            lost_to.lock().get_or_insert(format!("{reason:?}: {message}"));
        });
        // The default handler panics.
        // Every call through `scoped` reports what this handler stores.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            uncaught_to.lock().get_or_insert(error.to_string());
        }));
        let context = context(&device)?;
        let process = Process::this();
        Ok(Self {
            shared: Arc::new(Shared {
                process,
                context,
                answers: Answers::default(),
                images: Images::default(),
                slots: Locked::default(),
                joined: JoinedPool::default(),
                amongs: Locked::default(),
                timing: Locked::default(),
                clock: OnceLock::new(),
                staging: StagingPool::new(STAGING_KEPT),
                depth_staging: RowStaging::new(
                    "hiz.depth.staging",
                    DEPTH_SIZES,
                    DEPTH_KEPT,
                    DEPTH_KEPT_BYTES,
                ),
                device,
                queue,
                adapter: summary,
                lost,
                uncaught,
                kept_depth: Locked::default(),
            }),
        })
    }

    /// Refuses to go on in a fork of the process that made the device.
    ///
    /// Call it before taking any lock.
    /// If another thread held a lock at the fork, nobody ever releases it in the fork.
    pub(super) fn check_process(&self) -> Result<()> {
        self.shared.process.check()
    }

    /// The adapter of the device.
    pub fn adapter(&self) -> &AdapterSummary {
        &self.shared.adapter
    }

    /// The device.
    /// In a release build it does not check the arguments of indirect draws and dispatches.
    pub fn device(&self) -> &wgpu::Device {
        &self.shared.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        &self.shared.queue
    }

    /// The context that records on this device.
    pub fn context(&self) -> &HizContext {
        &self.shared.context
    }

    /// The depth images that may be lent again.
    pub(super) fn images(&self) -> &Images {
        &self.shared.images
    }

    /// The culls that were submitted ahead of their reads.
    pub(super) fn slots(&self) -> &Locked<Slots> {
        &self.shared.slots
    }

    /// The times that are being taken, if any.
    pub(super) fn timing(&self) -> &Locked<Option<Timing>> {
        &self.shared.timing
    }

    pub(super) fn clock(&self) -> &OnceLock<bool> {
        &self.shared.clock
    }

    /// What joins the masks of several views.
    pub(super) fn joined(&self) -> &JoinedPool {
        &self.shared.joined
    }

    pub(super) fn amongs(&self) -> &Locked<Vec<(InstancesId, Arc<Among>)>> {
        &self.shared.amongs
    }

    pub(super) fn staging(&self) -> &StagingPool {
        &self.shared.staging
    }

    pub(super) fn depth_staging(&self) -> &RowStaging {
        &self.shared.depth_staging
    }

    /// The buffers of the last answers.
    pub(super) fn answers(&self) -> &Answers {
        &self.shared.answers
    }

    /// The largest width or height of a depth image, in pixels.
    pub fn max_image_side(&self) -> u32 {
        self.device().limits().max_texture_dimension_2d.min(MAX_IMAGE_SIDE)
    }

    /// Waits until everything that was submitted has run.
    ///
    /// # Errors
    /// - [`Error::DeviceLost`].
    /// - [`Error::OtherProcess`] in a fork.
    pub fn wait(&self) -> Result<()> {
        self.scoped(|| readback::wait(self.device(), None))
    }

    pub(super) fn kept_depth(&self) -> &Locked<Option<KeptDepth>> {
        &self.shared.kept_depth
    }

    pub(super) fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Runs `work`, and returns what the device finds wrong as an error instead of panicking.
    pub(super) fn scoped<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        self.check_process()?;
        let device = self.device();
        if let Some(reason) = self.shared.lost.lock().clone() {
            return Err(Error::DeviceLost(reason));
        }
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        if result.is_err() {
            // A callback reports a lost device, and it runs when the device is polled.
            // What the loss broke may appear as any error, so poll before looking.
            drop(device.poll(wgpu::PollType::wait_indefinitely()));
        }
        // Scopes are popped from the innermost to the outermost.
        let internal = pollster::block_on(internal.pop());
        let validation = pollster::block_on(validation.pop());
        let memory = pollster::block_on(memory.pop());
        if let Some(reason) = self.shared.lost.lock().clone() {
            return Err(Error::DeviceLost(reason));
        }
        if let Some(error) = memory {
            return Err(Error::OutOfMemory(error.to_string()));
        }
        let uncaught = self.shared.uncaught.lock().take();
        if let Some(error) = internal.or(validation).map(|e| e.to_string()).or(uncaught) {
            return Err(Error::Device(error));
        }
        result
    }
}

/// How large the blocks are that wgpu cuts buffers and textures from.
///
/// Mesa's lavapipe takes memory as the host's programs do: what was never written costs nothing.
/// So blocks may be large there.
/// SwiftShader fills what it takes: with such blocks it opened a device in 0.3 s in place of 0.2 s,
/// and a process took 330 MiB in place of 140.
fn memory_hints(adapter: &wgpu::AdapterInfo) -> wgpu::MemoryHints {
    if adapter.backend != wgpu::Backend::Vulkan || adapter.driver != LAVAPIPE {
        return wgpu::MemoryHints::default();
    }
    // Such a driver's memory is the host's, whose blocks are half as large.
    let bytes = 2 * LAVAPIPE_BLOCK_BYTES;
    wgpu::MemoryHints::Manual { suballocated_device_memory_block_size: bytes..bytes }
}
