//! A renderer's own culling shader, which reads a mip texture, beside the certified cull.
//!
//! ```text
//! cargo run --release --example own_culling -- 20000
//! ```
//!
//! The shader tests spheres as many renderers do: a rectangle of pixels (Mara and `McGuire`, "2D
//! Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere", JCGT 2013), a level from its
//! size, one gather of 2x2 texels.
//! Nothing covers its roundings, so it may hide what shows.
//! The exact oracle counts how often it does, near the world's origin and far away from it.
//! `tests/examples.rs` runs this file.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use hiz_core::headless::Engine;
use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, Floats, Hierarchy, ImageSize, InstanceOptions,
    MIP_CULL, MIP_LOOKUP, MeshData, MipLayout, MipLookup, MipOptions, OccluderOptions, Outputs,
    Pose, Projection, Vec3,
};
use hiz_ref::{Verdict, View, Volume};

const SHADER: &str = "
struct OwnView {
    // Rows that give right, up and forward of the eye.
    right: vec4<f32>,
    up: vec4<f32>,
    forward: vec4<f32>,
    // Pixels per unit of x and y at distance 1, the near plane, and the number of spheres.
    scale: vec2<f32>,
    near: f32,
    count: u32,
    size: vec2<u32>,
    padding: vec2<u32>,
}

@group(0) @binding(0) var mips: texture_2d<f32>;
@group(0) @binding(1) var nearest_texel: sampler;
@group(0) @binding(2) var<uniform> view: OwnView;
@group(0) @binding(3) var<storage, read> spheres: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> kept: array<u32>;

// The least and the greatest slope at which a sphere is seen, along one axis.
fn slopes(across: f32, along: f32, radius: f32) -> vec2<f32> {
    let reach = sqrt(across * across + along * along - radius * radius);
    return vec2<f32>(
        (reach * across - along * radius) / (reach * along + across * radius),
        (reach * across + along * radius) / (reach * along - across * radius));
}

fn is_kept(sphere: vec4<f32>) -> bool {
    let p = vec4<f32>(sphere.xyz, 1.0);
    let radius = sphere.w;
    let c = vec3<f32>(dot(view.right, p), dot(view.up, p), dot(view.forward, p));
    if c.z + radius < view.near {
        return false;
    }
    if c.z - radius <= view.near {
        return true;
    }
    let middle = vec2<f32>(view.size) / 2.0;
    let x = middle.x + view.scale.x * slopes(c.x, c.z, radius);
    let y = middle.y - view.scale.y * slopes(c.y, c.z, radius).yx;
    if x.y < 0.0 || y.y < 0.0 || x.x >= f32(view.size.x) || y.x >= f32(view.size.y) {
        return false;
    }
    let edge = vec2<f32>(view.size - vec2<u32>(1u));
    let first = vec2<u32>(clamp(floor(vec2<f32>(x.x, y.x)), vec2<f32>(0.0), edge));
    let last = vec2<u32>(clamp(floor(vec2<f32>(x.y, y.y)), vec2<f32>(0.0), edge));
    let depth = view.near / (c.z - radius);
    return !mip_hides(mips, nearest_texel, first, last, view.size, depth, true);
}

@compute @workgroup_size(64)
fn cull(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x < view.count {
        kept[id.x] = u32(is_kept(spheres[id.x]));
    }
}
";

const NEAR: f64 = 0.1;
const SIZE: ImageSize = ImageSize { width: 961, height: 541 };

/// Twin of `OwnView` in the shader.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct OwnView {
    rows: [[f32; 4]; 3],
    scale: [f32; 2],
    near: f32,
    count: u32,
    size: [u32; 2],
    padding: [u32; 2],
}

/// Spheres among pillars, seen from an eye.
struct Scene {
    eye: Vec3,
    centers: Vec<f64>,
    radii: Vec<f64>,
    pillars: Vec<f64>,
    triangles: Vec<u32>,
}

/// What a way of culling keeps, hides wrongly and takes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub(crate) way: &'static str,
    /// As a share of the certified cull's time.
    pub(crate) cost: f64,
    pub(crate) kept: usize,
    /// What the oracle finds visible among what is not kept.
    pub(crate) false_culls: usize,
}

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn range(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
    [1.0, 1.0, 1.0],
];
const FACES: [[u32; 4]; 6] =
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

/// A scene of `count` spheres around a place of the world.
fn scene(place: Vec3, count: usize) -> Scene {
    let mut random = Random(0x9E37_79B9);
    let (mut pillars, mut triangles) = (Vec::new(), Vec::new());
    for _ in 0..60 {
        let at = [random.range(-40.0, 40.0), random.range(-6.0, 6.0), random.range(-90.0, -15.0)];
        let half = [random.range(1.0, 4.0), random.range(2.0, 8.0), random.range(1.0, 3.0)];
        let first = pillars.len() as u32 / 3;
        for corner in CORNERS {
            pillars.extend((0..3).map(|k| place[k] + at[k] + half[k] * corner[k]));
        }
        for [a, b, c, d] in FACES {
            triangles.extend([a, b, c, a, c, d].map(|i| first + i));
        }
    }
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let at = [random.range(-70.0, 70.0), random.range(-30.0, 30.0), random.range(-120.0, 5.0)];
        centers.extend((0..3).map(|k| place[k] + at[k]));
        radii.push(random.range(0.02, 0.5));
    }
    Scene { eye: place, centers, radii, pillars, triangles }
}

