//! Both ends of the pyramid: the farthest and the nearest depth of every block, bit for bit.
//! The expectations are plain loops over the pixels of each block.

mod common;
#[path = "common/sources.rs"]
mod sources;

use common::{BLOCK_SIZES, CONVENTIONS, Random, camera_along_z, engine};
use hiz_core::headless::Engine;
use hiz_core::{
    DepthConvention, DepthEnd, DepthInput, DepthKind, DepthSource, DepthTolerance, Depths, Floats,
    Pyramid, PyramidOptions, StoredLevels, WorldTolerance, wgpu,
};
use sources::{SOURCES, Source, pyramid_from};

const ENDS: [DepthEnd; 2] = [DepthEnd::Farthest, DepthEnd::Nearest];
const DEPTHS: [Depths; 4] = [Depths::Farthest, Depths::Nearest, Depths::Both, Depths::Receivers];

/// What a pixel adds to an end, by the definition; `None`: nothing.
fn counted(
    given: f32,
    (end, depths): (DepthEnd, Depths),
    convention: DepthConvention,
) -> Option<f32> {
    let far = if convention.is_reversed() { 0.0 } else { 1.0 };
    let is_depth = (0.0..=1.0).contains(&given);
    // -0 equals 0.
    if depths == Depths::Receivers && given == far {
        return None;
    }
    Some(match end {
        DepthEnd::Farthest if !is_depth => far,
        DepthEnd::Nearest if !is_depth => 1.0 - far,
        _ if given < f32::MIN_POSITIVE => 0.0,
        _ => given,
    })
}

/// A texel by its definition: the end of all pixels in its block.
fn expected(
    image: &[f32],
    (width, height): (u32, u32),
    (level, x, y): (u32, u32, u32),
    of: (DepthEnd, Depths),
    convention: DepthConvention,
) -> f32 {
    let reversed = convention.is_reversed();
    // Nothing there: farthest is near, nearest is far.
    let greatest = (of.0 == DepthEnd::Farthest) != reversed;
    let mut found = if greatest { 0.0_f32 } else { 1.0 };
    for row in y << level..((y + 1) << level).min(height) {
        for column in x << level..((x + 1) << level).min(width) {
            let Some(depth) = counted(image[(row * width + column) as usize], of, convention)
            else {
                continue;
            };
            found = if greatest { found.max(depth) } else { found.min(depth) };
        }
    }
    found
}

/// A level of an end by the definition.
fn expected_level(
    image: &[f32],
    size: (u32, u32),
    level: u32,
    of: (DepthEnd, Depths),
    convention: DepthConvention,
) -> Vec<f32> {
    let [columns, rows] = [size.0, size.1].map(|n| n.div_ceil(1 << level));
    let texel = |i: u32| expected(image, size, (level, i % columns, i / columns), of, convention);
    (0..columns * rows).map(texel).collect()
}

/// Random depths with what is no depth between them, background, and runs of equal pixels.
fn image(
    (width, height): (u32, u32),
    convention: DepthConvention,
    random: &mut Random,
) -> Vec<f32> {
    let far = if convention.is_reversed() { 0.0 } else { 1.0 };
    let edges = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        -0.0,
        0.0,
        1.0,
        1.0_f32.next_up(),
        1.0_f32.next_down(),
        -1.0,
        f32::from_bits(1),
        f32::MIN_POSITIVE,
        f32::MIN_POSITIVE.next_down(),
        f32::from_bits(0xffff_ffff),
        -f32::MIN_POSITIVE,
    ];
    // From all sky to none, so that whole blocks are background.
    let sky = random.below(4);
    let mut previous = far;
    (0..width * height)
        .map(|_| {
            previous = match random.below(32) {
                0 => random.pick(&edges),
                1..4 => random.unit() as f32,
                4..8 if sky > 0 => far,
                8..12 if sky > 1 => far,
                12..14 => f32::from_bits(0x3f00_0000 + random.below(0x0080_0000)),
                _ if sky == 3 => far,
                _ => previous,
            };
            previous
        })
        .collect()
}

fn options(depths: Depths, levels: StoredLevels) -> PyramidOptions {
    PyramidOptions { depths, levels, ..PyramidOptions::default() }
}

fn stored_ends(depths: Depths) -> impl Iterator<Item = DepthEnd> {
    ENDS.into_iter().filter(move |end| match end {
        DepthEnd::Farthest => depths.has_farthest(),
        DepthEnd::Nearest => depths.has_nearest(),
    })
}

