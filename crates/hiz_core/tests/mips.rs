//! Mip textures against their definition, bit for bit, and what shaders read of them.

mod common;

#[path = "common/sources.rs"]
#[allow(dead_code, reason = "depth textures alone")]
mod sources;

use common::{CONVENTIONS, Random, camera_along_z, engine};
use hiz_core::headless::Engine;
use hiz_core::wgpu::{self, util::DeviceExt, util::DownloadBuffer};
use hiz_core::{
    DepthConvention, DepthSource, ImageSize, MIP_LOOKUP, MipDepths, MipLayout, MipLookup,
    MipOptions, MipTexture,
};

const DEPTHS: [MipDepths; 3] = [MipDepths::Farthest, MipDepths::Nearest, MipDepths::Both];
const LOOKUPS: [MipLookup; 2] = [MipLookup::Normalized, MipLookup::EdgeTexel];

/// Single pixels, rows, columns, primes, powers of two and their neighbours.
/// The last ones have levels that are too large for one workgroup.
const SIZES: [(u32, u32); 60] = [
    (1, 1),
    (1, 2),
    (2, 1),
    (1, 3),
    (3, 1),
    (2, 2),
    (3, 3),
    (1, 5),
    (5, 1),
    (4, 3),
    (3, 4),
    (5, 5),
    (6, 7),
    (7, 6),
    (7, 7),
    (8, 8),
    (9, 9),
    (9, 8),
    (8, 9),
    (10, 11),
    (1, 64),
    (64, 1),
    (1, 65),
    (65, 1),
    (1, 130),
    (130, 1),
    (2, 131),
    (131, 2),
    (11, 13),
    (13, 17),
    (15, 15),
    (16, 16),
    (17, 17),
    (31, 33),
    (33, 31),
    (32, 20),
    (37, 23),
    (47, 61),
    (63, 64),
    (64, 63),
    (65, 65),
    (96, 72),
    (97, 73),
    (100, 60),
    (101, 103),
    (120, 67),
    (127, 127),
    (128, 128),
    (129, 129),
    (130, 130),
    (160, 90),
    (255, 257),
    (256, 255),
    (301, 17),
    (3, 1000),
    (1001, 5),
    (640, 360),
    (521, 373),
    (1366, 91),
    (480, 270),
];

/// Numbers that are no depth, and two that become 0.
const ODD: [f32; 10] = [
    f32::NAN,
    -f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -0.5,
    1.5,
    f32::from_bits(0x3f80_0001),
    -1e-40,
    -0.0,
    1e-40,
];

/// Random depths, where one in `every` is an odd one.
fn image(random: &mut Random, size: ImageSize, every: u32) -> Vec<f32> {
    let pixel = |_| {
        if random.below(every) == 0 { random.pick(&ODD) } else { random.unit() as f32 }
    };
    (0..size.pixels()).map(pixel).collect()
}

/// What a pixel counts as: its farthest and its nearest depth.
fn ends_of(depth: f32, convention: DepthConvention) -> [f32; 2] {
    if (0.0..=1.0).contains(&depth) {
        let flushed = if depth < f32::MIN_POSITIVE { 0.0 } else { depth };
        return [flushed; 2];
    }
    let far = convention.far();
    [far, 1.0 - far]
}

fn farther(a: f32, b: f32, convention: DepthConvention) -> f32 {
    if convention.is_reversed() { a.min(b) } else { a.max(b) }
}

fn joined(a: [f32; 2], b: [f32; 2], convention: DepthConvention) -> [f32; 2] {
    let other = if convention.is_reversed() {
        DepthConvention::Standard
    } else {
        DepthConvention::Reversed
    };
    [farther(a[0], b[0], convention), farther(a[1], b[1], other)]
}

