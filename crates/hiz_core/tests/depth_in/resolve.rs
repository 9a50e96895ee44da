//! Multisampled depth: the farthest and the nearest of each pixel's samples, bit for bit.
//!
//! Samples are written one by one, through a sample mask, by fragments that choose their bits.
//! Expectations are folds over these samples, by the definition of a depth.

use std::sync::mpsc;

use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, Coverage, CullOptions, DepthConvention, DepthEnd, DepthSource, Depths, Floats,
    HizContext, ImageSize, InstanceOptions, Outputs, PyramidOptions, ResolveOptions,
    ResolvedDepths, wgpu,
};
use wgpu::TextureFormat as Format;

use crate::common::{CONVENTIONS, Random, camera_along_z, depth_descriptor, engine};
use crate::{SAMPLED, differing_levels, encoder, image};

const DRAWN: &str = "
@group(0) @binding(0) var bits: texture_2d<u32>;

@vertex fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.5, 1.0);
}

@fragment fn depth(@builtin(position) at: vec4<f32>) -> @builtin(frag_depth) f32 {
    return bitcast<f32>(textureLoad(bits, vec2<u32>(at.xy), 0).x);
}

@fragment fn color(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(bitcast<f32>(textureLoad(bits, vec2<u32>(at.xy), 0).x));
}
";

/// A device of its own: more than four samples are no default of WebGPU.
struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
    counts: Vec<u32>,
}

impl Drop for Device {
    fn drop(&mut self) {
        drop(self.device.poll(wgpu::PollType::wait_indefinitely()));
    }
}

fn open(format: Format) -> Device {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .expect("the device tests need a Vulkan driver");
    let more = wgpu::Features::TEXTURE_ADAPTER_SPECIFIC_FORMAT_FEATURES;
    let features = adapter.features() & more;
    let flags = adapter.get_texture_format_features(format).flags;
    let counts = [2, 4, 8]
        .into_iter()
        .filter(|n| *n == 4 || !features.is_empty() && flags.sample_count_supported(*n))
        .collect();
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: features,
        ..Default::default()
    }))
    .expect("a device");
    Device { device, queue, counts }
}

/// A multisampled texture whose sample k of each pixel is that of `samples[k]`.
fn drawn(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    format: Format,
    size: ImageSize,
    samples: &[Vec<f32>],
) -> wgpu::Texture {
    let is_depth = format.has_depth_aspect();
    let count = samples.len() as u32;
    let usage = SAMPLED | wgpu::TextureUsages::RENDER_ATTACHMENT;
    let mut descriptor = depth_descriptor((size.width, size.height), format, usage);
    descriptor.sample_count = count;
    let target = device.create_texture(&descriptor);
    let view = target.create_view(&wgpu::TextureViewDescriptor::default());
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("test.samples"),
        source: wgpu::ShaderSource::Wgsl(DRAWN.into()),
    });
    for (k, bits) in samples.iter().enumerate() {
        let usage = SAMPLED | wgpu::TextureUsages::COPY_DST;
        let sized = depth_descriptor((size.width, size.height), Format::R32Uint, usage);
        let given = device.create_texture(&sized);
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * size.width),
            rows_per_image: None,
        };
        let bytes = bytemuck::cast_slice(bits);
        queue.write_texture(given.as_image_copy(), bytes, layout, given.size());
        let target = Some(wgpu::ColorTargetState {
            format,
            blend: None,
            write_mask: wgpu::ColorWrites::ALL,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("test.samples"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("corner"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: is_depth.then(|| wgpu::DepthStencilState {
                format,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Always),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState { count, mask: 1 << k, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(if is_depth { "depth" } else { "color" }),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: if is_depth { &[] } else { std::slice::from_ref(&target) },
            }),
            multiview_mask: None,
            cache: None,
        });
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("test.samples"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(
                    &given.create_view(&wgpu::TextureViewDescriptor::default()),
                ),
            }],
        });
        let mut commands = encoder(device);
        let color = [Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store },
        })];
        let mut pass = commands.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("test.samples"),
            color_attachments: if is_depth { &[] } else { &color },
            depth_stencil_attachment: is_depth.then_some(wgpu::RenderPassDepthStencilAttachment {
                view: &view,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Load,
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bindings, &[]);
        pass.draw(0..3, 0..1);
        drop(pass);
        queue.submit([commands.finish()]);
    }
    target
}

