//! One layer, one mip level, a viewport: everything that reads level 0 reads it where it lies.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, DepthSource, Fit, Floats, Footprint,
    Hierarchy, ImageSize, InstanceOptions, Outputs, Pyramid, PyramidOptions, StoredLevels, wgpu,
};

use crate::common::{CONVENTIONS, Random, camera_along_z, depth_descriptor, engine};
use crate::{COPIED, SAMPLED, STORED, differing_levels, encoder, image};

/// Where an image lies: layer and mip level of a texture, and a rectangle of that.
#[derive(Debug, Clone, Copy)]
struct Place {
    layer: u32,
    mip: u32,
    origin: [u32; 2],
    size: ImageSize,
    /// The size of the mip level.
    level: ImageSize,
}

fn place((layer, mip): (u32, u32), origin: [u32; 2], size: [u32; 2], level: [u32; 2]) -> Place {
    let size_of = |[width, height]: [u32; 2]| ImageSize::new(width, height);
    Place { layer, mip, origin, size: size_of(size), level: size_of(level) }
}

/// Viewports with odd sides and origins, at the texture's edges and within, and whole levels.
fn places() -> Vec<Place> {
    vec![
        place((0, 0), [1, 1], [7, 5], [13, 9]),
        place((0, 0), [33, 0], [31, 17], [64, 17]),
        place((0, 0), [0, 3], [64, 63], [64, 66]),
        place((0, 0), [3, 2], [1, 1], [9, 9]),
        place((0, 0), [5, 7], [129, 67], [200, 100]),
        place((2, 0), [0, 0], [33, 19], [33, 19]),
        place((1, 0), [11, 2], [20, 20], [33, 22]),
        place((0, 1), [0, 0], [40, 21], [40, 21]),
        place((3, 2), [2, 3], [17, 9], [20, 13]),
    ]
}

const FORMATS: [wgpu::TextureFormat; 2] =
    [wgpu::TextureFormat::R32Float, wgpu::TextureFormat::Depth32Float];

/// A texture that holds `depth` at `place`, and `around` everywhere else.
fn texture(
    engine: &Engine,
    format: wgpu::TextureFormat,
    place: &Place,
    depth: &[f32],
    around: f32,
) -> wgpu::Texture {
    let level = place.level;
    let mut all = vec![around; level.pixels() as usize];
    let [x, y] = place.origin;
    for (row, pixels) in (y..).zip(depth.chunks(place.size.width as usize)) {
        let begin = (row * level.width + x) as usize;
        all[begin..begin + pixels.len()].copy_from_slice(pixels);
    }
    let side = |side: u32| side << place.mip;
    let usage = SAMPLED | COPIED;
    let mut descriptor = depth_descriptor((side(level.width), side(level.height)), format, usage);
    descriptor.mip_level_count = place.mip + 1;
    descriptor.size.depth_or_array_layers = place.layer + 1;
    let texture = engine.device().create_texture(&descriptor);
    let target = wgpu::TexelCopyTextureInfo {
        mip_level: place.mip,
        origin: wgpu::Origin3d { x: 0, y: 0, z: place.layer },
        ..texture.as_image_copy()
    };
    let extent =
        wgpu::Extent3d { width: level.width, height: level.height, depth_or_array_layers: 1 };
    if format == wgpu::TextureFormat::Depth32Float {
        // Nothing but drawing writes depth.
        let drawn = crate::sources::drawn(engine, (level.width, level.height), &all);
        let mut copy = encoder(engine.device());
        copy.copy_texture_to_texture(drawn.as_image_copy(), target, extent);
        engine.queue().submit([copy.finish()]);
    } else {
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * level.width),
            rows_per_image: None,
        };
        engine.queue().write_texture(target, bytemuck::cast_slice(&all), layout, extent);
    }
    texture
}

fn source<'a>(texture: &'a wgpu::Texture, place: &Place) -> DepthSource<'a> {
    DepthSource {
        mip_level: Some(place.mip),
        array_layer: Some(place.layer),
        origin: place.origin,
        size: Some(place.size),
        ..DepthSource::from(texture)
    }
}

