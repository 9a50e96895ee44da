//! The depth pyramid, bit for bit against the oracle's.
//! The oracle takes every texel directly from the image.

mod common;

use std::sync::Arc;

use common::{CONVENTIONS, Random, camera_along_z, depth_descriptor, engine, ndc};
use hiz_core::headless::DepthImage;
use hiz_core::yardstick::{PerLevelReduction, ReductionShape, submitted_ms};
use hiz_core::{
    AtlasUse, Bounds, CullOptions, DepthConvention, Floats, Footprint, ImageSize, InstanceOptions,
    MeshData, OccluderOptions, Outputs, Pyramid, PyramidOptions, StoredLevels, wgpu,
};

/// Every class of size that has broken a reduction.
/// There are single pixels, rows, columns, and sizes odd in one or both sides.
/// There are powers of two and their neighbours, primes, and common screens.
const SIZES: [(u32, u32); 34] = [
    (1, 1),
    (1, 2),
    (2, 1),
    (2, 2),
    (3, 1),
    (1, 3),
    (3, 3),
    (4, 4),
    (5, 3),
    (5, 5),
    (7, 1),
    (1, 17),
    (8, 8),
    (9, 7),
    (15, 16),
    (16, 17),
    (17, 9),
    (31, 33),
    (32, 1),
    (1, 100),
    (63, 64),
    (64, 64),
    (65, 63),
    (127, 129),
    (251, 241),
    (255, 257),
    (511, 3),
    (512, 256),
    (513, 511),
    (640, 360),
    (1001, 563),
    (1023, 1025),
    (1920, 1080),
    (2053, 7),
];

fn image(width: u32, height: u32, random: &mut Random) -> Vec<f32> {
    (0..width * height)
        .map(|_| match random.below(64) {
            0 => f32::from_bits(random.bits() as u32),
            1 => random.pick(&[
                0.0,
                -0.0,
                1.0,
                f32::NAN,
                -f32::NAN,
                f32::INFINITY,
                f32::NEG_INFINITY,
                -1e-40,
                1e-40,
                -0.5,
                1.5,
            ]),
            2 => f32::MIN_POSITIVE,
            3 => 1.0_f32.next_up(),
            _ => random.unit() as f32,
        })
        .collect()
}

fn check(
    width: u32,
    height: u32,
    depth: &[f32],
    convention: DepthConvention,
    options: &PyramidOptions,
) {
    let camera = camera_along_z(width, height, convention);
    for uploaded in
        [engine().upload_depth(depth, &camera), engine().upload_depth_sampled(depth, &camera)]
    {
        check_image(&uploaded.unwrap(), depth, convention, options);
    }
}

/// SwiftShader's compiler runs out of memory on a reduction over several chunks.
/// Its largest image, 8192 x 8192, needs one chunk.
fn only_one_chunk() -> bool {
    let swiftshader = engine().adapter().to_string().contains("SwiftShader");
    if swiftshader {
        eprintln!(
            "skipped: SwiftShader cannot compile a reduction over several chunks, \
             and its images need none"
        );
    }
    swiftshader
}

fn check_image(
    image: &DepthImage,
    depth: &[f32],
    convention: DepthConvention,
    options: &PyramidOptions,
) {
    let ImageSize { width, height } = image.size();
    let pyramid = engine().pyramid_with(image, options).unwrap();
    let expected = hiz_ref::pyramid(depth, width, height, convention.is_reversed());
    assert_eq!(pyramid.num_levels() as usize, expected.len(), "{width}x{height}");
    let top = expected.len() as u32 - 1;
    let asked = options.levels;
    for (k, level) in expected.iter().enumerate() {
        assert_eq!(pyramid.level_size(k as u32), Some(ImageSize::new(level.width, level.height)));
        if k > 0 && !(asked.first.min(top)..=asked.last.min(top)).contains(&(k as u32)) {
            let error = engine().read_level(&pyramid, k as u32).unwrap_err().to_string();
            assert!(
                error.contains("expected 0 or a stored level")
                    && error.ends_with(&format!("got {k}")),
                "{error}"
            );
            continue;
        }
        let texels = engine().read_level(&pyramid, k as u32).unwrap();
        let differing =
            texels.iter().zip(&level.texels).position(|(a, b)| a.to_bits() != b.to_bits());
        assert_eq!(texels.len(), level.texels.len());
        if let Some(i) = differing {
            panic!(
                "{width}x{height} {convention:?} {asked:?} level {k} texel ({}, {}): \
                 device {}, oracle {}",
                i as u32 % level.width,
                i as u32 / level.width,
                texels[i],
                level.texels[i]
            );
        }
    }
}