/// The milliseconds from the submit of what `record` records to its end.
fn submitted_ms(
    engine: &Engine,
    record: &mut dyn FnMut(&mut wgpu::CommandEncoder) -> hiz_core::Result<()>,
) -> Result<f64, Box<dyn Error>> {
    let mut encoder = engine.device().create_command_encoder(&Default::default());
    record(&mut encoder)?;
    let commands = encoder.finish();
    let start = Instant::now();
    engine.queue().submit([commands]);
    engine.wait()?;
    Ok(start.elapsed().as_secs_f64() * 1e3)
}

/// Culls `count` spheres around a place of the world in each way.
pub(crate) fn compare(
    engine: &Engine,
    place: Vec3,
    count: usize,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let (device, hiz) = (engine.device(), engine.context());
    let scene = scene(place, count);
    let way = [0.3, -0.05, -1.0];
    let pose = Pose {
        eye: scene.eye,
        target: std::array::from_fn(|k| scene.eye[k] + way[k]),
        up: [0.0, 1.0, 0.0],
    };
    let (fov_y, convention) = (1.0_f64, DepthConvention::Reversed);
    let projection = Projection::Perspective { fov_y, near: NEAR, far: None, convention };
    let camera = Camera::look_at(&pose, &projection, SIZE)?;
    let vertices = Floats::F64(&scene.pillars);
    let pillars = MeshData { vertices, triangles: &scene.triangles, transforms: None };
    let occluders = engine.occluders(&[pillars], &OccluderOptions::default())?;
    let depth = engine.render_depth(&occluders, &camera)?;

    // The certified cull, instance by instance and in groups.
    let centers = Floats::F64(&scene.centers);
    let bounds = Bounds::Spheres { centers, radii: Floats::F64(&scene.radii) };
    let crowd = engine.instances(&bounds, &InstanceOptions::default())?;
    let pyramid = engine.pyramid(&depth)?;
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let options = |hierarchy| CullOptions { hierarchy, ..CullOptions::default() };
    let certified = [options(Hierarchy::Never), options(Hierarchy::Always)];
    let visible = hiz.create_visible(&crowd, &outputs)?;

    // The renderer's own: the farthest depths beside each other, for one gather.
    let mip_options = MipOptions {
        lookup: MipLookup::EdgeTexel,
        layout: MipLayout::Atlas,
        ..MipOptions::default()
    };
    let mips = hiz.create_mip_texture(SIZE, &mip_options)?;
    let mut encoder = device.create_command_encoder(&Default::default());
    hiz.record_mips(&mut encoder, depth.texture(), convention, &mips)?;
    engine.queue().submit([encoder.finish()]);
    let own = OwnCull::new(engine, &scene, way, fov_y, mips.view());

    let mut best = [f64::INFINITY; 3];
    for _ in 0..9 {
        for (options, best) in certified.iter().zip(&mut best) {
            let ms = submitted_ms(engine, &mut |encoder| {
                hiz.record_cull(encoder, &crowd, &camera, &pyramid, &visible, options)
            })?;
            *best = best.min(ms);
        }
        let ms = submitted_ms(engine, &mut |encoder| {
            own.record(encoder, count);
            Ok(())
        })?;
        best[2] = best[2].min(ms);
    }

    let image = depth.read()?;
    let mut masks = Vec::new();
    for options in &certified {
        masks.push(engine.cull(&crowd, &camera, &pyramid, options, &outputs)?.mask()?);
    }
    masks.push(own.read(engine)?);
    let ways = ["certified, each", "certified, groups", "own shader, uncertified"];
    let rows = ways.into_iter().zip(best).zip(masks).map(|((way, ms), mask)| Row {
        way,
        cost: ms / best[0],
        kept: mask.iter().filter(|kept| **kept).count(),
        false_culls: false_culls(&scene, &camera, &image, &mask),
    });
    Ok(rows.collect())
}

/// How many of those that are not kept are visible, by the exact oracle.
fn false_culls(scene: &Scene, camera: &Camera, image: &[f32], mask: &[bool]) -> usize {
    let view = View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: SIZE.width,
        height: SIZE.height,
        reversed: camera.convention().is_reversed(),
    };
    let is_visible = |i: &usize| {
        let center = std::array::from_fn(|k| scene.centers[3 * i + k]);
        let volume = Volume::Sphere { center, radius: scene.radii[*i] };
        hiz_ref::classify(&view, &volume, image) == Ok(Verdict::Visible)
    };
    (0..mask.len()).filter(|i| !mask[*i]).filter(is_visible).count()
}

