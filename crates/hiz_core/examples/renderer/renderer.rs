//! A renderer that owns its device, and lets `hiz_core` record into its encoder.
//!
//! A frame is a depth prepass, the pyramid, the cull and a draw.
//! Only the device knows the instance count of the draw.

use std::error::Error;

use hiz_core::headless::INSTALL_HINT;
use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Camera, CullOptions, DepthConvention, DrawOptions, DrawTemplate, Floats, HizContext, ImageSize,
    InstanceOptions, Instances, MeshData, OCCLUDER_DEPTH_FORMAT, OccluderOptions, Occluders, Order,
    Outputs, PyramidOptions, Visible,
};

use crate::scene::{Mesh, Scene, Shot};

const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const ID_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// The limits of a device cut very large crowds into pieces.
/// This small crowd is cut too, to show the loop over the pieces.
const PIECE_CAPACITY: u32 = 2048;

/// How much nearer than its bounds a body may be rasterised.
/// The cull reasons about bounds, but a picture is made of fragments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slack {
    /// In proportion to the depth, for perspective cameras.
    pub(crate) relative: f64,
    /// In NDC depth, for orthographic cameras: there a rasteriser errs by the same amount near and
    /// far.
    pub(crate) absolute: f64,
}

/// The slack that this renderer gives to a cull.
///
/// It is more than the worst error that `tests/renderer.rs` measures.
/// In its long form, only a few of millions of fragments err by more.
/// No slack covers every face that is seen edge-on; `docs/accuracy.md` has the numbers.
pub(crate) fn slack(adapter: &wgpu::AdapterInfo, camera: &Camera) -> Slack {
    // A driver that was never measured gets the larger numbers.
    // The test says whether they suffice.
    let swiftshader = adapter.name.contains("SwiftShader");
    if camera.rows()[3][..3] == [0.0; 3] {
        return Slack { relative: 0.0, absolute: 1e-4 };
    }
    let relative = match (swiftshader, camera.convention()) {
        (true, DepthConvention::Standard) => 2e-5,
        (true, DepthConvention::Reversed) => 2e-3,
        (false, DepthConvention::Standard) => 1e-4,
        (false, DepthConvention::Reversed) => 1e-2,
    };
    Slack { relative, absolute: 0.0 }
}

/// A device, its queue and the pipelines that draw bodies.
pub(crate) struct Renderer {
    pub(crate) adapter: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    hiz: HizContext,
    /// One for standard and one for reversed depth.
    pipelines: [wgpu::RenderPipeline; 2],
}

/// A scene on the device.
pub(crate) struct Stage {
    /// The vertices of the bodies, one body after another, then those of the walls.
    vertices: wgpu::Buffer,
    vertices_per_body: u32,
    /// The indices of one body.
    body_indices: wgpu::Buffer,
    wall_indices: wgpu::Buffer,
    /// The list 0, 1, 2, ..., which draws all bodies.
    everybody: wgpu::Buffer,
    num_crowd: u32,
    crowd: Instances,
    visible: Visible,
    /// Which bodies are inside the frustum, to tell the hidden ones from those outside.
    in_view: Visible,
    /// The walls alone, and the walls with the crowd.
    occluders: [Occluders; 2],
    nothing: Occluders,
}

/// A picture, with row 0 on top.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) size: ImageSize,
    /// RGBA, with 8 bits per channel.
    pub(crate) colour: Vec<u8>,
    /// A body's number + 1 per pixel; the walls have the number after the last body's.
    pub(crate) ids: Vec<u32>,
    pub(crate) depth: Vec<f32>,
}

impl Picture {
    /// How many pixels differ in colour or in the body's number.
    pub(crate) fn differing_pixels(&self, other: &Self) -> usize {
        assert_eq!(self.size, other.size);
        let colours = self.colour.chunks_exact(4).zip(other.colour.chunks_exact(4));
        let ids = self.ids.iter().zip(&other.ids);
        colours.zip(ids).filter(|((c, d), (i, j))| c != d || i != j).count()
    }
}

/// What became of the crowd.
/// It is read for the report, after the picture was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) kept: u32,
    pub(crate) occluded: u32,
    pub(crate) outside: u32,
    /// The sum of the instance counts in the draw arguments.
    pub(crate) drawn: u32,
}