#[test]
fn every_size_is_bit_exact_in_both_conventions() {
    let mut random = Random(1);
    for (width, height) in SIZES {
        let depth = image(width, height, &mut random);
        for convention in CONVENTIONS {
            check(width, height, &depth, convention, &PyramidOptions::default());
        }
    }
}

/// All quads of numbers at which the treatment of a depth's bits changes.
/// They are the numbers on either side of each border, and depths between.
#[test]
fn four_of_any_kind_have_the_farthest_of_their_depths() {
    let special = [
        0,           // 0
        0x0000_0001, // the least subnormal
        0x007f_ffff, // the greatest
        0x0080_0000, // the least depth above 0
        0x3e80_0000, // 0.25
        0x3f00_0000, // 0.5
        0x3f80_0000, // 1
        0x3f80_0001, // past it
        0x7f80_0000, // infinity
        0x7fff_ffff, // NaN, the greatest without a sign
        0x8000_0000, // -0
        0x8000_0001, // the least with a sign that counts
        0xffff_ffff, // NaN, the greatest
    ]
    .map(f32::from_bits);
    let n = special.len() as u32;
    let side = 2 * n * n;
    let depth: Vec<f32> = (0..side * side)
        .map(|i| {
            let (x, y) = (i % side, i / side);
            // The pair of a column of quads, and the pair of a row of them.
            let pair = if y % 2 == 0 { x / 2 } else { y / 2 };
            special[(if x % 2 == 0 { pair % n } else { pair / n }) as usize]
        })
        .collect();
    for convention in CONVENTIONS {
        check(side, side, &depth, convention, &PyramidOptions::default());
    }
}

#[test]
fn random_small_sizes_are_bit_exact() {
    let mut random = Random(2);
    for _ in 0..150 {
        let (width, height) = (1 + random.below(70), 1 + random.below(70));
        let depth = image(width, height, &mut random);
        check(width, height, &depth, random.pick(&CONVENTIONS), &PyramidOptions::default());
    }
}

/// Every choice of levels, by both shaders, including the seams between them.
/// A pass makes up to three levels, or one coarse level.
/// A coarse level has one invocation or one workgroup per texel.
/// Further passes continue from there.
#[test]
fn chosen_levels_are_bit_exact() {
    let mut random = Random(4);
    let sizes = [
        (1, 1),
        (2, 2),
        (1, 37),
        (41, 1),
        (17, 16),
        (31, 33),
        (127, 129),
        (251, 241),
        (1, 3001),
        (1023, 517),
    ];
    for (number, (width, height)) in sizes.into_iter().enumerate() {
        let depth = image(width, height, &mut random);
        for first in 1..=11 {
            let convention = CONVENTIONS[(number + first as usize) % 2];
            for last in [first, first + 1, first + 4, 15] {
                let levels = StoredLevels { first, last };
                check(
                    width,
                    height,
                    &depth,
                    convention,
                    &PyramidOptions { levels, ..PyramidOptions::default() },
                );
            }
        }
    }
}