/// Compares every level that is there; `from` is the first that is compared.
fn check(
    engine: &Engine,
    pyramid: &Pyramid,
    image: &[f32],
    (convention, from): (DepthConvention, u32),
    what: &str,
) {
    let size = (pyramid.size().width, pyramid.size().height);
    let stored = pyramid.stored_levels();
    let is_there = |k: &u32| *k == 0 || stored.is_some_and(|s| (s.first..=s.last).contains(k));
    for level in (from..pyramid.num_levels()).filter(is_there) {
        for end in stored_ends(pyramid.depths()) {
            let of = (end, pyramid.depths());
            let found = engine.read_level_of(pyramid, level, end).unwrap();
            let expected = expected_level(image, size, level, of, convention);
            let bits = |v: &[f32]| v.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            assert!(
                bits(&found) == bits(&expected),
                "{what}: {size:?} {convention:?} {of:?} level {level}"
            );
        }
    }
}

#[test]
fn every_level_of_both_ends_is_that_of_its_pixels() {
    let engine = engine();
    let mut random = Random(0xe4d5);
    for convention in CONVENTIONS {
        for size in BLOCK_SIZES {
            let camera = camera_along_z(size.0, size.1, convention);
            let image = image(size, convention, &mut random);
            let plain = plain_for(Source::Depth, image.clone());
            for (source, depths) in SOURCES.into_iter().flat_map(|s| DEPTHS.map(|d| (s, d))) {
                let given = if source == Source::Bits { &image } else { &plain };
                let options = options(depths, StoredLevels::ALL);
                let pyramid = pyramid_from(&engine, source, given, &camera, &options);
                check(&engine, &pyramid, given, (convention, 0), &format!("{source:?}"));
            }
        }
    }
}

/// All widths up to 70 with a height each, and rows and columns of all lengths.
#[test]
fn every_size_has_both_ends() {
    let engine = engine();
    let mut random = Random(70);
    for n in 1..=70 {
        for size in [(n, 1 + n * 37 % 70), (n, 1), (1, n)] {
            let convention = random.pick(&CONVENTIONS);
            let depths = random.pick(&DEPTHS[1..]);
            let source = random.pick(&[Source::Bits, Source::Float]);
            let camera = camera_along_z(size.0, size.1, convention);
            let image = plain_for(source, image(size, convention, &mut random));
            let options = options(depths, StoredLevels::ALL);
            let pyramid = pyramid_from(&engine, source, &image, &camera, &options);
            check(&engine, &pyramid, &image, (convention, 1), &format!("{source:?}"));
        }
    }
}

/// A level alone is made in one dispatch, by one invocation or by a workgroup per texel.
#[test]
fn levels_of_both_ends_alone_and_in_chunks() {
    let engine = engine();
    let mut random = Random(6);
    let choices = [
        StoredLevels::from(2),
        StoredLevels::only(1),
        StoredLevels::only(3),
        StoredLevels::only(4),
        StoredLevels::only(5),
        StoredLevels::only(6),
        StoredLevels::only(8),
        StoredLevels { first: 5, last: 7 },
    ];
    for size in [(333, 217), (64, 64), (1, 300), (640, 360)] {
        for convention in CONVENTIONS {
            let camera = camera_along_z(size.0, size.1, convention);
            let image = image(size, convention, &mut random);
            for depths in &DEPTHS[1..] {
                for levels in choices {
                    let source = random.pick(&[Source::Bits, Source::Float]);
                    let given = plain_for(source, image.clone());
                    let options = options(*depths, levels);
                    let pyramid = pyramid_from(&engine, source, &given, &camera, &options);
                    check(&engine, &pyramid, &given, (convention, 1), &format!("{levels:?}"));
                }
                // As many texels per chunk as make two or three of them.
                let depth = engine.upload_depth(&image, &camera).unwrap();
                let whole = engine.pyramid_with(&depth, &options(*depths, StoredLevels::ALL));
                let texels = whole.unwrap().device_bytes() / 4;
                let shift = Some(texels.div_ceil(3).next_power_of_two().ilog2());
                let options =
                    PyramidOptions { chunk_shift: shift, ..options(*depths, StoredLevels::ALL) };
                let pyramid = engine.pyramid_with(&depth, &options).unwrap();
                check(&engine, &pyramid, &image, (convention, 0), &format!("{shift:?}"));
            }
        }
    }
}

/// Float and depth textures hold no number that their driver may alter.
fn plain_for(source: Source, mut image: Vec<f32>) -> Vec<f32> {
    if source != Source::Bits {
        for depth in &mut image {
            let kept = (0.0..=1.0).contains(depth) && !depth.is_subnormal();
            *depth = if kept { depth.abs() } else { 0.75 };
        }
    }
    image
}