/// All levels by definition, as pairs of both ends.
fn levels(
    image: &[f32],
    size: ImageSize,
    lookup: MipLookup,
    convention: DepthConvention,
) -> Vec<Vec<[f32; 2]>> {
    let pixels: Vec<_> = image.iter().map(|d| ends_of(*d, convention)).collect();
    let (mut found, mut before) = (vec![pixels.clone()], (size.width, size.height));
    for k in 1.. {
        if before == (1, 1) {
            break;
        }
        let now = ((size.width >> k).max(1), (size.height >> k).max(1));
        let mut level = vec![None; (now.0 * now.1) as usize];
        let mut add = |x: u32, y: u32, ends: [f32; 2]| {
            let texel: &mut Option<[f32; 2]> = &mut level[(y * now.0 + x) as usize];
            *texel = Some(texel.map_or(ends, |old| joined(old, ends, convention)));
        };
        match lookup {
            // Each pixel goes into one texel.
            MipLookup::EdgeTexel => {
                for y in 0..size.height {
                    for x in 0..size.width {
                        let pixel = pixels[(y * size.width + x) as usize];
                        add((x >> k).min(now.0 - 1), (y >> k).min(now.1 - 1), pixel);
                    }
                }
            }
            // Two texels of the level before, or three where its size is odd.
            MipLookup::Normalized => {
                let taps = |i: u32, n: u32| {
                    if n == 1 { 0..=0 } else { 2 * i..=2 * i + 1 + n % 2 }
                };
                let texels = found.last().expect("level 0");
                for y in 0..now.1 {
                    for x in 0..now.0 {
                        for row in taps(y, before.1) {
                            for column in taps(x, before.0) {
                                add(x, y, texels[(row * before.0 + column) as usize]);
                            }
                        }
                    }
                }
            }
        }
        found.push(level.into_iter().map(|texel| texel.expect("it has pixels")).collect());
        before = now;
    }
    found
}

/// The bits of a level as the texture holds it.
fn chosen(level: &[[f32; 2]], depths: MipDepths) -> Vec<u32> {
    let of_texel = |ends: &[f32; 2]| match depths {
        MipDepths::Farthest => vec![ends[0].to_bits()],
        MipDepths::Nearest => vec![ends[1].to_bits()],
        MipDepths::Both => ends.map(f32::to_bits).to_vec(),
    };
    level.iter().flat_map(of_texel).collect()
}

/// How many levels of a mip texture differ from the definition.
fn differing(
    engine: &Engine,
    mips: &MipTexture,
    image: &[f32],
    convention: DepthConvention,
) -> usize {
    let MipOptions { depths, lookup, .. } = mips.options();
    let expected = levels(image, mips.size(), lookup, convention);
    assert_eq!(mips.num_levels() as usize, expected.len());
    let differs = |k: &u32| {
        let read = engine.read_mip(mips, *k).unwrap();
        let read: Vec<_> = read.into_iter().map(f32::to_bits).collect();
        read != chosen(&expected[*k as usize], depths)
    };
    (mips.first_level()..mips.num_levels()).filter(differs).count()
}

/// Fills a mip texture from `depth`.
fn made<'a>(
    engine: &Engine,
    depth: impl Into<DepthSource<'a>>,
    (size, convention): (ImageSize, DepthConvention),
    options: &MipOptions,
) -> MipTexture {
    let hiz = engine.context();
    let mips = hiz.create_mip_texture(size, options).unwrap();
    let mut encoder = engine.device().create_command_encoder(&Default::default());
    hiz.record_mips(&mut encoder, depth, convention, &mips).unwrap();
    engine.queue().submit([encoder.finish()]);
    mips
}

/// How many of all levels of an image differ, in each way to store them, and in how many ways.
/// `at_first`: the first way with a difference ends it.
fn differing_of_size(
    engine: &Engine,
    (width, height): (u32, u32),
    seed: u64,
    at_first: bool,
) -> (usize, usize) {
    let (size, mut random) = (ImageSize::new(width, height), Random(seed));
    let (mut wrong, mut made_so_far) = (0, 0);
    for convention in CONVENTIONS {
        let camera = camera_along_z(width, height, convention);
        // In the larger ones of few odd pixels, levels are not all far or near.
        let image = image(&mut random, size, if seed.is_multiple_of(2) { 7 } else { 500 });
        let upload = engine.upload_depth(&image, &camera).unwrap();
        let sampled = engine.upload_depth_sampled(&image, &camera).unwrap();
        for (depths, lookup) in DEPTHS.into_iter().flat_map(|d| LOOKUPS.map(|l| (d, l))) {
            let level_0 = random.below(2) == 0;
            let layout = random.pick(&[MipLayout::Levels, MipLayout::Atlas]);
            let options = MipOptions { depths, lookup, level_0, layout };
            let texture = if made_so_far % 2 == 0 { upload.texture() } else { sampled.texture() };
            let mips = made(engine, texture, (size, convention), &options);
            wrong += differing(engine, &mips, &image, convention);
            made_so_far += 1;
            if at_first && wrong > 0 {
                return (wrong, made_so_far);
            }
        }
    }
    (wrong, made_so_far)
}

