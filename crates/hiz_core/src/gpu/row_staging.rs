//! Rows that the host writes into a texture, through buffers that are kept.
//!
//! A buffer that is made anew is zeroed, and its memory is touched for the first time.
//! Both take about as long as writing the rows.
//! Threads that write into a mapped buffer share no lock, as those that call `write_texture` do.

use std::ops::Range;

use crate::error::Result;
use crate::gpu::buffers::Mapped;
use crate::gpu::device::Gpu;
use crate::gpu::kept::{Kept, Ring};

/// Bytes of a texel: four pixels of float32 (`Rgba32Uint`).
const TEXEL_BYTES: u32 = 16;

/// Bytes from a row to the next in a buffer for `texture`.
pub(crate) fn row_pitch(texture: &wgpu::Texture) -> u32 {
    (TEXEL_BYTES * texture.width()).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
}

/// Bytes of a buffer with room for so many rows of `texture`.
pub(crate) fn staging_bytes(texture: &wgpu::Texture, room: u32) -> u64 {
    u64::from(row_pitch(texture)) * u64::from(room)
}

/// Mapped buffers, each with room for some rows of a texture.
#[derive(Debug)]
pub(crate) struct RowStaging {
    label: &'static str,
    /// Those that are free, by their size in bytes.
    free: Kept<u64, Ring>,
    /// How many of one size are kept, and of how many bytes at most.
    most: (usize, u64),
}

impl RowStaging {
    /// Keeps buffers of the last `sizes` sizes: `count` of each, of at most `bytes` bytes.
    pub(crate) fn new(label: &'static str, sizes: usize, count: usize, bytes: u64) -> Self {
        Self { label, free: Kept::new(sizes), most: (count, bytes) }
    }

    /// Records the copy of `rows` of `texture`, which `fill` writes into a mapping.
    ///
    /// `fill` gets the bytes from a row to the next, too.
    /// The buffer has room for `room` rows, so that it serves other rows as well.
    ///
    /// # Errors
    /// Those of `fill`, and [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(crate) fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        part: (&wgpu::Texture, Range<u32>, u32),
        fill: impl FnOnce(&Mapped<'_>, usize) -> Result<()>,
    ) -> Result<()> {
        let (texture, _, room) = &part;
        let bytes = staging_bytes(texture, *room);
        let (count, most) = self.most;
        let ring = self.free.get(bytes, || Ok(Ring::new(if bytes <= most { count } else { 0 })))?;
        record_rows(gpu, encoder, (&ring, self.label), part, fill)
    }
}

/// Records the copy of some rows of a texture, as [`RowStaging::record`] does, through a buffer of
/// this ring with this label, whose buffers have [`staging_bytes`] for it.
///
/// # Errors
/// As there.
pub(crate) fn record_rows(
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    (ring, label): (&Ring, &'static str),
    (texture, rows, room): (&wgpu::Texture, Range<u32>, u32),
    fill: impl FnOnce(&Mapped<'_>, usize) -> Result<()>,
) -> Result<()> {
    let pitch = row_pitch(texture);
    let staging = gpu.staging(Some(ring), label, staging_bytes(texture, room))?;
    fill(&Mapped::of(label, &staging), pitch as usize)?;
    staging.unmap();
    gpu.recorded(|| {
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(pitch),
                    rows_per_image: None,
                },
            },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: rows.start, z: 0 },
                ..texture.as_image_copy()
            },
            wgpu::Extent3d {
                width: texture.width(),
                height: rows.end - rows.start,
                depth_or_array_layers: 1,
            },
        );
        Ok(())
    })?;
    ring.come_back(encoder, &staging);
    Ok(())
}
