//! The depth pyramid, bit for bit against the oracle's, which takes every texel directly from the image.

mod common;

use common::{CONVENTIONS, Random, camera_along_z, engine};
use hiz_core::{DepthConvention, ImageSize, PyramidOptions};

/// Every size class that has broken somebody's reduction: single pixels, rows, columns, odd in one or both sides, powers of two
/// and their neighbours, primes, common screens.
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

fn check(width: u32, height: u32, depth: &[f32], convention: DepthConvention, options: &PyramidOptions) {
    let camera = camera_along_z(width, height, convention);
    let uploaded = engine().upload_depth(depth, &camera).unwrap();
    let pyramid = engine().pyramid_with(&uploaded, options).unwrap();
    let expected = hiz_ref::pyramid(depth, width, height, convention.is_reversed());
    assert_eq!(pyramid.num_levels() as usize, expected.len(), "{width}x{height}");
    for (k, level) in expected.iter().enumerate() {
        assert_eq!(pyramid.level_size(k as u32), Some(ImageSize::new(level.width, level.height)));
        let texels = engine().read_level(&pyramid, k as u32).unwrap();
        let differing = texels.iter().zip(&level.texels).position(|(a, b)| a.to_bits() != b.to_bits());
        assert_eq!(texels.len(), level.texels.len());
        if let Some(i) = differing {
            panic!(
                "{width}x{height} {convention:?} level {k} texel ({}, {}): device {}, oracle {}",
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

#[test]
fn random_small_sizes_are_bit_exact() {
    let mut random = Random(2);
    for _ in 0..150 {
        let (width, height) = (1 + random.below(70), 1 + random.below(70));
        let depth = image(width, height, &mut random);
        check(width, height, &depth, random.pick(&CONVENTIONS), &PyramidOptions::default());
    }
}

/// A level larger than one binding is split: small chunks stand in for large images.
#[test]
fn split_pyramids_are_bit_exact() {
    let mut random = Random(3);
    for (width, height) in [(64, 64), (77, 41), (130, 129)] {
        let depth = image(width, height, &mut random);
        for convention in CONVENTIONS {
            let texels = u64::from(width * height) / 3;
            // Two chunks and three.
            for chunk_shift in [texels.ilog2(), texels.ilog2() - 1] {
                check(width, height, &depth, convention, &PyramidOptions { chunk_shift: Some(chunk_shift) });
            }
        }
    }
}

/// A single far pixel at each border must reach the top: dropped rows and columns show here by name.
#[test]
fn no_border_pixel_is_dropped() {
    for (width, height) in [(5, 5), (7, 3), (9, 9), (33, 17), (100, 75)] {
        for (x, y) in [(0, 0), (width - 1, 0), (0, height - 1), (width - 1, height - 1), (width - 1, height / 2)] {
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
    let depth = engine().upload_depth(&[0.0; 4096], &camera_along_z(64, 64, DepthConvention::Standard)).unwrap();
    let error = engine().pyramid_with(&depth, &PyramidOptions { chunk_shift: Some(4) }).unwrap_err();
    assert!(error.to_string().contains("pyramid texels: requested"), "{error}");
}
