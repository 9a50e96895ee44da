//! Records of volumes on the device.
//!
//! They lie in a texture, because a software driver fetches a texel of 16 bytes whole.
//! From a buffer it would fetch the words one by one (`docs/performance.md`).
//! Twin: `shaders/instances/record_layout.wgsl`.

use std::ops::Range;

use crate::error::Result;
use crate::gpu::buffers::{Mapped, entry};
use crate::gpu::device::Gpu;
use crate::gpu::kept::Ring;
use crate::gpu::layouts::Binding;

/// Records in a row of the texture.
pub(crate) const RECORDS_PER_ROW: u32 = 1024;

/// Bytes of a texel of `Rgba32Uint`.
pub(crate) const TEXEL_BYTES: u64 = 16;

/// A short row is padded to a multiple of this many records.
/// Then every size of record meets the alignment that copies need.
const ROW_MULTIPLE: u32 = 16;

/// The format of the texture.
pub(crate) const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;

/// The usage of records that culls read as storage, beside that as the target of copies.
const STORED: wgpu::TextureUsages =
    wgpu::TextureUsages::STORAGE_BINDING.union(wgpu::TextureUsages::COPY_SRC);

/// Records, one after the other, in rows of [`RECORDS_PER_ROW`].
#[derive(Debug)]
pub(crate) struct Records {
    pub(crate) view: wgpu::TextureView,
    texture: wgpu::Texture,
    count: u32,
    record_bytes: u64,
}

/// Records in a staging buffer, to be copied to the texture that the cull reads.
#[derive(Debug)]
pub(crate) struct Upload {
    staging: wgpu::Buffer,
    texture: wgpu::Texture,
    /// The rows of the texture that they are copied to.
    rows: Range<u32>,
    /// Where the staging buffer goes when it has been read; then the copy is recorded once.
    ring: Option<Ring>,
}

/// The most bytes that are staged at once, of records that are more.
///
/// Such buffers lie in a block of at least 64 MiB that wgpu keeps.
/// A buffer as large as the block has memory of its own, all of whose pages are new to the process.
const STAGED: u64 = 16 << 20;
/// From this many bytes on, records are staged in several buffers.
/// Fewer go through one, because a texture that is written in parts is cleared first.
const MANY: u64 = 64 << 20;
/// From this many bytes on, a staging buffer is kept for the next upload.
const KEPT_FROM: u64 = 1 << 20;

