//! How long the stages take on the device, by timestamp queries around their passes.
//!
//! A timer counts for one thread while [`StageTimer::time`] runs on it.
//! Without one nothing is recorded: a stage then costs the look at a variable of the thread.

use std::cell::RefCell;
use std::sync::Arc;

use crate::error::Result;
use crate::gpu::copies::{BufferRange, Copies, StagingPool};
use crate::gpu::device::{ContextId, Gpu};
use crate::host::threads::Locked;

/// Passes that one recording can time.
const MOST_PASSES: u32 = 512;

/// Answers of a timer that may be on their way at a time without new staging buffers.
const STAGING_KEPT: usize = 3;

const RESOLVED: wgpu::BufferUsages =
    wgpu::BufferUsages::QUERY_RESOLVE.union(wgpu::BufferUsages::COPY_SRC);

thread_local! {
    static CURRENT: RefCell<Option<Arc<Queries>>> = const { RefCell::new(None) };
}

/// Times the stages that are recorded.
/// [`HizContext::create_stage_timer`](crate::HizContext::create_stage_timer) makes it.
///
/// # Examples
/// ```
/// # use hiz_core::headless::Engine;
/// # use hiz_core::{Bounds, Camera, CullOptions, DepthConvention, Floats, ImageSize};
/// # use hiz_core::InstanceOptions;
/// # use hiz_core::{Outputs, Pose, Projection, wgpu};
/// # let engine = Engine::new(None)?;
/// # let (device, queue, hiz) = (engine.device(), engine.queue(), engine.context());
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
/// # let pyramid = engine.pyramid(&engine.upload_depth(&[0.01; 64 * 64], &camera)?)?;
/// # let (centers, radii) = ([0.0, 0.0, -5.0, 0.0, 0.0, -20.0], [0.5, 0.5]);
/// # let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// # let visible = hiz.create_visible(&instances, &Outputs::default())?;
/// # let options = CullOptions::default();
/// # let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
/// let timer = hiz.create_stage_timer(queue)?;
/// timer.time(|| hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options))?;
/// let times = hiz.record_stage_times(&mut encoder, &timer)?;
/// queue.submit([encoder.finish()]);
/// # engine.wait()?;
/// // Some frames later, after a poll of the device:
/// if times.is_ready() {
///     for stage in times.stages()? {
///         println!("{:12} {:?} ms", stage.stage, stage.gpu_ms); // None: no trustworthy timestamps
///     }
/// }
/// # let stages: Vec<_> = times.stages()?.iter().map(|stage| stage.stage).collect();
/// # assert_eq!(stages, ["cull", "list"]);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct StageTimer {
    context: ContextId,
    queries: Arc<Queries>,
    /// `None` without queries.
    resolved: Option<wgpu::Buffer>,
    pool: StagingPool,
    /// Milliseconds per tick; `None` where no number of the device's is to be trusted.
    ms_per_tick: Option<f64>,
}

#[derive(Debug)]
struct Queries {
    /// `None` on a device without timestamps.
    set: Option<wgpu::QuerySet>,
    /// The stage of each pass, in the order of the recording.
    passes: Locked<Vec<&'static str>>,
}

/// A pass that is timed.
pub(crate) struct TimedPass {
    queries: Arc<Queries>,
    number: u32,
}

impl TimedPass {
    fn writes(&self) -> Option<(&wgpu::QuerySet, Option<u32>, Option<u32>)> {
        let set = self.queries.set.as_ref().filter(|_| self.number < MOST_PASSES)?;
        Some((set, Some(2 * self.number), Some(2 * self.number + 1)))
    }

    pub(crate) fn of_render_pass(&self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let (query_set, beginning_of_pass_write_index, end_of_pass_write_index) = self.writes()?;
        Some(wgpu::RenderPassTimestampWrites {
            query_set,
            beginning_of_pass_write_index,
            end_of_pass_write_index,
        })
    }

    fn of_compute_pass(&self) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let (query_set, beginning_of_pass_write_index, end_of_pass_write_index) = self.writes()?;
        Some(wgpu::ComputePassTimestampWrites {
            query_set,
            beginning_of_pass_write_index,
            end_of_pass_write_index,
        })
    }
}