/// A texture with four pixels per texel, which a pair of images is read from.
fn packed(
    engine: &Engine,
    image: &[f32],
    camera: &hiz_core::Camera,
) -> hiz_core::headless::DepthImage {
    engine.upload_depth(image, camera).unwrap()
}

/// The farthest and the nearest samples come from an image each.
/// A pixel is background where its nearest sample is.
#[test]
fn pairs_of_images_have_an_end_each() {
    let engine = engine();
    let mut random = Random(2);
    for (size, convention) in BLOCK_SIZES.into_iter().flat_map(|s| CONVENTIONS.map(|c| (s, c))) {
        let far = if convention.is_reversed() { 0.0 } else { 1.0 };
        let camera = camera_along_z(size.0, size.1, convention);
        let nearest: Vec<f32> = image(size, convention, &mut random)
            .into_iter()
            .map(|d| if (0.0..=1.0).contains(&d) { d } else { 1.0 - far })
            .collect();
        let farthest: Vec<f32> = nearest
            .iter()
            .map(|d| if random.below(3) == 0 { far } else { d + (far - d) * random.unit() as f32 })
            .collect();
        let images = [&farthest, &nearest].map(|image| packed(&engine, image, &camera));
        for depths in DEPTHS {
            let options = options(depths, StoredLevels::ALL);
            let pyramid = engine.context().create_pyramid(camera.size(), &options).unwrap();
            let source = DepthSource {
                samples: 4,
                nearest: Some(images[1].texture()),
                ..DepthSource::from(images[0].texture())
            };
            let mut encoder = encoder(&engine);
            engine.context().record_reduce(&mut encoder, source, &camera, &pyramid).unwrap();
            engine.queue().submit([encoder.finish()]);
            for end in stored_ends(depths) {
                let image = if end == DepthEnd::Farthest { &farthest } else { &nearest };
                let pixels = image.iter().zip(&nearest).map(|(depth, nearest)| {
                    let nothing = depths == Depths::Receivers && *nearest == far;
                    match end {
                        DepthEnd::Farthest if nothing => 1.0 - far,
                        _ => *depth,
                    }
                });
                let pixels: Vec<f32> = pixels.collect();
                for level in 0..pyramid.num_levels() {
                    let found = engine.read_level_of(&pyramid, level, end).unwrap();
                    let of = (end, Depths::Both);
                    let expected = expected_level(&pixels, size, level, of, convention);
                    let what = format!("{size:?} {convention:?} {depths:?} {end:?} level {level}");
                    assert!(found == expected, "{what}");
                }
            }
        }
    }
}

fn encoder(engine: &Engine) -> wgpu::CommandEncoder {
    engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

/// What one image of several samples cannot tell is refused by name.
#[test]
fn what_lacks_an_end_is_refused() {
    let engine = engine();
    let camera = camera_along_z(8, 8, DepthConvention::Reversed);
    let image = packed(&engine, &[0.5; 64], &camera);
    let refused = |source: DepthSource<'_>, depths| {
        let options = options(depths, StoredLevels::ALL);
        let pyramid = engine.context().create_pyramid(camera.size(), &options).unwrap();
        let mut encoder = encoder(&engine);
        let recorded = engine.context().record_reduce(&mut encoder, source, &camera, &pyramid);
        recorded.unwrap_err().to_string()
    };
    let farthest = DepthSource { samples: 4, ..DepthSource::from(image.texture()) };
    for depths in [Depths::Nearest, Depths::Both, Depths::Receivers] {
        let why = refused(farthest, depths);
        assert_eq!(
            why,
            format!(
                "depths: expected Depths::Farthest for an image of the farthest of 4 samples per \
                 pixel, got Depths::{depths:?}; resolve with ResolvedDepths::Both"
            )
        );
    }
    let nearest = DepthSource { nearest: Some(image.texture()), ..farthest };
    for depths in [Depths::Farthest, Depths::Both, Depths::Receivers] {
        let why = refused(nearest, depths);
        assert!(why.starts_with("depths: expected Depths::Nearest for an image"), "{why}");
    }
    let other = packed(&engine, &[0.5; 16], &camera_along_z(4, 4, DepthConvention::Reversed));
    let unlike = DepthSource { nearest: Some(other.texture()), ..farthest };
    let why = refused(unlike, Depths::Both);
    assert!(why.starts_with("nearest: expected two textures of one size"), "{why}");

    let numbers = [3.0; 64];
    let input = DepthInput {
        numbers: Floats::F64(&numbers).into(),
        kind: DepthKind::Z,
        scale: 1.0,
        invalid: &[],
        tolerance: DepthTolerance::NONE,
        world_tolerance: WorldTolerance::NONE,
    };
    let converted = engine.upload_depth_of_kind(&input, &camera).unwrap();
    let why = engine.pyramid_with(&converted, &options(Depths::Both, StoredLevels::ALL));
    let why = why.unwrap_err().to_string();
    assert!(why.contains("uploaded for Depths::Both") && why.contains("upload_depth_for"), "{why}");
    for depths in DEPTHS {
        let kept = engine.upload_depth_for(&input, &camera, depths).unwrap();
        engine.pyramid_with(&kept, &options(depths, StoredLevels::ALL)).unwrap();
        engine.pyramid_with(&kept, &options(Depths::Farthest, StoredLevels::ALL)).unwrap();
    }
}