#[test]
fn levels_that_make_no_sense_are_refused() {
    let camera = camera_along_z(8, 8, DepthConvention::Standard);
    for (first, last) in [(0, 3), (3, 2), (16, 16), (1, 16), (u32::MAX, u32::MAX)] {
        let options =
            PyramidOptions { levels: StoredLevels { first, last }, ..PyramidOptions::default() };
        let error =
            engine().context().create_pyramid(camera.size(), &options).unwrap_err().to_string();
        assert!(error.starts_with("levels: expected 1 <= first <= last <= 15"), "{error}");
    }
}

/// The yardsticks of the reduction do the same work: all their levels are equal to ours.
#[test]
fn the_yardsticks_have_the_same_levels() {
    let mut random = Random(6);
    for (width, height) in [(64, 64), (77, 41), (1, 19), (130, 3)] {
        let depth = image(width, height, &mut random);
        for convention in CONVENTIONS {
            let uploaded =
                engine().upload_depth(&depth, &camera_along_z(width, height, convention)).unwrap();
            let pyramid = engine().pyramid(&uploaded).unwrap();
            for shape in [ReductionShape::Buffer, ReductionShape::Textures] {
                let reduction = PerLevelReduction::new(&engine(), &uploaded, shape).unwrap();
                submitted_ms(&engine(), |encoder| {
                    reduction.record(encoder);
                    Ok(())
                })
                .unwrap();
                for k in 1..pyramid.num_levels() {
                    let ours = engine().read_level(&pyramid, k).unwrap();
                    assert_eq!(
                        reduction.read(&engine(), k as usize).unwrap(),
                        ours,
                        "{shape:?} level {k}"
                    );
                }
            }
        }
    }
}

/// A level larger than one binding is split; small chunks stand in for large images.
#[test]
fn split_pyramids_are_bit_exact() {
    if only_one_chunk() {
        return;
    }
    let mut random = Random(3);
    for (width, height) in [(64, 64), (64, 72), (77, 41), (130, 129)] {
        let depth = image(width, height, &mut random);
        for convention in CONVENTIONS {
            let pyramid = engine()
                .context()
                .create_pyramid(ImageSize::new(width, height), &PyramidOptions::default());
            let texels = pyramid.unwrap().device_bytes() / 4;
            // Two chunks and, where they are enough, three.
            let two = (texels - 1).ilog2();
            for chunk_shift in [two, two - 1].into_iter().filter(|s| texels <= 3 << s) {
                check(
                    width,
                    height,
                    &depth,
                    convention,
                    &PyramidOptions { chunk_shift: Some(chunk_shift), ..PyramidOptions::default() },
                );
            }
        }
    }
}

/// A single far pixel at each border must reach the top.
/// A dropped row or column is reported by its place here.
#[test]
fn no_border_pixel_is_dropped() {
    for (width, height) in [(5, 5), (7, 3), (9, 9), (33, 17), (100, 75)] {
        for (x, y) in [
            (0, 0),
            (width - 1, 0),
            (0, height - 1),
            (width - 1, height - 1),
            (width - 1, height / 2),
        ] {
            for convention in CONVENTIONS {
                let near = if convention.is_reversed() { 0.75 } else { 0.25 };
                let mut depth = vec![near; (width * height) as usize];
                depth[(y * width + x) as usize] = 0.5;
                let camera = camera_along_z(width, height, convention);
                let uploaded = engine().upload_depth(&depth, &camera).unwrap();
                let pyramid = engine().pyramid(&uploaded).unwrap();
                let top = engine().read_level(&pyramid, pyramid.num_levels() - 1).unwrap();
                assert_eq!(top, [0.5], "{width}x{height} pixel ({x}, {y}) {convention:?}");
            }
        }
    }
}

#[test]
fn limits_are_named() {
    let side = engine().max_image_side() + 1;
    let camera = camera_along_z(side.min(32_768), 1, DepthConvention::Standard);
    if side <= 32_768 {
        let error = engine().upload_depth(&vec![0.0; side as usize], &camera).unwrap_err();
        assert!(error.to_string().contains("max_texture_dimension_2d: requested"), "{error}");
    }
    let depth = engine()
        .upload_depth(&[0.0; 4096], &camera_along_z(64, 64, DepthConvention::Standard))
        .unwrap();
    let error = engine()
        .pyramid_with(&depth, &PyramidOptions { chunk_shift: Some(4), ..PyramidOptions::default() })
        .unwrap_err();
    assert!(error.to_string().contains("pyramid texels: requested"), "{error}");
}

