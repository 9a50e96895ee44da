//! What is made on the device, each with what wgpu finds wrong with it as an error, at once.
//!
//! wgpu reports errors to the device's handler, which ends the process unless the caller has set
//! another one.
//! Error scopes belong to a thread and are popped at once, so a scope around each call catches that
//! call's own errors and nobody else's.
//! It has to be each call: an object that could not be made must not get into the caller's encoder,
//! whose `finish` would fail for it.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use super::{Gpu, Mapped, write_mapped};
use crate::error::{Error, Result};

/// Runs `make`, and gives what wgpu finds wrong as an error.
pub(crate) fn checked<T>(device: &wgpu::Device, make: impl FnOnce() -> T) -> Result<T> {
    let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
    let validation = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let internal = device.push_error_scope(wgpu::ErrorFilter::Internal);
    let made = make();
    // The innermost scope goes first.
    let internal = found(internal.pop());
    let validation = found(validation.pop());
    let memory = found(memory.pop());
    match (memory, internal.or(validation)) {
        (Some(error), _) => Err(Error::OutOfMemory(in_a_line(&error))),
        (None, Some(error)) => Err(Error::Device(in_a_line(&error))),
        (None, None) => Ok(made),
    }
}

/// What wgpu says, from the call down to the cause.
fn in_a_line(error: &wgpu::Error) -> String {
    let causes = std::iter::successors(std::error::Error::source(error), |error| error.source());
    let texts: Vec<_> = causes.map(|cause| cause.to_string().replace('\n', " ")).collect();
    if texts.is_empty() { error.to_string() } else { texts.join(": ") }
}

/// What a scope has caught.
/// Where wgpu runs natively it is there as soon as the scope is popped; elsewhere it is not waited
/// for.
fn found(scope: impl Future<Output = Option<wgpu::Error>>) -> Option<wgpu::Error> {
    match pin!(scope).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(error) => error,
        Poll::Pending => None,
    }
}

impl Gpu {
    fn checked<T>(&self, make: impl FnOnce(&wgpu::Device) -> T) -> Result<T> {
        checked(&self.device, || make(&self.device))
    }

    fn buffer(&self, descriptor: &wgpu::BufferDescriptor<'_>) -> Result<wgpu::Buffer> {
        let wgpu::Limits { max_buffer_size, max_storage_buffer_binding_size, .. } = self.limits;
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
        let allowed = self.limits.max_texture_dimension_2d;
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
        match checked(&self.device, record) {
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

    /// A shader with the planted faults in it: whoever makes a pipeline takes its module from here,
    /// within the pipeline's own check.
    pub(crate) fn shader_module(&self, label: &str, source: &str) -> wgpu::ShaderModule {
        let source =
            self.edits.iter().fold(source.to_owned(), |text, (what, by)| text.replace(what, by));
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        })
    }

    /// See `occluders::pipeline`.
    pub(crate) fn render_pipeline(
        &self,
        make: impl FnOnce() -> wgpu::RenderPipeline,
    ) -> Result<wgpu::RenderPipeline> {
        self.checked(|_| make())
    }

    pub(crate) fn pipeline(
        &self,
        label: &str,
        source: &str,
        entry_point: &str,
        groups: &[&wgpu::BindGroupLayout],
        constants: &[(&str, f64)],
    ) -> Result<wgpu::ComputePipeline> {
        let groups: Vec<_> = groups.iter().map(|g| Some(*g)).collect();
        self.checked(|device| {
            let module = self.shader_module(label, source);
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                module: &module,
                entry_point: Some(entry_point),
                // The shaders write workgroup memory before they read it.
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    zero_initialize_workgroup_memory: false,
                },
                cache: self.pipeline_cache(),
            })
        })
    }
}
