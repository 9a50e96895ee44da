//! Multisampled depth that is resolved again and again.

use crate::error::Result;
use crate::headless::Engine;
use crate::input::camera::Camera;
use crate::pyramid::resolve::{DepthResolve, ResolveOptions, record_resolve};
use crate::pyramid::source::DepthSource;

/// A multisampled depth texture, cleared to one depth, and what it is resolved into.
#[derive(Debug)]
pub struct MultisampledDepth {
    texture: wgpu::Texture,
    camera: Camera,
    resolve: DepthResolve,
}

impl MultisampledDepth {
    /// A texture of the camera's size with `samples` samples per pixel.
    ///
    /// # Errors
    /// [`Error::Device`](crate::Error::Device) where the device has no such texture.
    pub fn new(engine: &Engine, camera: &Camera, samples: u32) -> Result<Self> {
        let (gpu, size) = (&engine.context().gpu, camera.size());
        let texture = gpu.checked(|device| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("hiz.yardstick.samples"),
                size: wgpu::Extent3d {
                    width: size.width,
                    height: size.height,
                    depth_or_array_layers: 1,
                },
                mip_level_count: 1,
                sample_count: samples,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Depth32Float,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        })?;
        let view = gpu.view(&texture)?;
        let mut encoder = engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("hiz.yardstick.encoder"),
        });
        drop(encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("hiz.yardstick.clear"),
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.5),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        }));
        engine.queue().submit([encoder.finish()]);
        let resolve = DepthResolve::new(gpu, size, &ResolveOptions::default())?;
        Ok(Self { texture, camera: camera.clone(), resolve })
    }

    /// Records the resolve to the farthest samples.
    ///
    /// # Errors
    /// Those of [`HizContext::record_resolve`](crate::HizContext::record_resolve).
    pub fn record(&self, engine: &Engine, encoder: &mut wgpu::CommandEncoder) -> Result<()> {
        let depth = DepthSource::from(&self.texture);
        record_resolve(&engine.context().gpu, encoder, &depth, &self.camera, &self.resolve)
    }
}
