//! Copies of buffer ranges that come to the host while it does something else.
//!
//! The copies are recorded with the commands that fill the ranges, and the staging buffer is mapped
//! when their submission is done.
//! Whoever polls the device learns that; nothing here submits, polls or waits.

use std::sync::{Arc, OnceLock};

use crate::error::{Error, Result};
use crate::gpu::device::Gpu;
use crate::host::threads::Locked;

/// The part of a buffer to copy; offset and size are multiples of 4.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BufferRange<'a> {
    pub(crate) buffer: &'a wgpu::Buffer,
    pub(crate) offset: u64,
    pub(crate) size: u64,
}

impl<'a> BufferRange<'a> {
    /// The first `size` bytes (a multiple of 4).
    pub(crate) fn first(buffer: &'a wgpu::Buffer, size: u64) -> Self {
        Self { buffer, offset: 0, size }
    }
}

/// Staging buffers that may be used again.
#[derive(Debug, Clone)]
pub(crate) struct StagingPool {
    free: Arc<Locked<Vec<wgpu::Buffer>>>,
    most: usize,
}

impl StagingPool {
    /// Keeps at most `most` buffers.
    pub(crate) fn new(most: usize) -> Self {
        Self { free: Arc::default(), most }
    }

    /// A buffer of exactly `size` bytes, above 0.
    fn take(&self, gpu: &Gpu, size: u64) -> Result<wgpu::Buffer> {
        let mut free = self.free.lock();
        if let Some(fitting) = free.iter().position(|buffer| buffer.size() == size) {
            return Ok(free.swap_remove(fitting));
        }
        drop(free);
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        gpu.empty("hiz.readback.staging", size, usage)
    }

    /// Takes back a buffer that is not mapped; the oldest one gives way.
    fn give(&self, buffer: wgpu::Buffer) {
        let mut free = self.free.lock();
        if free.len() >= self.most {
            free.remove(0);
        }
        free.push(buffer);
    }
}

/// Whether the staging buffer is mapped, once that is known.
type Outcome = Arc<OnceLock<std::result::Result<(), String>>>;

/// Ranges that were copied, and where their bytes are.
#[derive(Debug)]
pub(crate) struct Copies {
    /// `None` if there was nothing to copy.
    staging: Option<wgpu::Buffer>,
    /// The source, the first byte of the range in it, the size, and where the bytes are staged.
    ranges: Vec<(wgpu::Buffer, u64, u64, u64)>,
    outcome: Outcome,
    pool: StagingPool,
}

impl Copies {
    /// Records the copies of `ranges`, and asks for the mapping with the submission.
    pub(crate) fn record(
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        pool: &StagingPool,
        ranges: &[BufferRange<'_>],
    ) -> Result<Self> {
        let total: u64 = ranges.iter().map(|range| range.size).sum();
        let outcome = Outcome::default();
        let staging = if total == 0 {
            outcome.get_or_init(|| Ok(()));
            None
        } else {
            Some(pool.take(gpu, total)?)
        };
        let mut staged = Vec::with_capacity(ranges.len());
        let mut at = 0;
        for BufferRange { buffer, offset, size } in ranges.iter().copied() {
            if let (Some(staging), true) = (&staging, size > 0) {
                encoder.copy_buffer_to_buffer(buffer, offset, staging, at, size);
            }
            staged.push((buffer.clone(), offset, size, at));
            at += size;
        }
        if let Some(staging) = &staging {
            let told = Arc::clone(&outcome);
            encoder.map_buffer_on_submit(staging, wgpu::MapMode::Read, .., move |mapped| {
                told.get_or_init(|| mapped.map_err(|error| error.to_string()));
            });
        }
        Ok(Self { staging, ranges: staged, outcome, pool: pool.clone() })
    }

    /// Whether the bytes are there, or never will be.
    /// A poll of the device finds that out.
    pub(crate) fn is_ready(&self) -> bool {
        self.outcome.get().is_some()
    }

    /// Bytes of a range that lies within one that was copied; `None` for another.
    ///
    /// # Errors
    /// [`Error::Device`] if the copies are not ready, or could not be mapped.
    pub(crate) fn read(&self, range: &BufferRange<'_>) -> Result<Option<Vec<u8>>> {
        self.with(range, <[u8]>::to_vec)
    }

    /// Calls `use_bytes` with the bytes of such a range.
    pub(crate) fn with<T>(
        &self,
        range: &BufferRange<'_>,
        use_bytes: impl FnOnce(&[u8]) -> T,
    ) -> Result<Option<T>> {
        let within = |(buffer, offset, size, _): &&(wgpu::Buffer, u64, u64, u64)| {
            buffer == range.buffer
                && (*offset..=offset + size).contains(&range.offset)
                && range.offset + range.size <= offset + size
        };
        if range.size == 0 {
            return Ok(Some(use_bytes(&[])));
        }
        let Some((_, offset, _, at)) = self.ranges.iter().find(within) else { return Ok(None) };
        let failed = |why: &str| {
            Err(Error::Device(format!("hiz.readback.staging could not be mapped: {why}")))
        };
        let staging = match (self.outcome.get(), &self.staging) {
            (Some(Ok(())), Some(staging)) => staging,
            (Some(Err(why)), _) => return failed(why),
            _ => return failed("its submission is not done"),
        };
        let begin = at + (range.offset - offset);
        match staging.get_mapped_range(..) {
            Ok(view) => Ok(Some(use_bytes(&view[begin as usize..(begin + range.size) as usize]))),
            Err(error) => failed(&error.to_string()),
        }
    }
}

impl Drop for Copies {
    fn drop(&mut self) {
        // A buffer that waits for its submission is left to wgpu, which frees it afterwards.
        if let (Some(Ok(())), Some(staging)) = (self.outcome.get(), self.staging.take()) {
            staging.unmap();
            self.pool.give(staging);
        }
    }
}
