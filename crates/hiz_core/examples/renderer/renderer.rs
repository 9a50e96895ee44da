//! A renderer that owns its device and lets `hiz_core` record into its encoder: depth prepass, pyramid, cull, then a draw
//! whose instance count only the device knows.

use std::error::Error;

use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, DrawTemplate, Floats, HizContext, ImageSize, InstanceOptions,
    Instances, MeshData, OCCLUDER_DEPTH_FORMAT, OccluderOptions, Occluders, Order, PyramidOptions, Visible,
    VisibleOptions,
};

use crate::scene::{BLOCK_INDICES, Block, Scene, Shot, mesh};

const COLOUR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const ID_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

/// Crowds are small here; real ones may be cut into pieces by the device's limits. So is this one, to show the loop.
const PIECE_CAPACITY: u32 = 2048;

/// How much nearer than its bounds a box may be rasterised, relative to its depth: the cull reasons about boxes, a picture
/// is made of fragments. At least twice the worst that was measured.
///
/// Measured: the fragments of each box against its nearest corner in float64, as `tests/renderer.rs` does it, in this
/// town with random perspective cameras along the world's axes, 3000 on lavapipe (Mesa 22.3) and 1000 on `SwiftShader`:
///
/// | worst | standard | reversed |
/// |---|---|---|
/// | lavapipe | 2.5e-5 | 4.3e-3 |
/// | `SwiftShader` | 4.5e-7 | 1.6e-5 |
///
/// lavapipe's fragments fall up to 0.002 pixels outside their triangle and take its plane's depth there, beyond every
/// vertex; on a face seen edge-on that plane is steep. Reversed depth is inverse to the distance, so it shows all of it:
/// with a slack of 2e-3 one of the 3000 pictures was wrong, by one pixel. Nothing bounds how edge-on a face can be: these
/// numbers are the ends of tails, no proof. `SwiftShader` snaps vertices to sixteenths of a pixel, which moves the depth of
/// a fragment by far more, but between its vertices: hardly ever out of the bounds.
///
/// The walls are the same triangles in the prepass and in the picture. A renderer whose prepass has others, or transforms
/// them otherwise, has to measure and add that difference. No guard: area coverage leaves at least half a pixel around
/// each sample, and no driver strays that far.
pub(crate) fn depth_slack(adapter: &wgpu::AdapterInfo, convention: DepthConvention) -> f64 {
    // A driver that nobody has measured gets the larger numbers; the test says whether they suffice.
    match (adapter.name.contains("SwiftShader"), convention) {
        (true, DepthConvention::Standard) => 1e-6,
        (true, DepthConvention::Reversed) => 4e-5,
        (false, DepthConvention::Standard) => 1e-4,
        (false, DepthConvention::Reversed) => 1e-2,
    }
}

/// A device, a queue, and what draws boxes.
pub(crate) struct Renderer {
    pub(crate) adapter: wgpu::AdapterInfo,
    device: wgpu::Device,
    queue: wgpu::Queue,
    hiz: HizContext,
    /// For standard and reversed depth.
    pipelines: [wgpu::RenderPipeline; 2],
    block_indices: wgpu::Buffer,
}

/// A scene on the device.
pub(crate) struct Town {
    blocks: wgpu::Buffer,
    /// 0, 1, 2, ...: the list that draws every box.
    everything: wgpu::Buffer,
    num_crowd: u32,
    num_blocks: u32,
    crowd: Instances,
    visible: Visible,
    /// The walls alone, and with the crowd.
    occluders: [Occluders; 2],
}

/// What was drawn, row 0 on top.
#[derive(Debug)]
pub(crate) struct Picture {
    pub(crate) size: ImageSize,
    /// RGBA, 8 bits each.
    pub(crate) colour: Vec<u8>,
    /// Box numbers + 1.
    pub(crate) ids: Vec<u32>,
    pub(crate) depth: Vec<f32>,
}

