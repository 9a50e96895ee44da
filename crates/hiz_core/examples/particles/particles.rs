//! Particles against a scene's depth, with and without the ends of one coarse level.

use std::error::Error;
use std::time::Instant;

use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Camera, DepthConvention, Depths, DrawOptions, Floats, HizContext, ImageSize, MeshData,
    OCCLUDER_DEPTH_FORMAT, OccluderOptions, Pose, Projection, Pyramid, PyramidOptions,
    StoredLevels,
};

const SHADER: &str = include_str!("particles.wgsl");

/// Invocations of a workgroup; twin: `particles.wgsl`.
const WORKGROUP: u32 = 64;

/// Twin: `View` in `particles.wgsl`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct View {
    rows: [[f32; 4]; 4],
    size: [u32; 2],
    particles: u32,
    level: u32,
    farthest: u32,
    nearest: u32,
    stride: u32,
    step: u32,
}

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Setup {
    pub(crate) size: ImageSize,
    pub(crate) particles: u32,
    /// The coarse level: its texels have `2^level` by `2^level` pixels.
    pub(crate) level: u32,
    /// Whether 2x2 pixels decide in shares, instead of one.
    pub(crate) soft: bool,
    /// Timed drawings of each kind.
    pub(crate) rounds: u32,
}

/// What came of it.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// Sums of brightness per pixel: by the depth image alone, and with the coarse level.
    pub(crate) pictures: [Vec<u32>; 2],
    /// Particles in the image; before all of their texel, and behind all of it.
    pub(crate) counts: [u32; 3],
    /// The least milliseconds of a drawing, in the same order.
    pub(crate) ms: [f64; 2],
}

impl Outcome {
    /// The share of the particles in the image that read no pixel of the depth image.
    pub(crate) fn skipped(&self) -> f64 {
        let [all, before, behind] = self.counts.map(f64::from);
        (before + behind) / all.max(1.0)
    }
}

/// A device with the scene's depth and its pyramid.
struct Scene<'a> {
    device: &'a wgpu::Device,
    queue: &'a wgpu::Queue,
    camera: Camera,
    depth: wgpu::TextureView,
    pyramid: Pyramid,
}

/// Draws the particles in both ways; `faults` replaces texts in the shader.
pub(crate) fn run(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    setup: Setup,
    faults: &[(&str, &str)],
) -> Result<Outcome, Box<dyn Error>> {
    let scene = Scene::new(device, queue, setup)?;
    let texels = |found: Option<_>| found.ok_or("the level lies in several buffers");
    let farthest = texels(scene.pyramid.level_texels(setup.level))?;
    let nearest = texels(scene.pyramid.nearest_texels(setup.level))?;
    let clip_from_world = scene.camera.clip_from_world();
    let view = View {
        rows: clip_from_world.map(|row| row.map(|v| v as f32)),
        size: [setup.size.width, setup.size.height],
        particles: setup.particles,
        level: setup.level,
        farthest: farthest.first,
        nearest: nearest.first,
        stride: farthest.stride,
        step: farthest.step,
    };
    let view = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("particles.view"),
        contents: bytemuck::bytes_of(&view),
        usage: wgpu::BufferUsages::UNIFORM,
    });
    let pixels = u64::from(setup.size.width) * u64::from(setup.size.height);
    let [picture, counts] = [pixels, 3].map(|words| scene.words(words));
    let mut source = SHADER.to_owned();
    for (what, by) in faults {
        assert!(source.contains(what), "no text {what:?}");
        source = source.replace(what, by);
    }
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("particles"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let draw = |coarse: bool, counted: bool| {
        let flags = [("COARSE", coarse), ("COUNTED", counted), ("SOFT", setup.soft)];
        let pipeline = scene.pipeline(&module, flags);
        let entries = [
            view.as_entire_binding(),
            wgpu::BindingResource::TextureView(&scene.depth),
            farthest.buffer.as_entire_binding(),
            nearest.buffer.as_entire_binding(),
            picture.as_entire_binding(),
            counts.as_entire_binding(),
        ];
        let bindings = scene.bind(&pipeline, &entries);
        let picture = picture.clone();
        move || {
            let mut encoder = device.create_command_encoder(&Default::default());
            encoder.clear_buffer(&picture, 0, None);
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            pass.dispatch_workgroups(setup.particles.div_ceil(WORKGROUP), 1, 1);
            drop(pass);
            let start = Instant::now();
            queue.submit([encoder.finish()]);
            device.poll(wgpu::PollType::wait_indefinitely())?;
            Ok::<f64, wgpu::PollError>(1e3 * start.elapsed().as_secs_f64())
        }
    };
    draw(true, true)()?;
    let found = scene.read(&counts)?;
    let ways = [false, true].map(|coarse| draw(coarse, false));
    let mut pictures = [Vec::new(), Vec::new()];
    for (way, pixels) in ways.iter().zip(&mut pictures) {
        way()?;
        *pixels = scene.read(&picture)?;
    }
    // In turns, so that both meet the same disturbances.
    let mut ms = [f64::INFINITY; 2];
    for _ in 0..setup.rounds {
        for (way, least) in ways.iter().zip(&mut ms) {
            *least = least.min(way()?);
        }
    }
    Ok(Outcome { pictures, counts: [found[0], found[1], found[2]], ms })
}

