//! Two frames with two passes and levels of detail, on the renderer's own device, without a window.
//!
//! ```text
//! cargo run --example frames
//! ```
//!
//! A diamond hides the middle of a grid of discs, whose rows lie farther and farther away.
//! Each frame draws what was visible before, and reduces the depth of that.
//! Then it culls all of them, and draws what else is visible.
//! The example `simple` is the same with one pass and one mesh; `tests/examples.rs` runs both.

use std::error::Error;

use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, DrawIndirect, EarlySet, Emit, Floats, HizContext,
    ImageSize, InstanceOptions, Lod, LodRule, MeshLods, Outputs, Placement, Pose, Projection,
    PyramidOptions, Temporal, VertexDraw, Visible,
};

const SHADER: &str = "
// `i` comes from the packed list: the number of a disc that was kept, and its place in the grid.
@vertex fn corner(@location(0) corner: vec2<f32>, @location(1) i: u32)
        -> @builtin(position) vec4<f32> {
    let row = f32(i / 20);
    let depth = 4.0 + 1.4 * row;
    let disc = vec3((vec2(f32(i % 20), row) - 9.5) * 0.1 * depth + 0.2 * corner, depth);
    let p = select(disc, vec3(2.0 * corner, 3.0), i == 400);
    // A view of 90 degrees along -z from the origin: w is the depth, and z the near plane's.
    return vec4(p.xy, 0.1, p.z);
}

@fragment fn nearness(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4(sqrt(p.z) * 5.0);
}
";

/// Corners of the levels of detail of a disc; the diamond is a disc with the last of them.
const CORNERS: [u32; 3] = [16, 8, 4];

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    // hiz_core needs no features of the device, and no more than the default limits.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let (_, passes) = draw_frames(&device, &queue, EarlySet::LastVisible)?;

    // This readback is for the message alone: the draws took the counts on the device.
    for (name, visible) in [("early", passes.early()), ("late", passes.late())] {
        let draws = visible.draw_arguments().expect("among the outputs").slice(..);
        wgpu::util::DownloadBuffer::read_buffer(&device, &queue, &draws, move |bytes| {
            let draws: Vec<DrawIndirect> = bytemuck::pod_collect_to_vec(&bytes.unwrap());
            let counts: Vec<u32> = draws.iter().map(|draw| draw.instance_count).collect();
            println!("{name}: {counts:?} instances of each mesh's three levels were drawn");
        });
    }
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(())
}

