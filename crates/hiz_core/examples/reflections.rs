//! Screen-space reflections that march through a mip texture of the nearest depths.
//!
//! ```text
//! cargo run --example reflections -- reflections.png
//! ```
//!
//! Boxes stand on wet ground.
//! Each pixel of the ground sends a reflected ray through the depth image, until a pixel's surface
//! is in front of the ray.
//! Uludag, "Hi-Z Screen-Space Cone-Traced Reflections" (GPU Pro 5, 2014), skips empty space: where
//! the ray is in front of the nearest depth of a texel, it passes all of the texel's pixels at once.
//!
//! The mip texture is looked up by edge texels, which share no pixels.
//! So the ray finds the pixel that a march pixel by pixel finds; `tests/examples.rs` compares both.

use std::error::Error;

use hiz_core::wgpu::{self, util::DeviceExt};
use hiz_core::{
    DepthConvention, HizContext, ImageSize, MIP_LOOKUP, MipDepths, MipLookup, MipOptions,
};

const SHADER: &str = "
struct Ray {
    // Column, row and depth in the image, and how they change until the ray is infinitely far away.
    begin: vec4<f32>,
    change: vec4<f32>,
    // The reciprocals of the change of column and row.
    inverse: vec4<f32>,
}

@group(0) @binding(0) var mips: texture_2d<f32>;
@group(0) @binding(1) var<storage, read> rays: array<Ray>;
// The pixel that each ray hits, or NONE, and how many texels it has looked at.
@group(0) @binding(2) var<storage, read_write> hits: array<vec2<u32>>;
// The size of the image.
@group(0) @binding(3) var<uniform> image: vec4<u32>;

const NONE: u32 = 0xffffffffu;
// Farther than any border that a ray reaches.
const NEVER: f32 = 1e30;

// The border of the pixels first..last at which the ray leaves them along an axis.
fn border(first: u32, last: u32, change: f32) -> f32 {
    return select(f32(first), f32(last + 1u), change > 0.0);
}

// When the ray reaches a border.
fn time_of(at: f32, ray: Ray, axis: u32) -> f32 {
    let time = (at - ray.begin[axis]) * ray.inverse[axis];
    return select(time, NEVER, ray.change[axis] == 0.0);
}

// Whether the ray enters pixel p along an axis before it does something else at a time.
// Where both happen at once, columns come before rows.
fn enters(p: f32, ray: Ray, axis: u32, time: f32) -> bool {
    let entered = time_of(p + select(1.0, 0.0, ray.change[axis] > 0.0), ray, axis);
    return entered < time || (entered == time && axis == 0u);
}

// The pixel along an axis at a time when the ray leaves first..last along the other axis.
fn pixel_at(first: u32, last: u32, ray: Ray, axis: u32, time: f32) -> i32 {
    if ray.change[axis] == 0.0 {
        return i32(ray.begin[axis]);
    }
    let forward = select(-1.0, 1.0, ray.change[axis] > 0.0);
    // A guess, and what its rounding may have changed.
    var p = floor(ray.begin[axis] + time * ray.change[axis]);
    p = clamp(p, f32(first), f32(last));
    if !enters(p, ray, axis, time) {
        p -= forward;
    }
    if enters(p + forward, ray, axis, time) {
        p += forward;
    }
    return i32(clamp(p, f32(first), f32(last)));
}

@compute @workgroup_size(64)
fn trace(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rays) {
        return;
    }
    let ray = rays[id.x];
    let size = image.xy;
    let coarsest = firstLeadingBit(max(size.x, size.y));
    var pixel = vec2<i32>(ray.begin.xy);
    var level = 0u;
    var time = 0.0;
    var looked = 0u;
    var hit = NONE;
    var is_first = true;
    // A ray that goes nowhere belongs to a pixel that reflects nothing.
    var goes_on = any(ray.change.xy != vec2<f32>(0.0));
    while goes_on {
        let at = vec2<u32>(pixel);
        let texel = mip_edge_texel(at, level, size);
        let pixels = mip_pixels(texel, level, size);
        let times = vec2<f32>(
            time_of(border(pixels.x, pixels.z, ray.change.x), ray, 0u),
            time_of(border(pixels.y, pixels.w, ray.change.y), ray, 1u));
        let left = min(times.x, times.y);
        let depths = ray.begin.z + vec2<f32>(time, min(left, 1.0)) * ray.change.z;
        // Reversed Z: the nearest depth is the greatest, and the ray is behind where it has less.
        let nearest = textureLoad(mips, texel, level).x;
        looked += 1u;
        // The pixel that the ray begins at shows the ground itself.
        if !is_first && min(depths.x, depths.y) < nearest {
            if level == 0u {
                hit = at.y * size.x + at.x;
                goes_on = false;
            } else {
                level -= 1u;
            }
        } else {
            let forward = vec2<i32>(sign(ray.change.xy));
            if times.x <= times.y {
                pixel.x = select(i32(pixels.x) - 1, i32(pixels.z) + 1, forward.x > 0);
                pixel.y = pixel_at(pixels.y, pixels.w, ray, 1u, left);
            } else {
                pixel.x = pixel_at(pixels.x, pixels.z, ray, 0u, left);
                pixel.y = select(i32(pixels.y) - 1, i32(pixels.w) + 1, forward.y > 0);
            }
            time = left;
            level = select(min(level + 1u, coarsest), 0u, is_first);
            is_first = false;
            goes_on = left < 1.0 && all(pixel >= vec2<i32>(0)) && all(pixel < vec2<i32>(size));
        }
    }
    hits[id.x] = vec2<u32>(hit, looked);
}
";