/// Pillars and walls of a hall, as boxes: least and greatest corners.
fn boxes() -> Vec<[[f32; 3]; 2]> {
    let mut boxes = vec![[[-21.0, -4.2, -21.0], [21.0, -4.0, 21.0]]];
    for x in -3..=3 {
        for z in -3..=3 {
            let [x, z] = [x, z].map(|v| 5.5 * v as f32);
            boxes.push([[x - 0.7, -4.0, z - 0.7], [x + 0.7, 4.0, z + 0.7]]);
        }
    }
    boxes.push([[-21.0, -4.0, -21.0], [21.0, 4.0, -20.0]]);
    boxes
}

impl<'a> Scene<'a> {
    /// Draws the hall's depth, and reduces it to one level with both ends.
    fn new(
        device: &'a wgpu::Device,
        queue: &'a wgpu::Queue,
        setup: Setup,
    ) -> Result<Self, Box<dyn Error>> {
        let pose = Pose { eye: [2.7, 0.5, 19.0], target: [0.0, -0.5, -8.0], up: [0.0, 1.0, 0.0] };
        let convention = DepthConvention::Reversed;
        let projection = Projection::Perspective { fov_y: 1.1, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, setup.size)?;
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for corners in boxes() {
            let first = vertices.len() as u32 / 3;
            for corner in 0..8 {
                vertices.extend([0, 1, 2].map(|k| corners[corner >> k & 1][k]));
            }
            for [a, b, c, d] in
                [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
            {
                triangles.extend([a, b, c, a, c, d].map(|corner| first + corner));
            }
        }
        let vertices = Floats::F32(&vertices);
        let mesh = MeshData { vertices, triangles: &triangles, transforms: None };
        let hiz = HizContext::new(device)?;
        let hall = hiz.create_occluders(&[mesh], &OccluderOptions::default())?;
        let depth = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("particles.depth"),
            size: wgpu::Extent3d {
                width: setup.size.width,
                height: setup.size.height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: OCCLUDER_DEPTH_FORMAT,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let depth = depth.create_view(&Default::default());
        let options = PyramidOptions {
            levels: StoredLevels::only(setup.level),
            depths: Depths::Both,
            ..PyramidOptions::default()
        };
        let pyramid = hiz.create_pyramid(setup.size, &options)?;
        let mut encoder = device.create_command_encoder(&Default::default());
        hiz.record_occluders(&mut encoder, &hall, &camera, &depth, &DrawOptions::default())?;
        hiz.record_reduce(&mut encoder, &depth, &camera, &pyramid)?;
        queue.submit([encoder.finish()]);
        Ok(Self { device, queue, camera, depth, pyramid })
    }

    fn words(&self, words: u64) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("particles.words"),
            size: 4 * words,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    }

    fn layout(&self) -> wgpu::BindGroupLayout {
        use wgpu::{BindingType, BufferBindingType, TextureSampleType, TextureViewDimension};
        let buffer =
            |ty| BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let read = buffer(BufferBindingType::Storage { read_only: true });
        let write = buffer(BufferBindingType::Storage { read_only: false });
        let depth = BindingType::Texture {
            sample_type: TextureSampleType::Depth,
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        let entries: Vec<_> = (0..)
            .zip([buffer(BufferBindingType::Uniform), depth, read, read, write, write])
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty,
                count: None,
            })
            .collect();
        self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("particles.layout"),
            entries: &entries,
        })
    }

    fn pipeline(
        &self,
        module: &wgpu::ShaderModule,
        flags: [(&str, bool); 3],
    ) -> wgpu::ComputePipeline {
        let constants = flags.map(|(name, flag)| (name, f64::from(u8::from(flag))));
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("particles.draw"),
            bind_group_layouts: &[Some(&self.layout())],
            ..Default::default()
        });
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("particles.draw"),
            layout: Some(&layout),
            module,
            entry_point: Some("draw"),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            cache: None,
        })
    }

    fn bind(
        &self,
        pipeline: &wgpu::ComputePipeline,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("particles.draw"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        })
    }

    fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u32>, Box<dyn Error>> {
        let (told, answer) = std::sync::mpsc::channel();
        let all = buffer.slice(..);
        wgpu::util::DownloadBuffer::read_buffer(self.device, self.queue, &all, move |bytes| {
            drop(told.send(bytes.map(|bytes| bytemuck::pod_collect_to_vec::<u8, u32>(&bytes))));
        });
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(answer.recv()??)
    }
}