/// The pixels of a texture with four of a row per texel.
fn read(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    texture: &wgpu::Texture,
    size: ImageSize,
) -> Vec<f32> {
    let row = (16 * texture.width()).next_multiple_of(256);
    let staging = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.resolved"),
        size: u64::from(row * size.height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut copy = encoder(device);
    let layout =
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
    copy.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &staging, layout },
        texture.size(),
    );
    queue.submit([copy.finish()]);
    let (told, mapped) = mpsc::channel();
    staging.map_async(wgpu::MapMode::Read, .., move |done| told.send(done).unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    mapped.recv().unwrap().unwrap();
    let bytes = staging.get_mapped_range(..).unwrap();
    let rows = bytes.chunks_exact(row as usize);
    rows.flat_map(|row| bytemuck::pod_collect_to_vec::<u8, f32>(&row[..4 * size.width as usize]))
        .collect()
}

/// What a sample stands for: `bad` where it is no depth, 0 for -0 and subnormals.
fn meaning(depth: f32, bad: f32) -> f32 {
    if depth.is_nan() || !(0.0..=1.0).contains(&depth) {
        return bad;
    }
    if depth.is_subnormal() || depth == 0.0 { 0.0 } else { depth }
}

/// The farthest and the nearest of each pixel's samples.
fn expected(samples: &[Vec<f32>], reversed: bool) -> [Vec<f32>; 2] {
    let (near, far) = if reversed { (1.0, 0.0) } else { (0.0, 1.0_f32) };
    let greatest_is_far = !reversed;
    let fold = |bad: f32, greatest: bool| {
        let pixels = samples[0].len();
        let of_pixel = |i: usize| {
            let found = samples.iter().map(|plane| meaning(plane[i], bad));
            found.reduce(if greatest { f32::max } else { f32::min }).unwrap()
        };
        (0..pixels).map(of_pixel).collect::<Vec<_>>()
    };
    [fold(far, greatest_is_far), fold(near, !greatest_is_far)]
}

/// Widths that are no multiple of the four pixels of a vector, and sizes around workgroups.
const SIZES: [(u32, u32); 9] =
    [(1, 1), (2, 3), (3, 2), (5, 7), (7, 1), (33, 17), (255, 5), (257, 4), (333, 65)];

const FORMATS: [Format; 2] = [Format::Depth32Float, Format::R32Float];

fn planes(format: Format, count: u32, size: ImageSize, random: &mut Random) -> Vec<Vec<f32>> {
    let mut planes: Vec<_> = (0..count).map(|_| image(size, random)).collect();
    if format.has_depth_aspect() {
        // A driver decides itself what it stores of anything that is no depth.
        for d in planes.iter_mut().flatten() {
            *d = if d.is_nan() { 0.5 } else { d.abs().clamp(0.0, 1.0) };
        }
    }
    planes
}

fn bits(depth: &[f32]) -> Vec<u32> {
    depth.iter().map(|d| d.to_bits()).collect()
}

/// How many images are wrong at either end, with a context that `faults` are planted in.
fn wrong(format: Format, faults: &[(&str, &str)], sizes: &[(u32, u32)]) -> [usize; 2] {
    let opened = open(format);
    let (device, queue) = (&opened.device, &opened.queue);
    let context = HizContext::with_planted_faults(device, faults).unwrap();
    let (mut random, mut wrong) = (Random(11), [0, 0]);
    eprintln!("{format:?}: {:?} samples", opened.counts);
    for count in &opened.counts {
        for (width, height) in sizes {
            let size = ImageSize::new(*width, *height);
            let samples = planes(format, *count, size, &mut random);
            let texture = drawn((device, queue), format, size, &samples);
            for convention in CONVENTIONS {
                let camera = camera_along_z(*width, *height, convention);
                let expected = expected(&samples, convention.is_reversed());
                for depths in
                    [ResolvedDepths::Farthest, ResolvedDepths::Nearest, ResolvedDepths::Both]
                {
                    let options = ResolveOptions { depths };
                    let resolve = context.create_depth_resolve(size, &options).unwrap();
                    let mut commands = encoder(device);
                    context.record_resolve(&mut commands, &texture, &camera, &resolve).unwrap();
                    queue.submit([commands.finish()]);
                    let ends = [
                        resolve.farthest().ok().map(|depth| depth.texture),
                        resolve.nearest().ok(),
                    ];
                    assert_eq!(ends[0].is_some(), depths != ResolvedDepths::Nearest);
                    assert_eq!(ends[1].is_some(), depths != ResolvedDepths::Farthest);
                    for ((end, expected), wrong) in ends.iter().zip(&expected).zip(&mut wrong) {
                        let Some(texture) = end else { continue };
                        let found = read((device, queue), texture, size);
                        *wrong += usize::from(bits(&found) != bits(expected));
                    }
                }
            }
        }
    }
    wrong
}