#[test]
fn levels_are_those_of_the_definition() {
    let engine = engine();
    let (mut wrong, mut made) = (0, 0);
    for (seed, size) in (0..).zip(SIZES) {
        let (differ, count) = differing_of_size(&engine, size, seed, false);
        assert_eq!(differ, 0, "{size:?}");
        wrong += differ;
        made += count;
    }
    println!("{} sizes, {made} mip textures, {wrong} levels differ", SIZES.len());
    assert_eq!(made, 720);
}

/// Depth textures, and parts of textures whose other pixels are as far and as near as can be.
#[test]
fn depth_textures_and_parts_have_the_same_levels() {
    let engine = engine();
    let (width, height) = (203, 121);
    let (mut random, whole) = (Random(3), ImageSize::new(width, height));
    for convention in CONVENTIONS {
        let depth: Vec<f32> = (0..whole.pixels()).map(|_| random.unit() as f32).collect();
        let drawn = sources::drawn(&engine, (width, height), &depth);
        let camera = camera_along_z(width, height, convention);
        for (origin, size) in [([0, 0], (203, 121)), ([17, 5], (101, 67)), ([3, 2], (64, 90))] {
            let [x, y] = origin;
            let mut around: Vec<f32> = (0..whole.pixels()).map(|i| (i % 2) as f32).collect();
            let mut part = Vec::new();
            for row in y..y + size.1 {
                let first = (row * width + x) as usize;
                let pixels = first..first + size.0 as usize;
                around[pixels.clone()].copy_from_slice(&depth[pixels.clone()]);
                part.extend_from_slice(&depth[pixels]);
            }
            let sampled = engine.upload_depth_sampled(&around, &camera).unwrap();
            let size = ImageSize::new(size.0, size.1);
            for (depths, lookup) in DEPTHS.into_iter().flat_map(|d| LOOKUPS.map(|l| (d, l))) {
                let options = MipOptions { depths, lookup, level_0: true, ..Default::default() };
                for texture in [&drawn, sampled.texture()] {
                    let source =
                        DepthSource { origin, size: Some(size), ..DepthSource::from(texture) };
                    let mips = made(&engine, source, (size, convention), &options);
                    let wrong = differing(&engine, &mips, &part, convention);
                    assert_eq!(wrong, 0, "{size} at {origin:?}, {options:?}");
                }
            }
        }
    }
}

/// A mip texture can be filled again, from another image.
#[test]
fn a_mip_texture_follows_its_image() {
    let engine = engine();
    let (size, mut random) = (ImageSize::new(150, 77), Random(8));
    let camera = camera_along_z(150, 77, DepthConvention::Reversed);
    let options = MipOptions { depths: MipDepths::Both, level_0: true, ..Default::default() };
    let mips = engine.context().create_mip_texture(size, &options).unwrap();
    for convention in CONVENTIONS {
        let depth = image(&mut random, size, 100);
        let upload = engine.upload_depth(&depth, &camera).unwrap();
        let mut encoder = engine.device().create_command_encoder(&Default::default());
        let hiz = engine.context();
        hiz.record_mips(&mut encoder, upload.texture(), convention, &mips).unwrap();
        engine.queue().submit([encoder.finish()]);
        assert_eq!(differing(&engine, &mips, &depth, convention), 0);
    }
    let pyramid = engine.pyramid(&engine.upload_depth(&[0.5; 150 * 77], &camera).unwrap()).unwrap();
    let of_pyramid = engine.mips(&pyramid, &options).unwrap();
    assert_eq!(differing(&engine, &of_pyramid, &[0.5; 150 * 77], DepthConvention::Reversed), 0);
}