/// The renderer's own cull.
struct OwnCull {
    pipeline: wgpu::ComputePipeline,
    bound: wgpu::BindGroup,
    kept: Arc<wgpu::Buffer>,
}

impl OwnCull {
    fn new(
        engine: &Engine,
        scene: &Scene,
        way: Vec3,
        fov_y: f64,
        mips: &wgpu::TextureView,
    ) -> Self {
        let device = engine.device();
        let cross = |a: Vec3, b: Vec3| {
            let at = |i: usize, j: usize| a[i] * b[j] - a[j] * b[i];
            [at(1, 2), at(2, 0), at(0, 1)]
        };
        let unit = |v: Vec3| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| x / length)
        };
        let forward = unit(way);
        let right = unit(cross(forward, [0.0, 1.0, 0.0]));
        let rows = [right, cross(right, forward), forward].map(|axis| {
            let constant = -(0..3).map(|k| axis[k] * scene.eye[k]).sum::<f64>();
            [axis[0], axis[1], axis[2], constant].map(|x| x as f32)
        });
        let pixels = f64::from(SIZE.height) / (2.0 * (fov_y / 2.0).tan());
        let view = OwnView {
            rows,
            scale: [pixels as f32; 2],
            near: NEAR as f32,
            count: scene.radii.len() as u32,
            size: [SIZE.width, SIZE.height],
            padding: [0; 2],
        };
        let spheres: Vec<[f32; 4]> = scene
            .centers
            .chunks_exact(3)
            .zip(&scene.radii)
            .map(|(c, r)| [c[0], c[1], c[2], *r].map(|x| x as f32))
            .collect();

        let source = format!("{MIP_LOOKUP}{MIP_CULL}{SHADER}");
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("own culling"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        // R32Float cannot be filtered by default, so the layout has to say that it is not.
        let visibility = wgpu::ShaderStages::COMPUTE;
        let entry =
            |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
        let buffer = |ty| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("own culling"),
            entries: &[
                entry(0, texture),
                entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)),
                entry(2, buffer(wgpu::BufferBindingType::Uniform)),
                entry(3, storage(true)),
                entry(4, storage(false)),
            ],
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("own culling"),
            layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("own culling"),
                bind_group_layouts: &[Some(&layout)],
                immediate_size: 0,
            })),
            module: &module,
            entry_point: Some("cull"),
            compilation_options: Default::default(),
            cache: None,
        });
        let filled = |contents: &[u8], usage| {
            let label = Some("own culling");
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
        };
        let view = filled(bytemuck::bytes_of(&view), wgpu::BufferUsages::UNIFORM);
        let kept = filled(
            bytemuck::cast_slice(&vec![2_u32; spheres.len()]),
            wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        );
        let spheres = filled(bytemuck::cast_slice(&spheres), wgpu::BufferUsages::STORAGE);
        // A sampler filters nothing by default.
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor::default());
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("own culling"),
            layout: &layout,
            entries: &[
                entry(0, wgpu::BindingResource::TextureView(mips)),
                entry(1, wgpu::BindingResource::Sampler(&sampler)),
                entry(2, view.as_entire_binding()),
                entry(3, spheres.as_entire_binding()),
                entry(4, kept.as_entire_binding()),
            ],
        });
        Self { pipeline, bound, kept: Arc::new(kept) }
    }

    fn record(&self, encoder: &mut wgpu::CommandEncoder, count: usize) {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bound, &[]);
        pass.dispatch_workgroups(count.div_ceil(64) as u32, 1, 1);
    }

    fn read(&self, engine: &Engine) -> Result<Vec<bool>, Box<dyn Error>> {
        let (told, answer) = std::sync::mpsc::channel();
        let kept = self.kept.slice(..);
        let (device, queue) = (engine.device(), engine.queue());
        wgpu::util::DownloadBuffer::read_buffer(device, queue, &kept, move |bytes| {
            let _ = told.send(bytes.map(|bytes| bytemuck::pod_collect_to_vec::<_, u32>(&bytes)));
        });
        engine.wait()?;
        Ok(answer.recv()??.into_iter().map(|kept| kept == 1).collect())
    }
}

/// Places of the world: at its origin, and where float32 has steps of 1/128 m and of a metre.
pub(crate) const PLACES: [(&str, Vec3); 3] = [
    ("at the origin", [0.0; 3]),
    ("100 km away", [100_000.0, 10.0, -70_000.0]),
    ("10,000 km away", [10_000_000.0, 10.0, -7_000_000.0]),
];

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(20_000);
    let engine = Engine::new(None)?;
    println!("{}, {count} spheres, {SIZE}", engine.adapter());
    println!("| place | way | cost | kept | false culls |\n|---|---|---|---|---|");
    for (name, place) in PLACES {
        for Row { way, cost, kept, false_culls } in compare(&engine, place, count)? {
            println!("| {name} | {way} | {cost:.2} | {kept} | {false_culls} |");
        }
    }
    Ok(())
}
