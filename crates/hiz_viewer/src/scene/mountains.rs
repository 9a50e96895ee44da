//! Mountains: ridges hide ridges, and thousands of trees.
//!
//! The terrain is split into patches.
//! Each patch is an occluder and an instance at once, so what lies behind a ridge is not drawn.
//! After Rakos, Hierarchical-Z map based occlusion culling (2010), whose demo is called Mountains.

use hiz_core::{LodRule, Vec3};

use crate::mesh::{Mesh, unit};
use crate::scene::random::{Random, noise};
use crate::scene::{Body, Kind, Leg, Scene, boxes, by_kind};

/// Patches per side, quads per side of a patch, and metres per quad.
const PATCHES: usize = 20;
const QUADS: usize = 16;
const STEP: f64 = 12.0;
/// Half of the terrain's side in metres.
const HALF: f64 = PATCHES as f64 * QUADS as f64 * STEP / 2.0;
const TREES: usize = 12_000;
/// Kinds of trees behind the kinds of the patches: a conifer and a broad one.
const CONIFER: u32 = (PATCHES * PATCHES) as u32;
const BROAD: u32 = CONIFER + 1;

/// The scene.
pub(crate) fn scene() -> Scene {
    let mut kinds = Vec::new();
    let mut bodies = Vec::new();
    for i in 0..PATCHES {
        for j in 0..PATCHES {
            let middle = [i, j].map(|k| (k as f64 + 0.5) * QUADS as f64 * STEP - HALF);
            let ground = height(middle[0], middle[1]);
            let at = [middle[0], ground, middle[1]];
            kinds.push(Kind::of(patch(at)));
            bodies.push(Body::at(kinds.len() as u32 - 1, at.map(|v| v as f32), true));
        }
    }
    kinds.push(Kind::with_lods(conifers(), 1.0));
    kinds.push(Kind::with_lods(broad_trees(), 1.0));
    bodies.extend(trees());
    let bodies = by_kind(bodies);
    let volumes = boxes(&kinds, &bodies);
    Scene {
        name: "mountains",
        kinds,
        bodies,
        volumes,
        rule: LodRule::Error { pixels: 1.0 },
        legs: legs(),
        fov_y: 0.85,
        near: 0.5,
        far: None,
        speed: 60.0,
    }
}

/// The height at a place in metres, a multiple of 1/64: the sum of ridges that get smaller.
///
/// Each octave of ridges is weighed by the one before (Musgrave, Procedural fractal terrains, in
/// Texturing and Modeling, 2003).
/// So sums of a patch's place and a height are exact in float32, and patches meet without cracks.
fn height(x: f64, z: f64) -> f64 {
    let bend = [noise(x / 900.0, z / 900.0, 5), noise(x / 900.0, z / 900.0, 6)];
    let (x, z) = (x + 140.0 * bend[0], z + 140.0 * bend[1]);
    let (mut sum, mut weight, mut size, mut tall) = (0.0, 1.0, 1500.0, 380.0);
    for octave in 0..5 {
        let ridge = 1.0 - noise(x / size, z / size, octave).abs();
        let ridge = ridge * ridge * weight;
        sum += tall * ridge;
        weight = (1.6 * ridge).clamp(0.0, 1.0);
        size *= 0.47;
        tall *= 0.38;
    }
    let valley = 60.0 * noise(x / 700.0, z / 700.0, 77);
    (64.0 * (sum + valley - 250.0)).round() / 64.0
}

/// Up from the ground, from heights a few metres around.
fn normal(x: f64, z: f64) -> Vec3 {
    const AROUND: f64 = 6.0;
    let slope_x = height(x + AROUND, z) - height(x - AROUND, z);
    let slope_z = height(x, z + AROUND) - height(x, z - AROUND);
    unit([-slope_x, 2.0 * AROUND, -slope_z])
}

/// Grass, rock where it is steep, snow on top.
fn colour(x: f64, y: f64, z: f64, up: f64) -> [f32; 3] {
    let patchy = noise(x / 90.0, z / 90.0, 31);
    let rock = ((0.80 - up) / 0.10 + 0.3 * patchy).clamp(0.0, 1.0);
    let snow =
        ((y + 30.0 * patchy - 230.0) / 40.0).clamp(0.0, 1.0) * ((up - 0.6) / 0.15).clamp(0.0, 1.0);
    let grass = [0.34 + 0.05 * patchy, 0.45 + 0.04 * patchy, 0.22];
    let mix = |a: [f64; 3], b: [f64; 3], t: f64| [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]));
    mix(mix(grass, [0.47, 0.43, 0.39], rock), [0.93, 0.95, 0.98], snow).map(|v| v as f32)
}

