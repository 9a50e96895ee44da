//! Every kind of texture that a pyramid takes a depth image from.
//! They are filled with any bits that their kind can hold.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{Camera, Pyramid, PyramidOptions, wgpu};

use crate::common::depth_descriptor;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// A packed upload.
    Bits,
    /// A float texture.
    Float,
    /// A depth texture, drawn by fragments that choose their depth.
    Depth,
}

pub(crate) const SOURCES: [Source; 3] = [Source::Bits, Source::Float, Source::Depth];

const DRAWN: &str = "
@group(0) @binding(0) var bits: texture_2d<u32>;

@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.5, 1.0);
}

@fragment fn chosen(@builtin(position) at: vec4<f32>) -> @builtin(frag_depth) f32 {
    return bitcast<f32>(textureLoad(bits, vec2<u32>(at.xy), 0).x);
}
";

/// A texture for `usage` that holds `words`, one per pixel.
fn texture_of(
    engine: &Engine,
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    words: &[u8],
) -> wgpu::Texture {
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let usage = wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_DST
        | wgpu::TextureUsages::COPY_SRC;
    let texture = engine.device().create_texture(&depth_descriptor((width, height), format, usage));
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(4 * width),
        rows_per_image: None,
    };
    engine.queue().write_texture(texture.as_image_copy(), words, layout, size);
    texture
}

/// A depth texture whose pixels are written by fragments.
/// The driver decides what becomes of NaN.
pub(crate) fn drawn(engine: &Engine, (width, height): (u32, u32), depth: &[f32]) -> wgpu::Texture {
    let device = engine.device();
    let bits = texture_of(
        engine,
        (width, height),
        wgpu::TextureFormat::R32Uint,
        bytemuck::cast_slice(depth),
    );
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT
        | wgpu::TextureUsages::TEXTURE_BINDING
        | wgpu::TextureUsages::COPY_SRC;
    let format = wgpu::TextureFormat::Depth32Float;
    let target = device.create_texture(&depth_descriptor((width, height), format, usage));
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test.drawn"),
        source: wgpu::ShaderSource::Wgsl(DRAWN.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("test.drawn"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: wgpu::TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("chosen"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("test.drawn"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry {
            binding: 0,
            resource: wgpu::BindingResource::TextureView(
                &bits.create_view(&wgpu::TextureViewDescriptor::default()),
            ),
        }],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("test.drawn"),
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(0.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    engine.queue().submit([encoder.finish()]);
    target
}

/// The pyramid of `depth` by way of `source`.
pub(crate) fn pyramid_from(
    engine: &Engine,
    source: Source,
    depth: &[f32],
    camera: &Camera,
    options: &PyramidOptions,
) -> Arc<Pyramid> {
    let size = (camera.size().width, camera.size().height);
    let texture = match source {
        Source::Bits => {
            return engine
                .pyramid_with(&engine.upload_depth(depth, camera).unwrap(), options)
                .unwrap();
        }
        Source::Float => {
            texture_of(engine, size, wgpu::TextureFormat::R32Float, bytemuck::cast_slice(depth))
        }
        Source::Depth => drawn(engine, size, depth),
    };
    let pyramid = Arc::new(engine.context().create_pyramid(camera.size(), options).unwrap());
    let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
    let mut encoder =
        engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    engine.context().record_reduce(&mut encoder, &view, camera, &pyramid).unwrap();
    engine.queue().submit([encoder.finish()]);
    pyramid
}
