//! Renderers draw what is kept, with every way to draw bins.

use hiz_core::{
    Bounds, CullOptions, DrawTemplate, Emit, Floats, HizContext, InstanceOptions, Lod, LodRule,
    MeshLods, MeshTable, Outputs, Placement, PyramidOptions, Visible, wgpu,
};

use crate::common::{Random, camera_along_z};
use crate::{CONVENTION, Crowd, Made};

/// Draws one pixel per instance: column `index`, and the number of its draw as the colour.
const DRAW_SHADER: &str = "
struct Out { @builtin(position) at: vec4<f32>, @location(0) @interpolate(flat) bin: u32 }
@vertex fn vertex(@builtin(vertex_index) vertex: u32, @location(0) instance: u32) -> Out {
    let corner = vec2<f32>(f32(vertex % 3u & 1u), f32(vertex % 3u >> 1u)) * 4.0 - 1.0;
    // A triangle that holds the centre of its pixel, cut by the row above and below.
    let x = (f32(instance) + 0.5 + 0.1 * corner.x) / WIDTH * 2.0 - 1.0;
    return Out(vec4<f32>(x, corner.y, 0.5, 1.0), vertex / 3u);
}
@fragment fn fragment(in: Out) -> @location(0) u32 { return in.bin + 1u; }
";

/// How the renderer of a test draws.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    All,
    Counted,
    PerBin,
}

/// What a renderer draws of the bins: the number of the bin at each instance's column, plus one.
fn drawn(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    (visible, meshes): (&Visible, &MeshTable),
    (width, way): (u32, Way),
) -> Vec<u32> {
    let size = wgpu::Extent3d { width, height: 1, depth_or_array_layers: 1 };
    let target = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("test.target"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let text = DRAW_SHADER.replace("WIDTH", &format!("{width}.0"));
    let source = wgpu::ShaderSource::Wgsl(text.into());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: None, source });
    let attributes = wgpu::vertex_attr_array![0 => Uint32];
    let list = wgpu::VertexBufferLayout {
        array_stride: 4,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &attributes,
    };
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[Some(list)],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::TextureFormat::R32Uint.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    // Three corners per bin.
    let bins = meshes.len() * meshes.most_lods();
    let corners: Vec<u8> = (0..3 * bins).flat_map(u32::to_le_bytes).collect();
    let indices = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.indices"),
        size: corners.len() as u64,
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&indices, 0, &corners);
    let row = (4 * width).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.staging"),
        size: row.into(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    let draws = visible.draw_arguments().unwrap();
    for piece in 0..visible.num_pieces() {
        let list = visible.list(piece).unwrap();
        pass.set_vertex_buffer(0, list.slice(..));
        let offset = visible.draw_offset(piece);
        match way {
            Way::All => pass.multi_draw_indexed_indirect(draws, offset, visible.max_draws()),
            Way::Counted => {
                let (count, at) = (visible.draw_count().unwrap(), visible.draw_count_offset(piece));
                let most = visible.max_draws();
                pass.multi_draw_indexed_indirect_count(draws, offset, count, at, most);
            }
            Way::PerBin => {
                for mesh in 0..meshes.len() {
                    for lod in 0..meshes.lods(mesh) {
                        let (draw, part) = visible.bin(piece, mesh, lod).unwrap();
                        if !part.is_empty() {
                            pass.set_vertex_buffer(0, list.slice(part));
                            pass.draw_indexed_indirect(draws, draw);
                        }
                    }
                }
            }
        }
    }
    drop(pass);
    let copied = wgpu::TexelCopyBufferInfo {
        buffer: &staging,
        layout: wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(row),
            rows_per_image: None,
        },
    };
    encoder.copy_texture_to_buffer(target.as_image_copy(), copied, size);
    queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    let view = staging.get_mapped_range(..).unwrap();
    let words = view.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap()));
    words.take(width as usize).collect()
}