/// Random triangles in front of a camera along z.
fn triangles(random: &mut Random) -> MeshData<'static> {
    let vertices: Vec<f32> = (0..40)
        .flat_map(|_| {
            let z = 3.0 + 9.0 * random.unit();
            let (x, y) = (z * (2.0 * random.unit() - 1.0), z * (2.0 * random.unit() - 1.0));
            (0..3)
                .flat_map(|_| [x + 3.0 * random.unit(), y + 3.0 * random.unit(), z])
                .collect::<Vec<_>>()
        })
        .map(|v| v as f32)
        .collect();
    let indices: Vec<u32> = (0..120).collect();
    MeshData { vertices: Floats::F32(vertices.leak()), triangles: indices.leak(), transforms: None }
}

/// Culls that read all levels from an atlas give the same results as those that read them in place.
/// This holds for each kind of depth image, and after the next reduction.
#[test]
fn an_atlas_culls_alike_and_follows_the_next_reduction() {
    let mut random = Random(9);
    let centers: Vec<f32> = (0..4000)
        .flat_map(|_| {
            let z = 1.0 + 30.0 * random.unit() as f32;
            [z * (2.0 * random.unit() as f32 - 1.0), z * (2.0 * random.unit() as f32 - 1.0), z]
        })
        .collect();
    let radii: Vec<f32> = (0..4000).map(|_| 0.5 * random.unit() as f32).collect();
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    for ((width, height), levels) in [
        ((131, 115), StoredLevels::ALL),
        ((64, 7), StoredLevels::ALL),
        ((3, 90), StoredLevels::ALL),
        ((130, 63), StoredLevels { first: 2, last: 4 }),
        ((129, 61), StoredLevels::only(3)),
    ] {
        for convention in CONVENTIONS {
            let camera = camera_along_z(width, height, convention);
            let mut wall =
                || if random.below(40) == 0 { 1e6 } else { 4.0 + 8.0 * random.unit() as f32 };
            let depth: Vec<f32> = (0..width * height).map(|_| ndc(wall(), convention)).collect();
            let occluders =
                engine().occluders(&[triangles(&mut random)], &OccluderOptions::default()).unwrap();
            let images = [
                engine().upload_depth(&depth, &camera).unwrap(),
                engine().upload_depth_sampled(&depth, &camera).unwrap(),
                engine().render_depth(&occluders, &camera).unwrap(),
            ];
            let pyramids = [AtlasUse::Never, AtlasUse::Always].map(|atlas| {
                let options = PyramidOptions { atlas, levels, ..PyramidOptions::default() };
                Arc::new(engine().context().create_pyramid(camera.size(), &options).unwrap())
            });
            let mut seen = Vec::new();
            for depth in [&images[0], &images[1], &images[2], &images[0]] {
                let view = depth.texture().create_view(&wgpu::TextureViewDescriptor::default());
                let verdicts = pyramids.each_ref().map(|pyramid| {
                    let mut encoder = engine()
                        .device()
                        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    engine()
                        .context()
                        .record_reduce(&mut encoder, &view, &camera, pyramid)
                        .unwrap();
                    engine().queue().submit([encoder.finish()]);
                    let cull = |options: &CullOptions| {
                        let output = Outputs::default();
                        engine()
                            .cull(&instances, &camera, pyramid, options, &output)
                            .unwrap()
                            .verdicts()
                            .unwrap()
                    };
                    let wide = CullOptions {
                        footprint: Footprint::Four,
                        descent: 16,
                        ..CullOptions::default()
                    };
                    [cull(&CullOptions::default()), cull(&wide)]
                });
                assert!(verdicts[0] == verdicts[1], "{width}x{height} {convention:?}");
                seen.push(verdicts[0].clone());
            }
            assert!(pyramids[1].device_bytes() > pyramids[0].device_bytes(), "nothing was copied");
            assert!(seen[0] == seen[1] && seen[0] == seen[3], "the same depths");
            assert!(seen[0] != seen[2], "each image hides others");
        }
    }
}