impl Records {
    /// Makes room for `count` records; `fill` writes them into mapped memory.
    /// They are on the device once the upload was recorded and has run.
    pub(crate) fn new<T>(
        gpu: &Gpu,
        label: &str,
        count: u32,
        record_bytes: u64,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(Self, Upload, T)> {
        Self::of_usage(gpu, label, (count, record_bytes), STORED, fill)
    }

    /// Records as [`Records::new`] makes them, in a texture that shaders sample.
    pub(crate) fn sampled<T>(
        gpu: &Gpu,
        label: &str,
        count: u32,
        record_bytes: u64,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(Self, Upload, T)> {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING;
        Self::of_usage(gpu, label, (count, record_bytes), usage, fill)
    }

    fn of_usage<T>(
        gpu: &Gpu,
        label: &str,
        (count, record_bytes): (u32, u64),
        texture_usage: wgpu::TextureUsages,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(Self, Upload, T)> {
        let records = Self::made(gpu, label, (count, record_bytes), texture_usage)?;
        let rows = 0..records.texture.height();
        let (upload, filled) = records.staged_by(gpu, label, rows, None, fill)?;
        Ok((records, upload, filled))
    }

    /// The parts in which these records are staged: rows of the texture.
    pub(crate) fn bands(&self) -> impl Iterator<Item = Range<u32>> + use<> {
        let (row, rows) = (self.row_bytes(), self.texture.height());
        let band = if row * u64::from(rows) < MANY { rows } else { (STAGED / row).max(1) as u32 };
        (0..rows).step_by(band as usize).map(move |first| first..rows.min(first + band))
    }

    /// Stages the records of some rows; `fill` writes them into mapped memory.
    /// The upload's copy must be recorded at most once, since its buffer serves the next upload.
    pub(crate) fn staged<T>(
        &self,
        gpu: &Gpu,
        label: &str,
        rows: Range<u32>,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(Upload, T)> {
        let size = self.row_bytes() * rows.len() as u64;
        let ring = if size < KEPT_FROM { None } else { Some(gpu.kept_staging(size)?) };
        self.staged_by(gpu, label, rows.clone(), ring, |staged| {
            let filled = fill(staged)?;
            self.clear_padding(staged, &rows)?;
            Ok(filled)
        })
    }

    fn staged_by<T>(
        &self,
        gpu: &Gpu,
        label: &str,
        rows: Range<u32>,
        ring: Option<Ring>,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(Upload, T)> {
        let size = self.row_bytes() * rows.len() as u64;
        let staging = gpu.staging(ring.as_ref(), label, size)?;
        let filled = fill(&Mapped::of(label, &staging))?;
        staging.unmap();
        Ok((Upload { staging, texture: self.texture.clone(), rows, ring }, filled))
    }

    /// Zeroes what lies behind the last record, where a buffer still holds an older upload.
    fn clear_padding(&self, mapped: &Mapped<'_>, rows: &Range<u32>) -> Result<()> {
        let first = u64::from(rows.start) * u64::from(RECORDS_PER_ROW) * self.record_bytes;
        let end = self.row_bytes() * rows.len() as u64;
        let used = u64::from(self.count) * self.record_bytes - first;
        if used < end {
            mapped.range(used..end)?.slice(..).fill(0);
        }
        Ok(())
    }

    fn row_bytes(&self) -> u64 {
        TEXEL_BYTES * u64::from(self.texture.width())
    }

    /// Makes room for `count` records, which commands write later.
    pub(crate) fn unwritten(gpu: &Gpu, label: &str, count: u32, record_bytes: u64) -> Result<Self> {
        Self::made(gpu, label, (count, record_bytes), STORED)
    }

    fn made(
        gpu: &Gpu,
        label: &str,
        (count, record_bytes): (u32, u64),
        texture_usage: wgpu::TextureUsages,
    ) -> Result<Self> {
        let columns = Self::columns(count);
        let rows = count.div_ceil(RECORDS_PER_ROW).max(1);
        let texture = gpu.texture(
            label,
            (columns * (record_bytes / TEXEL_BYTES) as u32, rows),
            FORMAT,
            texture_usage | wgpu::TextureUsages::COPY_DST,
        )?;
        let view = gpu.view(&texture)?;
        Ok(Self { view, texture, count, record_bytes })
    }

    /// The records in a row, of `count` in all.
    fn columns(count: u32) -> u32 {
        count.clamp(1, RECORDS_PER_ROW).next_multiple_of(ROW_MULTIPLE)
    }

    /// Texels per record.
    pub(crate) fn texels(&self) -> u32 {
        (self.record_bytes / TEXEL_BYTES) as u32
    }

    /// The texture.
    /// Its rows have no padding except after the last record.
    #[cfg(feature = "testing")]
    pub(crate) fn texture(&self) -> &wgpu::Texture {
        &self.texture
    }

    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        TEXEL_BYTES * u64::from(self.texture.width()) * u64::from(self.texture.height())
    }
}

impl Upload {
    pub(crate) fn record(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_texture(
            wgpu::TexelCopyBufferInfo {
                buffer: &self.staging,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.texture.width() * TEXEL_BYTES as u32),
                    rows_per_image: None,
                },
            },
            wgpu::TexelCopyTextureInfo {
                origin: wgpu::Origin3d { x: 0, y: self.rows.start, z: 0 },
                ..self.texture.as_image_copy()
            },
            wgpu::Extent3d { height: self.rows.len() as u32, ..self.texture.size() },
        );
        if let Some(ring) = &self.ring {
            ring.come_back(encoder, &self.staging);
        }
    }
}

/// The bindings of a piece's uniform and records in every cull.
/// The last one says which instances are asked for (`shaders/cull/among.wgsl`).
pub(crate) const RECORD_BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::ReadQuads), (4, Binding::SampledQuads)];

/// Binds a piece's uniform and records for a cull of all instances.
pub(crate) fn bind_records(
    gpu: &Gpu,
    uniform: &wgpu::Buffer,
    records: &Records,
) -> Result<wgpu::BindGroup> {
    bind_records_among(gpu, uniform, records, gpu.no_texels()?)
}

/// Binds a piece's uniform and records for a cull that reads which instances it asks for.
pub(crate) fn bind_records_among(
    gpu: &Gpu,
    uniform: &wgpu::Buffer,
    records: &Records,
    among: &wgpu::TextureView,
) -> Result<wgpu::BindGroup> {
    gpu.bind_group(
        "hiz.cull.instances",
        &gpu.layout("hiz.cull.instances_layout", RECORD_BINDINGS)?,
        &[
            entry(0, uniform.as_entire_binding()),
            entry(1, wgpu::BindingResource::TextureView(&records.view)),
            entry(4, wgpu::BindingResource::TextureView(among)),
        ],
    )
}

const _: () =
    assert!((ROW_MULTIPLE * 16).is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT), "points");
const _: () =
    assert!((ROW_MULTIPLE * 32).is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT), "spheres");
const _: () =
    assert!((ROW_MULTIPLE * 48).is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT), "boxes");
const _: () = assert!(
    (ROW_MULTIPLE * 64).is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT),
    "oriented boxes"
);