/// A picture with culling, its counts, and the depth that the cull read.
pub(crate) struct Culled {
    pub(crate) picture: Picture,
    pub(crate) counts: Counts,
    pub(crate) prepass: Vec<f32>,
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ViewUniform {
    clip_from_eye: [[f32; 4]; 4],
    eye_hi: [f32; 3],
    vertices_per_body: u32,
    eye_lo: [f32; 3],
    padding: u32,
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct VertexRecord {
    hi: [f32; 3],
    colour: [u8; 4],
    lo: [f32; 3],
    body: u32,
}

/// A position as two float32 whose sum is the position, up to 2^-48 of it.
/// So the shader can subtract the eye before a large number is rounded.
fn halves(p: [f64; 3]) -> [[f32; 3]; 2] {
    let hi = p.map(|v| v as f32);
    [hi, [0, 1, 2].map(|k| (p[k] - f64::from(hi[k])) as f32)]
}

/// The vertices of a mesh.
/// The body's number goes up by one every `vertices_per_body` vertices.
fn records(mesh: &Mesh, first_body: u32, vertices_per_body: u32) -> Vec<VertexRecord> {
    let vertices = mesh.vertices.iter().zip(&mesh.colours).enumerate();
    let record = |(i, (position, colour)): (usize, (&[f64; 3], &[f32; 3]))| {
        let [hi, lo] = halves(*position);
        let [r, g, b] = colour.map(|c| (255.0 * c.clamp(0.0, 1.0)).round() as u8);
        VertexRecord {
            hi,
            colour: [r, g, b, 255],
            lo,
            body: first_body + i as u32 / vertices_per_body,
        }
    };
    vertices.map(record).collect()
}

impl Renderer {
    /// Opens a Vulkan device.
    ///
    /// `$HIZVK_ADAPTER` chooses the adapter by its index or by a part of its description.
    /// Without it the first adapter is taken.
    /// `faults` is for tests.
    pub(crate) fn open(faults: &[(&str, &str)]) -> Result<Self, Box<dyn Error>> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let wanted = std::env::var("HIZVK_ADAPTER").unwrap_or_default().to_lowercase();
        let is_wanted = |i: usize, adapter: &wgpu::Adapter| match wanted.parse::<usize>() {
            Ok(index) => i == index,
            Err(_) => format!("{:?}", adapter.get_info()).to_lowercase().contains(&wanted),
        };
        let adapters = wgpu::Instance::new(descriptor).enumerate_adapters(wgpu::Backends::VULKAN);
        let (_, adapter) = pollster::block_on(adapters)
            .into_iter()
            .enumerate()
            .find(|(i, adapter)| is_wanted(*i, adapter))
            .ok_or_else(|| format!("no adapter. {INSTALL_HINT}"))?;
        let (device, queue) =
            pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
                label: Some("renderer.device"),
                // A real renderer adds its own features and limits.
                required_features: HizContext::required_features(),
                required_limits: HizContext::required_limits(),
                ..Default::default()
            }))?;
        Ok(Self {
            adapter: adapter.get_info(),
            hiz: HizContext::with_planted_faults(&device, faults)?,
            pipelines: [wgpu::CompareFunction::Less, wgpu::CompareFunction::Greater]
                .map(|nearer| pipeline(&device, nearer)),
            device,
            queue,
        })
    }

    /// Uploads a scene once, for all of its pictures.
    pub(crate) fn build(&self, scene: &Scene) -> Result<Stage, Box<dyn Error>> {
        let num_crowd = scene.crowd.len() as u32;
        let one = scene.crowd[0].mesh();
        let vertices_per_body = one.vertices.len() as u32;
        let crowd_mesh = Mesh::of_bodies(&scene.crowd);
        let first_wall = crowd_mesh.vertices.len() as u32;
        let mut vertices = records(&crowd_mesh, 0, vertices_per_body);
        vertices.extend(records(&scene.walls, num_crowd, u32::MAX));
        let wall_indices: Vec<[u32; 3]> =
            scene.walls.triangles.iter().map(|t| t.map(|v| first_wall + v)).collect();
        let numbers: Vec<u32> = (0..num_crowd).collect();

        let options = InstanceOptions {
            strict: true,
            piece_capacity: Some(PIECE_CAPACITY),
            ..InstanceOptions::default()
        };
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("renderer.upload"),
        });
        let crowd = scene
            .with_bounds(|bounds| self.hiz.record_instances(&mut encoder, bounds, &options))?;
        self.queue.submit([encoder.finish()]);
        // The constant part of the draw arguments: the number of indices of one body.
        let index_count = 3 * one.triangles.len() as u32;
        let draw = DrawTemplate { index_count, ..DrawTemplate::default() };
        let listed = Outputs { mask: true, indices: true, draws: true, draw, ..Outputs::NONE };
        let masked = Outputs { mask: true, ..Outputs::NONE };
        let visible = self.hiz.create_visible(&crowd, &listed)?;
        let in_view = self.hiz.create_visible(&crowd, &masked)?;
        let occluders = |meshes: &[&Mesh]| {
            let parts: Vec<MeshData<'_>> = meshes
                .iter()
                .map(|mesh| MeshData {
                    vertices: Floats::F64(mesh.vertices.as_flattened()),
                    triangles: mesh.triangles.as_flattened(),
                    transforms: None,
                })
                .collect();
            self.hiz.create_occluders(&parts, &OccluderOptions::default())
        };
        let indices = |label, triangles: &[[u32; 3]]| {
            buffer(&self.device, label, triangles, wgpu::BufferUsages::INDEX)
        };
        Ok(Stage {
            vertices: buffer(
                &self.device,
                "renderer.vertices",
                &vertices,
                wgpu::BufferUsages::STORAGE,
            ),
            vertices_per_body,
            body_indices: indices("renderer.body_indices", &one.triangles),
            wall_indices: indices("renderer.wall_indices", &wall_indices),
            everybody: buffer(
                &self.device,
                "renderer.everybody",
                &numbers,
                wgpu::BufferUsages::VERTEX,
            ),
            num_crowd,
            crowd,
            visible,
            in_view,
            occluders: [occluders(&[&scene.walls])?, occluders(&[&scene.walls, &crowd_mesh])?],
            nothing: occluders(&[])?,
        })
    }

    /// The options of this renderer's culls: the slack that the driver needs, and a list in
    /// ascending order.
    ///
    /// Where two bodies share a face, the one that is drawn first wins.
    /// With ascending lists that is the same body in both pictures.
    pub(crate) fn cull_options(&self, camera: &Camera) -> CullOptions {
        let Slack { relative, absolute } = slack(&self.adapter, camera);
        CullOptions {
            order: Order::Stable,
            depth_slack: relative,
            depth_slack_abs: absolute,
            ..CullOptions::default()
        }
    }

    /// Draws all bodies.
    pub(crate) fn draw_all(&self, stage: &Stage, shot: &Shot) -> Picture {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("renderer.all"),
        });
        let targets = Targets::new(&self.device, shot.camera.size());
        let mut pass = self.begin_picture(&mut encoder, stage, &shot.camera, &targets);
        pass.draw_indexed(0..index_count(&stage.body_indices), 0, 0..stage.num_crowd);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        self.read_picture(&targets)
    }

    /// Draws the bodies that the cull keeps.
    /// All passes are in one command buffer, and the count never leaves the device.
    pub(crate) fn draw_culled(
        &self,
        stage: &Stage,
        shot: &Shot,
        options: &CullOptions,
    ) -> Result<Culled, Box<dyn Error>> {
        let (camera, size) = (&shot.camera, shot.camera.size());
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("renderer.culled"),
        });

        let prepass = target(&self.device, "renderer.prepass", size, OCCLUDER_DEPTH_FORMAT);
        let depth_view = prepass.create_view(&wgpu::TextureViewDescriptor::default());
        let occluders = &stage.occluders[usize::from(shot.crowd_occludes)];
        let all = DrawOptions::default();
        self.hiz.record_occluders(&mut encoder, occluders, camera, &depth_view, &all)?;

        let pyramid = self.hiz.create_pyramid(size, &PyramidOptions::default())?;
        self.hiz.record_reduce(&mut encoder, &depth_view, camera, &pyramid)?;

        self.hiz.record_cull(
            &mut encoder,
            &stage.crowd,
            camera,
            &pyramid,
            &stage.visible,
            options,
        )?;

        let targets = Targets::new(&self.device, size);
        let mut pass = self.begin_picture(&mut encoder, stage, camera, &targets);
        for piece in 0..stage.visible.num_pieces() {
            let list = stage.visible.list(piece).expect("indices were asked for");
            pass.set_vertex_buffer(0, list.slice(..));
            pass.draw_indexed_indirect(
                stage.visible.draw_arguments().expect("draws are among the outputs"),
                stage.visible.draw_offset(piece),
            );
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
        Ok(Culled {
            picture: self.read_picture(&targets),
            counts: self.counts(stage, camera, options)?,
            prepass: bytemuck::pod_collect_to_vec(&self.read_texture(&prepass)),
        })
    }

    /// Begins the pass that makes a picture.
    /// It has drawn the walls, and bound the indices of a body and the list of all bodies.
    fn begin_picture<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        stage: &Stage,
        camera: &Camera,
        targets: &Targets,
    ) -> wgpu::RenderPass<'e> {
        let [eye_hi, eye_lo] = halves(camera.origin());
        // The rows are about the camera's origin, and the shader subtracts the two halves of it.
        // The remainder of the halves goes into the constants, as in the engine's prepass.
        // It matters where a face is seen edge-on: there the last bit decides what is drawn.
        let left_over =
            [0, 1, 2].map(|k| f64::from(eye_hi[k]) + f64::from(eye_lo[k]) - camera.origin()[k]);
        let about_eye = |[x, y, z, constant]: [f64; 4]| {
            [x, y, z, x * left_over[0] + y * left_over[1] + z * left_over[2] + constant]
                .map(|v| v as f32)
        };
        let view = ViewUniform {
            clip_from_eye: camera.rows().map(about_eye),
            eye_hi,
            vertices_per_body: stage.vertices_per_body,
            eye_lo,
            padding: 0,
        };
        let view = buffer(&self.device, "renderer.view", &[view], wgpu::BufferUsages::UNIFORM);
        let pipeline =
            &self.pipelines[usize::from(camera.convention() == DepthConvention::Reversed)];
        let bind_group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("renderer.view"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: stage.vertices.as_entire_binding() },
            ],
        });
        let views = [&targets.colour, &targets.ids, &targets.depth]
            .map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));
        let cleared = |view, colour| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(colour),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        let sky = wgpu::Color { r: 0.62, g: 0.74, b: 0.86, a: 1.0 };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("renderer.picture"),
            color_attachments: &[
                cleared(&views[0], sky),
                cleared(&views[1], wgpu::Color::TRANSPARENT),
            ],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &views[2],
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(camera.convention().far()),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.set_vertex_buffer(0, stage.everybody.slice(..));
        pass.set_index_buffer(stage.wall_indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..index_count(&stage.wall_indices), 0, 0..1);
        pass.set_index_buffer(stage.body_indices.slice(..), wgpu::IndexFormat::Uint32);
        pass
    }

    fn read_picture(&self, targets: &Targets) -> Picture {
        let size = ImageSize::new(targets.colour.width(), targets.colour.height());
        Picture {
            size,
            colour: self.read_texture(&targets.colour),
            ids: bytemuck::pod_collect_to_vec(&self.read_texture(&targets.ids)),
            depth: bytemuck::pod_collect_to_vec(&self.read_texture(&targets.depth)),
        }
    }

    /// How many bodies are kept, and how many of the others are inside the frustum.
    /// A cull by an empty depth image keeps all that are inside.
    fn counts(
        &self,
        stage: &Stage,
        camera: &Camera,
        options: &CullOptions,
    ) -> Result<Counts, Box<dyn Error>> {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("renderer.in_view"),
        });
        let depth = target(&self.device, "renderer.nothing", camera.size(), OCCLUDER_DEPTH_FORMAT);
        let depth = depth.create_view(&wgpu::TextureViewDescriptor::default());
        let pyramid = self.hiz.create_pyramid(camera.size(), &PyramidOptions::default())?;
        let all = DrawOptions::default();
        self.hiz.record_occluders(&mut encoder, &stage.nothing, camera, &depth, &all)?;
        self.hiz.record_reduce(&mut encoder, &depth, camera, &pyramid)?;
        self.hiz.record_cull(
            &mut encoder,
            &stage.crowd,
            camera,
            &pyramid,
            &stage.in_view,
            options,
        )?;
        self.queue.submit([encoder.finish()]);

        let (kept, in_view) = (self.count_kept(&stage.visible), self.count_kept(&stage.in_view));
        let draws =
            self.read_buffer(stage.visible.draw_arguments().expect("draws are among the outputs"));
        let draws: Vec<hiz_core::DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&draws);
        Ok(Counts {
            kept,
            occluded: in_view - kept,
            outside: stage.num_crowd - in_view,
            drawn: draws.iter().map(|d| d.instance_count).sum(),
        })
    }

    fn count_kept(&self, visible: &Visible) -> u32 {
        let words = |piece: usize| -> Vec<u32> {
            let mask = self.read_buffer(visible.mask(piece).expect("a mask was asked for"));
            bytemuck::pod_collect_to_vec(&mask)
        };
        (0..visible.num_pieces()).flat_map(words).map(u32::count_ones).sum()
    }

    /// The bytes of a texture with 4 bytes per texel.
    fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u8> {
        let row = 4 * texture.width();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes =
            self.read(u64::from(padded) * u64::from(texture.height()), |encoder, staging| {
                let layout = wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(padded),
                    rows_per_image: None,
                };
                let target = wgpu::TexelCopyBufferInfo { buffer: staging, layout };
                encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
            });
        bytes
            .chunks_exact(padded as usize)
            .flat_map(|line| &line[..row as usize])
            .copied()
            .collect()
    }

    fn read_buffer(&self, source: &wgpu::Buffer) -> Vec<u8> {
        self.read(source.size(), |encoder, staging| {
            encoder.copy_buffer_to_buffer(source, 0, staging, 0, source.size());
        })
    }

    /// Copies into a staging buffer, waits, and maps the buffer.
    fn read(
        &self,
        size: u64,
        copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer),
    ) -> Vec<u8> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("renderer.staging"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("renderer.read"),
        });
        copy(&mut encoder, &staging);
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |mapped| {
            mapped.expect("a staging buffer can be mapped");
        });
        self.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        let view = staging.get_mapped_range(..).expect("it is mapped");
        view.to_vec()
    }
}

