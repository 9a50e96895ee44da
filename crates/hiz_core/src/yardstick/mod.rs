//! Yardsticks: reference work that the library is measured against.
//!
//! - `reduce` builds a pyramid with one dispatch per level.
//! - `multisampled` resolves multisampled depth.
//! - `cull` culls without certificates.
//! - `emit` makes lists and draws without a cull.
//! - `raster` draws occluders on the host, without what comes before and after.
//! - `from_buffer` copies the bounds that the library takes from a buffer.
//! - `frames` times a renderer's frames call by call.
//!
//! They are for benchmarks and their tests alone.

mod cull;
mod emit;
mod frames;
mod from_buffer;
mod multisampled;
mod raster;
pub(crate) mod reduce;

use std::time::Instant;

#[cfg(feature = "testing")]
pub(crate) use cull::uncertified_module;
pub use cull::{read_mask, record_uncertified_cull};
pub use emit::record_emission;
pub use frames::{FrameTimes, frames};
pub use from_buffer::BoundsInBuffer;
pub use multisampled::MultisampledDepth;
pub use raster::HostRaster;
#[cfg(feature = "testing")]
pub(crate) use reduce::yardstick_modules;
pub use reduce::{PerLevelReduction, ReductionShape, reduce, reduce_region};

use crate::error::Result;
use crate::headless::{Engine, readback};

/// Wall-clock milliseconds from the submit of what `record` records to its end.
///
/// Waits first for whatever was submitted before; recording is not counted.
/// Timestamps are not used, because they are wrong on lavapipe once a render pass has run.
///
/// # Errors
/// Those of `record`, and [`Error::DeviceLost`](crate::Error::DeviceLost).
pub fn submitted_ms(
    engine: &Engine,
    record: impl FnOnce(&mut wgpu::CommandEncoder) -> Result<()>,
) -> Result<f64> {
    let device = engine.device();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("hiz.yardstick.encoder"),
    });
    record(&mut encoder)?;
    let commands = encoder.finish();
    readback::wait(device, None)?;
    let start = Instant::now();
    let submission = engine.queue().submit([commands]);
    readback::wait(device, Some(submission))?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// Wall-clock milliseconds of a submit that does nothing, and of the wait for it.
///
/// # Errors
/// Those of [`submitted_ms`].
pub fn empty_submit_ms(engine: &Engine) -> Result<f64> {
    submitted_ms(engine, |_| Ok(()))
}

/// How many pipelines an engine has made so far.
pub fn pipelines_made(engine: &Engine) -> u64 {
    engine.context().gpu.making.pipelines.get()
}

/// Wall-clock milliseconds of copying `from` into `to` on one thread of the host.
/// This is the price of touching every number once.
///
/// # Panics
/// If the lengths differ.
pub fn memcpy_ms(from: &[f32], to: &mut [f32]) -> f64 {
    let start = Instant::now();
    to.copy_from_slice(std::hint::black_box(from));
    std::hint::black_box(to);
    start.elapsed().as_secs_f64() * 1e3
}
