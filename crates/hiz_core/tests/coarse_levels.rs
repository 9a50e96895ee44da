//! Coarse levels, where one pixel of thousands decides the farthest depth of a texel.
//! Where one pixel in fifty is far, every texel from level 4 on is far, and faults do not show.
//! So these images have a handful of far pixels and no invalid numbers.
//! Every texel of every level has a different depth.

mod common;

use common::{CONVENTIONS, Random, camera_along_z, engine};
use hiz_core::headless::Engine;
use hiz_core::{DepthConvention, PyramidOptions, StoredLevels};

const SIZES: [(u32, u32); 10] = [
    (1, 1),
    (1, 37),
    (37, 1),
    (131, 127),
    (257, 255),
    (64, 65),
    (1, 3001),
    (3001, 2),
    (1023, 517),
    (1920, 1080),
];

/// Depths from 1/4 to 3/4, all finite and all different.
/// Then `far` single pixels at random places are set to greater distances.
fn image(
    width: u32,
    height: u32,
    convention: DepthConvention,
    far: u32,
    random: &mut Random,
) -> Vec<f32> {
    let mut depth: Vec<f32> =
        (0..width * height).map(|_| random.range(0.25, 0.75) as f32).collect();
    for _ in 0..far {
        let farther = random.range(0.75, 0.999) as f32;
        let at = random.below(width * height) as usize;
        depth[at] = if convention.is_reversed() { 1.0 - farther } else { farther };
    }
    depth
}

/// The first texel that differs from the oracle's.
/// Tries each of these choices of levels with both kinds of upload.
fn difference(
    engine: &Engine,
    (width, height): (u32, u32),
    convention: DepthConvention,
    far: u32,
    choices: &[StoredLevels],
) -> Option<String> {
    let depth =
        image(width, height, convention, far, &mut Random(u64::from(width * 7 + height + far)));
    let camera = camera_along_z(width, height, convention);
    let expected = hiz_ref::pyramid(&depth, width, height, convention.is_reversed());
    let top = expected.len() as u32 - 1;
    for uploaded in
        [engine.upload_depth(&depth, &camera), engine.upload_depth_sampled(&depth, &camera)]
    {
        let uploaded = uploaded.unwrap();
        for levels in choices {
            let options = PyramidOptions { levels: *levels, ..PyramidOptions::default() };
            let pyramid = engine.pyramid_with(&uploaded, &options).unwrap();
            for k in
                (1..=top).filter(|k| (levels.first.min(top)..=levels.last.min(top)).contains(k))
            {
                let texels = engine.read_level(&pyramid, k).unwrap();
                let level = &expected[k as usize];
                if let Some(i) =
                    texels.iter().zip(&level.texels).position(|(a, b)| a.to_bits() != b.to_bits())
                {
                    return Some(format!(
                        "{width}x{height} {convention:?} {levels:?} level {k} texel {i}: {}",
                        texels[i]
                    ));
                }
            }
        }
    }
    None
}

#[test]
fn every_coarse_level_alone_has_the_farthest_of_its_pixels() {
    let alone: Vec<StoredLevels> = (1..=12).map(StoredLevels::only).collect();
    for (number, size) in SIZES.into_iter().enumerate() {
        let choices = if size == (1920, 1080) { &alone[3..] } else { &alone[..] };
        let convention = CONVENTIONS[number % 2];
        assert_eq!(difference(&engine(), size, convention, 5, choices), None);
    }
    // Both conventions, at a size where a workgroup shares a texel and at one where it does not.
    assert_eq!(difference(&engine(), (257, 255), CONVENTIONS[1], 3, &alone), None);
    assert_eq!(
        difference(
            &engine(),
            (1920, 1080),
            CONVENTIONS[0],
            5,
            &[StoredLevels::only(4), StoredLevels::only(7)]
        ),
        None
    );
}

#[test]
fn all_levels_down_to_the_last_have_the_farthest_of_their_pixels() {
    for size in SIZES {
        for (convention, far) in
            [(CONVENTIONS[0], 0), (CONVENTIONS[1], 0), (CONVENTIONS[0], 4), (CONVENTIONS[1], 4)]
        {
            let choices = [StoredLevels::ALL, StoredLevels::from(5)];
            assert_eq!(
                difference(
                    &engine(),
                    size,
                    convention,
                    far,
                    &choices[..if far == 0 { 1 } else { 2 }]
                ),
                None
            );
        }
    }
}