/// What `hits` says of a ray that hits nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// The depth of the near plane, and the height of the eye above the ground.
const NEAR: f64 = 0.1;
const EYE: f64 = 1.5;

/// A box on the ground: its corners, and its colour.
type Block = ([f64; 3], [f64; 3], [u8; 3]);

const BLOCKS: [Block; 5] = [
    ([-6.0, 0.0, -14.0], [-3.0, 4.0, -11.0], [200, 90, 70]),
    ([-1.5, 0.0, -9.0], [-0.2, 1.2, -8.0], [90, 160, 80]),
    ([1.0, 0.0, -16.0], [4.0, 6.0, -13.0], [80, 110, 190]),
    ([2.6, 0.0, -7.5], [3.4, 0.9, -6.8], [210, 180, 70]),
    ([-30.0, 0.0, -41.0], [30.0, 9.0, -40.0], [150, 140, 150]),
];

/// A ray in the image, as the shader takes it.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Ray {
    /// Column, row and depth where it begins.
    pub(crate) begin: [f32; 4],
    /// How they change until it is infinitely far away; 0 for pixels that reflect nothing.
    pub(crate) change: [f32; 4],
    /// Reciprocals of the first two changes.
    pub(crate) inverse: [f32; 4],
}

/// What a renderer has drawn, and the rays that its ground reflects.
pub(crate) struct Frame {
    pub(crate) size: ImageSize,
    /// Reversed Z without a far plane: the near plane's depth over the view depth.
    pub(crate) depth: Vec<f32>,
    pub(crate) colours: Vec<[u8; 3]>,
    pub(crate) rays: Vec<Ray>,
}

/// Where a ray from the eye enters a block: as a multiple of `way`.
fn entry_of(block: &Block, way: [f64; 3]) -> Option<f64> {
    let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
    for (k, way) in way.into_iter().enumerate() {
        let eye = if k == 1 { EYE } else { 0.0 };
        let [a, b] = [block.0[k], block.1[k]].map(|side| (side - eye) / way);
        (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
    }
    (enters > 0.0 && enters < leaves).then_some(enters)
}

/// Draws the scene from the eye along -z, 90 degrees wide.
pub(crate) fn draw(size: ImageSize) -> Frame {
    let (width, height) = (f64::from(size.width), f64::from(size.height));
    let focal = width / 2.0;
    let mut frame = Frame { size, depth: Vec::new(), colours: Vec::new(), rays: Vec::new() };
    for y in 0..size.height {
        for x in 0..size.width {
            let (column, row) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let way = [(column - width / 2.0) / focal, (height / 2.0 - row) / focal, -1.0];
            let ground = if way[1] < 0.0 { EYE / -way[1] } else { f64::INFINITY };
            let nearest = BLOCKS
                .iter()
                .filter_map(|block| Some((entry_of(block, way)?, block.2)))
                .fold((ground, [70, 75, 80]), |a, b| if b.0 < a.0 { b } else { a });
            let (view_depth, colour) = nearest;
            let is_ground = view_depth == ground && ground.is_finite();
            let sky = [120, 150, (190.0 + 40.0 * way[1]) as u8];
            frame.colours.push(if view_depth.is_finite() { colour } else { sky });
            let depth = NEAR / view_depth;
            frame.depth.push(depth as f32);
            frame.rays.push(if is_ground {
                reflected([column, row, depth], way, (focal, size))
            } else {
                Ray { begin: [0.0; 4], change: [0.0; 4], inverse: [0.0; 4] }
            });
        }
    }
    frame
}

/// The ray that ripples on the ground reflect.
fn reflected(begin: [f64; 3], way: [f64; 3], (focal, size): (f64, ImageSize)) -> Ray {
    let at = [0, 2].map(|k| way[k] * NEAR / begin[2]);
    let slope = [0.03 * (3.0 * at[0] + at[1]).sin(), 0.02 * (5.0 * at[1]).cos()];
    let normal = [slope[0], 1.0, slope[1]];
    let along =
        (0..3).map(|k| normal[k] * way[k]).sum::<f64>() / normal.iter().map(|n| n * n).sum::<f64>();
    let away: [f64; 3] = std::array::from_fn(|k| way[k] - 2.0 * along * normal[k]);
    // Where it vanishes: as it goes away along -z its depth becomes 0.
    let half = [size.width, size.height].map(|n| f64::from(n) / 2.0);
    let end = [half[0] - focal * away[0] / away[2], half[1] + focal * away[1] / away[2], 0.0];
    let change: [f64; 3] = std::array::from_fn(|k| end[k] - begin[k]);
    let four = |v: [f64; 3]| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0];
    Ray {
        begin: four(begin),
        change: four(change),
        inverse: four([1.0 / change[0], 1.0 / change[1], 0.0]),
    }
}