/// Sizes with odd levels of both kinds of steps, and one with steps of three levels.
const FAULT_SIZES: [(u32, u32); 3] = [(255, 255), (480, 270), (521, 373)];

/// Planted faults, each of which changes levels.
#[test]
fn planted_faults_change_levels() {
    let faults = [
        ("return !EDGE_TEXEL || i + 1u == n;", "return false;"),
        ("return !EDGE_TEXEL || i + 1u == n;", "return !EDGE_TEXEL;"),
        ("return joined_rows(of_pair, third);", "return of_pair;"),
        ("vec4<u32>(left.z, right.x, right.z, ninth)", "vec4<u32>(left.z, right.xz, right.w)"),
        ("column <= last.x;", "column <= last.x - u32(third.x && row == first.y + 2u);"),
        ("return select(sanitized(bits), near_bits(), outside);", "return sanitized(bits);"),
        ("nearest_each(a.near, b.near)", "a.near"),
        ("let bottom = halved(c, d);", "let bottom = halved(c, c);"),
        ("let y = step.first + row;", "let y = row;"),
    ];
    for fault in faults {
        let engine = Engine::with_planted_faults(None, &[fault]).unwrap();
        // The first size that shows the fault will do.
        let of_size = |(seed, size)| differing_of_size(&engine, size, seed, true).0;
        let mut wrong = (11..).zip(FAULT_SIZES).map(of_size);
        let wrong = wrong.find(|wrong| *wrong > 0).unwrap_or(0);
        println!("{wrong} levels differ with {}", fault.1);
        assert!(wrong > 0, "{fault:?}");
    }
}

/// What is read at one place of one level.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Probe {
    at: [f32; 2],
    pixel: [u32; 2],
    level: u32,
    padding: u32,
}

/// Neighbouring invocations ask for different levels.
const PROBES: &str = "
struct Probe { at: vec2<f32>, pixel: vec2<u32>, level: u32, padding: u32 }
@group(0) @binding(0) var mips: texture_2d<f32>;
@group(0) @binding(1) var nearest_texel: sampler;
@group(0) @binding(2) var<storage, read> probes: array<Probe>;
@group(0) @binding(3) var<storage, read_write> found: array<vec4<f32>>;
@group(0) @binding(4) var<uniform> size: vec4<u32>;
fn texel(at: vec2<u32>, level: u32) -> f32 { return textureLoad(mips, at, level).x; }
@compute @workgroup_size(64) fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= size.z { return; }
    let p = probes[id.x];
    found[id.x] = vec4<f32>(
        textureSampleLevel(mips, nearest_texel, p.at, f32(p.level)).x,
        texel(mip_texel_at(p.at, p.level, size.xy), p.level),
        texel(mip_centre_texel(p.pixel, p.level, size.xy), p.level),
        texel(mip_edge_texel(p.pixel, p.level, size.xy), p.level));
}";

fn read(engine: &Engine, buffer: &wgpu::Buffer) -> Vec<u8> {
    let (told, answer) = std::sync::mpsc::channel();
    DownloadBuffer::read_buffer(engine.device(), engine.queue(), &buffer.slice(..), move |bytes| {
        told.send(bytes.expect("a small buffer can be read").to_vec()).expect("it is waited for");
    });
    engine.wait().unwrap();
    answer.recv().unwrap()
}