fn reduced(
    engine: &Engine,
    depth: DepthSource<'_>,
    camera: &Camera,
    options: &PyramidOptions,
) -> Arc<Pyramid> {
    let pyramid = engine.context().create_pyramid(camera.size(), options).unwrap();
    let mut reduction = encoder(engine.device());
    engine.context().record_reduce(&mut reduction, depth, camera, &pyramid).unwrap();
    engine.queue().submit([reduction.finish()]);
    Arc::new(pyramid)
}

fn near(convention: DepthConvention) -> f32 {
    if convention.is_reversed() { 1.0 } else { 0.0 }
}

/// Depths that a depth texture holds as they are given.
fn depths(format: wgpu::TextureFormat, size: ImageSize, random: &mut Random) -> Vec<f32> {
    let mut depth = image(size, random);
    if format == wgpu::TextureFormat::Depth32Float {
        for d in &mut depth {
            *d = if d.is_nan() { 0.5 } else { d.abs().clamp(0.0, 1.0) };
        }
    }
    depth
}

fn wrong_levels(engine: &Engine, stored: &[StoredLevels], places: &[Place]) -> usize {
    let (mut random, mut wrong) = (Random(3), 0);
    for convention in CONVENTIONS {
        for place in places {
            for format in FORMATS {
                let depth = depths(format, place.size, &mut random);
                let camera = camera_along_z(place.size.width, place.size.height, convention);
                // Neighbours that are near would hide, and far ones would keep.
                for around in [0.0, 1.0] {
                    let texture = texture(engine, format, place, &depth, around);
                    for levels in stored {
                        let options = PyramidOptions { levels: *levels, ..Default::default() };
                        let pyramid = reduced(engine, source(&texture, place), &camera, &options);
                        let reversed = convention.is_reversed();
                        let found = differing_levels(engine, &pyramid, &depth, reversed);
                        if !found.is_empty() {
                            eprintln!("{convention:?} {place:?} {format:?} {levels:?}: {found:?}");
                            wrong += 1;
                        }
                    }
                }
            }
        }
    }
    wrong
}

#[test]
fn levels_of_a_part_are_those_of_its_own_pixels() {
    assert_eq!(wrong_levels(&engine(), &STORED, &places()), 0);
}

/// Boxes of all sizes all over the image, at the depths of its pixels.
fn boxes(size: ImageSize, count: usize) -> (Vec<f32>, Vec<f32>) {
    let mut random = Random(9);
    let (mut min, mut max) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let z = random.range(1.5, 60.0);
        let (x, y) = (random.range(-1.1, 1.1) * z, random.range(-1.1, 1.1) * z);
        let pixels = 2.0_f64.powf(random.range(-2.0, 6.0));
        let half = pixels * z / f64::from(size.width.max(size.height));
        min.extend([x - half, y - half, z].map(|v| v as f32));
        max.extend([x + half, y + half, z + half].map(|v| v as f32));
    }
    (min, max)
}

/// How culls read depth.
fn ways() -> Vec<CullOptions> {
    let plain = CullOptions::default();
    vec![
        plain.clone(),
        CullOptions { footprint: Footprint::Four, hierarchy: Hierarchy::Never, ..plain.clone() },
        CullOptions { descent: 64, hierarchy: Hierarchy::Always, ..plain.clone() },
        CullOptions { fit: Fit::Volume, descent: 16, ..plain },
    ]
}