/// The textures that a picture is drawn into.
/// The depth is the picture's own, and not the prepass.
struct Targets {
    colour: wgpu::Texture,
    ids: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Targets {
    fn new(device: &wgpu::Device, size: ImageSize) -> Self {
        Self {
            colour: target(device, "renderer.colour", size, COLOUR_FORMAT),
            ids: target(device, "renderer.ids", size, ID_FORMAT),
            depth: target(device, "renderer.depth", size, OCCLUDER_DEPTH_FORMAT),
        }
    }
}

fn index_count(indices: &wgpu::Buffer) -> u32 {
    (indices.size() / 4) as u32
}

fn target(
    device: &wgpu::Device,
    label: &str,
    size: ImageSize,
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn buffer<T: bytemuck::NoUninit>(
    device: &wgpu::Device,
    label: &str,
    contents: &[T],
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let contents = bytemuck::cast_slice(contents);
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents,
        usage,
    })
}

fn pipeline(device: &wgpu::Device, nearer: wgpu::CompareFunction) -> wgpu::RenderPipeline {
    let label = Some("renderer.pipeline");
    let module = device.create_shader_module(wgpu::include_wgsl!("bodies.wgsl"));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("body_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            // One number of a body per instance, from the packed list.
            buffers: &[Some(wgpu::VertexBufferLayout {
                array_stride: 4,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &wgpu::vertex_attr_array![0 => Uint32],
            })],
        },
        // Two-sided, like the occluders.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: OCCLUDER_DEPTH_FORMAT,
            depth_write_enabled: Some(true),
            depth_compare: Some(nearer),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("body_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOUR_FORMAT.into()), Some(ID_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