/// Draws two frames of 256 x 256 pixels; returns depth and colour of the second, and its passes.
pub(crate) fn draw_frames(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    set: EarlySet<'_>,
) -> Result<([wgpu::Texture; 2], Temporal), Box<dyn Error>> {
    // From the origin along -z, 90 degrees wide.
    let size = ImageSize::new(256, 256);
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    let camera = Camera::look_at(&pose, &projection, size)?;
    // 20 x 20 discs of radius 0.2, each row 1.4 m behind the last; then the diamond.
    let center = |i: usize| {
        let depth = 4.0 + 1.4 * (i / 20) as f32;
        [(i % 20) as f32 - 9.5, (i / 20) as f32 - 9.5, -10.0].map(|v| v * 0.1 * depth)
    };
    let centers: Vec<f32> = (0..400).map(center).chain([[0.0, 0.0, -3.0]]).flatten().collect();
    let radii: Vec<f32> = (0..=400).map(|i| if i == 400 { 2.0 } else { 0.2 }).collect();
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };

    // Once: the meshes, what is culled, and what the passes write.
    let mut encoder = device.create_command_encoder(&Default::default());
    let hiz = HizContext::new(device)?;
    let pyramid = hiz.create_pyramid(size, &PyramidOptions::default())?;
    let lod = |l: usize| {
        let draw = VertexDraw { vertex_count: CORNERS[l], first_vertex: CORNERS[..l].iter().sum() };
        // A side lies this far inside of the circle, whose radius is 1.
        Lod::new(draw, 1.0 - (std::f64::consts::PI / f64::from(CORNERS[l])).cos())
    };
    let disc = [lod(0), lod(1), lod(2)];
    let meshes = hiz.create_mesh_table(&[MeshLods::new(&disc), MeshLods::new(&disc[2..])])?;
    let mesh_ids: Vec<u32> = (0..=400).map(|i| i / 400).collect();
    let (mesh_ids, scales) = (Some(&mesh_ids[..]), Some(Floats::F32(&radii)));
    let options = InstanceOptions { mesh_ids, scales, ..InstanceOptions::default() };
    let instances = hiz.record_instances(&mut encoder, &bounds, &options)?;
    let emit = Emit::Binned { meshes, placement: Placement::Reserved };
    let outputs = Outputs { indices: true, draws: true, emit, ..Outputs::NONE };
    let passes = hiz.create_temporal(&instances, &outputs)?;

    // And the renderer's own: a strip of triangles for each level of detail.
    let corner = |n: u32, k: u32| {
        let around = if k.is_multiple_of(2) { k / 2 } else { n - 1 - k / 2 };
        (around as f32 * std::f32::consts::TAU / n as f32).sin_cos().into()
    };
    let corners = CORNERS.iter().flat_map(|n| (0..*n).map(|k| corner(*n, k)));
    let corners = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&corners.collect::<Vec<[f32; 2]>>()),
        usage: wgpu::BufferUsages::VERTEX,
    });
    let targets = [wgpu::TextureFormat::Depth32Float, wgpu::TextureFormat::R8Unorm];
    let targets = targets.map(|format| target(device, format));
    let [depth, picture] = targets.each_ref().map(|of| of.create_view(&Default::default()));
    let pipeline = pipeline(device, targets.each_ref().map(wgpu::Texture::format));
    let draw = |encoder: &mut wgpu::CommandEncoder, visible: &Visible, is_first: bool| {
        let load = if is_first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
        let load_color = if is_first { wgpu::LoadOp::default() } else { wgpu::LoadOp::Load };
        let store = wgpu::StoreOp::Store;
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &picture,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: load_color, store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations { load, store }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_vertex_buffer(0, corners.slice(..));
        let draws = visible.draw_arguments().expect("among the outputs");
        for piece in 0..visible.num_pieces() {
            let list = visible.list(piece).expect("among the outputs");
            for (mesh, lod) in [(0, 0), (0, 1), (0, 2), (1, 0)] {
                let (draw, indices) = visible.bin(piece, mesh, lod).expect("it is reserved");
                pass.set_vertex_buffer(1, list.slice(indices));
                pass.draw_indirect(draws, draw);
            }
        }
    };

    // Each frame: draw, pyramid, cull, draw the rest.
    let lod = LodRule::Error { pixels: 0.5 };
    let options = CullOptions { lod, ..CullOptions::default() };
    for _ in 0..2 {
        hiz.record_early(&mut encoder, &instances, &camera, &passes, set, &options)?;
        draw(&mut encoder, passes.early(), true);
        hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
        hiz.record_late(&mut encoder, &instances, &camera, &pyramid, &passes, &options)?;
        draw(&mut encoder, passes.late(), false);
    }
    queue.submit([encoder.finish()]);
    Ok((targets, passes))
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

fn pipeline(
    device: &wgpu::Device,
    [depth, color]: [wgpu::TextureFormat; 2],
) -> wgpu::RenderPipeline {
    use wgpu::VertexStepMode::{Instance, Vertex};
    let source = wgpu::ShaderSource::Wgsl(SHADER.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let layout = |array_stride, step_mode, attributes| {
        Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes })
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            // The corners, and the packed list: one number per instance.
            buffers: &[
                layout(8, Vertex, &wgpu::vertex_attr_array![0 => Float32x2]),
                layout(4, Instance, &wgpu::vertex_attr_array![1 => Uint32]),
            ],
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(color.into())],
        }),
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..Default::default()
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: depth,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        multiview_mask: None,
        cache: None,
    })
}