/// Culls a part with near and with far neighbours, and the same pixels alone, in all ways.
/// Returns how many instances differ, and how many are hidden.
fn culled(engine: &Engine, places: &[Place]) -> (usize, usize) {
    let (mut random, mut differing, mut hidden) = (Random(5), 0, 0);
    for convention in CONVENTIONS {
        let far = 1.0 - near(convention);
        for place in places {
            let (width, height) = (place.size.width, place.size.height);
            let camera = camera_along_z(width, height, convention);
            // The lower half is at a depth of 8, the rest is empty.
            let wall = crate::common::ndc(8.0, convention);
            let depth: Vec<f32> = (0..width * height)
                .map(|i| if i / width >= height / 2 && random.below(40) > 0 { wall } else { far })
                .collect();
            let (min, max) = boxes(place.size, 1500);
            let bounds = Bounds::Boxes { min: Floats::F32(&min), max: Floats::F32(&max) };
            let crowd = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
            let alone = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
            for format in FORMATS {
                for around in [near(convention), far] {
                    let texture = texture(engine, format, place, &depth, around);
                    // An atlas cannot be filled from a part, and is not used.
                    let options = PyramidOptions { atlas: AtlasUse::Always, ..Default::default() };
                    let part = reduced(engine, source(&texture, place), &camera, &options);
                    for options in ways() {
                        let mask = |pyramid: &Arc<Pyramid>| {
                            let outputs = Outputs::default();
                            let cull =
                                engine.cull(&crowd, &camera, pyramid, &options, &outputs).unwrap();
                            (cull.mask().unwrap(), cull)
                        };
                        let ((ours, cull), (theirs, whole)) = (mask(&part), mask(&alone));
                        hidden += theirs.iter().filter(|kept| !**kept).count();
                        differing += ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
                        for index in (0..1500).step_by(97) {
                            let told = [&cull, &whole].map(|cull| {
                                let told = cull.explain(index).unwrap();
                                (told.verdict, told.texels, told.farthest.map(f32::to_bits))
                            });
                            differing += usize::from(told[0] != told[1]);
                        }
                    }
                }
            }
        }
    }
    (differing, hidden)
}

#[test]
fn culls_of_a_part_read_its_own_pixels() {
    let places = [places()[0], places()[1], places()[4], places()[8]];
    let (differing, hidden) = culled(&engine(), &places);
    assert_eq!(differing, 0);
    assert!(hidden > 10_000, "{hidden}");
}

/// What reads a neighbour turns red.
#[test]
fn planted_faults_of_parts_show() {
    let levels: [(&str, &str); 3] = [
        ("    return part_origin();", "    return vec2<u32>(0u);"),
        ("min(first + vec2<u32>(1u), edge)", "first + vec2<u32>(1u)"),
        (
            "return vec2<u32>(pyramid.levels[0].width, pyramid.levels[0].height) - vec2<u32>(1u);",
            "return textureDimensions(source);",
        ),
    ];
    for fault in levels {
        let faulty = Engine::with_planted_faults(None, &[fault]).unwrap();
        assert!(wrong_levels(&faulty, &[StoredLevels::ALL], &places()[..2]) > 0, "{fault:?}");
    }
    let culls: [(&str, &str); 3] = [
        ("view.source_origin & COORDINATE_MASK, view.source_origin >> COORDINATE_BITS", "0u, 0u"),
        ("let at = t.xy + source_origin() + vec2<u32>(1u);", "let at = t.xy + vec2<u32>(1u);"),
        ("select(columns.xyxy, columns, t.y < t.w)", "columns"),
    ];
    for fault in culls {
        let faulty = Engine::with_planted_faults(None, &[fault]).unwrap();
        assert!(culled(&faulty, &places()[1..2]).0 > 0, "{fault:?}");
    }
}

/// Half floats of a viewport keep their tolerance.
#[test]
fn a_part_of_half_floats_keeps_its_tolerance() {
    let (engine, camera) = (engine(), camera_along_z(8, 8, DepthConvention::Standard));
    let format = wgpu::TextureFormat::R16Float;
    let texture = engine.device().create_texture(&depth_descriptor((16, 8), format, SAMPLED));
    let right = DepthSource { origin: [8, 0], ..DepthSource::from(&texture) };
    let pyramid = reduced(&engine, right, &camera, &PyramidOptions::default());
    assert_eq!(pyramid.tolerance(), Some(hiz_core::DepthTolerance::HALF));
}