/// For each ray the pixel that it hits, or [`NONE`], and how many texels it has looked at.
pub(crate) fn trace(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    frame: &Frame,
) -> Result<Vec<[u32; 2]>, Box<dyn Error>> {
    // A renderer has drawn this texture.
    let ImageSize { width, height } = frame.size;
    let depth = device.create_texture_with_data(
        queue,
        &wgpu::TextureDescriptor {
            label: Some("depth"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::R32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&frame.depth),
    );

    let hiz = HizContext::new(device)?;
    let options = MipOptions {
        depths: MipDepths::Nearest,
        lookup: MipLookup::EdgeTexel,
        level_0: true,
        ..MipOptions::default()
    };
    let mips = hiz.create_mip_texture(frame.size, &options)?;

    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("reflections"),
        source: wgpu::ShaderSource::Wgsl(format!("{MIP_LOOKUP}{SHADER}").into()),
    });
    // R32Float cannot be filtered by default, so a layout that is derived from the shader will do:
    // `textureLoad` filters nothing.
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("reflections"),
        layout: None,
        module: &module,
        entry_point: Some("trace"),
        compilation_options: Default::default(),
        cache: None,
    });
    let buffer = |contents: &[u8], usage| {
        let label = Some("reflections");
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
    };
    let rays = buffer(bytemuck::cast_slice(&frame.rays), wgpu::BufferUsages::STORAGE);
    let none = vec![[NONE; 2]; frame.rays.len()];
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    let hits = buffer(bytemuck::cast_slice(&none), usage);
    let image = buffer(bytemuck::bytes_of(&[width, height, 0, 0]), wgpu::BufferUsages::UNIFORM);
    let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
    let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("reflections"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            entry(0, wgpu::BindingResource::TextureView(mips.view())),
            entry(1, rays.as_entire_binding()),
            entry(2, hits.as_entire_binding()),
            entry(3, image.as_entire_binding()),
        ],
    });

    let mut encoder = device.create_command_encoder(&Default::default());
    hiz.record_mips(&mut encoder, &depth, DepthConvention::Reversed, &mips)?;
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bound, &[]);
    pass.dispatch_workgroups(frame.rays.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    queue.submit([encoder.finish()]);

    let (told, answer) = std::sync::mpsc::channel();
    wgpu::util::DownloadBuffer::read_buffer(device, queue, &hits.slice(..), move |bytes| {
        let _ = told.send(bytes.map(|bytes| bytemuck::pod_collect_to_vec(&bytes)));
    });
    device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(answer.recv()??)
}

/// The picture: the ground shows a third of what its rays hit.
pub(crate) fn picture(frame: &Frame, hits: &[[u32; 2]]) -> Vec<u8> {
    let pixel = |(own, [hit, _]): (&[u8; 3], &[u32; 2])| match frame.colours.get(*hit as usize) {
        Some(seen) => std::array::from_fn(|k| own[k] / 3 * 2 + seen[k] / 3),
        None => *own,
    };
    let rgb: Vec<[u8; 3]> = frame.colours.iter().zip(hits).map(pixel).collect();
    rgb.into_iter().flatten().collect()
}

pub(crate) fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).filter(|path| path.ends_with(".png"));
    let path = path.unwrap_or_else(|| "target/reflections.png".to_owned());
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;

    let frame = draw(ImageSize::new(640, 360));
    let hits = trace(&device, &queue, &frame)?;
    let rays = frame.rays.iter().filter(|ray| ray.change[1] != 0.0).count();
    let found = hits.iter().filter(|[hit, _]| *hit != NONE).count();
    let looked: u64 = hits.iter().map(|[_, looked]| u64::from(*looked)).sum();
    println!("{rays} rays, {found} hits, {:.1} texels per ray", looked as f64 / rays as f64);

    let file = std::io::BufWriter::new(std::fs::File::create(&path)?);
    let mut encoder = png::Encoder::new(file, frame.size.width, frame.size.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&picture(&frame, &hits))?;
    println!("picture: {path}");
    Ok(())
}