/// Parts of textures, mip levels, layers and half floats, around which all is nearer or farther.
/// After random rectangles have changed, the levels are those of the whole image.
#[test]
fn parts_of_textures_and_changed_rectangles_have_both_ends() {
    let engine = engine();
    let mut random = Random(9);
    let formats = [wgpu::TextureFormat::R32Float, wgpu::TextureFormat::R16Float];
    for (size, format) in
        [(13, 17), (65, 63), (1, 40), (127, 90)].into_iter().flat_map(|s| formats.map(|f| (s, f)))
    {
        for (convention, depths) in
            CONVENTIONS.into_iter().flat_map(|c| DEPTHS[1..].iter().map(move |d| (c, *d)))
        {
            let is_half = format == wgpu::TextureFormat::R16Float;
            let origin = [3, 5];
            let texture = engine.device().create_texture(&wgpu::TextureDescriptor {
                label: Some("test.parts"),
                size: wgpu::Extent3d {
                    width: 2 * (size.0 + 9),
                    height: 2 * (size.1 + 8),
                    depth_or_array_layers: 2,
                },
                mip_level_count: 2,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            });
            // Multiples of 1/1024 are exact in half floats.
            let exact = |d: f32| (d * 1024.0).round() / 1024.0;
            let mut depth: Vec<f32> =
                plain_for(Source::Float, image(size, convention, &mut random));
            depth.iter_mut().for_each(|d| *d = exact(*d));
            let write = |depth: &[f32]| {
                let (width, height) = (size.0 + 9, size.1 + 8);
                let pixels = (0..width * height).map(|i| {
                    let (x, y) = (i % width, i / width);
                    let inside = x >= origin[0] && y >= origin[1];
                    let (x, y) = (x.wrapping_sub(origin[0]), y.wrapping_sub(origin[1]));
                    if inside && x < size.0 && y < size.1 {
                        depth[(y * size.0 + x) as usize]
                    } else {
                        [0.0, 1.0][(i % 2) as usize]
                    }
                });
                let bytes: Vec<u8> = if is_half {
                    pixels.flat_map(|d| half_bits(d).to_le_bytes()).collect()
                } else {
                    pixels.flat_map(f32::to_le_bytes).collect()
                };
                engine.queue().write_texture(
                    wgpu::TexelCopyTextureInfo {
                        mip_level: 1,
                        origin: wgpu::Origin3d { x: 0, y: 0, z: 1 },
                        ..texture.as_image_copy()
                    },
                    &bytes,
                    wgpu::TexelCopyBufferLayout {
                        offset: 0,
                        bytes_per_row: Some(bytes.len() as u32 / height),
                        rows_per_image: None,
                    },
                    wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                );
            };
            write(&depth);
            let camera = camera_along_z(size.0, size.1, convention);
            let options = options(depths, random.pick(&[StoredLevels::ALL, StoredLevels::only(4)]));
            let pyramid = engine.context().create_pyramid(camera.size(), &options).unwrap();
            let source = DepthSource {
                mip_level: Some(1),
                array_layer: Some(1),
                origin,
                size: Some(camera.size()),
                ..DepthSource::from(&texture)
            };
            let mut commands = encoder(&engine);
            engine.context().record_reduce(&mut commands, source, &camera, &pyramid).unwrap();
            engine.queue().submit([commands.finish()]);
            check(&engine, &pyramid, &depth, (convention, 1), "a part");
            for _ in 0..4 {
                let ([x0, y0], more) =
                    ([random.below(size.0), random.below(size.1)], random.below(3));
                let x1 = if more == 0 { x0 } else { x0 + random.below(size.0 - x0) };
                let y1 = if more == 1 { y0 } else { y0 + random.below(size.1 - y0) };
                let whole = random.pick(&[0.0, 1.0, 0.5]);
                for (x, y) in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| (x, y))) {
                    let new = if more == 2 { exact(random.unit() as f32) } else { whole };
                    depth[(y * size.0 + x) as usize] = new;
                }
                write(&depth);
                let mut commands = encoder(&engine);
                let rectangle = [x0, y0, x1, y1];
                engine
                    .context()
                    .record_reduce_region(&mut commands, source, rectangle, &pyramid)
                    .unwrap();
                engine.queue().submit([commands.finish()]);
                check(&engine, &pyramid, &depth, (convention, 1), &format!("{rectangle:?}"));
            }
        }
    }
}

