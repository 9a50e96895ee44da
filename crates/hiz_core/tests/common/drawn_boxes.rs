//! A small renderer of boxes, for tests that compare images: per pixel the number of the nearest
//! box and its depth.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{Camera, Emit, ImageSize, Placement, Visible, wgpu};

const SHADER: &str = "
struct Body { center: vec4<f32>, half: vec4<f32> }
struct Vertex {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) @interpolate(flat) number: u32,
}
@group(0) @binding(0) var<uniform> clip_from_world: mat4x4<f32>;
@group(0) @binding(1) var<storage, read> bodies: array<Body>;

@vertex fn vertex(@builtin(vertex_index) corner: u32, @location(0) index: u32) -> Vertex {
    let bits = vec3<f32>(f32(corner & 1u), f32(corner >> 1u & 1u), f32(corner >> 2u));
    let body = bodies[index];
    let at = body.center.xyz + (2.0 * bits - 1.0) * body.half.xyz;
    return Vertex(clip_from_world * vec4<f32>(at, 1.0), index + 1u);
}

@fragment fn fragment(in: Vertex) -> @location(0) u32 { return in.number; }
";

/// The triangles of a box, whose corner `i` has the bits of `i` as its sides.
const TRIANGLES: [u16; 36] = [
    0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1, 2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5,
    7, 1, 7, 3,
];

pub(crate) const NUM_INDICES: u32 = TRIANGLES.len() as u32;

/// A box: its centre and half its sides.
pub(crate) type Body = ([f32; 3], [f32; 3]);

/// What a picture shows, row by row: 0 where there is no box.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Picture {
    pub(crate) numbers: Vec<u32>,
    pub(crate) depth: Vec<u32>,
}

/// How two pictures differ, in pixels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Difference {
    pub(crate) depth: usize,
    /// The same depth of another box: two boxes share the nearest depth there.
    pub(crate) ties: usize,
}

impl Picture {
    pub(crate) fn difference(&self, other: &Self) -> Difference {
        let pixels = || self.numbers.iter().zip(&other.numbers).zip(&self.depth).zip(&other.depth);
        Difference {
            depth: pixels().filter(|((_, a), b)| a != b).count(),
            ties: pixels().filter(|(((m, n), a), b)| a == b && m != n).count(),
        }
    }
}

/// Where boxes are drawn.
pub(crate) struct Target {
    numbers: wgpu::Texture,
    depth: wgpu::Texture,
    pub(crate) depth_view: wgpu::TextureView,
    numbers_view: wgpu::TextureView,
    size: ImageSize,
}

pub(crate) struct BoxRenderer {
    pub(crate) engine: Arc<Engine>,
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    camera: wgpu::Buffer,
    bodies: wgpu::Buffer,
    triangles: wgpu::Buffer,
    /// The numbers from 0 on, which draw everything.
    all: wgpu::Buffer,
    count: u32,
}