/// Runs [`PROBES`] with these functions for finding texels.
fn probed(engine: &Engine, lookup: &str, mips: &MipTexture, probes: &[Probe]) -> Vec<[f32; 4]> {
    let device = engine.device();
    let source = wgpu::ShaderSource::Wgsl(format!("{lookup}\n{PROBES}").into());
    let descriptor = wgpu::ShaderModuleDescriptor { label: None, source };
    let module = device.create_shader_module(descriptor);
    let visibility = wgpu::ShaderStages::COMPUTE;
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    // Neither format can be filtered by default.
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[
            entry(0, texture),
            entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::NonFiltering)),
            entry(2, buffer(wgpu::BufferBindingType::Storage { read_only: true })),
            entry(3, buffer(wgpu::BufferBindingType::Storage { read_only: false })),
            entry(4, buffer(wgpu::BufferBindingType::Uniform)),
        ],
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        })),
        module: &module,
        entry_point: Some("probe"),
        compilation_options: Default::default(),
        cache: None,
    });
    let filled = |contents: &[u8], usage| {
        let descriptor = wgpu::util::BufferInitDescriptor { label: None, contents, usage };
        device.create_buffer_init(&descriptor)
    };
    let out = vec![0_u8; 16 * probes.len()];
    let out = filled(&out, wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let size = [mips.size().width, mips.size().height, probes.len() as u32, 0];
    let size = filled(bytemuck::bytes_of(&size), wgpu::BufferUsages::UNIFORM);
    let probes_in = filled(bytemuck::cast_slice(probes), wgpu::BufferUsages::STORAGE);
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor::default());
    let bound = |binding, resource| wgpu::BindGroupEntry { binding, resource };
    let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layout,
        entries: &[
            bound(0, wgpu::BindingResource::TextureView(mips.view())),
            bound(1, wgpu::BindingResource::Sampler(&sampler)),
            bound(2, probes_in.as_entire_binding()),
            bound(3, out.as_entire_binding()),
            bound(4, size.as_entire_binding()),
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bound, &[]);
    pass.dispatch_workgroups(probes.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    engine.queue().submit([encoder.finish()]);
    bytemuck::pod_collect_to_vec(&read(engine, &out))
}

/// Coordinates at the borders of texels, and some float32 steps beside them.
fn coordinates(random: &mut Random, n: u32) -> f32 {
    let level = (n >> random.below(12)).max(1);
    let border = (f64::from(random.below(level + 1)) / f64::from(level)) as f32;
    let steps = i64::from(random.below(7)) - 3;
    let bits = (i64::from(border.to_bits()) + steps).clamp(0, 0x3f7f_ffff);
    f32::from_bits(bits as u32)
}

const PROBED_SIZES: [(u32, u32); 6] = [(1023, 77), (640, 361), (130, 129), (97, 1), (5, 7), (1, 1)];

/// How many probes differ from the formulas, by the four ways to read.
fn wrong_probes(engine: &Engine, functions: &str) -> ([usize; 4], usize) {
    let (mut random, mut wrong, mut count) = (Random(21), [0; 4], 0);
    for (width, height) in PROBED_SIZES {
        let (size, convention) = (ImageSize::new(width, height), DepthConvention::Standard);
        let camera = camera_along_z(width, height, convention);
        // The later a pixel, the farther it is: no two texels of a level are alike.
        let steps = (width * height) as f32;
        let depth: Vec<f32> = (0..width * height).map(|i| (i + 1) as f32 / (steps + 1.0)).collect();
        let upload = engine.upload_depth(&depth, &camera).unwrap();
        let num_levels = width.max(height).ilog2() + 1;
        let probes: Vec<_> = (0..4000)
            .map(|i| Probe {
                at: [coordinates(&mut random, width), coordinates(&mut random, height)],
                pixel: [random.below(width), random.below(height)],
                level: (i + random.below(2)) % num_levels,
                padding: 0,
            })
            .collect();
        let side = |n: u32, level: u32| (n >> level).max(1);
        for lookup in LOOKUPS {
            let options = MipOptions { lookup, level_0: true, ..MipOptions::default() };
            let mips = made(engine, upload.texture(), (size, convention), &options);
            let expected = levels(&depth, size, lookup, convention);
            for (probe, found) in probes.iter().zip(probed(engine, functions, &mips, &probes)) {
                let k = probe.level;
                let texel = |at: [u32; 2]| {
                    expected[k as usize][(at[1] * side(width, k) + at[0]) as usize][0]
                };
                let each =
                    |f: &dyn Fn(usize, u32) -> u32| [f(0, side(width, k)), f(1, side(height, k))];
                let n = [width, height];
                let by_coordinates =
                    texel(each(&|i, m| ((probe.at[i] * m as f32).floor() as u32).min(m - 1)));
                let by_centre = texel(each(&|i, m| {
                    ((2 * u64::from(probe.pixel[i]) + 1) * u64::from(m) / (2 * u64::from(n[i])))
                        as u32
                }));
                let by_edge = texel(each(&|i, m| (probe.pixel[i] >> k).min(m - 1)));
                let formulas = [by_coordinates, by_coordinates, by_centre, by_edge];
                for (wrong, (found, formula)) in wrong.iter_mut().zip(found.iter().zip(formulas)) {
                    *wrong += usize::from(found.to_bits() != formula.to_bits());
                }
                count += 1;
            }
        }
    }
    (wrong, count)
}

