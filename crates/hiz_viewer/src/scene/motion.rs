//! Bodies that move, appear and disappear: where everything is in a frame.

use crate::scene::{Body, Scene, Volumes};

/// Of so many bodies that hide nothing, one drifts about its place.
const DRIFTS: usize = 5;
/// Of so many, one comes and goes.
const COMES: usize = 11;
/// Frames for which it stays, and stays away.
const STAYS: usize = 3;
/// How far a body drifts, in metres.
const REACH: f64 = 0.8;
/// How far below its place a body is that is away: under the ground of every scene.
const AWAY: f64 = -4000.0;

/// The bodies of frame `frame` and their bounds.
pub(crate) fn moved(scene: &Scene, frame: usize) -> (Vec<Body>, Volumes) {
    let offsets: Vec<_> = (0..scene.bodies.len()).map(|i| offset(scene, i, frame)).collect();
    let bodies: Vec<_> = scene
        .bodies
        .iter()
        .zip(&offsets)
        .map(|(body, offset)| {
            let position = [0, 1, 2].map(|k| (f64::from(body.position[k]) + offset[k]) as f32);
            Body { position, ..*body }
        })
        .collect();
    // As float32 has moved the body, and for what that rounds in the vertex shader.
    let shift = |i: usize, k: usize| {
        f64::from(bodies[i].position[k]) - f64::from(scene.bodies[i].position[k])
    };
    let pad = |i: usize, k: usize| shift(i, k).abs() * 2.0_f64.powi(-21);
    let volumes = match &scene.volumes {
        Volumes::Boxes { min, max } => {
            let moved = |corners: &[f64], side: f64| {
                let of = |(j, v): (usize, &f64)| v + shift(j / 3, j % 3) + side * pad(j / 3, j % 3);
                corners.iter().enumerate().map(of).collect()
            };
            Volumes::Boxes { min: moved(min, -1.0), max: moved(max, 1.0) }
        }
        Volumes::Spheres { centers, radii } => Volumes::Spheres {
            centers: centers.iter().enumerate().map(|(j, v)| v + shift(j / 3, j % 3)).collect(),
            radii: (0..radii.len())
                .map(|i| radii[i] + 2.0 * (0..3).map(|k| pad(i, k)).sum::<f64>())
                .collect(),
        },
    };
    (bodies, volumes)
}

/// How far a body is from its place.
fn offset(scene: &Scene, i: usize, frame: usize) -> [f64; 3] {
    if scene.bodies[i].occluder || frame == 0 {
        return [0.0; 3];
    }
    if i.is_multiple_of(COMES) && (i / COMES + frame / STAYS) % 2 == 1 {
        return [0.0, AWAY, 0.0];
    }
    if !i.is_multiple_of(DRIFTS) {
        return [0.0; 3];
    }
    let phase = 0.7 * frame as f64 + i as f64;
    [REACH * phase.sin(), 0.2 * REACH * (1.3 * phase).sin(), REACH * phase.cos()]
}
