//! Everything of a frame in one submission and one readback: lights, particles and shadow casters.
//!
//! ```text
//! cargo run --example every_way
//! ```
//!
//! Three cameras look through a hall with a wall across it: two eyes and a mirror.
//! Lights are spheres around what they reach, and particles are points.
//! Shadow casters are boxes, half of whose shadows fall on what the first eye sees of the wall.
//! The others stand behind the wall, as seen from that eye, and so do their shadows.
//! One encoder draws three depth images, reduces them and culls everything.
//! It copies all masks into one buffer, which is submitted, mapped and read once.
//! `tests/examples.rs` runs this file, and knows the answers from where things stand.

use std::error::Error;

use hiz_core::wgpu;
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, Depths, DirectionalLight, DrawOptions, Floats,
    HizContext, ImageSize, InstanceOptions, Instances, MeshData, OCCLUDER_DEPTH_FORMAT,
    OccluderOptions, Outputs, Pose, Projection, Pyramid, PyramidOptions, View, ViewsOutputs,
};

/// How many there are of each, half of them before the wall.
pub(crate) const LIGHTS: usize = 200;
pub(crate) const PARTICLES: usize = 5000;
pub(crate) const CASTERS: usize = 300;

/// Two eyes, 6 cm apart, and the camera of a mirror.
const EYES: [[f64; 3]; 3] = [[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.5, -1.0]];

/// What a frame has cost, and its answers: a flag per instance.
#[derive(Debug, Default)]
pub(crate) struct Frame {
    pub(crate) submissions: usize,
    pub(crate) readbacks: usize,
    /// By camera.
    pub(crate) lights: Vec<Vec<bool>>,
    pub(crate) particles: Vec<Vec<bool>>,
    /// Whose shadows the first eye may see.
    pub(crate) casters: Vec<bool>,
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let frame = run(&device, &queue)?;
    let kept = |flags: &[bool]| flags.iter().filter(|flag| **flag).count();
    for (camera, (lights, particles)) in frame.lights.iter().zip(&frame.particles).enumerate() {
        let (lights, particles) = (kept(lights), kept(particles));
        println!(
            "camera {camera}: {lights} of {LIGHTS} lights, {particles} of {PARTICLES} particles"
        );
    }
    println!("the first eye: shadows of {} of {CASTERS} casters", kept(&frame.casters));
    println!("{} submission, {} readback", frame.submissions, frame.readbacks);
    Ok(())
}

/// Places within a box, the same in each run; every other one lies in the other box.
fn places(count: usize, boxes: [[[f32; 2]; 3]; 2]) -> Vec<f32> {
    let mut state = 1_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    let of = |i: usize| boxes[i % 2];
    (0..count).flat_map(|i| of(i).map(|[low, high]| low + (high - low) * random())).collect()
}

