//! Readback, from the device to the host: copies into staging buffers, waits, and maps them.

use crate::error::{Error, Result};
pub(crate) use crate::gpu::copies::BufferRange;
use crate::host::memory;
use crate::input::image::ImageSize;

/// Bytes of a staging buffer at most.
/// Larger ranges are read in bands.
const STAGING_BYTES: u64 = 1 << 28;

/// Reads ranges of buffers and returns their bytes in the same order.
pub(crate) fn read_buffers(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    ranges: &[BufferRange<'_>],
) -> Result<Vec<Vec<u8>>> {
    let total: u64 = ranges.iter().map(|r| r.size).sum();
    if total > STAGING_BYTES {
        return ranges.iter().map(|r| read_in_bands(device, queue, r)).collect();
    }
    if total == 0 {
        return Ok(vec![Vec::new(); ranges.len()]);
    }
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("hiz.readback.encoder"),
    });
    let staged = Staged::record(&mut encoder, staging(device, total), ranges);
    let submission = queue.submit([encoder.finish()]);
    let copied = |parts: &[&[u8]]| {
        parts.iter().map(|part| memory::collected(part.iter().copied(), "readback")).collect()
    };
    staged.read(device, submission, copied)?
}

/// Copies of buffer ranges in a staging buffer.
/// Record them with the commands that fill the ranges, and they need no submit of their own.
#[derive(Debug)]
pub(crate) struct Staged {
    staging: wgpu::Buffer,
    sizes: Vec<u64>,
}

impl Staged {
    /// Records the copies into `staging`, which is as large as all ranges together.
    /// At least one range must not be empty.
    pub(crate) fn record(
        encoder: &mut wgpu::CommandEncoder,
        staging: wgpu::Buffer,
        ranges: &[BufferRange<'_>],
    ) -> Self {
        let sizes: Vec<_> = ranges.iter().map(|range| range.size).collect();
        let mut offset = 0;
        for range in ranges.iter().filter(|range| range.size > 0) {
            encoder.copy_buffer_to_buffer(range.buffer, range.offset, &staging, offset, range.size);
            offset += range.size;
        }
        Self { staging, sizes }
    }

    /// Waits for the submission of the copies.
    /// `use_parts` gets the bytes of the ranges in their order, where they lie.
    pub(crate) fn read<T>(
        &self,
        device: &wgpu::Device,
        submission: wgpu::SubmissionIndex,
        use_parts: impl FnOnce(&[&[u8]]) -> T,
    ) -> Result<T> {
        with_mapped(device, &self.staging, submission, |bytes| {
            let mut rest = bytes;
            let parts: Vec<_> = self
                .sizes
                .iter()
                .map(|size| {
                    let (part, behind) = rest.split_at(*size as usize);
                    rest = behind;
                    part
                })
                .collect();
            use_parts(&parts)
        })
    }
}

fn read_in_bands(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    range: &BufferRange<'_>,
) -> Result<Vec<u8>> {
    let mut out = memory::list(range.size as usize, "readback")?;
    let mut done = 0;
    while done < range.size {
        let size = STAGING_BYTES.min(range.size - done);
        let band = BufferRange { buffer: range.buffer, offset: range.offset + done, size };
        out.extend(read_buffers(device, queue, &[band])?.swap_remove(0));
        done += size;
    }
    Ok(out)
}

/// Reads the first `row` bytes of each row of a texture.
/// That is the whole row, except the padding to a whole texel of up to 16 bytes.
pub(crate) fn read_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    row: u64,
) -> Result<Vec<u8>> {
    let size = ImageSize::new(texture.width(), texture.height());
    let crop = Crop { skip: 0, row, first: 0, rows: u64::from(size.height) };
    read_texels(device, queue, (texture.as_image_copy(), size), &crop)
}

/// What is kept of the rows that were copied.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crop {
    /// Bytes of a row before those that are kept, and how many are kept.
    pub(crate) skip: u64,
    pub(crate) row: u64,
    /// The first row that is kept, and how many are.
    pub(crate) first: u64,
    pub(crate) rows: u64,
}

/// Reads a part of one layer of one mip level, which has `texels`.
/// The level is copied as a whole, since depth allows nothing else.
pub(crate) fn read_texels(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (source, texels): (wgpu::TexelCopyTextureInfo<'_>, ImageSize),
    crop: &Crop,
) -> Result<Vec<u8>> {
    let ImageSize { width, height } = texels;
    let texel = source.texture.format().block_copy_size(None).unwrap_or(4);
    let padded = (u64::from(texel) * u64::from(width))
        .next_multiple_of(u64::from(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT));
    let staging = staging(device, padded * u64::from(height));
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("hiz.readback.encoder"),
    });
    encoder.copy_texture_to_buffer(
        source,
        wgpu::TexelCopyBufferInfo {
            buffer: &staging,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(
                    u32::try_from(padded)
                        .map_err(|_| Error::limit("bytes per row", padded, u64::from(u32::MAX)))?,
                ),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
    );
    let submission = queue.submit([encoder.finish()]);
    with_mapped(device, &staging, submission, |bytes| {
        let Crop { skip, row, first, rows } = *crop;
        let mut out = memory::list((row * rows) as usize, "readback")?;
        let kept = skip as usize..(skip + row) as usize;
        let lines = bytes.chunks_exact(padded as usize).skip(first as usize);
        for line in lines.take(rows as usize) {
            out.extend_from_slice(&line[kept.clone()]);
        }
        Ok(out)
    })?
}

/// Looks what is done by now, and runs its callbacks.
pub(crate) fn look(device: &wgpu::Device) -> Result<()> {
    device.poll(wgpu::PollType::Poll).map(drop).map_err(|e| Error::DeviceLost(e.to_string()))
}

/// Waits for a submission; `None`: for all of them.
pub(crate) fn wait(device: &wgpu::Device, submission: Option<wgpu::SubmissionIndex>) -> Result<()> {
    device
        .poll(wgpu::PollType::Wait { submission_index: submission, timeout: None })
        .map(drop)
        .map_err(|e| Error::DeviceLost(e.to_string()))
}

fn staging(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("hiz.readback.staging"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    })
}

fn with_mapped<T>(
    device: &wgpu::Device,
    staging: &wgpu::Buffer,
    submission: wgpu::SubmissionIndex,
    use_bytes: impl FnOnce(&[u8]) -> T,
) -> Result<T> {
    let (sender, receiver) = std::sync::mpsc::channel();
    staging.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver lives until the end of this function, so a failed send has no reader.
        let _ = sender.send(result);
    });
    wait(device, Some(submission))?;
    match receiver.try_recv() {
        Ok(Ok(())) => {}
        Ok(Err(e)) => {
            return Err(Error::Device(format!("hiz.readback.staging could not be mapped: {e}")));
        }
        // Another thread's poll may be running the callback at this moment.
        Err(_) => match receiver.recv_timeout(std::time::Duration::from_secs(60)) {
            Ok(Ok(())) => {}
            other => {
                return Err(Error::Device(format!(
                    "hiz.readback.staging could not be mapped: {other:?}"
                )));
            }
        },
    }
    let view = staging
        .get_mapped_range(..)
        .map_err(|e| Error::Device(format!("hiz.readback.staging could not be mapped: {e}")))?;
    let out = use_bytes(&view);
    drop(view);
    staging.unmap();
    Ok(out)
}

/// The little-endian u32 words in `bytes`.
pub(crate) fn to_u32(bytes: &[u8]) -> impl ExactSizeIterator<Item = u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}