/// Notes a pass of `stage`, if this thread's recording is timed.
pub(crate) fn timed_pass(stage: &'static str) -> Option<TimedPass> {
    CURRENT.with_borrow(|current| {
        let queries = Arc::clone(current.as_ref()?);
        let mut passes = queries.passes.lock();
        let number = passes.len() as u32;
        passes.push(stage);
        drop(passes);
        Some(TimedPass { queries, number })
    })
}

/// Begins a compute pass that is one stage.
pub(crate) fn stage_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    stage: &'static str,
) -> wgpu::ComputePass<'e> {
    let timed = timed_pass(stage);
    encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
        label: Some(label),
        timestamp_writes: timed.as_ref().and_then(TimedPass::of_compute_pass),
    })
}

/// Several stages: in one compute pass, or in one each if they are timed.
#[expect(clippy::large_enum_variant, reason = "one at a time, on the stack")]
pub(crate) enum StagePasses<'e> {
    /// Not timed.
    One(wgpu::ComputePass<'e>),
    /// Timed, with the passes' label.
    Each(&'e mut wgpu::CommandEncoder, &'static str),
}

impl<'e> StagePasses<'e> {
    pub(crate) fn begin(encoder: &'e mut wgpu::CommandEncoder, label: &'static str) -> Self {
        if CURRENT.with_borrow(Option::is_some) {
            return Self::Each(encoder, label);
        }
        Self::One(encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: None,
        }))
    }

    /// Records a stage, which must set everything that it binds.
    pub(crate) fn record(
        &mut self,
        stage: &'static str,
        record: impl FnOnce(&mut wgpu::ComputePass<'_>),
    ) {
        match self {
            Self::One(pass) => record(pass),
            Self::Each(encoder, label) => record(&mut stage_pass(encoder, label, stage)),
        }
    }
}

impl StageTimer {
    pub(crate) fn new(gpu: &Gpu, ns_per_tick: f32) -> Result<Self> {
        let device = gpu.device();
        let has_queries = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let set = has_queries.then(|| {
            gpu.checked(|device| {
                device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("hiz.times.queries"),
                    ty: wgpu::QueryType::Timestamp,
                    count: 2 * MOST_PASSES,
                })
            })
        });
        let set = set.transpose()?;
        let size = u64::from(2 * MOST_PASSES) * size_of::<u64>() as u64;
        let resolved =
            set.as_ref().map(|_| gpu.empty("hiz.times.resolved", size, RESOLVED)).transpose()?;
        Ok(Self {
            context: gpu.id(),
            queries: Arc::new(Queries { set, passes: Locked::default() }),
            resolved,
            pool: StagingPool::new(STAGING_KEPT),
            ms_per_tick: gpu.ms_per_tick(ns_per_tick),
        })
    }

    /// Times the stages that `record` records on this thread.
    ///
    /// Each stage then has a pass of its own.
    pub fn time<T>(&self, record: impl FnOnce() -> T) -> T {
        struct Restore(Option<Arc<Queries>>);
        impl Drop for Restore {
            fn drop(&mut self) {
                CURRENT.set(self.0.take());
            }
        }
        let _restore = Restore(CURRENT.replace(Some(Arc::clone(&self.queries))));
        record()
    }
}

/// What a stage took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageTime {
    /// `"raster"`, `"resolve"` (of samples), `"reduce"`, `"cull groups"`, `"cull members"`, `"cull"`
    /// (without groups), `"list"`, `"join"` (of views), `"among"`, `"update"` or `"refine"`.
    ///
    /// Copies are no passes: what the host has drawn, and the levels that it has made
    /// ([`HostLevels`](crate::HostLevels)), have no stage.
    pub stage: &'static str,
    /// How many passes it had.
    pub passes: u32,
    /// Milliseconds on the device, all passes together.
    /// `None` where the device has no timestamps that can be trusted.
    pub gpu_ms: Option<f64>,
}

/// Times on their way to the host.
#[derive(Debug)]
pub struct StageTimesInFlight {
    copies: Copies,
    resolved: Option<wgpu::Buffer>,
    passes: Vec<&'static str>,
    ms_per_tick: Option<f64>,
}