/// The half float of a multiple of 1/1024 from 0 to 1.
fn half_bits(d: f32) -> u16 {
    if d == 0.0 {
        return 0;
    }
    let bits = d.to_bits();
    ((((bits >> 23) - 112) << 10) | (bits >> 13 & 1023)) as u16
}

/// Whether the levels of any end differ from the definition, in a context with planted faults.
fn differs(engine: &Engine, source: Source, depths: Depths, levels: StoredLevels) -> bool {
    let mut random = Random(31);
    [(65, 63), (200, 130)].into_iter().any(|size| {
        CONVENTIONS.into_iter().any(|convention| {
            let camera = camera_along_z(size.0, size.1, convention);
            let image = plain_for(source, image(size, convention, &mut random));
            // Neither near nor far, so that what a block begins with would show.
            let between = plain_for(Source::Float, image.clone());
            let between = between.iter().map(|d| 0.25 + 0.5 * d).collect();
            [image, between].iter().any(|image| {
                let options = options(depths, levels);
                let pyramid = pyramid_from(engine, source, image, &camera, &options);
                let stored = levels.first..=levels.last;
                (1..pyramid.num_levels()).filter(|k| stored.contains(k)).any(|level| {
                    stored_ends(depths).any(|end| {
                        engine.read_level_of(&pyramid, level, end).unwrap()
                            != expected_level(image, size, level, (end, depths), convention)
                    })
                })
            })
        })
    })
}

#[test]
fn faults_of_both_ends_are_seen() {
    let all = StoredLevels::ALL;
    let receivers = "return Ends(farthest_sanitized4(foreground4(pixels)), nearest_sanitized4";
    let faults: [(&str, &str, Depths, StoredLevels); 15] = [
        // What is no depth counts as a depth, or as far at the nearest end.
        ("greatest > ONE_BITS || least < LEAST_NORMAL_BITS", "least < 1u", Depths::Both, all),
        ("greatest > NEGATIVE_ZERO_BITS)", "false)", Depths::Both, all),
        ("greatest > NEGATIVE_ZERO_BITS)", "greatest >= NEGATIVE_ZERO_BITS)", Depths::Both, all),
        ("min(u32(max(greatest_signed, 0)), ONE_BITS)", "greatest & ONE_BITS", Depths::Both, all),
        // Near and far are swapped, or one of them is lost.
        ("return Ends(range.x, range.y);", "return Ends(range.y, range.x);", Depths::Both, all),
        ("return Ends(range.y, range.x);", "return Ends(range.y, range.y);", Depths::Both, all),
        ("nearest4(v.near)", "farthest4(v.near)", Depths::Both, all),
        ("nearest(a.near, b.near)", "b.near", Depths::Both, StoredLevels::only(5)),
        ("store(index + 1u, ends.near)", "store(index, ends.near)", Depths::Both, all),
        ("vec4<u32>(left.yw, right.yw)", "vec4<u32>(left.xz, right.xz)", Depths::Both, all),
        ("vec4<u32>(a.near.xy, b.near.xy)", "vec4<u32>(a.near.xy, a.near.xy)", Depths::Both, all),
        (
            "return Ends(near_bits(), far_bits());",
            "return Ends(far_bits(), far_bits());",
            Depths::Both,
            StoredLevels::only(5),
        ),
        // Background: -0 as well, and subnormals are none.
        (
            receivers,
            "return Ends(farthest_sanitized4(pixels), nearest_sanitized4",
            Depths::Receivers,
            all,
        ),
        (
            "(bits == far_bits()) | (REVERSED",
            "(bits == far_bits()) & (REVERSED",
            Depths::Receivers,
            all,
        ),
        (
            "return (bits == far_bits()) |",
            "return (sanitized(bits) == far_bits()) |",
            Depths::Receivers,
            all,
        ),
    ];
    for (what, by, depths, levels) in faults {
        let engine = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        assert!(differs(&engine, Source::Bits, depths, levels), "{what} -> {by}: stayed green");
    }
}
