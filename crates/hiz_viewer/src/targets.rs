//! The textures that a frame is drawn into.

use hiz_core::wgpu;
use hiz_core::{ImageSize, OCCLUDER_DEPTH_FORMAT};

use crate::gpu::Gpu;
use crate::pipelines::COLOUR_FORMAT;

/// Colour and depth with some samples per pixel, and the picture that they become.
#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) size: ImageSize,
    pub(crate) samples: u32,
    /// With several samples; `None`: the picture is drawn directly.
    colour: Option<wgpu::TextureView>,
    pub(crate) depth: wgpu::TextureView,
    pub(crate) picture_texture: wgpu::Texture,
    pub(crate) picture: wgpu::TextureView,
}

pub(crate) fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Whether a pass begins with an empty target, or goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Begin {
    Empty,
    On,
}

impl Targets {
    pub(crate) fn new(gpu: &Gpu, size: ImageSize, samples: u32) -> Self {
        let picture_texture = gpu.texture("viewer.picture", size, 1, COLOUR_FORMAT);
        let depth_texture = gpu.texture("viewer.depth", size, samples, OCCLUDER_DEPTH_FORMAT);
        let colour = (samples > 1)
            .then(|| view(&gpu.texture("viewer.colour", size, samples, COLOUR_FORMAT)));
        Self {
            size,
            samples,
            colour,
            depth: view(&depth_texture),
            picture: view(&picture_texture),
            picture_texture,
        }
    }

    /// Begins a pass over colour and depth.
    ///
    /// The `last` pass of a frame resolves the samples into the picture.
    pub(crate) fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        begin: Begin,
        sky: [f64; 3],
        last: bool,
    ) -> wgpu::RenderPass<'e> {
        let [r, g, b] = sky;
        let load = match begin {
            Begin::Empty => wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
            Begin::On => wgpu::LoadOp::Load,
        };
        let colour = wgpu::RenderPassColorAttachment {
            view: self.colour.as_ref().unwrap_or(&self.picture),
            depth_slice: None,
            resolve_target: self.colour.as_ref().filter(|_| last).map(|_| &self.picture),
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer.bodies"),
            color_attachments: &[Some(colour)],
            depth_stencil_attachment: Some(self.depth_attachment(begin)),
            ..Default::default()
        })
    }

    /// Begins a pass over depth alone, which is empty at first.
    pub(crate) fn begin_depth<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
    ) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("viewer.occluders"),
            depth_stencil_attachment: Some(self.depth_attachment(Begin::Empty)),
            ..Default::default()
        })
    }

    fn depth_attachment(&self, begin: Begin) -> wgpu::RenderPassDepthStencilAttachment<'_> {
        let load = match begin {
            // Reversed Z: 0 is far.
            Begin::Empty => wgpu::LoadOp::Clear(0.0),
            Begin::On => wgpu::LoadOp::Load,
        };
        wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }
    }
}

/// Begins a pass over a target without depth.
pub(crate) fn begin_flat<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    target: &wgpu::TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    })
}
