//! A city from a seed: buildings hide cars, lamps, people and trees, and one another.

use hiz_core::{LodRule, Vec3};

use crate::mesh::Mesh;
use crate::scene::random::Random;
use crate::scene::{Body, Kind, Leg, Scene, boxes, by_kind};

/// Blocks per side, metres from street to street, and the width of a street.
const BLOCKS: usize = 10;
const PITCH: f64 = 80.0;
const STREET: f64 = 16.0;
const THINGS: usize = 10_000;
/// Eyes are this high above the street.
const EYE: f64 = 1.7;

const CAR: u32 = 0;
const LAMP: u32 = 1;
const PERSON: u32 = 2;
const TREE: u32 = 3;
const GROUND: u32 = 4;
const FIRST_BUILDING: u32 = 5;

/// The scene.
pub(crate) fn scene() -> Scene {
    let mut random = Random(2010);
    let mut kinds = vec![
        Kind::with_lods(cars(), 4.4),
        Kind::with_lods(lamps(), 7.0),
        Kind::with_lods(people(), 1.7),
        Kind::with_lods(trees(), 6.0),
    ];
    let side = BLOCKS as f64 * PITCH + STREET;
    let mut ground = Mesh::default();
    ground.push_box([0.0, -0.5, 0.0], [side, 0.0, side], [0.40, 0.41, 0.43]);
    kinds.push(Kind::of(ground));
    let mut bodies = vec![Body::at(GROUND, [0.0; 3], true)];
    for (i, j) in (0..BLOCKS).flat_map(|i| (0..BLOCKS).map(move |j| (i, j))) {
        let corner = [i, j].map(|k| k as f64 * PITCH + STREET);
        add_block(&mut random, corner, &mut kinds, &mut bodies);
    }
    bodies.extend((0..THINGS).map(|_| thing(&mut random, side)));
    let bodies = by_kind(bodies);
    let volumes = boxes(&kinds, &bodies);
    let street = |k: f64| k * PITCH + STREET / 2.0;
    let leg = |eyes, targets| Leg { eyes, targets };
    Scene {
        name: "city",
        kinds,
        bodies,
        volumes,
        rule: LodRule::Error { pixels: 1.0 },
        legs: vec![
            leg(
                [[street(2.0), EYE, 60.0], [street(2.0) + 2.0, EYE, 110.0]],
                [[street(2.0), 4.0, 300.0], [street(2.0) + 20.0, 4.0, 300.0]],
            ),
            leg(
                [[300.0, EYE, street(5.0)], [340.0, EYE, street(5.0) - 3.0]],
                [[500.0, 5.0, street(5.0) + 40.0], [560.0, 5.0, street(5.0) + 4.0]],
            ),
            leg(
                [[120.0, 40.0, 90.0], [150.0, 34.0, 120.0]],
                [[420.0, 0.0, 420.0], [420.0, 0.0, 430.0]],
            ),
        ],
        fov_y: 1.0,
        near: 0.1,
        far: None,
        speed: 12.0,
    }
}

/// Appends the buildings of the block at a corner: two or three lots per side.
fn add_block(random: &mut Random, corner: [f64; 2], kinds: &mut Vec<Kind>, bodies: &mut Vec<Body>) {
    let [columns, rows] = [0; 2].map(|_| 2 + random.below(2));
    let inner = PITCH - STREET;
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let [wide, deep] = [inner / columns as f64, inner / rows as f64];
        let gap = random.range(0.0, 3.0);
        let tall = random.range(9.0, 24.0) + if random.below(8) == 0 { 30.0 } else { 0.0 };
        let at = [corner[0] + i as f64 * wide, 0.0, corner[1] + j as f64 * deep];
        let stone = random.range(0.55, 0.85) as f32;
        let mesh = building([wide - gap, tall, deep - gap], [stone, 0.94 * stone, 0.85 * stone]);
        kinds.push(Kind::of(mesh));
        let place = at.map(|v| v as f32);
        bodies.push(Body::at(
            FIRST_BUILDING + (kinds.len() as u32 - 1 - FIRST_BUILDING),
            place,
            true,
        ));
    }
}

