//! A device of its own: for scripts and tests that have no renderer. This is what the Python package drives.
//!
//! Everything here is `Send + Sync`; an [`Engine`] is cheap to clone and may be used from any thread.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use crate::bounds::Bounds;
use crate::camera::{Camera, ImageSize};
use crate::context::HizContext;
use crate::cull::{CullInputs, CullOptions, ExplanationRecord, record_explain};
use crate::error::{Error, Result};
use crate::instances::{InstanceOptions, Instances};
use crate::occluders::{MeshData, OCCLUDER_DEPTH_FORMAT, OccluderOptions, Occluders};
use crate::pyramid::{Pyramid, PyramidOptions};
use crate::readback::{self, BufferRange};
use crate::visible::{CounterRecord, DrawIndexedIndirect, Visible, VisibleOptions};

/// The environment variable that chooses an adapter.
pub const ADAPTER_VARIABLE: &str = "HIZVK_ADAPTER";

/// How to install a software driver.
pub const INSTALL_HINT: &str = "A software Vulkan driver: apt install libvulkan1 mesa-vulkan-drivers";

/// A Vulkan adapter, as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Its place in [`adapters`].
    pub index: usize,
    /// The device's name.
    pub name: String,
    /// The driver's name.
    pub driver: String,
    /// The driver's version.
    pub driver_info: String,
    /// The graphics API.
    pub backend: String,
    /// `discrete_gpu`, `integrated_gpu`, `virtual_gpu`, `cpu` or `other`.
    pub device_type: String,
}

impl AdapterSummary {
    fn new(index: usize, info: &wgpu::AdapterInfo) -> Self {
        let device_type = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete_gpu",
            wgpu::DeviceType::IntegratedGpu => "integrated_gpu",
            wgpu::DeviceType::VirtualGpu => "virtual_gpu",
            wgpu::DeviceType::Cpu => "cpu",
            wgpu::DeviceType::Other => "other",
        };
        Self {
            index,
            name: info.name.clone(),
            driver: info.driver.clone(),
            driver_info: info.driver_info.clone(),
            backend: info.backend.to_string(),
            device_type: device_type.to_owned(),
        }
    }

    /// Lower is better: real GPUs first.
    fn rank(&self) -> usize {
        let order = ["discrete_gpu", "integrated_gpu", "virtual_gpu", "cpu"];
        order.iter().position(|t| *t == self.device_type).unwrap_or(order.len())
    }

    fn matches(&self, request: &str) -> bool {
        // Digits are an index and nothing else: "1" is also part of many a version.
        if let Ok(index) = request.parse::<usize>() {
            return index == self.index;
        }
        let request = request.to_lowercase();
        [&self.name, &self.driver, &self.driver_info].iter().any(|text| text.to_lowercase().contains(&request))
    }
}

impl std::fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({}, {} {})", self.name, self.device_type, self.driver, self.driver_info)
    }
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    wgpu::Instance::new(descriptor)
}

fn enumerate() -> Vec<(AdapterSummary, wgpu::Adapter)> {
    pollster::block_on(instance().enumerate_adapters(wgpu::Backends::VULKAN))
        .into_iter()
        .enumerate()
        .map(|(i, adapter)| (AdapterSummary::new(i, &adapter.get_info()), adapter))
        .collect()
}

/// The Vulkan adapters of this machine; none without a driver.
pub fn adapters() -> Vec<AdapterSummary> {
    enumerate().into_iter().map(|(summary, _)| summary).collect()
}

/// A device, its queue and the pipelines on it.
#[derive(Debug, Clone)]
pub struct Engine {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    context: HizContext,
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: AdapterSummary,
    /// Why the device was lost, once it is; and errors that no scope caught.
    lost: Arc<Mutex<Option<String>>>,
    uncaught: Arc<Mutex<Option<String>>>,
}