#[test]
fn resolved_depth_is_that_of_the_samples() {
    for format in FORMATS {
        assert_eq!(wrong(format, &[], &SIZES), [0, 0], "{format:?}");
    }
}

#[test]
fn planted_faults_of_the_resolve_show() {
    let faults: [(&str, &str, [bool; 2]); 7] = [
        (
            "farthest_sanitized4(four_samples(at, k))",
            "sanitized(sample_bits(at, 0))",
            [true, false],
        ),
        ("let last = SAMPLES - 1;", "let last = SAMPLES - 2;", [true, false]),
        ("k < SAMPLES; k += 1", "k < SAMPLES - 1; k += 1", [false, true]),
        (
            "select(min(a, b), max(a, b), REVERSED)",
            "select(max(a, b), min(a, b), REVERSED)",
            [false, true],
        ),
        (
            "select(max(a, b), min(a, b), REVERSED)",
            "select(min(a, b), max(a, b), REVERSED)",
            [true, false],
        ),
        (
            "return select(sanitized(bits), near_bits(), outside);",
            "return sanitized(bits);",
            [false, true],
        ),
        (
            "bits = nearest(bits, sanitized_near(sample_bits(at, k)));",
            "bits = nearest(bits, sample_bits(at, k));",
            [false, true],
        ),
    ];
    for (what, by, shows) in faults {
        let found = wrong(Format::R32Float, &[(what, by)], &[(33, 17)]);
        assert_eq!(found.map(|wrong| wrong > 0), shows, "{what:?}: {found:?}");
    }
}

/// A vector reaches past an odd width.
/// What is read there would count as depth of the last pixels: 0 is far with reversed Z.
#[test]
fn nothing_is_read_past_the_last_column() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let past = [(
        "image.origin + min(vec2<u32>(x, y), image.size - vec2<u32>(1u))",
        "image.origin + vec2<u32>(x, y)",
    )];
    let size = ImageSize::new(333, 9);
    let samples = vec![vec![0.75; size.pixels() as usize]; 4];
    let texture = drawn((device, queue), Format::Depth32Float, size, &samples);
    for (faults, expected) in [(&past[..0], true), (&past[..], false)] {
        let context = HizContext::with_planted_faults(device, faults).unwrap();
        let camera = camera_along_z(size.width, size.height, DepthConvention::Reversed);
        let resolve = context.create_depth_resolve(size, &ResolveOptions::default()).unwrap();
        let mut commands = encoder(device);
        context.record_resolve(&mut commands, &texture, &camera, &resolve).unwrap();
        queue.submit([commands.finish()]);
        let depth = resolve.farthest().unwrap().texture;
        // The spare pixels of the last texel, too: they count for the levels above.
        let all = ImageSize::new(4 * depth.width(), size.height);
        let found = read((device, queue), depth, all);
        assert_eq!(found.iter().all(|d| *d == 0.75), expected);
    }
}

