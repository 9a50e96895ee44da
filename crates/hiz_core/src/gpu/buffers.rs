//! Buffers, textures and bind groups, each made inside an error scope of its own.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::checked::checked;
use crate::gpu::device::Gpu;
use crate::gpu::kept::Ring;

/// A buffer that is mapped at creation, for the time of the mapping.
///
/// Several threads may write to ranges of their own.
pub(crate) struct Mapped<'a> {
    label: &'a str,
    buffer: &'a wgpu::Buffer,
}

impl<'a> Mapped<'a> {
    /// A buffer that is mapped.
    pub(crate) fn of(label: &'a str, buffer: &'a wgpu::Buffer) -> Self {
        Self { label, buffer }
    }

    /// The bytes of `range`, which must not be empty and must begin at a multiple of 8.
    ///
    /// Opening a range costs more than writing one record, so open few.
    ///
    /// # Errors
    /// [`Error::Device`] where the range cannot be mapped, as on a lost device.
    pub(crate) fn range(&self, range: std::ops::Range<u64>) -> Result<wgpu::BufferViewMut> {
        let Self { label, buffer } = self;
        buffer
            .get_mapped_range_mut(range)
            .map_err(|e| Error::Device(format!("{label} could not be mapped: {e}")))
    }
}

/// Writes `contents` at byte `offset` into a buffer that is mapped at creation.
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

/// The value in `cell`, which `make` provides on first use.
pub(crate) fn made<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    if let Some(there) = cell.get() {
        return Ok(there);
    }
    let fresh = make()?;
    Ok(cell.get_or_init(|| fresh))
}

/// Checks that a buffer, which must not be mapped, has not been destroyed.
///
/// wgpu tells it to those that use the buffer.
/// Of all uses, asking for a mapped range costs the least: it makes nothing and needs no error
/// scope.
///
/// # Errors
/// [`Error::Device`] with wgpu's words for a destroyed buffer.
pub(crate) fn check_alive(buffer: &wgpu::Buffer) -> Result<()> {
    match buffer.get_mapped_range(..) {
        Err(error) if !error.to_string().contains(NOT_MAPPED) => {
            Err(Error::Device(error.to_string().replace('\n', " ")))
        }
        _ => Ok(()),
    }
}

/// What wgpu's message contains for objects of another device.
const OF_ANOTHER_DEVICE: &str = "doesn't match";

fn depth_aspect(texture: &wgpu::Texture) -> wgpu::TextureAspect {
    if texture.format().is_combined_depth_stencil_format() {
        wgpu::TextureAspect::DepthOnly
    } else {
        wgpu::TextureAspect::All
    }
}

/// What wgpu's message contains for a buffer that exists.
const NOT_MAPPED: &str = "is not mapped";

/// Texels of an atlas that is not read, with room for its headers.
const NO_ATLAS_TEXELS: u32 = 4;

/// Bytes of a stand-in: the size of the largest structure that one is bound for.
const STAND_IN_BYTES: u64 = 256;

impl Gpu {
    /// A buffer to bind where a pipeline has a binding that this call does not use.
    ///
    /// Each label has its own buffer, since a dispatch may not bind one buffer twice for writing.
    pub(crate) fn stand_in(&self, label: &'static str) -> Result<wgpu::Buffer> {
        let usage = wgpu::BufferUsages::STORAGE;
        self.buffers.get(label, || self.empty(label, STAND_IN_BYTES, usage))
    }

    /// A texture of format `R32Uint` to bind where a call samples none.
    pub(crate) fn no_texels(&self) -> Result<&wgpu::TextureView> {
        made(&self.no_texels, || {
            let usage = wgpu::TextureUsages::TEXTURE_BINDING;
            let format = wgpu::TextureFormat::R32Uint;
            self.view(&self.texture("hiz.no_texels", (1, 1), format, usage)?)
        })
    }

    /// An atlas of zeros to bind where no depth is read: its header has the number of no reduction.
    pub(crate) fn no_atlas(&self) -> Result<&wgpu::TextureView> {
        made(&self.no_atlas, || {
            let usage = wgpu::TextureUsages::STORAGE_BINDING;
            let format = wgpu::TextureFormat::Rgba32Uint;
            self.view(&self.texture("hiz.no_atlas", (NO_ATLAS_TEXELS, 1), format, usage)?)
        })
    }