impl BoxRenderer {
    pub(crate) fn new(engine: Arc<Engine>, count: u32) -> Self {
        let device = engine.device();
        let buffer = |size: u64, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let camera = buffer(64, wgpu::BufferUsages::UNIFORM);
        let bodies = buffer(32 * u64::from(count), wgpu::BufferUsages::STORAGE);
        let triangles = buffer(2 * TRIANGLES.len() as u64, wgpu::BufferUsages::INDEX);
        let usages = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::STORAGE;
        let all = buffer(4 * u64::from(count), usages);
        engine.queue().write_buffer(&triangles, 0, bytemuck::cast_slice(&TRIANGLES));
        let numbers: Vec<u32> = (0..count).collect();
        engine.queue().write_buffer(&all, 0, bytemuck::cast_slice(&numbers));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let index = [wgpu::VertexAttribute {
            format: wgpu::VertexFormat::Uint32,
            offset: 0,
            shader_location: 0,
        }];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: 4,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: &index,
                })],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::TextureFormat::R32Uint.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: camera.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: bodies.as_entire_binding() },
            ],
        });
        Self { pipeline, bindings, camera, bodies, triangles, all, count, engine }
    }

    pub(crate) fn target(&self, size: ImageSize) -> Target {
        let texture = |format| {
            self.engine.device().create_texture(&wgpu::TextureDescriptor {
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::COPY_SRC,
                ..crate::common::depth_descriptor(
                    (size.width, size.height),
                    format,
                    wgpu::TextureUsages::empty(),
                )
            })
        };
        let depth = texture(wgpu::TextureFormat::Depth32Float);
        let numbers = texture(wgpu::TextureFormat::R32Uint);
        let view =
            |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        Target { depth_view: view(&depth), numbers_view: view(&numbers), depth, numbers, size }
    }

    /// Where everything stands from the next submit on, and who looks.
    pub(crate) fn place(&self, bodies: &[Body], camera: &Camera) {
        let words: Vec<[f32; 8]> =
            bodies.iter().map(|(c, h)| [c[0], c[1], c[2], 0.0, h[0], h[1], h[2], 0.0]).collect();
        self.engine.queue().write_buffer(&self.bodies, 0, bytemuck::cast_slice(&words));
        let (rows, origin) = (camera.rows(), camera.origin());
        let mut columns = [[0.0_f32; 4]; 4];
        for (r, row) in rows.iter().enumerate() {
            let shift: f64 = (0..3).map(|k| row[k] * origin[k]).sum();
            for k in 0..3 {
                columns[k][r] = row[k] as f32;
            }
            columns[3][r] = (row[3] - shift) as f32;
        }
        self.engine.queue().write_buffer(&self.camera, 0, bytemuck::cast_slice(&columns));
    }

    /// Records the drawing of what a cull has listed, or of everything.
    pub(crate) fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        listed: Option<&Visible>,
        is_first: bool,
    ) {
        let mut pass = begin(encoder, target, is_first);
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.set_index_buffer(self.triangles.slice(..), wgpu::IndexFormat::Uint16);
        let Some(visible) = listed else {
            pass.set_vertex_buffer(0, self.all.slice(..));
            pass.draw_indexed(0..NUM_INDICES, 0, 0..self.count);
            return;
        };
        let draws = visible.draw_arguments().expect("asked for");
        for piece in 0..visible.num_pieces() {
            let list = visible.list(piece).expect("asked for");
            let reserved = |draw| visible.bin(piece, draw, 0);
            for draw in 0..visible.max_draws() {
                // The meshes have one LOD, so a draw is a mesh.
                let bin = reserved_of(visible).then(|| reserved(draw)).flatten();
                let (offset, bytes) = bin
                    .unwrap_or((visible.draw_offset(piece) + 20 * u64::from(draw), 0..list.size()));
                if !bytes.is_empty() {
                    pass.set_vertex_buffer(0, list.slice(bytes));
                    pass.draw_indexed_indirect(draws, offset);
                }
            }
        }
    }

    /// A buffer with the numbers from 0 on.
    pub(crate) fn numbers(&self) -> &wgpu::Buffer {
        &self.all
    }

    /// Records the clearing of a target.
    pub(crate) fn clear(&self, encoder: &mut wgpu::CommandEncoder, target: &Target) {
        drop(begin(encoder, target, true));
    }

    /// What a target shows after everything that was submitted.
    pub(crate) fn read(&self, target: &Target) -> Picture {
        let [numbers, depth] = [&target.numbers, &target.depth].map(|texture| {
            let ImageSize { width, height } = target.size;
            let row = (4 * width).next_multiple_of(256);
            let buffer = self.engine.device().create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: u64::from(row * height),
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let mut encoder = self.engine.device().create_command_encoder(&Default::default());
            encoder.copy_texture_to_buffer(
                texture.as_image_copy(),
                wgpu::TexelCopyBufferInfo {
                    buffer: &buffer,
                    layout: wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(row),
                        rows_per_image: None,
                    },
                },
                texture.size(),
            );
            self.engine.queue().submit([encoder.finish()]);
            let bytes = self.words(&buffer);
            let rows = bytes.chunks_exact(row as usize / 4);
            rows.flat_map(|row| row[..width as usize].to_vec()).collect()
        });
        Picture { numbers, depth }
    }

    /// The words of a buffer after everything that was submitted.
    pub(crate) fn words(&self, buffer: &wgpu::Buffer) -> Vec<u32> {
        crate::common::words_of(&self.engine, buffer)
    }

    /// How many boxes a cull has listed.
    pub(crate) fn listed(&self, visible: &Visible) -> u32 {
        let draws = self.words(visible.draw_arguments().expect("asked for"));
        draws.chunks_exact(5).map(|draw| draw[1]).sum()
    }
}

/// Whether each draw has a part of the list of its own.
fn reserved_of(visible: &Visible) -> bool {
    let reserved = Placement::Reserved;
    matches!(&visible.outputs().emit, Emit::Binned { placement, .. } if *placement == reserved)
}

fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    target: &Target,
    is_first: bool,
) -> wgpu::RenderPass<'a> {
    let numbers =
        if is_first { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
    let depth = if is_first { wgpu::LoadOp::Clear(0.0) } else { wgpu::LoadOp::Load };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &target.numbers_view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: numbers, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &target.depth_view,
            depth_ops: Some(wgpu::Operations { load: depth, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    })
}