/// A sampler with nearest filtering and the functions for shaders take the same texels as the
/// formulas.
#[test]
fn samplers_and_functions_find_the_texels() {
    let engine = engine();
    let (wrong, count) = wrong_probes(&engine, MIP_LOOKUP);
    println!("{}: {count} probes, {wrong:?} wrong", engine.adapter());
    assert_eq!(wrong, [0; 4]);
    assert_eq!(count, 48_000);
}

/// Sizes rounded up, and pixels that are not held at the last texel.
#[test]
fn planted_faults_find_other_texels() {
    let engine = engine();
    let halved = "max(size >> vec2<u32>(level), vec2<u32>(1u))";
    let faults = [
        (halved, "((size - vec2<u32>(1u)) >> vec2<u32>(level)) + vec2<u32>(1u)"),
        ("min(pixel >> vec2<u32>(level), ", "max(pixel >> vec2<u32>(level), "),
        ("(2u * pixel + vec2<u32>(1u))", "(2u * pixel)"),
    ];
    for (what, by) in faults {
        assert!(MIP_LOOKUP.contains(what), "{what}");
        let (wrong, _) = wrong_probes(&engine, &MIP_LOOKUP.replace(what, by));
        println!("{wrong:?} wrong with {by}");
        assert!(wrong.iter().any(|n| *n > 0), "{by}");
    }
    // What the page about shaders warns of; lavapipe gives all lanes the first one's size.
    let asked = MIP_LOOKUP.replace(halved, "textureDimensions(mips, level)");
    let (wrong, _) = wrong_probes(&engine, &asked);
    println!("{}: {wrong:?} wrong with textureDimensions of a level", engine.adapter());
    if engine.adapter().to_string().contains("llvmpipe") {
        assert!(wrong.iter().sum::<usize>() > 1000, "{wrong:?}");
    }
}

#[test]
fn errors_name_what_is_wrong() {
    let engine = engine();
    let hiz = engine.context();
    let create = |width, height| {
        let size = ImageSize::new(width, height);
        hiz.create_mip_texture(size, &MipOptions::default()).unwrap_err().to_string()
    };
    assert!(
        create(0, 4).starts_with("size: expected at least one pixel a side"),
        "{}",
        create(0, 4)
    );
    assert!(create(1 << 20, 4).contains("max_texture_dimension_2d"), "{}", create(1 << 20, 4));
    let mips = hiz.create_mip_texture(ImageSize::new(8, 4), &MipOptions::default()).unwrap();
    let error = engine.read_mip(&mips, 0).unwrap_err().to_string();
    assert_eq!(error, "level: expected 1 <= level < 4, got 0");
    let camera = camera_along_z(8, 5, DepthConvention::Standard);
    let depth = engine.upload_depth(&[0.5; 40], &camera).unwrap();
    let mut encoder = engine.device().create_command_encoder(&Default::default());
    let error = hiz
        .record_mips(&mut encoder, depth.texture(), DepthConvention::Standard, &mips)
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("depth: expected the mip texture's size (height 4, width 8)"),
        "{error}"
    );
    let other = Engine::new(None).unwrap();
    let mut encoder = other.device().create_command_encoder(&Default::default());
    let error = other
        .context()
        .record_mips(&mut encoder, depth.texture(), DepthConvention::Standard, &mips)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("mips: expected an object of this device"), "{error}");
}