/// Two kinds of fault.
/// One takes the mean of two depths in place of the farthest, at each place that takes a farthest.
/// The other leaves out parts of a coarse level.
#[test]
fn faults_of_coarse_levels_are_seen() {
    let all = [StoredLevels::ALL];
    let alone = [
        StoredLevels::only(4),
        StoredLevels::only(5),
        StoredLevels::only(6),
        StoredLevels::only(8),
    ];
    let mean =
        |a: &str, b: &str| format!("bitcast<u32>(0.5 * (bitcast<f32>({a}) + bitcast<f32>({b})))");
    let rows = mean("a.x", "b.y");
    let eighth = mean("farthest4(q0.xyxy)", "farthest4(q1.xyxy)");
    let two = mean("a", "b");
    let blocks = format!("ends = {};", mean("ends", "block"));
    let shares = format!("ends = {};", mean("ends", "parts[i]"));
    let planted: [((&str, &str), &[StoredLevels]); 11] = [
        (("farthest4(vec4<u32>(a.xy, b.xy))", &rows), &all),
        (("joined4(pairs_in_row(q0, q1))", &eighth), &all),
        (("select(max(a, b), min(a, b), REVERSED)", &two), &all),
        (("ends = joined(ends, block);", &blocks), &alone),
        (("ends = joined(ends, parts[i]);", &shares), &alone),
        // Half of the shares; shares off by one; shares that are too short.
        (("i < WORKGROUP; i += 1u", "i < 32u; i += 1u"), &alone),
        (("var ends = parts[0];", "var ends = parts[1];"), &alone),
        (
            ("let part = side >> SIDE_LOG2;", "let part = max(side >> (SIDE_LOG2 + 1u), 1u);"),
            &alone,
        ),
        // The last column of blocks is left out.
        (
            (
                "min(begin + vec2<u32>(side), blocks)",
                "min(begin + vec2<u32>(side), blocks - vec2<u32>(1u, 0u))",
            ),
            &alone,
        ),
        // A tail's blocks and lanes are left out.
        (("(end + vec2<u32>(BLOCK - 1u)) / BLOCK;", "(end + vec2<u32>(3u)) / BLOCK;"), &all),
        (
            (
                "i < size.x * size.y; i += WORKGROUP",
                "i < min(size.x * size.y, WORKGROUP); i += WORKGROUP",
            ),
            &all,
        ),
    ];
    for ((what, by), choices) in planted {
        let engine = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        let seen = [(1023, 517), (257, 255), (513, 511)]
            .into_iter()
            .flat_map(|size| CONVENTIONS.map(|convention| (size, convention)))
            .find_map(|(size, convention)| difference(&engine, size, convention, 3, choices));
        eprintln!("{what} -> {by}: {seen:?}");
        assert!(seen.is_some(), "{what} -> {by}: stayed green");
    }
}

/// A part of level 14 takes more iterations than lavapipe has for one loop after the other.
#[test]
fn the_coarsest_level_of_a_large_image_has_all_its_blocks() {
    let (width, height) = (8193, 2048);
    let convention = DepthConvention::Reversed;
    let camera = camera_along_z(width, height, convention);
    let mut depth = vec![0.5_f32; (width * height) as usize];
    // In the last blocks of two of 8x8 parts; other parts repeat the last row of the image.
    for (column, row, farthest) in [(2047, 2041, 0.25), (4095, 2040, 0.125)] {
        depth[(row * width + column) as usize] = farthest;
        let image = engine().upload_depth(&depth, &camera).unwrap();
        let options =
            PyramidOptions { levels: StoredLevels::only(14), ..PyramidOptions::default() };
        let pyramid = engine().pyramid_with(&image, &options).unwrap();
        assert_eq!(engine().read_level(&pyramid, 14).unwrap(), [farthest], "{column} {row}");
        let fault = ("min(y + 1u, end.y - 1u)", "y");
        let faulty = Engine::with_planted_faults(None, &[fault]).expect("a Vulkan driver");
        let image = faulty.upload_depth(&depth, &camera).unwrap();
        let pyramid = faulty.pyramid_with(&image, &options).unwrap();
        assert_ne!(faulty.read_level(&pyramid, 14).unwrap(), [farthest], "stayed green");
    }
}