/// A depth image that cannot be copied from is read in place, and so are several chunks.
#[test]
fn without_an_atlas_culls_go_on() {
    let camera = camera_along_z(64, 64, DepthConvention::Standard);
    let usage = wgpu::TextureUsages::TEXTURE_BINDING;
    let descriptor = depth_descriptor((64, 64), wgpu::TextureFormat::R32Float, usage);
    let uncopied = engine().device().create_texture(&descriptor);
    let near = engine().upload_depth_sampled(&[0.0; 64 * 64], &camera).unwrap();
    let bounds =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    let one_chunk_only = only_one_chunk();
    for (texture, chunk_shift) in [(&uncopied, None), (near.texture(), Some(11))] {
        if one_chunk_only && chunk_shift.is_some() {
            continue;
        }
        let options =
            PyramidOptions { atlas: AtlasUse::Always, chunk_shift, ..PyramidOptions::default() };
        let pyramid = Arc::new(engine().context().create_pyramid(camera.size(), &options).unwrap());
        let bytes = pyramid.device_bytes();
        let mut encoder =
            engine().device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        engine().context().record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
        engine().queue().submit([encoder.finish()]);
        let (options, output) = (CullOptions::default(), Outputs::default());
        let mask = engine()
            .cull(&instances, &camera, &pyramid, &options, &output)
            .unwrap()
            .mask()
            .unwrap();
        assert_eq!(
            (mask, pyramid.device_bytes()),
            (vec![false], bytes),
            "all depths are 0, the nearest"
        );
    }
}

/// What was recorded may never run.
/// A copy that was dropped, or that was made before its reduction, must not be used.
#[test]
fn a_copy_that_never_ran_is_made_again() {
    let camera = camera_along_z(32, 24, DepthConvention::Reversed);
    let wall =
        engine().upload_depth(&[ndc(4.0, DepthConvention::Reversed); 32 * 24], &camera).unwrap();
    let bounds = Bounds::Spheres {
        centers: Floats::F32(&[0.0, 0.0, 8.0].repeat(5000)),
        radii: Floats::F32(&[0.1; 5000]),
    };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    let context = engine().context().clone();
    let view = wall.texture().create_view(&wgpu::TextureViewDescriptor::default());
    let encoder =
        || engine().device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let kept = |pyramid: &Arc<Pyramid>| {
        let (options, output) = (CullOptions::default(), Outputs::default());
        let culling = engine().cull(&instances, &camera, pyramid, &options, &output).unwrap();
        culling.mask().unwrap().iter().filter(|kept| **kept).count()
    };
    // A cull whose encoder was dropped.
    let pyramid = engine().pyramid(&wall).unwrap();
    let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
    context
        .record_cull(
            &mut encoder(),
            &instances,
            &camera,
            &pyramid,
            &visible,
            &CullOptions::default(),
        )
        .unwrap();
    assert_eq!(kept(&pyramid), 0);
    // A cull before its reduction.
    let early =
        Arc::new(context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap());
    let mut reduction = encoder();
    context.record_reduce(&mut reduction, &view, &camera, &early).unwrap();
    assert_eq!(kept(&early), 5000, "the reduction has not run");
    engine().queue().submit([reduction.finish()]);
    assert_eq!(kept(&early), 0);
    // A cull that was refused.
    let refused =
        CullOptions { transform_slack: 1e6, guard_px: Some(0.3), ..CullOptions::default() };
    let fresh = engine().pyramid(&wall).unwrap();
    assert!(engine().cull(&instances, &camera, &fresh, &refused, &Outputs::default()).is_err());
    assert_eq!(kept(&fresh), 0);
}