/// Uploads, then records and reads a frame.
pub(crate) fn run(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Frame, Box<dyn Error>> {
    let hiz = HizContext::new(device)?;
    let size = ImageSize::new(160, 120);
    let convention = DepthConvention::Reversed;
    let eye = |eye: [f64; 3]| {
        let target = [eye[0], eye[1], eye[2] - 1.0];
        let projection = Projection::Perspective { fov_y: 1.2, near: 0.1, far: None, convention };
        Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.0] }, &projection, size)
    };
    let cameras = EYES.map(eye).into_iter().collect::<hiz_core::Result<Vec<_>>>()?;

    // The wall is 12 m away, and the sun shines on it from behind the eyes.
    let (low, high) = ([-60.0, -60.0, -12.0], [60.0, 20.0, -12.0]);
    let vertices = [low, [high[0], low[1], low[2]], high, [low[0], high[1], low[2]]].concat();
    let vertices = Floats::F64(&vertices);
    let mesh = MeshData { vertices, triangles: &[0, 1, 2, 0, 2, 3], transforms: None };
    let sun = DirectionalLight::new([0.0, -1.0, -1.0], low, high);
    let walls = hiz.create_occluders(&[mesh], &OccluderOptions::default())?;

    let behind = [[-2.0, 2.0], [-2.0, 2.0], [-30.0, -14.0]];
    let centers = places(LIGHTS, [[[-2.0, 2.0], [-1.0, 1.0], [-10.0, -6.0]], behind]);
    let points = places(PARTICLES, [[[-2.0, 2.0], [-1.0, 1.0], [-11.0, -5.0]], behind]);
    let casters = places(CASTERS, [[[-2.0, 2.0], [0.5, 5.0], [-11.0, -7.0]], behind]);
    let [min, max] = [-0.4, 0.4].map(|d| casters.iter().map(|v| v + d).collect::<Vec<f32>>());
    let radii = [0.5; LIGHTS];
    let lights = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let points = Bounds::Points { positions: Floats::F32(&points) };
    let casters = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };

    // Once: what is tested, and what a frame fills.
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut upload = |bounds: &Bounds<'_>| {
        hiz.record_instances(&mut encoder, bounds, &InstanceOptions::default())
    };
    let [lights, points, casters] = [upload(&lights)?, upload(&points)?, upload(&casters)?];
    queue.submit([encoder.finish()]);
    let masks = Outputs { mask: true, ..Outputs::NONE };
    let of_views = ViewsOutputs { each: masks.clone(), any: masks.clone() };
    let seen_lights = hiz.create_visible_views(&lights, EYES.len(), &of_views)?;
    let seen_points = hiz.create_visible_views(&points, EYES.len(), &of_views)?;
    let lit = hiz.create_visible(&casters, &masks)?;
    let depths: Vec<_> = cameras.iter().map(|_| depth_target(device, size)).collect();
    let pyramids = cameras
        .iter()
        .map(|_| hiz.create_pyramid(size, &PyramidOptions::default()))
        .collect::<hiz_core::Result<Vec<Pyramid>>>()?;
    // Of what can receive shadows, the nearest depths count, too.
    let of_receivers = PyramidOptions { depths: Depths::Receivers, ..PyramidOptions::default() };
    let receivers = hiz.create_pyramid(size, &of_receivers)?;

    // A frame: depth of all cameras, all culls, and the copy of all answers.
    let mut frame = Frame::default();
    let options = CullOptions::default();
    let mut encoder = device.create_command_encoder(&Default::default());
    for ((camera, depth), pyramid) in cameras.iter().zip(&depths).zip(&pyramids) {
        hiz.record_occluders(&mut encoder, &walls, camera, depth, &DrawOptions::default())?;
        hiz.record_reduce(&mut encoder, depth, camera, pyramid)?;
    }
    hiz.record_reduce(&mut encoder, &depths[0], &cameras[0], &receivers)?;
    let views: Vec<_> =
        cameras.iter().zip(&pyramids).map(|(camera, pyramid)| View { camera, pyramid }).collect();
    hiz.record_cull_views(&mut encoder, &lights, &views, None, &seen_lights, &options)?;
    hiz.record_cull_views(&mut encoder, &points, &views, None, &seen_points, &options)?;
    let shadows = CullOptions { shadow: Some(sun), ..options.clone() };
    hiz.record_cull(&mut encoder, &casters, &cameras[0], &receivers, &lit, &shadows)?;
    let answers =
        [seen_lights.masks(), seen_points.masks(), lit.mask(0).expect("a mask was asked for")];
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("every_way.answers"),
        size: answers.iter().map(|mask| mask.size()).sum(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut begin = 0;
    for mask in answers {
        encoder.copy_buffer_to_buffer(mask, 0, &staging, begin, mask.size());
        begin += mask.size();
    }
    queue.submit([encoder.finish()]);
    frame.submissions += 1;
    staging.map_async(wgpu::MapMode::Read, .., |mapped| mapped.expect("it can be mapped"));
    device.poll(wgpu::PollType::wait_indefinitely())?;
    frame.readbacks += 1;

    let bytes = staging.get_mapped_range(..)?.to_vec();
    let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let flags = |begin: u64, crowd: &Instances| {
        let word = |i: usize| words[begin as usize / 4 + i / 32];
        (0..crowd.len() as usize).map(|i| word(i) >> (i % 32) & 1 == 1).collect::<Vec<_>>()
    };
    let row = |view: usize, stride: u64| view as u64 * stride;
    let stride = [seen_lights.mask_stride(), seen_points.mask_stride()];
    frame.lights = (0..EYES.len()).map(|view| flags(row(view, stride[0]), &lights)).collect();
    let begin = answers[0].size();
    frame.particles =
        (0..EYES.len()).map(|view| flags(begin + row(view, stride[1]), &points)).collect();
    frame.casters = flags(begin + answers[1].size(), &casters);
    Ok(frame)
}

fn depth_target(device: &wgpu::Device, size: ImageSize) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("every_way.depth"),
        size: wgpu::Extent3d { width: size.width, height: size.height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: OCCLUDER_DEPTH_FORMAT,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