/// A viewport of a multisampled texture, whose neighbours are near.
#[test]
fn a_part_of_multisampled_depth_is_resolved_alone() {
    let engine = engine();
    let (device, queue, context) = (engine.device(), engine.queue(), engine.context());
    let (whole, size, [x, y]) = (ImageSize::new(40, 20), ImageSize::new(21, 13), [13, 3]);
    for convention in CONVENTIONS {
        let mut random = Random(7);
        let samples = planes(Format::Depth32Float, 4, whole, &mut random);
        let texture = drawn((device, queue), Format::Depth32Float, whole, &samples);
        let camera = camera_along_z(size.width, size.height, convention);
        let resolve = context.create_depth_resolve(size, &ResolveOptions::default()).unwrap();
        let pyramid = context.create_pyramid(size, &PyramidOptions::default()).unwrap();
        let part = DepthSource { origin: [x, y], size: Some(size), ..DepthSource::from(&texture) };
        let mut commands = encoder(device);
        context.record_resolve(&mut commands, part, &camera, &resolve).unwrap();
        let depth = resolve.farthest().unwrap();
        context.record_reduce(&mut commands, depth, &camera, &pyramid).unwrap();
        queue.submit([commands.finish()]);
        let [farthest, _] = expected(&samples, convention.is_reversed());
        let rows = farthest.chunks(whole.width as usize).skip(y as usize);
        let own = rows
            .take(size.height as usize)
            .flat_map(|row| row[x as usize..(x + size.width) as usize].iter().copied());
        let own: Vec<f32> = own.collect();
        let differing = differing_levels(&engine, &pyramid, &own, convention.is_reversed());
        assert!(differing.is_empty(), "{convention:?}: {differing:?}");
    }
}

/// A gap that one sample of a pixel shows keeps what is behind it.
/// Culls of such a pyramid know nothing about the pixels' centres.
#[test]
fn culls_keep_what_one_sample_shows() {
    let engine = engine();
    let (device, queue, context) = (engine.device(), engine.queue(), engine.context());
    let (size, convention) = (ImageSize::new(16, 16), DepthConvention::Standard);
    let camera = camera_along_z(size.width, size.height, convention);
    // A wall at view depth 4, whose last sample is missing in one pixel.
    let wall = crate::common::ndc(4.0, convention);
    let mut samples = vec![vec![wall; size.pixels() as usize]; 4];
    samples[3][8 * 16 + 8] = 1.0;
    // Boxes behind pixel (8, 8) and behind pixel (2, 2), half a pixel wide.
    let at = |pixel: f32| 20.0 * ((pixel + 0.5) / 8.0 - 1.0);
    let (low, high): (Vec<_>, Vec<_>) = [8.0_f32, 2.0]
        .into_iter()
        .flat_map(|pixel| {
            let (x, y) = (at(pixel), -at(pixel));
            [(x - 0.5, x + 0.5), (y - 0.5, y + 0.5), (20.0, 20.5)]
        })
        .unzip();
    let bounds = Bounds::Boxes { min: Floats::F32(&low), max: Floats::F32(&high) };
    let crowd = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let texture = drawn((device, queue), Format::Depth32Float, size, &samples);
    let resolve = context.create_depth_resolve(size, &ResolveOptions::default()).unwrap();
    let pyramid = context.create_pyramid(size, &PyramidOptions::default()).unwrap();
    let mut commands = encoder(device);
    context.record_resolve(&mut commands, &texture, &camera, &resolve).unwrap();
    let depth = resolve.farthest().unwrap();
    assert_eq!(depth.samples, 4);
    context.record_reduce(&mut commands, depth, &camera, &pyramid).unwrap();
    queue.submit([commands.finish()]);
    let pyramid = std::sync::Arc::new(pyramid);
    let cull = |coverage| {
        let options = CullOptions { coverage, ..CullOptions::default() };
        engine.cull(&crowd, &camera, &pyramid, &options, &Outputs::default())
    };
    assert_eq!(cull(Coverage::Area).unwrap().mask().unwrap(), [true, false]);
    let refused = cull(Coverage::Sample).unwrap_err().to_string();
    assert!(
        refused.starts_with("coverage: expected Coverage::Area") && refused.contains("4 samples"),
        "{refused}"
    );
}

/// A format of fixed point keeps its step through the resolve.
#[test]
fn the_tolerance_of_the_format_goes_with_the_depth() {
    let engine = engine();
    let (device, context) = (engine.device(), engine.context());
    let camera = camera_along_z(8, 8, DepthConvention::Standard);
    let resolve = context.create_depth_resolve(camera.size(), &ResolveOptions::default()).unwrap();
    let pyramid = context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let usage = SAMPLED | wgpu::TextureUsages::RENDER_ATTACHMENT;
    let mut descriptor = depth_descriptor((8, 8), Format::Depth16Unorm, usage);
    descriptor.sample_count = 4;
    let texture = device.create_texture(&descriptor);
    let mut commands = encoder(device);
    context.record_resolve(&mut commands, &texture, &camera, &resolve).unwrap();
    let depth = resolve.farthest().unwrap();
    context.record_reduce(&mut commands, depth, &camera, &pyramid).unwrap();
    engine.queue().submit([commands.finish()]);
    let step = pyramid.tolerance().unwrap().absolute * 65_535.0;
    assert!((1.0..1.001).contains(&step), "{step}");
}