fn locked<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Engine {
    /// Opens a Vulkan device: the adapter whose index is, or whose name or driver contains, `adapter`; without it what the
    /// environment variable [`ADAPTER_VARIABLE`] says; without that the best one, real GPUs first.
    ///
    /// # Errors
    /// [`Error::NoAdapter`] where none fits, with the adapters that were seen and the line that installs a software driver.
    pub fn new(adapter: Option<&str>) -> Result<Self> {
        Self::with_planted_faults(adapter, &[])
    }

    /// For tests: see [`HizContext::with_planted_faults`].
    #[doc(hidden)]
    pub fn with_planted_faults(adapter: Option<&str>, faults: &[(&str, &str)]) -> Result<Self> {
        let from_environment = std::env::var(ADAPTER_VARIABLE).ok().filter(|s| !s.is_empty());
        let request = adapter.map(str::to_owned).or(from_environment);
        let mut found = enumerate();
        let no_adapter = |request: String, seen| Error::NoAdapter { request, seen, hint: INSTALL_HINT.to_owned() };
        let seen: Vec<String> = found.iter().map(|(summary, _)| summary.to_string()).collect();
        if let Some(request) = &request {
            found.retain(|(summary, _)| summary.matches(request));
        }
        let Some((summary, adapter)) = found.into_iter().min_by_key(|(summary, _)| (summary.rank(), summary.index))
        else {
            let request = request.map_or_else(|| "was found".to_owned(), |r| format!("matches {r:?}"));
            return Err(no_adapter(request, seen));
        };
        let features = adapter.features() & wgpu::Features::INDIRECT_FIRST_INSTANCE;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hiz.device"),
            required_features: features,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|e| no_adapter(format!("would open: {summary}: {e}"), seen))?;
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
        Ok(Self { shared: Arc::new(Shared { context, device, queue, adapter: summary, lost, uncaught }) })
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
    /// As [`HizContext::create_instances`], and [`Error::OutOfMemory`].
    pub fn instances(&self, bounds: &Bounds<'_>, options: &InstanceOptions) -> Result<Arc<Instances>> {
        self.scoped(|| self.context().create_instances(bounds, options)).map(Arc::new)
    }

    /// Uploads triangle meshes.
    ///
    /// # Errors
    /// As [`HizContext::create_occluders`], and [`Error::OutOfMemory`].
    pub fn occluders(&self, meshes: &[MeshData<'_>], options: &OccluderOptions) -> Result<Arc<Occluders>> {
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
            let depth = self.depth_image(camera, OCCLUDER_DEPTH_FORMAT, usage)?;
            let mut encoder = self.encoder("hiz.occluders.encoder");
            self.context().record_occluders(&mut encoder, occluders, camera, &depth.view)?;
            self.queue().submit([encoder.finish()]);
            Ok(depth)
        })
    }

    /// Uploads NDC depth (row 0 on top, the camera's size and convention). What is no depth becomes far when it is read.
    ///
    /// # Errors
    /// [`Error::Invalid`] for another number of pixels, [`Error::Limit`] for an image larger than the device's textures.
    pub fn upload_depth(&self, ndc: &[f32], camera: &Camera) -> Result<DepthImage> {
        let size = camera.size();
        if ndc.len() as u64 != size.pixels() {
            return Err(Error::invalid(
                "depth",
                format!("expected the camera's size {size} = {} numbers, got {}", size.pixels(), ndc.len()),
            ));
        }
        self.scoped(|| {
            let usage =
                wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC;
            let depth = self.depth_image(camera, wgpu::TextureFormat::R32Uint, usage)?;
            // In bands, so that one staging area serves the largest image.
            let rows_at_once = (UPLOAD_BYTES / (4 * size.width)).max(1);
            for (band, rows) in ndc.chunks((rows_at_once * size.width) as usize).enumerate() {
                let height = rows.len() as u32 / size.width;
                self.queue().write_texture(
                    wgpu::TexelCopyTextureInfo {
                        origin: wgpu::Origin3d { x: 0, y: band as u32 * rows_at_once, z: 0 },
                        ..depth.texture.as_image_copy()
                    },
                    bytemuck::cast_slice(rows),
                    wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(4 * size.width),
                        rows_per_image: None,
                    },
                    wgpu::Extent3d { width: size.width, height, depth_or_array_layers: 1 },
                );
                if band > 0 {
                    // Lets go of the previous band's staging.
                    self.queue().submit([]);
                }
            }
            Ok(depth)
        })
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
    pub fn pyramid_with(&self, depth: &DepthImage, options: &PyramidOptions) -> Result<Arc<Pyramid>> {
        self.context().check_context("depth", depth.engine.context().id())?;
        self.scoped(|| {
            let pyramid = self.context().create_pyramid(depth.size(), options)?;
            let mut encoder = self.encoder("hiz.reduce.encoder");
            self.context().record_reduce(&mut encoder, &depth.view, &depth.camera, &pyramid)?;
            self.queue().submit([encoder.finish()]);
            Ok(Arc::new(pyramid))
        })
    }

    /// Reads a level of a pyramid: sanitised depth, row 0 on top.
    ///
    /// # Errors
    /// [`Error::Invalid`] past the last level, [`Error::Mismatch`] for a pyramid that was never built.
    pub fn read_level(&self, pyramid: &Pyramid, level: u32) -> Result<Vec<f32>> {
        self.context().check_context("pyramid", pyramid.context)?;
        let layout = pyramid.layout.levels.get(level as usize).ok_or_else(|| {
            Error::invalid("level", format!("expected a level below {}, got {level}", pyramid.num_levels()))
        })?;
        let built = pyramid.built().ok_or_else(|| {
            Error::mismatch("pyramid", "expected one that was built from a depth image, got one that never was")
        })?;
        if level == 0 {
            let bytes = self.scoped(|| readback::read_texture(self.device(), self.queue(), built.source.texture()))?;
            let convention = built.camera.convention();
            return Ok(to_u32(&bytes).map(|bits| crate::depth::sanitized(bits, convention)).collect());
        }
        let (width, stride) = (layout.width as usize, layout.stride as usize);
        let (first, count) = (u64::from(layout.offset), u64::from(layout.stride) * u64::from(layout.height));
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
        let bytes = self.scoped(|| readback::read_buffers(self.device(), self.queue(), &ranges))?.concat();
        let texels: Vec<f32> = to_u32(&bytes).map(f32::from_bits).collect();
        Ok(texels.chunks(stride).flat_map(|row| row[..width].iter().copied()).collect())
    }

    /// Culls: records and submits; reading the answer waits.
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
        let start = Instant::now();
        self.scoped(|| {
            let visible = self.context().create_visible(instances, output)?;
            let mut encoder = self.encoder("hiz.cull.encoder");
            self.context().record_cull(&mut encoder, instances, camera, pyramid, &visible, options)?;
            let recorded = Instant::now();
            let submission = self.queue().submit([encoder.finish()]);
            Ok(Culling {
                engine: self.clone(),
                instances: Arc::clone(instances),
                pyramid: Arc::clone(pyramid),
                camera: camera.clone(),
                options: options.clone(),
                visible,
                submission,
                submitted: Instant::now(),
                timings: Mutex::new(Timings { record_ms: milliseconds(start, recorded), ..Timings::default() }),
            })
        })
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

    fn depth_image(
        &self,
        camera: &Camera,
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<DepthImage> {
        let size = camera.size();
        let side = size.width.max(size.height);
        let allowed = self.device().limits().max_texture_dimension_2d;
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", u64::from(side), u64::from(allowed)));
        }
        let texture = self.device().create_texture(&wgpu::TextureDescriptor {
            label: Some("hiz.depth.image"),
            size: wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(DepthImage { engine: self.clone(), texture, view, camera: camera.clone() })
    }

    /// Runs `work` so that what the device finds wrong comes back as an error and nothing panics.
    fn scoped<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let device = self.device();
        if let Some(reason) = locked(&self.shared.lost).clone() {
            return Err(Error::DeviceLost(reason));
        }
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
        let result = work();
        if result.is_err() {
            // A loss is told by a callback, which runs when the device is polled; what it broke may be reported as anything.
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

/// Bytes of a depth image that one staging area takes.
const UPLOAD_BYTES: u32 = 1 << 26;

fn milliseconds(start: Instant, end: Instant) -> f64 {
    end.duration_since(start).as_secs_f64() * 1e3
}

fn to_u32(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

/// A depth image on the device and the camera that it was made by.
#[derive(Debug, Clone)]
pub struct DepthImage {
    engine: Engine,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
    camera: Camera,
}

impl DepthImage {
    /// The image's size.
    pub fn size(&self) -> ImageSize {
        self.camera.size()
    }

    /// The camera that it was made by.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The texture.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// The depth as given, row 0 on top.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn read(&self) -> Result<Vec<f32>> {
        let engine = &self.engine;
        let bytes = engine.scoped(|| readback::read_texture(engine.device(), engine.queue(), &self.texture))?;
        Ok(to_u32(&bytes).map(f32::from_bits).collect())
    }
}

/// How many instances met which end.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// All instances.
    pub tested: u64,
    /// Outside the frustum.
    pub outside: u64,
    /// Hidden by the depth image.
    pub occluded: u64,
    /// Possibly visible.
    pub visible: u64,
    /// Bad bounds, kept.
    pub invalid: u64,
    /// Visible and invalid: what the lists would hold without a capacity.
    pub demand: u64,
    /// What they hold.
    pub written: u64,
    /// Depth tests at each level (with [`CullOptions::statistics`]).
    pub levels: [u64; 16],
    /// Texels read (with [`CullOptions::statistics`]).
    pub texels_read: u64,
}

/// Wall times of one cull.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Making buffers and recording.
    pub record_ms: f64,
    /// From the submit to the end of the first wait for it.
    pub gpu_ms: f64,
    /// Copies to the host after that, so far.
    pub readback_ms: f64,
}

/// Why an instance got its verdict.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// 0 outside, 1 occluded, 2 visible, 3 invalid (kept).
    pub verdict: u8,
    /// First and last pixel column and row that the projection may touch, inclusive: x0, y0, x1, y1.
    pub rectangle: Option<[i32; 4]>,
    /// The level that was read.
    pub level: Option<u32>,
    /// The texels (x, y) of that level that were read.
    pub texels: Vec<[u32; 2]>,
    /// Their depths.
    pub texel_depths: Vec<f32>,
    /// The farthest of them.
    pub farthest: Option<f32>,
    /// The NDC depth of the bounds' nearest point, an estimate.
    pub nearest: Option<f64>,
    /// In words.
    pub reason: &'static str,
}