/// Records the copies of what `timer` has timed.
pub(crate) fn record_stage_times(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    timer: &StageTimer,
) -> Result<StageTimesInFlight> {
    gpu.check_context("timer", timer.context)?;
    let passes = std::mem::take(&mut *timer.queries.passes.lock());
    let queries = 2 * (passes.len() as u32).min(MOST_PASSES);
    let resolved = timer.resolved.clone().filter(|_| queries > 0);
    let bytes = u64::from(queries) * size_of::<u64>() as u64;
    let range = resolved.as_ref().map(|resolved| BufferRange::first(resolved, bytes));
    let copies = gpu.recorded(|| {
        if let (Some(set), Some(resolved)) = (&timer.queries.set, &resolved) {
            encoder.resolve_query_set(set, 0..queries, resolved, 0);
        }
        Copies::record(gpu, encoder, &timer.pool, range.as_slice())
    })?;
    Ok(StageTimesInFlight { copies, resolved, passes, ms_per_tick: timer.ms_per_tick })
}

impl StageTimesInFlight {
    /// Whether the times have arrived; a poll of the device finds out, as a submit does.
    pub fn is_ready(&self) -> bool {
        self.copies.is_ready()
    }

    /// The stages in the order in which they began, each once.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) if the times have not arrived.
    pub fn stages(&self) -> Result<Vec<StageTime>> {
        let mut ticks: Vec<u64> = Vec::new();
        if let Some(resolved) = &self.resolved {
            let passes = self.passes.len().min(MOST_PASSES as usize);
            let range = BufferRange::first(resolved, (2 * passes * size_of::<u64>()) as u64);
            if let Some(bytes) = self.copies.with(&range, bytemuck::pod_collect_to_vec)? {
                ticks = bytes;
            }
        }
        let ms_per_tick = self.ms_per_tick.filter(|_| are_in_order(&ticks));
        let mut stages: Vec<StageTime> = Vec::new();
        for (number, stage) in self.passes.iter().enumerate() {
            let span = ticks.get(2 * number + 1).map(|end| end - ticks[2 * number].min(*end));
            let gpu_ms = ms_per_tick.zip(span).map(|(ms, span)| ms * span as f64);
            match stages.iter_mut().find(|known| known.stage == *stage) {
                Some(known) => {
                    known.passes += 1;
                    known.gpu_ms = known.gpu_ms.zip(gpu_ms).map(|(sum, more)| sum + more);
                }
                None => stages.push(StageTime { stage, passes: 1, gpu_ms }),
            }
        }
        Ok(stages)
    }

    /// The ticks as they came, for tests.
    #[cfg(feature = "testing")]
    pub fn ticks(&self) -> Vec<u64> {
        let Some(resolved) = &self.resolved else { return Vec::new() };
        let range = BufferRange::first(resolved, (16 * self.passes.len()) as u64);
        self.copies.with(&range, bytemuck::pod_collect_to_vec).ok().flatten().unwrap_or_default()
    }
}

/// Whether timestamps can be those of passes that ran one after the other.
/// A driver that writes them at other times mostly shows that here.
fn are_in_order(ticks: &[u64]) -> bool {
    ticks.iter().all(|tick| *tick > 0) && ticks.is_sorted()
}

/// What `driver` and `driver_info` say of the drivers whose timestamps are known to be wrong.
/// Mesa 22.3's software driver stamps a render pass, and what follows it, when it flushes.
const WRONG: [(&str, &str); 1] = [("llvmpipe", "Mesa 22.")];

impl Gpu {
    /// Milliseconds per tick of a timestamp; `None` where the device has none to be trusted.
    fn ms_per_tick(&self, ns_per_tick: f32) -> Option<f64> {
        let info = self.device().adapter_info();
        let is_wrong = WRONG
            .iter()
            .any(|(driver, of)| info.driver == *driver && info.driver_info.contains(of));
        (!is_wrong).then(|| f64::from(ns_per_tick) * 1e-6).filter(|ms| *ms > 0.0)
    }
}