    /// The buffer with this label, which the first call fills with `contents`.
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
        // Storage buffers are bound as a whole, so the limit of one binding applies.
        let (name, allowed) = if is_storage && max_storage_buffer_binding_size < max_buffer_size {
            ("max_storage_buffer_binding_size", max_storage_buffer_binding_size)
        } else {
            ("max_buffer_size", max_buffer_size)
        };
        if descriptor.size > allowed {
            return Err(Error::limit(name, descriptor.size, allowed));
        }
        self.making.buffers.add();
        self.checked(|device| device.create_buffer(descriptor))
    }

    /// A uniform buffer that holds `value` from its creation.
    ///
    /// No queue is needed for that, and every recording has a uniform of its own.
    pub(crate) fn uniform<T: bytemuck::Pod>(&self, label: &str, value: &T) -> Result<wgpu::Buffer> {
        self.filled(label, bytemuck::bytes_of(value), wgpu::BufferUsages::UNIFORM)
    }

    /// A buffer that holds `contents`, a multiple of 4 bytes, from its creation.
    ///
    /// wgpu's own helper is not used.
    /// It panics where a lost device or exhausted memory leaves nothing to map.
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

    /// A mapped buffer for copies to the device, of `size` bytes: a free one of the ring, whose
    /// buffers have this size, or a new one.
    pub(crate) fn staging(
        &self,
        ring: Option<&Ring>,
        label: &str,
        size: u64,
    ) -> Result<wgpu::Buffer> {
        self.staging_for(ring, label, size, wgpu::BufferUsages::COPY_SRC)
    }

    /// The same for other usages than copies.
    pub(crate) fn staging_for(
        &self,
        ring: Option<&Ring>,
        label: &str,
        size: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        if let Some(free) = ring.and_then(Ring::take) {
            return Ok(free);
        }
        // Without MAP_WRITE, wgpu would map a staging buffer of its own and copy it into this one.
        self.mapped(label, size, usage | wgpu::BufferUsages::MAP_WRITE)
    }

    /// A buffer of `size` bytes, a multiple of 4, that is mapped at creation.
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

    /// A buffer of `size` bytes, a multiple of 4, whose contents `fill` writes into the mapping.
    ///
    /// That saves a copy on the host.
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

    /// A 2D texture with one mip level, one sample and one layer.
    pub(crate) fn texture(
        &self,
        label: &str,
        size: (u32, u32),
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Result<wgpu::Texture> {
        self.texture_of_levels(label, size, format, usage, 1)
    }

    /// A 2D texture with `levels` mip levels, one sample and one layer.
    pub(crate) fn texture_of_levels(
        &self,
        label: &str,
        (width, height): (u32, u32),
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
        levels: u32,
    ) -> Result<wgpu::Texture> {
        let allowed = self.limits().max_texture_dimension_2d;
        let side = width.max(height);
        if side > allowed {
            return Err(Error::limit("max_texture_dimension_2d", side.into(), allowed.into()));
        }
        self.making.textures.add();
        self.checked(|device| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: levels,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        })
    }

    /// The view of a whole texture of this device; of its depth alone if it has a stencil as well.
    pub(crate) fn view(&self, texture: &wgpu::Texture) -> Result<wgpu::TextureView> {
        let descriptor =
            wgpu::TextureViewDescriptor { aspect: depth_aspect(texture), ..Default::default() };
        self.checked(|_| texture.create_view(&descriptor))
    }

    /// The view of one layer of one mip level of a 2D texture of this device; of its depth alone if
    /// it has a stencil as well.
    pub(crate) fn view_of(
        &self,
        texture: &wgpu::Texture,
        mip_level: u32,
        array_layer: u32,
    ) -> Result<wgpu::TextureView> {
        let descriptor = wgpu::TextureViewDescriptor {
            aspect: depth_aspect(texture),
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_mip_level: mip_level,
            mip_level_count: Some(1),
            base_array_layer: array_layer,
            array_layer_count: Some(1),
            ..Default::default()
        };
        self.checked(|_| texture.create_view(&descriptor))
    }

    /// Checks that a texture belongs to this device.
    ///
    /// A copy of it is recorded into an encoder that is thrown away.
    /// wgpu offers no other way to find it out without an error on the texture's own device.
    ///
    /// # Errors
    /// [`Error::Device`] with wgpu's words for a texture of another device.
    pub(crate) fn check_owned(&self, texture: &wgpu::Texture) -> Result<()> {
        let copied = self.checked(|device| {
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let extent = wgpu::Extent3d { width: 1, height: 1, depth_or_array_layers: 1 };
            encoder.copy_texture_to_texture(
                texture.as_image_copy(),
                texture.as_image_copy(),
                extent,
            );
            drop(encoder.finish());
        });
        match copied {
            Err(error) if error.to_string().contains(OF_ANOTHER_DEVICE) => Err(error),
            // It may well be refused for its usage, or because it is copied onto itself.
            _ => Ok(()),
        }
    }

    pub(crate) fn bind_group(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        entries: &[wgpu::BindGroupEntry<'_>],
    ) -> Result<wgpu::BindGroup> {
        let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout, entries };
        self.making.bind_groups.add();
        self.checked(|device| device.create_bind_group(&descriptor))
    }

    /// Runs `record`, which writes into the caller's encoder.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the encoder if a pass is open in it: it can take no commands, and
    /// wgpu reports that at once.
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

    /// Checks that a render pass can clear `target` and draw depth into it.
    ///
    /// The same pass is recorded into an encoder that is thrown away.
    /// wgpu offers no other way to find out what a view shows, which device its texture belongs to,
    /// and whether it has been destroyed.
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
        // wgpu reports a destroyed texture at the submit only, but at once if a view is made.
        self.view(target.texture()).map(drop)
    }
}
