//! The device, its queue and its errors.

use std::sync::Arc;

use crate::context::HizContext;
use crate::error::{Error, Result};
use crate::headless::adapter::{self, ADAPTER_VARIABLE, AdapterSummary};
use crate::headless::process::Process;
use crate::headless::readback;
use crate::host::threads::Locked;
use crate::input::image::MAX_IMAGE_SIDE;

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
    lost: Arc<Locked<Option<String>>>,
    uncaught: Arc<Locked<Option<String>>>,
}

impl Drop for Shared {
    fn drop(&mut self) {
        // A lost device has nothing to wait for.
        drop(self.device.poll(wgpu::PollType::wait_indefinitely()));
    }
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
        Self::open(adapter, HizContext::new)
    }

    /// One whose shaders have planted faults, for tests: see [`HizContext::with_planted_faults`].
    ///
    /// # Errors
    /// As [`Engine::new`].
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
        let features = adapter.features() & wgpu::Features::INDIRECT_FIRST_INSTANCE;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("hiz.device"),
            required_features: features,
            required_limits: adapter.limits(),
            ..Default::default()
        }))
        .map_err(|e| adapter::no_adapter(format!("would open: {summary}: {e}"), &seen))?;
        let lost = Arc::new(Locked::new(None));
        let uncaught = Arc::new(Locked::new(None));
        let (lost_to, uncaught_to) = (Arc::clone(&lost), Arc::clone(&uncaught));
        device.set_device_lost_callback(move |reason, message| {
            lost_to.lock().get_or_insert(format!("{reason:?}: {message}"));
        });
        // The default handler panics; every call below asks for what was left here instead.
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            uncaught_to.lock().get_or_insert(error.to_string());
        }));
        let context = context(&device)?;
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
    pub(super) fn check_process(&self) -> Result<()> {
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
        self.device().limits().max_texture_dimension_2d.min(MAX_IMAGE_SIDE)
    }

    /// Waits for everything that was submitted.
    ///
    /// # Errors
    /// [`Error::DeviceLost`].
    pub fn wait(&self) -> Result<()> {
        self.scoped(|| readback::wait(self.device(), None))
    }

    pub(super) fn encoder(&self, label: &str) -> wgpu::CommandEncoder {
        self.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
    }

    /// Runs `work` so that what the device finds wrong comes back as an error and nothing panics.
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
            // A loss is told by a callback, which runs when the device is polled; what it broke may
            // be reported as anything.
            drop(device.poll(wgpu::PollType::wait_indefinitely()));
        }
        // The innermost scope goes first.
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
