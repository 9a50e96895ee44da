//! The numbers of one recording, such as a camera: how they come to the device.
//!
//! Bind groups are made once, so a uniform keeps its buffer while its contents change.
//! A recording writes its numbers into a small staging buffer.
//! It copies them into the uniform in its own commands, right before those that read them.
//! So every recording reads its own numbers, in whichever order encoders are submitted.
//!
//! The staging buffers form a ring.
//! wgpu maps a buffer again once the submission that copies from it is done, and only then does the
//! buffer come back.
//! A recording that is never submitted drops its buffer together with its encoder.
//! So no buffer is rewritten while a recording may still read it, and none is waited for.

use crate::error::Result;
use crate::gpu::buffers::write_mapped;
use crate::gpu::device::Gpu;
use crate::gpu::kept::Ring;

/// Bytes of a staging buffer: two uniforms.
pub(crate) const STAGING_BYTES: u64 = 2 * UNIFORM_BYTES;

/// Room for a uniform, at an offset that every device allows.
pub(crate) const UNIFORM_BYTES: u64 = 2 * UNIFORM_ALIGNMENT;

/// An offset of uniforms that every device allows, in bytes.
pub(crate) const UNIFORM_ALIGNMENT: u64 = 256;

/// Numbers in a staging buffer, which the encoder of their recording takes.
#[derive(Debug)]
pub(crate) struct Numbers {
    staging: wgpu::Buffer,
    len: u64,
    ring: Ring,
}

/// A copy of some of the numbers; all in bytes, and multiples of 4.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Copy<'a> {
    pub(crate) from: u64,
    pub(crate) target: &'a wgpu::Buffer,
    pub(crate) to: u64,
    pub(crate) size: u64,
}

impl Gpu {
    /// Writes `contents` into a staging buffer, for one recording.
    /// It holds at most [`STAGING_BYTES`].
    pub(crate) fn numbers(&self, contents: &[u8]) -> Result<Numbers> {
        const LABEL: &str = "hiz.numbers.staging";
        let staging = self.staging(Some(&self.ring), LABEL, STAGING_BYTES)?;
        write_mapped(LABEL, &staging, 0, contents)?;
        staging.unmap();
        Ok(Numbers { staging, len: contents.len() as u64, ring: self.ring.clone() })
    }
}

impl Numbers {
    /// Bytes of the numbers.
    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Records the copies of the numbers to where the commands that follow read them.
    pub(crate) fn record(self, encoder: &mut wgpu::CommandEncoder, copies: &[Copy<'_>]) {
        for Copy { from, target, to, size } in copies {
            encoder.copy_buffer_to_buffer(&self.staging, *from, target, *to, *size);
        }
        self.ring.come_back(encoder, &self.staging);
    }

    /// Records commands that read the staging buffer itself.
    pub(crate) fn record_with(
        self,
        encoder: &mut wgpu::CommandEncoder,
        record: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
    ) {
        record(encoder, &self.staging);
        self.ring.come_back(encoder, &self.staging);
    }
}
