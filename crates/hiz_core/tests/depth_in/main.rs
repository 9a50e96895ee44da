//! Depth as renderers have it: parts of textures, multisampled depth, and changed rectangles.

#[path = "../common/mod.rs"]
mod common;
mod parts;
mod refusals;
mod region;
mod resolve;
#[allow(dead_code, reason = "only drawing is used here")]
#[path = "../common/sources.rs"]
mod sources;

use common::Random;
use hiz_core::{ImageSize, Pyramid, StoredLevels, headless::Engine, wgpu};

const SAMPLED: wgpu::TextureUsages = wgpu::TextureUsages::TEXTURE_BINDING;
const COPIED: wgpu::TextureUsages =
    wgpu::TextureUsages::COPY_SRC.union(wgpu::TextureUsages::COPY_DST);

/// Depths, some of which are none: NaN, negative, -0, subnormal, above 1.
fn image(size: ImageSize, random: &mut Random) -> Vec<f32> {
    let bad = [-0.0, 1.0, 0.0, f32::NAN, -0.5, 1.5, 1e-40, f32::INFINITY, -1e-40];
    (0..size.pixels())
        .map(|_| if random.below(16) == 0 { random.pick(&bad) } else { random.unit() as f32 })
        .collect()
}

/// Every stored level, bit for bit, against the definition: each texel is taken from all of its
/// pixels.
fn differing_levels(
    engine: &Engine,
    pyramid: &Pyramid,
    depth: &[f32],
    reversed: bool,
) -> Vec<usize> {
    let ImageSize { width, height } = pyramid.size();
    let expected = hiz_ref::pyramid(depth, width, height, reversed);
    let stored = pyramid.stored_levels();
    let is_there = |k: usize| {
        let Some(StoredLevels { first, last }) = stored else { return k == 0 };
        k == 0 || (first as usize..=last as usize).contains(&k)
    };
    (0..expected.len())
        .filter(|k| is_there(*k))
        .filter(|k| {
            let texels = engine.read_level(pyramid, *k as u32).unwrap();
            let bits = |texels: &[f32]| texels.iter().map(|d| d.to_bits()).collect::<Vec<_>>();
            bits(&texels) != bits(&expected[*k].texels)
        })
        .collect()
}

fn encoder(device: &wgpu::Device) -> wgpu::CommandEncoder {
    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

/// Which levels are stored: all, without the first, one coarse one of either shape, a range.
const STORED: [StoredLevels; 6] = [
    StoredLevels::ALL,
    StoredLevels::from(2),
    StoredLevels::only(3),
    StoredLevels::only(4),
    StoredLevels::only(6),
    StoredLevels { first: 5, last: 6 },
];
