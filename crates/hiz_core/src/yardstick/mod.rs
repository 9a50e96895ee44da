//! What the library is measured against: the same work in the shapes that others give it.
//! For benchmarks and their tests alone.

mod cull;
pub(crate) mod reduce;

use std::time::Instant;

#[cfg(feature = "testing")]
pub(crate) use cull::cull_module;
pub use cull::{read_mask, record_uncertified_cull};
#[cfg(feature = "testing")]
pub(crate) use reduce::modules;
pub use reduce::{PerLevelReduction, ReductionShape, reduce};

use crate::error::Result;
use crate::headless::{Engine, readback};

/// Milliseconds on the wall from the submit of what `record` records to its end.
/// (Timestamps are wrong on lavapipe once a render pass has run.)
/// Whatever was submitted before is waited for first; recording is not counted.
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

/// Milliseconds of a submit that does nothing, and the wait for it.
///
/// # Errors
/// As [`submitted_ms`].
pub fn empty_submit_ms(engine: &Engine) -> Result<f64> {
    submitted_ms(engine, |_| Ok(()))
}

/// Milliseconds of copying `from` into `to` on one thread of the host: what touching every number
/// once costs.
///
/// # Panics
/// If the two are not of the same length.
pub fn memcpy_ms(from: &[f32], to: &mut [f32]) -> f64 {
    let start = Instant::now();
    to.copy_from_slice(std::hint::black_box(from));
    std::hint::black_box(to);
    start.elapsed().as_secs_f64() * 1e3
}
