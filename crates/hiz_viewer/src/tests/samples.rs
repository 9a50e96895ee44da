//! Where samples lie and where their depths are computed, and what follows where the two differ.
//!
//! A fragment of a surface seen edge-on can have a depth that its body has nowhere:
//!
//! - SwiftShader computes the depths of four samples at places that are mirrored in the pixel.
//! - lavapipe has, rarely, a fragment of a sliver whose plane is steep.
//!
//! A picture with culling may lack such a fragment if its body is hidden: it is excused, once it is
//! proved to lie beyond the bounds of every body that was culled.

use std::sync::Arc;

use hiz_core::{Camera, ImageSize};

use crate::gpu::Gpu;
use crate::picture::Picture;
use crate::renderer::Renderer;
use crate::sample_places::measure;
use crate::scene::Volumes;

/// Vulkan's standard places of four samples.
const STANDARD: [[f64; 2]; 4] = [[0.375, 0.125], [0.875, 0.375], [0.125, 0.625], [0.625, 0.875]];
/// How far around a sample a body is looked for, in pixels.
const AROUND: f64 = 1.5;

#[test]
fn samples_lie_where_vulkan_says_and_their_depths_are_known() {
    let gpu = super::pictures::gpu();
    for samples in [1, 4] {
        let places = measure(&gpu, samples).expect("a picture");
        eprintln!("{}, {samples} samples: {places:?}", gpu.words());
        let standard: &[_] = if samples == 1 { &[[0.5; 2]] } else { &STANDARD };
        let mirrors = samples == 4 && gpu.adapter.name.contains("SwiftShader");
        for (place, standard) in places.iter().zip(standard) {
            assert_eq!(place.lies, *standard, "{samples} samples");
            assert_eq!(place.agrees(), !mirrors, "{place:?}");
        }
    }
}

/// A sphere around bounds, relative to the eye.
fn sphere_around(volumes: &Volumes, body: usize, eye: [f64; 3]) -> ([f64; 3], f64) {
    match volumes {
        Volumes::Spheres { centers, radii } => {
            ([0, 1, 2].map(|k| centers[3 * body + k] - eye[k]), radii[body])
        }
        Volumes::Boxes { min, max } => {
            let half = [0, 1, 2].map(|k| 0.5 * (max[3 * body + k] - min[3 * body + k]));
            let centre = [0, 1, 2].map(|k| min[3 * body + k] + half[k] - eye[k]);
            (centre, half.iter().map(|v| v * v).sum::<f64>().sqrt())
        }
    }
}

/// Whether no bounds of a culled body hold a point of this depth around the pixel.
fn is_beyond(
    renderer: &Renderer,
    camera: &Camera,
    culled: &[bool],
    pixel: usize,
    depth: f64,
) -> bool {
    let ImageSize { width, height } = renderer.targets.size;
    let (rows, eye) = (camera.rows(), camera.origin());
    let [x, y] = [pixel % width as usize, pixel / width as usize].map(|p| p as f64 + 0.5);
    let middle = [2.0 * x / f64::from(width) - 1.0, 1.0 - 2.0 * y / f64::from(height)];
    let pixels = [f64::from(width), f64::from(height)].map(|n| 2.0 / n);
    let slack = crate::culler::depth_slack(&renderer.gpu.adapter);
    (0..culled.len()).filter(|body| culled[*body]).all(|body| {
        let (centre, radius) = sphere_around(&renderer.scene.volumes, body, eye);
        let value = |row: [f64; 4]| row[3] + (0..3).map(|k| row[k] * centre[k]).sum::<f64>();
        let reach = |row: [f64; 4]| radius * row[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        let less = |row: usize, t: f64| [0, 1, 2, 3].map(|k| rows[row][k] - t * rows[3][k]);
        // The planes through the eye, `AROUND` pixels before and behind the pixel's middle.
        let misses = (0..2).any(|k| {
            let [low, high] = [-1.0, 1.0].map(|s| less(k, middle[k] + s * AROUND * pixels[k]));
            value(low) + reach(low) < 0.0 || value(high) - reach(high) > 0.0
        });
        // Reversed Z: the depth of a point is Z / W, and greater is nearer.
        let [nearest, farthest] = [1.0 - slack, 1.0 + slack].map(|f| less(2, depth * f));
        misses || value(nearest) + reach(nearest) < 0.0 || value(farthest) - reach(farthest) > 0.0
    })
}

/// Takes over from `seen` the pixels whose differing samples are all excused, and counts those.
pub(super) fn excuse(
    seen: &Picture,
    expected: &mut Picture,
    camera: &Camera,
    [culling, reference]: [&Renderer; 2],
) -> usize {
    let samples = seen.samples as usize;
    let [drawn, all] = [culling, reference].map(drawn);
    let culled: Vec<_> = drawn.iter().zip(&all).map(|(seen, of)| *of && !seen).collect();
    let mut excused = 0;
    for pixel in 0..seen.depth.len() / samples {
        let places = pixel * samples..(pixel + 1) * samples;
        let differing: Vec<_> =
            places.clone().filter(|p| seen.depth[*p] != expected.depth[*p]).collect();
        let all_beyond = differing.iter().all(|place| {
            let depth = f64::from(f32::from_bits(expected.depth[*place]));
            is_beyond(culling, camera, &culled, pixel, depth)
        });
        if !differing.is_empty() && all_beyond {
            excused += differing.len();
            expected.depth[places.clone()].copy_from_slice(&seen.depth[places]);
            let bytes = 4 * pixel..4 * pixel + 4;
            expected.rgba[bytes.clone()].copy_from_slice(&seen.rgba[bytes]);
        }
    }
    excused
}

/// Whether the last frame drew each body.
fn drawn(renderer: &Renderer) -> Vec<bool> {
    let mut drawn = vec![false; renderer.scene.bodies.len()];
    for mask in renderer.masks() {
        let gpu: &Arc<Gpu> = &renderer.gpu;
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&gpu.read_buffer(mask).expect("a mask"));
        for (body, drawn) in drawn.iter_mut().enumerate() {
            *drawn |= words[body / 32] >> (body % 32) & 1 == 1;
        }
    }
    drawn
}