/// A renderer draws each kept instance with the draw of its bin: from all records with their zeros,
/// from as many as the device counts, and bin by bin.
/// The devices have no feature, that for first instances, and that for counts.
#[test]
fn renderers_draw_what_is_kept() {
    const N: usize = 2000;
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let request = wgpu::RequestAdapterOptions::default();
    let adapter = pollster::block_on(instance.request_adapter(&request)).expect("a driver");
    let first = wgpu::Features::INDIRECT_FIRST_INSTANCE;
    let counted = first | wgpu::Features::MULTI_DRAW_INDIRECT_COUNT;
    let mut random = Random(8);
    let lods = [1, 3, 1, 2, 1];
    let made = Crowd::random(N, &lods, 0.6, 0.1, &mut random);
    // By distance: LOD l is chosen beyond 10 l.
    let depth = |m: &Made| if m.shows { 10.0 * (m.lod as f32) + 5.0 } else { -5.0 };
    let centers: Vec<f32> = made.iter().flat_map(|m| [0.0, 0.0, depth(m)]).collect();
    let radii = vec![0.125_f32; N];
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let ids: Vec<u32> = made.iter().map(|m| m.mesh).collect();
    let bin = |m: &Made| if m.is_kept() { 3 * m.mesh + m.lod + 1 } else { 0 };
    let want: Vec<u32> = made.iter().map(bin).collect();
    for (features, ways) in [
        (wgpu::Features::empty(), &[Way::PerBin][..]),
        (first, &[Way::PerBin, Way::All]),
        (counted, &[Way::Counted]),
    ] {
        if !adapter.features().contains(features) {
            eprintln!("left out: the adapter lacks {features:?}");
            continue;
        }
        let limits = HizContext::required_limits();
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: features,
            required_limits: limits,
            ..Default::default()
        }))
        .expect("a device");
        let hiz = HizContext::new(&device).unwrap();
        let draw = |m: usize, l: usize| {
            let first_index = 3 * (3 * m + l) as u32;
            Lod::new(DrawTemplate { index_count: 3, first_index, ..Default::default() }, 0.0)
        };
        let all: Vec<Vec<Lod>> =
            (0..lods.len()).map(|m| (0..lods[m]).map(|l| draw(m, l)).collect()).collect();
        let meshes: Vec<_> = all.iter().map(|lods| MeshLods::new(lods)).collect();
        let meshes = hiz.create_mesh_table(&meshes).unwrap();
        let camera = camera_along_z(16, 16, CONVENTION);
        let far = device.create_texture(&crate::common::depth_descriptor(
            (16, 16),
            wgpu::TextureFormat::R32Float,
            wgpu::TextureUsages::TEXTURE_BINDING,
        ));
        let view = far.create_view(&wgpu::TextureViewDescriptor::default());
        let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
        let lod = LodRule::Distance { thresholds: vec![10.0, 20.0] };
        let options = CullOptions { lod, ..CullOptions::default() };
        for way in ways {
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let upload = InstanceOptions {
                mesh_ids: Some(&ids),
                piece_capacity: Some(1024),
                ..InstanceOptions::default()
            };
            let instances = hiz.record_instances(&mut encoder, &bounds, &upload).unwrap();
            let placement =
                if *way == Way::PerBin { Placement::Reserved } else { Placement::Packed };
            let emit = Emit::Binned { meshes: meshes.clone(), placement };
            let outputs = Outputs { indices: true, emit, ..Outputs::NONE };
            let visible = hiz.create_visible(&instances, &outputs).unwrap();
            hiz.record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
            hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
                .unwrap();
            queue.submit([encoder.finish()]);
            let got = drawn((&device, &queue), (&visible, &meshes), (N as u32, *way));
            let at = got.iter().zip(&want).position(|(a, b)| a != b);
            assert_eq!(at, None, "{features:?} {way:?}");
        }
    }
}