/// A box with rows of windows that stand out by a hand.
fn building([wide, tall, deep]: Vec3, stone: [f32; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.push_box([0.0, 0.0, 0.0], [wide, tall, deep], stone);
    mesh.push_box([0.4, tall, 0.4], [wide - 0.4, tall + 0.6, deep - 0.4], stone.map(|c| 0.8 * c));
    let glass = [0.25, 0.32, 0.40];
    let floors = (tall / 3.2) as usize;
    for floor in 0..floors {
        let y = 1.0 + 3.2 * floor as f64;
        for (length, along_x) in [(wide, true), (deep, false)] {
            let windows = (length / 3.5) as usize;
            for w in 0..windows {
                let a = 1.0 + w as f64 * (length - 1.0) / windows as f64;
                let (b, top) = (a + 1.4, y + 1.6);
                if along_x {
                    mesh.push_box([a, y, -0.06], [b, top, deep + 0.06], glass);
                } else {
                    mesh.push_box([-0.06, y, a], [wide + 0.06, top, b], glass);
                }
            }
        }
    }
    mesh
}

/// A thing somewhere in a street.
fn thing(random: &mut Random, side: f64) -> Body {
    let kind = [CAR, CAR, CAR, LAMP, PERSON, PERSON, PERSON, TREE][random.below(8)];
    let street = random.below(BLOCKS + 1) as f64 * PITCH;
    let (along, across) = (random.range(1.0, side - 1.0), random.range(0.8, STREET - 0.8));
    let x_street = random.below(2) == 0;
    let across = match kind {
        LAMP | TREE => [1.2, STREET - 1.2][random.below(2)],
        _ => across,
    };
    let [x, z] = if x_street { [along, street + across] } else { [street + across, along] };
    let turn = if x_street { 0.0 } else { std::f64::consts::FRAC_PI_2 }
        + if kind == CAR { random.range(-0.05, 0.05) } else { random.range(0.0, 6.2) };
    let tint = match kind {
        CAR => [0; 3].map(|_| random.range(0.3, 1.0) as f32),
        PERSON => [random.range(0.4, 1.0) as f32, 0.6, random.range(0.4, 1.0) as f32],
        _ => [random.range(0.8, 1.1) as f32; 3],
    };
    let position = [x, 0.0, z].map(|v| v as f32);
    let turn = [turn.sin() as f32, turn.cos() as f32];
    Body { tint, turn, ..Body::at(kind, position, false) }
}

fn boxes_mesh(parts: &[(Vec3, Vec3, [f32; 3])]) -> Mesh {
    let mut mesh = Mesh::default();
    for (min, max, colour) in parts {
        mesh.push_box(*min, *max, *colour);
    }
    mesh
}

/// A car along x: body, cabin and wheels, then without wheels, then one box.
fn cars() -> Vec<Mesh> {
    let (paint, glass, tyre) = ([0.9; 3], [0.25, 0.3, 0.35], [0.1; 3]);
    let body = ([-2.2, 0.25, -0.9], [2.2, 0.9, 0.9], paint);
    let cabin = ([-1.1, 0.9, -0.8], [1.2, 1.45, 0.8], glass);
    let roof = ([-1.0, 1.45, -0.75], [1.1, 1.5, 0.75], paint);
    let wheel = |x: f64, z: f64| ([x - 0.32, 0.0, z - 0.1], [x + 0.32, 0.64, z + 0.1], tyre);
    let wheels = [(-1.4, -0.82), (-1.4, 0.82), (1.4, -0.82), (1.4, 0.82)];
    let mut all = vec![body, cabin, roof];
    all.extend(wheels.map(|(x, z)| wheel(x, z)));
    vec![
        boxes_mesh(&all),
        boxes_mesh(&[body, cabin, ([-1.7, 0.0, -0.8], [1.7, 0.25, 0.8], tyre)]),
        boxes_mesh(&[([-2.2, 0.1, -0.9], [2.2, 1.1, 0.9], paint)]),
    ]
}

fn lamps() -> Vec<Mesh> {
    let steel = [0.35, 0.37, 0.4];
    let pole = ([-0.08, 0.0, -0.08], [0.08, 7.0, 0.08], steel);
    let arm = ([-0.06, 6.9, -0.06], [1.6, 7.02, 0.06], steel);
    let head = ([1.1, 6.8, -0.14], [1.7, 6.92, 0.14], [0.9, 0.88, 0.7]);
    let foot = ([-0.2, 0.0, -0.2], [0.2, 0.3, 0.2], steel);
    vec![boxes_mesh(&[pole, arm, head, foot]), boxes_mesh(&[pole, arm])]
}

fn people() -> Vec<Mesh> {
    let (skin, cloth, dark) = ([0.85, 0.7, 0.6], [0.8; 3], [0.25; 3]);
    let legs = ([-0.12, 0.0, -0.18], [0.12, 0.8, 0.18], dark);
    let torso = ([-0.14, 0.8, -0.24], [0.14, 1.42, 0.24], cloth);
    let head = ([-0.1, 1.45, -0.1], [0.1, 1.72, 0.1], skin);
    vec![
        boxes_mesh(&[legs, torso, head]),
        boxes_mesh(&[([-0.12, 0.0, -0.2], [0.12, 1.7, 0.2], cloth)]),
    ]
}

fn trees() -> Vec<Mesh> {
    let tree = |points: u32, sides: u32| {
        let mut mesh = Mesh::default();
        mesh.push_cone(sides, [0.0, 4.5], 0.22, [0.36, 0.28, 0.2]);
        let first = mesh.vertices.len() as u32;
        let crown = Mesh::sphere(points, [0.32, 0.46, 0.22]);
        for mut vertex in crown.vertices {
            let [x, y, z] = vertex.position;
            vertex.position = [1.6 * x, 4.2 + 1.8 * y, 1.6 * z];
            mesh.vertices.push(vertex);
        }
        mesh.indices.extend(crown.indices.iter().map(|i| first + i));
        mesh
    };
    vec![tree(18, 7), tree(12, 5), tree(8, 3)]
}
