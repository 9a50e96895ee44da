//! Buffers, textures and bind groups, each made within a check of its own.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::checked::checked;
use crate::gpu::device::Gpu;

/// A buffer that is mapped at its creation.
/// Threads open ranges of their own.
pub(crate) struct Mapped<'a> {
    label: &'a str,
    buffer: &'a wgpu::Buffer,
}

impl Mapped<'_> {
    /// Bytes of `range`, not empty, which begins at a multiple of 8.
    /// Opening costs more than writing a record.
    pub(crate) fn range(&self, range: std::ops::Range<u64>) -> Result<wgpu::BufferViewMut> {
        let Self { label, buffer } = self;
        buffer
            .get_mapped_range_mut(range)
            .map_err(|e| Error::Device(format!("{label} could not be mapped: {e}")))
    }
}

/// Writes into a buffer that was mapped at its creation.
pub(crate) fn write_mapped(
    label: &str,
    buffer: &wgpu::Buffer,
    offset: u64,
    contents: &[u8],
) -> Result<()> {
    let range = offset..offset + contents.len() as u64;
    Mapped { label, buffer }.range(range)?.copy_from_slice(contents);
    Ok(())
}

pub(crate) fn entry(binding: u32, resource: wgpu::BindingResource<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource }
}

pub(crate) const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

/// What `cell` holds, made if there is nothing.
pub(crate) fn made<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    if let Some(there) = cell.get() {
        return Ok(there);
    }
    let fresh = make()?;
    Ok(cell.get_or_init(|| fresh))
}

/// As large as the largest structure that a stand-in is bound for.
const STAND_IN_BYTES: u64 = 256;

impl Gpu {
    /// A buffer to bind where a pipeline asks for one and a call does without.
    /// Each label has its own: one may not be bound twice to be written.
    pub(crate) fn stand_in(&self, label: &'static str) -> Result<wgpu::Buffer> {
        let usage = wgpu::BufferUsages::STORAGE;
        self.buffers.get(label, || self.empty(label, STAND_IN_BYTES, usage))
    }

    /// The buffer of this label, which holds `contents` from the first call on.
    pub(crate) fn constant(
        &self,
        label: &'static str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        self.buffers.get(label, || self.filled(label, contents, usage))
    }

    fn buffer(&self, descriptor: &wgpu::BufferDescriptor<'_>) -> Result<wgpu::Buffer> {
        let wgpu::Limits { max_buffer_size, max_storage_buffer_binding_size, .. } = *self.limits();
        let is_storage = descriptor.usage.contains(wgpu::BufferUsages::STORAGE);
        // Storage is bound as a whole.
        let (name, allowed) = if is_storage && max_storage_buffer_binding_size < max_buffer_size {
            ("max_storage_buffer_binding_size", max_storage_buffer_binding_size)
        } else {
            ("max_buffer_size", max_buffer_size)
        };
        if descriptor.size > allowed {
            return Err(Error::limit(name, descriptor.size, allowed));
        }
        self.checked(|device| device.create_buffer(descriptor))
    }

    /// A uniform buffer that holds `value` from the start: no queue is needed, and every recording
    /// has its own.
    pub(crate) fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Result<wgpu::Buffer> {
        self.filled(label, bytemuck::bytes_of(value), wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer that holds `contents` (a multiple of 4 bytes) from the start.
    /// (wgpu's own helper panics where a lost device or memory that ran out leave nothing to map.)
    pub(crate) fn filled(
        &self,
        label: &str,
        contents: &[u8],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        let buffer = self.mapped(label, contents.len() as u64, usage)?;
        write_mapped(label, &buffer, 0, contents)?;
        buffer.unmap();
        Ok(buffer)
    }

    /// A buffer of `size` bytes, all 0.
    pub(crate) fn empty(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        self.buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }

    /// A buffer of `size` bytes (a multiple of 4) that is mapped.
    pub(crate) fn mapped(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        self.buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: true,
        })
    }

    /// A buffer of `size` bytes (a multiple of 4) whose contents `fill` writes where they are
    /// mapped, without a copy on the host.
    pub(crate) fn written<T>(
        &self,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
        fill: impl FnOnce(&Mapped<'_>) -> Result<T>,
    ) -> Result<(wgpu::Buffer, T)> {
        let buffer = self.mapped(label, size, usage)?;
        let filled = fill(&Mapped { label, buffer: &buffer })?;
        buffer.unmap();
        Ok((buffer, filled))
    }

    /// A 2D texture of one mip level, sample and layer.
    pub(crate) fn texture(
        &self,
        label: &str,
        (width, height): (u32, u32),
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<wgpu::Texture> {
        let allowed = self.limits().max_texture_dimension_2d;
        if width.max(height) > allowed {
            return Err(Error::limit(
                "max_texture_dimension_2d",
                width.max(height).into(),
                allowed.into(),
            ));
        }
        self.checked(|device| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        })
    }

    /// The view of a whole texture of this device; of its depth where it has a stencil, too.
    pub(crate) fn view(&self, texture: &wgpu::Texture) -> Result<wgpu::TextureView> {
        let aspect = if texture.format().is_combined_depth_stencil_format() {
            wgpu::TextureAspect::DepthOnly
        } else {
            wgpu::TextureAspect::All
        };
        let descriptor = wgpu::TextureViewDescriptor { aspect, ..Default::default() };
        self.checked(|_| texture.create_view(&descriptor))
    }

    pub(crate) fn bind_group(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        entries: &[wgpu::BindGroupEntry<'_>],
    ) -> Result<wgpu::BindGroup> {
        let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries };
        self.checked(|device| device.create_bind_group(&descriptor))
    }

    /// Runs `record`, which writes into the caller's encoder.
    /// With a pass open there it can take nothing, and wgpu says so at once.
    pub(crate) fn recorded<T>(&self, record: impl FnOnce() -> Result<T>) -> Result<T> {
        match checked(self.device(), record) {
            Ok(result) => result,
            Err(Error::Device(why)) => Err(Error::invalid(
                "encoder",
                format!("expected one of this device without an open pass, but {why}"),
            )),
            Err(other) => Err(other),
        }
    }

    /// Whether a render pass can draw depth into `target` and clear it first: the same pass,
    /// recorded into an encoder that is thrown away.
    /// Nothing else tells what a view shows, where its texture lives, and whether it is still
    /// there.
    pub(crate) fn can_draw_into(
        &self,
        target: &wgpu::TextureView,
        depth_ops: wgpu::Operations<f32>,
    ) -> Result<()> {
        self.checked(|device| {
            let label = Some("hiz.occluders.check");
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label,
                color_attachments: &[],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: target,
                    depth_ops: Some(depth_ops),
                    stencil_ops: None,
                }),
                ..Default::default()
            }));
            drop(encoder.finish());
        })?;
        // A destroyed texture is not told of before the submit.
        self.view(target.texture()).map(drop)
    }
}