/// Every level of a pyramid of resolved samples, of each end, against folds over the samples.
///
/// Receivers: a pixel is background where all its samples are.
fn wrong_levels(depths: Depths, faults: &[(&str, &str)]) -> usize {
    let engine = Engine::with_planted_faults(None, faults).expect("a Vulkan driver");
    let (mut random, mut wrong) = (Random(12), 0);
    for (width, height) in [(33, 17), (64, 40), (5, 90)] {
        let size = ImageSize::new(width, height);
        let mut samples = planes(Format::R32Float, 4, size, &mut random);
        for convention in CONVENTIONS {
            let far = if convention.is_reversed() { 0.0 } else { 1.0_f32 };
            for plane in &mut samples {
                // Background behind all samples of the first rows, and behind some of others.
                let mixed = random.below(2) == 0;
                plane[..(5 * width) as usize].fill(far);
                if mixed {
                    plane[(5 * width) as usize..(8 * width) as usize].fill(far);
                }
            }
            let texture =
                drawn((engine.device(), engine.queue()), Format::R32Float, size, &samples);
            let camera = camera_along_z(width, height, convention);
            let hiz = engine.context();
            let options = ResolveOptions { depths: ResolvedDepths::Both };
            let resolve = hiz.create_depth_resolve(size, &options).unwrap();
            let options = PyramidOptions { depths, ..PyramidOptions::default() };
            let pyramid = hiz.create_pyramid(size, &options).unwrap();
            let mut commands = encoder(engine.device());
            hiz.record_resolve(&mut commands, &texture, &camera, &resolve).unwrap();
            hiz.record_reduce(&mut commands, resolve.source().unwrap(), &camera, &pyramid).unwrap();
            engine.queue().submit([commands.finish()]);
            let [mut farthest, nearest] = expected(&samples, convention.is_reversed());
            if depths == Depths::Receivers {
                for (farthest, nearest) in farthest.iter_mut().zip(&nearest) {
                    *farthest = if *nearest == far { 1.0 - far } else { *farthest };
                }
            }
            let ends = [
                (DepthEnd::Farthest, farthest, depths.has_farthest()),
                (DepthEnd::Nearest, nearest, depths.has_nearest()),
            ];
            for (end, pixels, _) in ends.into_iter().filter(|(.., is_there)| *is_there) {
                let greatest = (end == DepthEnd::Farthest) != convention.is_reversed();
                for level in 0..pyramid.num_levels() {
                    let found = engine.read_level_of(&pyramid, level, end).unwrap();
                    let columns = width.div_ceil(1 << level);
                    let fold = if greatest { f32::max } else { f32::min };
                    let mut blocks = vec![if greatest { 0.0 } else { 1.0 }; found.len()];
                    for (i, depth) in (0..).zip(&pixels) {
                        let (x, y) = ((i % width) >> level, (i / width) >> level);
                        let block = &mut blocks[(y * columns + x) as usize];
                        *block = fold(*block, *depth);
                    }
                    wrong += usize::from(bits(&found) != bits(&blocks));
                }
            }
        }
    }
    wrong
}

#[test]
fn pyramids_of_resolved_samples_have_both_ends() {
    for depths in [Depths::Farthest, Depths::Nearest, Depths::Both, Depths::Receivers] {
        assert_eq!(wrong_levels(depths, &[]), 0, "{depths:?}");
    }
    // The nearest depth from the farthest samples, and background by the farthest sample.
    for (what, by, depths) in [
        ("nearest_sanitized4(near));", "nearest_sanitized4(far));", Depths::Both),
        ("RECEIVERS & is_background(near)", "RECEIVERS & is_background(far)", Depths::Receivers),
        ("sanitized_near(sample_bits(at, k))", "sanitized_near(sample_bits(at, 0))", Depths::Both),
    ] {
        assert!(wrong_levels(depths, &[(what, by)]) > 0, "{what} -> {by}: stayed green");
    }
}
