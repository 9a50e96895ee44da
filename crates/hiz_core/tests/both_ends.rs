//! Both ends of the pyramid: the farthest and the nearest depth of every block, bit for bit.
//! The expectations are plain loops over the pixels of each block.

mod common;
#[path = "common/sources.rs"]
mod sources;

use common::{CONVENTIONS, Random, camera_along_z, engine};
use hiz_core::headless::Engine;
use hiz_core::{DepthConvention, DepthEnd, Depths, Pyramid, PyramidOptions, StoredLevels};
use sources::{SOURCES, Source, pyramid_from};

const ENDS: [DepthEnd; 2] = [DepthEnd::Farthest, DepthEnd::Nearest];
const DEPTHS: [Depths; 4] = [Depths::Farthest, Depths::Nearest, Depths::Both, Depths::Receivers];

const SIZES: [(u32, u32); 14] = [
    (1, 1),
    (1, 9),
    (9, 1),
    (2, 2),
    (7, 5),
    (13, 17),
    (31, 33),
    (64, 64),
    (65, 63),
    (127, 129),
    (251, 241),
    (513, 31),
    (1023, 9),
    (640, 360),
];

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
        for size in SIZES {
            let camera = camera_along_z(size.0, size.1, convention);
            let image = image(size, convention, &mut random);
            // Depth textures hold numbers from 0 to 1 alone.
            let plain: Vec<f32> = image
                .iter()
                .map(|d| if (0.0..=1.0).contains(d) && !d.is_subnormal() { d.abs() } else { 0.75 })
                .collect();
            for (source, depths) in SOURCES.into_iter().flat_map(|s| DEPTHS.map(|d| (s, d))) {
                let given = if source == Source::Bits { &image } else { &plain };
                let options = options(depths, StoredLevels::ALL);
                let pyramid = pyramid_from(&engine, source, given, &camera, &options);
                check(&engine, &pyramid, given, (convention, 0), &format!("{source:?}"));
            }
        }
    }
}