/// The patch around a place, in coordinates relative to it.
fn patch([x, y, z]: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    let half = QUADS as f64 * STEP / 2.0;
    for i in 0..=QUADS {
        for j in 0..=QUADS {
            let [u, v] = [i, j].map(|k| k as f64 * STEP - half);
            let (tall, up) = (height(x + u, z + v), normal(x + u, z + v));
            mesh.push([u, tall - y, v], up, colour(x + u, tall, z + v, up[1]));
        }
    }
    let at = |i: usize, j: usize| (i * (QUADS + 1) + j) as u32;
    for i in 0..QUADS {
        for j in 0..QUADS {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)];
            mesh.indices.extend([a, b, c, c, b, d]);
        }
    }
    mesh
}

/// Conifers of height 1 with their feet at 0: a trunk and three cones, down to one cone.
fn conifers() -> Vec<Mesh> {
    let (bark, needles) = ([0.35, 0.26, 0.18], [0.20, 0.36, 0.20]);
    let tree = |sides: u32, cones: &[([f64; 2], f64)]| {
        let mut mesh = Mesh::default();
        mesh.push_cone(sides.min(5), [0.0, 0.5], 0.05, bark);
        for (ends, radius) in cones {
            mesh.push_cone(sides, *ends, *radius, needles);
        }
        mesh
    };
    let [low, middle, top] = [([0.12, 0.58], 0.22), ([0.34, 0.80], 0.17), ([0.58, 1.0], 0.115)];
    vec![
        tree(14, &[low, middle, top]),
        tree(8, &[low, middle, top]),
        tree(6, &[([0.12, 0.72], 0.20), ([0.5, 1.0], 0.13)]),
        tree(4, &[([0.12, 1.0], 0.20)]),
    ]
}

/// Broad trees of height 1 with their feet at 0: a trunk and a round crown.
fn broad_trees() -> Vec<Mesh> {
    let tree = |points: u32, sides: u32| {
        let mut mesh = Mesh::default();
        mesh.push_cone(sides, [0.0, 0.8], 0.06, [0.36, 0.28, 0.2]);
        let crown = Mesh::sphere(points, [0.36, 0.44, 0.18]);
        let first = mesh.vertices.len() as u32;
        for mut vertex in crown.vertices {
            let [x, y, z] = vertex.position;
            vertex.position = [0.3 * x, 0.64 + 0.36 * y, 0.3 * z];
            mesh.vertices.push(vertex);
        }
        mesh.indices.extend(crown.indices.iter().map(|i| first + i));
        mesh
    };
    vec![tree(16, 6), tree(10, 4), tree(6, 3)]
}

/// Trees in groves, where the ground is neither steep nor high.
fn trees() -> Vec<Body> {
    let mut random = Random(2010);
    let mut bodies = Vec::new();
    while bodies.len() < TREES {
        let [x, z] = [0; 2].map(|_| random.range(-0.97 * HALF, 0.97 * HALF));
        let grove = noise(x / 260.0, z / 260.0, 99) + 0.5 * noise(x / 90.0, z / 90.0, 98);
        let ground = height(x, z);
        if random.range(-0.3, 0.9) > grove || normal(x, z)[1] < 0.70 || ground > 180.0 {
            continue;
        }
        let kind = if ground + random.range(-40.0, 40.0) > -20.0 { CONIFER } else { BROAD };
        let tall = random.range(9.0, 20.0);
        let turn = random.range(0.0, std::f64::consts::TAU);
        let [light, warm] = [random.range(0.8, 1.15), random.range(0.92, 1.1)];
        bodies.push(Body {
            kind,
            position: [x, ground - 0.6, z].map(|v| v as f32),
            scale: tall as f32,
            turn: [turn.sin() as f32, turn.cos() as f32],
            tint: [light * warm, light, light / warm].map(|v| v as f32),
            occluder: false,
        });
    }
    bodies
}

/// Flights: along valleys close to the ground, over a ridge, and high above.
fn legs() -> Vec<Leg> {
    let above = |[x, over, z]: Vec3| [x, height(x, z) + over, z];
    let flight = |from: Vec3, to: Vec3, [down, turn]: [f64; 2]| {
        let eyes = [above(from), above(to)];
        let heading = (to[2] - from[2]).atan2(to[0] - from[0]);
        let ahead = |eye: Vec3, by: f64| {
            let (sin, cos) = (heading + by).sin_cos();
            [eye[0] + 300.0 * cos, eye[1] - down, eye[2] + 300.0 * sin]
        };
        Leg { eyes, targets: [ahead(eyes[0], 0.0), ahead(eyes[1], turn)] }
    };
    vec![
        flight([700.0, 30.0, 900.0], [480.0, 40.0, 640.0], [5.0, -0.3]),
        flight([-200.0, 120.0, 1200.0], [-120.0, 110.0, 900.0], [60.0, 0.2]),
        flight([-900.0, 45.0, -700.0], [-600.0, 40.0, -560.0], [25.0, 0.4]),
    ]
}
