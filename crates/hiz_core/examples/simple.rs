//! The smallest renderer: depth in, cull, draw, on its own device and without a window.
//!
//! ```text
//! cargo run --example simple
//! ```
//!
//! A wall hides the left half of a grid of boxes.
//! The device culls them, and draws those that are left as squares.
//! The example `renderer` draws larger scenes, and compares pictures with and without culling.
//! `tests/examples.rs` runs this file.

use std::error::Error;

use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, DrawOptions, DrawTemplate, Floats, HizContext,
    ImageSize, InstanceOptions, MeshData, OccluderOptions, Outputs, Pose, Projection,
    PyramidOptions, Rasteriser, Visible,
};

const SHADER: &str = "
// `i` comes from the packed list: the number of a box that was kept, and its place in the grid.
@vertex fn corner(@builtin(vertex_index) v: u32, @location(0) i: u32)
        -> @builtin(position) vec4<f32> {
    let center = vec2(f32(i % 20), f32(i / 20)) - 9.5;
    let offset = vec2(f32(v % 2), f32(v / 2)) * 0.5 - 0.25;
    // A view of 90 degrees along -z from the origin: w is the depth, and z the near plane's.
    return vec4(center + offset, 0.1, 16.0);
}

@fragment fn white() -> @location(0) vec4<f32> { return vec4(1.0); }
";

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // hiz_core needs no features of the device, and no more than the default limits.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let (_, visible) = draw_frame(&device, &queue)?;

    // This readback is for the message alone: the draw took the count on the device.
    let draws = visible.draw_arguments().expect("among the outputs").slice(..);
    wgpu::util::DownloadBuffer::read_buffer(&device, &queue, &draws, |bytes| {
        let draw: hiz_core::DrawIndexedIndirect = bytemuck::pod_read_unaligned(&bytes.unwrap());
        println!("{} of 400 boxes were drawn", draw.instance_count);
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(())
}

/// Draws one frame: 256 x 256 pixels of one byte, 255 where a box was drawn.
pub(crate) fn draw_frame(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
) -> Result<(wgpu::Texture, Visible), Box<dyn Error>> {
    // From the origin along -z, 90 degrees wide.
    let size = ImageSize::new(256, 256);
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    let camera = Camera::look_at(&pose, &projection, size)?;
    // 20 x 20 boxes, half a metre wide and a metre apart, 16 m away.
    let centers: Vec<[f32; 3]> =
        (0..400).map(|i| [(i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, -16.0]).collect();
    let min: Vec<f32> = centers.iter().flatten().map(|v| v - 0.25).collect();
    let max: Vec<f32> = centers.iter().flatten().map(|v| v + 0.25).collect();
    let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
    // The wall, 8 m away, covers the left half of the view.
    let wall = [-9.0, -9.0, -8.0, 0.0, -9.0, -8.0, -9.0, 9.0, -8.0, 0.0, 9.0, -8.0];
    let (vertices, triangles) = (Floats::F32(&wall), &[0, 1, 2, 2, 1, 3]);
    let wall = MeshData { vertices, triangles, transforms: None };

    // Once: what hides, what is culled, and what a cull writes.
    let mut encoder = device.create_command_encoder(&Default::default());
    let hiz = HizContext::new(device)?;
    let occluders = hiz.create_occluders(&[wall], &OccluderOptions::default())?;
    let depth = hiz.create_occluder_depth(size, Rasteriser::Auto)?;
    let pyramid = hiz.create_pyramid(size, &PyramidOptions::default())?;
    let instances = hiz.record_instances(&mut encoder, &bounds, &InstanceOptions::default())?;
    let draw = DrawTemplate { index_count: 6, ..DrawTemplate::default() };
    let outputs = Outputs { indices: true, draws: true, draw, ..Outputs::NONE };
    let visible = hiz.create_visible(&instances, &outputs)?;

    // Each frame: depth, pyramid, cull.
    let all = DrawOptions::default();
    hiz.record_occluder_depth(&mut encoder, &occluders, &camera, &depth, &all)?;
    hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
    let options = CullOptions::default();
    hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)?;

    // Then the renderer's own pass, in the same encoder.
    // It has no depth test, so the picture shows everything that was drawn.
    let picture = target(device, wgpu::TextureFormat::R8Unorm);
    let pipeline = pipeline(device, picture.format());
    let square = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&[0_u32, 1, 2, 2, 1, 3]),
        usage: wgpu::BufferUsages::INDEX,
    });
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &picture.create_view(&Default::default()),
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_index_buffer(square.slice(..), wgpu::IndexFormat::Uint32);
    let draws = visible.draw_arguments().expect("among the outputs");
    for piece in 0..visible.num_pieces() {
        pass.set_vertex_buffer(0, visible.list(piece).expect("among the outputs").slice(..));
        pass.draw_indexed_indirect(draws, visible.draw_offset(piece));
    }
    drop(pass);
    queue.submit([encoder.finish()]);
    Ok((picture, visible))
}

fn target(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::Texture {
    use wgpu::TextureUsages as Usages;
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: 256, height: 256, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: Usages::RENDER_ATTACHMENT | Usages::TEXTURE_BINDING | Usages::COPY_SRC,
        view_formats: &[],
    })
}

fn pipeline(device: &wgpu::Device, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            // The packed list: one number per instance.
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 4,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![0 => Uint32],
            })],
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(format.into())],
        }),
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