/// A cull that was submitted. Reading waits for it.
#[derive(Debug)]
pub struct Culling {
    engine: Engine,
    instances: Arc<Instances>,
    pyramid: Arc<Pyramid>,
    camera: Camera,
    options: CullOptions,
    visible: Visible,
    submission: wgpu::SubmissionIndex,
    submitted: Instant,
    timings: Mutex<Timings>,
}

impl Culling {
    /// The buffers on the device.
    pub fn visible(&self) -> &Visible {
        &self.visible
    }

    /// The instances that were culled.
    pub fn instances(&self) -> &Instances {
        &self.instances
    }

    /// Waits until the device is done.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<()> {
        self.engine.scoped(|| readback::wait(self.engine.device(), Some(self.submission.clone())))?;
        let mut timings = locked(&self.timings);
        if timings.gpu_ms == 0.0 {
            timings.gpu_ms = milliseconds(self.submitted, Instant::now());
        }
        Ok(())
    }

    /// Wall times so far.
    pub fn timings(&self) -> Timings {
        *locked(&self.timings)
    }

    fn read(&self, ranges: &[BufferRange<'_>]) -> Result<Vec<Vec<u8>>> {
        self.wait()?;
        let start = Instant::now();
        let bytes = self.engine.scoped(|| readback::read_buffers(self.engine.device(), self.engine.queue(), ranges))?;
        locked(&self.timings).readback_ms += milliseconds(start, Instant::now());
        Ok(bytes)
    }

    /// Whether each instance is kept.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn mask(&self) -> Result<Vec<bool>> {
        let ranges: Vec<_> = self
            .instances
            .pieces
            .iter()
            .zip(&self.visible.pieces)
            .map(|(piece, output)| BufferRange::first(&output.planes, 4 * u64::from(piece.words())))
            .collect();
        let planes = self.read(&ranges)?;
        let mut mask = Vec::with_capacity(self.instances.len() as usize);
        for (piece, plane) in self.instances.pieces.iter().zip(planes) {
            let words: Vec<u32> = to_u32(&plane).collect();
            mask.extend((0..piece.count() as usize).map(|i| bit(&words, i) == 1));
        }
        Ok(mask)
    }

    /// Each instance's verdict: 0 outside, 1 occluded, 2 visible, 3 invalid (kept).
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn verdicts(&self) -> Result<Vec<u8>> {
        let ranges: Vec<_> = self
            .instances
            .pieces
            .iter()
            .zip(&self.visible.pieces)
            .map(|(piece, output)| BufferRange::first(&output.planes, 8 * u64::from(piece.words())))
            .collect();
        let planes = self.read(&ranges)?;
        let mut verdicts = Vec::with_capacity(self.instances.len() as usize);
        for (piece, plane) in self.instances.pieces.iter().zip(planes) {
            let words: Vec<u32> = to_u32(&plane).collect();
            let (kept, low) = words.split_at(piece.words() as usize);
            verdicts.extend((0..piece.count() as usize).map(|i| 2 * bit(kept, i) + bit(low, i)));
        }
        Ok(verdicts)
    }

    /// The draw arguments, one record a piece.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn draws(&self) -> Result<Vec<DrawIndexedIndirect>> {
        let draws = &self.visible.draws;
        let bytes = self.read(&[BufferRange::first(draws, draws.size())])?;
        Ok(bytemuck::pod_collect_to_vec(&bytes[0]))
    }

    /// The packed list, the pieces joined.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn indices(&self) -> Result<Vec<u32>> {
        let draws = self.draws()?;
        let ranges: Vec<_> = draws
            .iter()
            .zip(&self.visible.pieces)
            .map(|(draw, output)| {
                BufferRange::first(&output.list, 4 * u64::from(draw.instance_count.min(output.list_capacity)))
            })
            .collect();
        let lists = self.read(&ranges)?;
        Ok(lists.iter().flat_map(|bytes| to_u32(bytes)).collect())
    }

    /// How many instances met which end.
    ///
    /// # Errors
    /// [`Error::DeviceLost`], [`Error::OutOfMemory`].
    pub fn counts(&self) -> Result<Counts> {
        let (counters, draws) = (&self.visible.counters, &self.visible.draws);
        let bytes =
            self.read(&[BufferRange::first(counters, counters.size()), BufferRange::first(draws, draws.size())])?;
        let record: CounterRecord = bytemuck::pod_read_unaligned(&bytes[0]);
        let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&bytes[1]);
        Ok(Counts {
            tested: u64::from(self.instances.len()),
            outside: record.outside.into(),
            occluded: record.occluded.into(),
            visible: record.visible.into(),
            invalid: record.invalid.into(),
            demand: u64::from(record.visible) + u64::from(record.invalid),
            written: draws.iter().map(|d| u64::from(d.instance_count)).sum(),
            levels: record.levels.map(u64::from),
            texels_read: u64::from(record.texels_high) << 32 | u64::from(record.texels_low),
        })
    }

    /// Why instance `index` got its verdict: the cull's own steps, run for it once more.
    ///
    /// # Errors
    /// [`Error::Invalid`] for an index past the end.
    pub fn explain(&self, index: u64) -> Result<Explanation> {
        let engine = &self.engine;
        let index = u32::try_from(index).unwrap_or(u32::MAX);
        let bytes = engine.scoped(|| {
            let target = engine.device().create_buffer(&wgpu::BufferDescriptor {
                label: Some("hiz.explain.target"),
                size: size_of::<ExplanationRecord>() as u64,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let mut encoder = engine.encoder("hiz.explain.encoder");
            let inputs = CullInputs {
                instances: &self.instances,
                camera: &self.camera,
                pyramid: &self.pyramid,
                options: &self.options,
            };
            record_explain(engine.context(), &mut encoder, &inputs, index, &target)?;
            engine.queue().submit([encoder.finish()]);
            readback::read_buffers(engine.device(), engine.queue(), &[BufferRange::first(&target, target.size())])
        })?;
        Ok(explanation(&bytemuck::pod_read_unaligned(&bytes[0]), &self.camera))
    }
}

fn bit(words: &[u32], i: usize) -> u8 {
    (words[i / 32] >> (i % 32) & 1) as u8
}

/// The stages of `shaders/shared/classify.wgsl`.
fn explanation(record: &ExplanationRecord, camera: &Camera) -> Explanation {
    let reached_depth = record.stage >= 4;
    let reason = match (record.stage, record.verdict) {
        (0, _) => "the bounds are not finite, negative, or too large for this camera: kept",
        (1, _) => "outside one plane of the frustum",
        (2, _) => "crosses the plane of the eye: kept",
        (3, 0) => "between the pixel centres",
        (3, _) => "touches no pixel for sure, but no plane of the frustum separates it: kept",
        (4, _) => "not surely behind the farthest depth of the texels: kept",
        (6, 1) => "behind the farthest depth of every pixel that it can touch",
        (6, _) => "not surely behind every pixel that it can touch, or the budget ended: kept",
        (_, 1) => "behind the farthest depth of all texels that it can touch",
        _ => "behind the texels, but not surely inside their block: kept",
    };
    let [x0, y0, x1, y1] = record.texels;
    let corners = [[x0, y0], [x1, y0], [x0, y1], [x1, y1]];
    let (mut texels, mut texel_depths) = (Vec::new(), Vec::new());
    if reached_depth {
        for (texel, bits) in corners.iter().zip(record.texel_bits) {
            if !texels.contains(texel) {
                texels.push(*texel);
                texel_depths.push(f32::from_bits(bits));
            }
        }
    }
    let [least, greatest] = record.depths.map(f64::from);
    let nearest = if camera.convention().is_reversed() { greatest } else { least };
    Explanation {
        verdict: record.verdict as u8,
        rectangle: reached_depth.then_some(record.pixels),
        level: reached_depth.then_some(record.level),
        texels,
        texel_depths,
        farthest: reached_depth.then(|| f32::from_bits(record.farthest_bits)),
        nearest: (record.stage >= 3).then_some(nearest),
        reason,
    }
}