impl Picture {
    /// How many pixels differ in colour or number.
    pub(crate) fn differing_pixels(&self, other: &Self) -> usize {
        assert_eq!(self.size, other.size);
        let colours = self.colour.chunks_exact(4).zip(other.colour.chunks_exact(4));
        let ids = self.ids.iter().zip(&other.ids);
        colours.zip(ids).filter(|((c, d), (i, j))| c != d || i != j).count()
    }
}

/// What became of the crowd; read for the report, long after it was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) kept: u32,
    pub(crate) occluded: u32,
    pub(crate) outside: u32,
    /// What the draw arguments held.
    pub(crate) drawn: u32,
}

/// A culled picture, how it came about, and the depth that it was culled against.
pub(crate) struct Culled {
    pub(crate) picture: Picture,
    pub(crate) counts: Counts,
    pub(crate) prepass: Vec<f32>,
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct ViewUniform {
    clip_from_eye: [[f32; 4]; 4],
    eye_hi: [f32; 4],
    eye_lo: [f32; 4],
}

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct BlockRecord {
    min_hi: [f32; 4],
    min_lo: [f32; 4],
    max_hi: [f32; 4],
    max_lo: [f32; 4],
    colour: [f32; 4],
}

/// A position as two float32 that add up to it (to 2^-48): the shader subtracts the eye before anything large is rounded.
fn halves(p: [f64; 3]) -> [[f32; 4]; 2] {
    let hi = p.map(|v| v as f32);
    let lo = [0, 1, 2].map(|k| (p[k] - f64::from(hi[k])) as f32);
    [hi, lo].map(|v| [v[0], v[1], v[2], 0.0])
}

impl BlockRecord {
    fn new(block: &Block) -> Self {
        let ([min_hi, min_lo], [max_hi, max_lo]) = (halves(block.min), halves(block.max));
        let [r, g, b] = block.colour;
        Self { min_hi, min_lo, max_hi, max_lo, colour: [r, g, b, 1.0] }
    }
}

impl Renderer {
    /// Opens a Vulkan device: the adapter whose index `$HIZVK_ADAPTER` is, or whose description contains it, or the first.
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
            .ok_or("no Vulkan adapter (a software driver: apt install libvulkan1 mesa-vulkan-drivers)")?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("renderer.device"),
            // A renderer adds what it needs itself.
            required_features: HizContext::required_features(),
            required_limits: HizContext::required_limits(),
            ..Default::default()
        }))?;
        Ok(Self {
            adapter: adapter.get_info(),
            hiz: HizContext::with_planted_faults(&device, faults)?,
            pipelines: [wgpu::CompareFunction::Less, wgpu::CompareFunction::Greater]
                .map(|nearer| pipeline(&device, nearer)),
            block_indices: buffer(&device, "renderer.block_indices", &BLOCK_INDICES, wgpu::BufferUsages::INDEX),
            device,
            queue,
        })
    }

    /// Uploads a scene, once for all its pictures.
    pub(crate) fn build(&self, scene: &Scene) -> Result<Town, Box<dyn Error>> {
        let records: Vec<_> = scene.blocks.iter().map(BlockRecord::new).collect();
        let numbers: Vec<u32> = (0..scene.blocks.len() as u32).collect();
        let (min, max): (Vec<_>, Vec<_>) = scene.crowd().iter().map(|b| (b.min, b.max)).unzip();
        let crowd = self.hiz.create_instances(
            &Bounds::Boxes { min: Floats::F64(min.as_flattened()), max: Floats::F64(max.as_flattened()) },
            &InstanceOptions { strict: true, piece_capacity: Some(PIECE_CAPACITY) },
        )?;
        // What the draw arguments say beside the count: one box has 36 indices.
        let draw = DrawTemplate { index_count: BLOCK_INDICES.len() as u32, ..DrawTemplate::default() };
        let visible = self.hiz.create_visible(&crowd, &VisibleOptions { capacity: None, draw })?;
        let occluders = |blocks: &[Block]| {
            let (vertices, triangles) = mesh(blocks);
            let mesh = MeshData { vertices: Floats::F64(&vertices), triangles: &triangles, transforms: None };
            self.hiz.create_occluders(&[mesh], &OccluderOptions::default())
        };
        Ok(Town {
            blocks: buffer(&self.device, "renderer.blocks", &records, wgpu::BufferUsages::STORAGE),
            everything: buffer(&self.device, "renderer.everything", &numbers, wgpu::BufferUsages::VERTEX),
            num_crowd: scene.crowd,
            num_blocks: scene.blocks.len() as u32,
            crowd,
            visible,
            occluders: [occluders(scene.walls())?, occluders(&scene.blocks)?],
        })
    }

    /// Draws everything.
    pub(crate) fn draw_all(&self, town: &Town, shot: &Shot) -> Picture {
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("renderer.all") });
        let targets = Targets::new(&self.device, shot.camera.size());
        let mut pass = self.begin_picture(&mut encoder, town, &shot.camera, &targets);
        pass.draw_indexed(0..36, 0, 0..town.num_crowd);
        drop(pass);
        self.queue.submit([encoder.finish()]);
        self.read_picture(&targets)
    }

    /// Draws what the cull keeps. From the first pass to the last it is one command buffer: the count never leaves the device.
    pub(crate) fn draw_culled(&self, town: &Town, shot: &Shot) -> Result<Culled, Box<dyn Error>> {
        let (camera, size) = (&shot.camera, shot.camera.size());
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("renderer.culled") });

        let prepass = target(&self.device, "renderer.prepass", size, OCCLUDER_DEPTH_FORMAT);
        let depth_view = prepass.create_view(&wgpu::TextureViewDescriptor::default());
        let occluders = &town.occluders[usize::from(shot.crowd_occludes)];
        self.hiz.record_occluders(&mut encoder, occluders, camera, &depth_view)?;

        let pyramid = self.hiz.create_pyramid(size, &PyramidOptions::default())?;
        self.hiz.record_reduce(&mut encoder, &depth_view, camera, &pyramid)?;

        let depth_slack = depth_slack(&self.adapter, camera.convention());
        // Ascending numbers: where two boxes share a face, the first drawn wins, in both pictures the same.
        let options = CullOptions { order: Order::Stable, depth_slack, ..CullOptions::default() };
        self.hiz.record_cull(&mut encoder, &town.crowd, camera, &pyramid, &town.visible, &options)?;

        let targets = Targets::new(&self.device, size);
        let mut pass = self.begin_picture(&mut encoder, town, camera, &targets);
        for piece in 0..town.visible.num_pieces() {
            pass.set_vertex_buffer(0, town.visible.list(piece).slice(..));
            pass.draw_indexed_indirect(town.visible.draw_arguments(), town.visible.draw_offset(piece));
        }
        drop(pass);
        self.queue.submit([encoder.finish()]);
        Ok(Culled {
            picture: self.read_picture(&targets),
            counts: self.read_counts(town),
            prepass: bytemuck::pod_collect_to_vec(&self.read_texture(&prepass)),
        })
    }

    /// Begins the pass that makes a picture: walls are drawn, the list of all boxes is bound.
    fn begin_picture<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        town: &Town,
        camera: &Camera,
        targets: &Targets,
    ) -> wgpu::RenderPass<'e> {
        let [eye_hi, eye_lo] = halves(camera.origin());
        let view = ViewUniform { clip_from_eye: camera.rows().map(|row| row.map(|v| v as f32)), eye_hi, eye_lo };
        let view = buffer(&self.device, "renderer.view", &[view], wgpu::BufferUsages::UNIFORM);
        let pipeline = &self.pipelines[usize::from(camera.convention() == DepthConvention::Reversed)];
        let bind_group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("renderer.view"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: view.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: town.blocks.as_entire_binding() },
            ],
        });
        let views = [&targets.colour, &targets.ids, &targets.depth]
            .map(|t| t.create_view(&wgpu::TextureViewDescriptor::default()));
        let cleared = |view, colour| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(colour), store: wgpu::StoreOp::Store },
            })
        };
        let sky = wgpu::Color { r: 0.62, g: 0.74, b: 0.86, a: 1.0 };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("renderer.picture"),
            color_attachments: &[cleared(&views[0], sky), cleared(&views[1], wgpu::Color::TRANSPARENT)],
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
        pass.set_index_buffer(self.block_indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.set_vertex_buffer(0, town.everything.slice(..));
        pass.draw_indexed(0..36, 0, town.num_crowd..town.num_blocks);
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

    fn read_counts(&self, town: &Town) -> Counts {
        let mut counts = Counts { kept: 0, occluded: 0, outside: 0, drawn: 0 };
        for piece in 0..town.visible.num_pieces() {
            // A plane of kept bits, then one that tells occluded from outside.
            let planes: Vec<u32> = bytemuck::pod_collect_to_vec(&self.read_buffer(town.visible.planes(piece)));
            let (kept, low) = planes.split_at(planes.len() / 2);
            counts.kept += kept.iter().map(|w| w.count_ones()).sum::<u32>();
            counts.occluded += kept.iter().zip(low).map(|(k, l)| (!k & l).count_ones()).sum::<u32>();
        }
        counts.outside = town.num_crowd - counts.kept - counts.occluded;
        let draws = self.read_buffer(town.visible.draw_arguments());
        let draws: Vec<hiz_core::DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&draws);
        counts.drawn = draws.iter().map(|d| d.instance_count).sum();
        counts
    }

    /// The bytes of a texture of 4 bytes a texel.
    fn read_texture(&self, texture: &wgpu::Texture) -> Vec<u8> {
        let row = 4 * texture.width();
        let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let bytes = self.read(u64::from(padded) * u64::from(texture.height()), |encoder, staging| {
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None };
            let target = wgpu::TexelCopyBufferInfo { buffer: staging, layout };
            encoder.copy_texture_to_buffer(texture.as_image_copy(), target, texture.size());
        });
        bytes.chunks_exact(padded as usize).flat_map(|line| &line[..row as usize]).copied().collect()
    }

    fn read_buffer(&self, source: &wgpu::Buffer) -> Vec<u8> {
        self.read(source.size(), |encoder, staging| encoder.copy_buffer_to_buffer(source, 0, staging, 0, source.size()))
    }

    /// Copies into a staging buffer, waits and maps it.
    fn read(&self, size: u64, copy: impl FnOnce(&mut wgpu::CommandEncoder, &wgpu::Buffer)) -> Vec<u8> {
        let staging = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("renderer.staging"),
            size,
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder =
            self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("renderer.read") });
        copy(&mut encoder, &staging);
        self.queue.submit([encoder.finish()]);
        staging.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("a staging buffer can be mapped"));
        self.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        let view = staging.get_mapped_range(..).expect("it is mapped");
        view.to_vec()
    }
}

/// What a picture is drawn into. The depth is the picture's own, not the prepass.
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

fn target(device: &wgpu::Device, label: &str, size: ImageSize, format: wgpu::TextureFormat) -> wgpu::Texture {
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
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage })
}

fn pipeline(device: &wgpu::Device, nearer: wgpu::CompareFunction) -> wgpu::RenderPipeline {
    let label = Some("renderer.pipeline");
    let module = device.create_shader_module(wgpu::include_wgsl!("boxes.wgsl"));
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label,
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("block_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            // One box number an instance, out of the packed list.
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
            entry_point: Some("block_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOUR_FORMAT.into()), Some(ID_FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
