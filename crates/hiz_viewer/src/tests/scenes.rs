//! What scenes say of themselves holds: bounds, errors of LODs, and ARM's numbers.

use std::collections::HashMap;

use hiz_core::{LodRule, Vec3};

use crate::mesh::Mesh;
use crate::scene::{Body, NAMES, Scene, Volumes};

fn scene(name: &str) -> Scene {
    Scene::by_name(name).expect("it needs no data")
}

/// Where the vertex shader places a vertex, in its own float32 arithmetic.
fn placed(body: &Body, [x, y, z]: [f32; 3]) -> [f32; 3] {
    let [sin, cos] = body.turn;
    let turned = [cos * x + sin * z, y, cos * z - sin * x];
    [0, 1, 2].map(|k| body.position[k] + body.scale * turned[k])
}

#[test]
fn bounds_contain_what_is_drawn() {
    for name in NAMES {
        let scene = scene(name);
        for (i, body) in scene.bodies.iter().enumerate().step_by(7) {
            let lods = &scene.kinds[body.kind as usize].lods;
            for vertex in lods.iter().flat_map(|lod| &lod.mesh.vertices) {
                let p = placed(body, vertex.position).map(f64::from);
                let is_inside = match &scene.volumes {
                    Volumes::Boxes { min, max } => {
                        (0..3).all(|k| min[3 * i + k] <= p[k] && p[k] <= max[3 * i + k])
                    }
                    Volumes::Spheres { centers, radii } => {
                        let d: f64 = (0..3).map(|k| (p[k] - centers[3 * i + k]).powi(2)).sum();
                        d <= radii[i].powi(2)
                    }
                };
                assert!(is_inside, "{name}: body {i} at {p:?}");
            }
        }
    }
}

/// Points of a mesh's triangles, so many along each edge.
fn points(mesh: &Mesh, cuts: u32) -> Vec<Vec3> {
    let corner = |i: u32| mesh.vertices[i as usize].position.map(f64::from);
    let of_triangle = |t: &[u32]| {
        let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
        let mut found = Vec::new();
        for i in 0..=cuts {
            for j in 0..=cuts - i {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(cuts));
                found.push([0, 1, 2].map(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k])));
            }
        }
        found
    };
    mesh.indices.chunks_exact(3).flat_map(of_triangle).collect()
}

/// The errors are bounds, and not much more.
/// Points of one surface are compared with points of the other, which are not nearer than it.
#[test]
fn errors_of_lods_bound_how_far_they_are() {
    // Kinds with LODs, and how far they reach.
    for (name, size) in [("mountains", 1.0), ("city", 3.0)] {
        let scene = scene(name);
        let kinds: Vec<_> = scene.kinds.iter().filter(|kind| kind.lods.len() > 1).collect();
        assert!(!kinds.is_empty());
        for lods in kinds.iter().map(|kind| &kind.lods) {
            assert_eq!(lods[0].error, 0.0);
            let full = points(&lods[0].mesh, 5);
            for lod in &lods[1..] {
                let coarse = points(&lod.mesh, 12);
                let worst = farthest(&full, &coarse).max(farthest(&coarse, &full));
                assert!(
                    worst < lod.error + 0.25 * size,
                    "{name}: {worst} is more than {} and the points' distance",
                    lod.error
                );
                assert!(lod.error < 0.6 * size + worst, "{name}: {} for {worst}", lod.error);
            }
        }
    }
}

/// The greatest distance of a point of `from` to the nearest one of `to`.
fn farthest(from: &[Vec3], to: &[Vec3]) -> f64 {
    let square = |a: &Vec3, b: &Vec3| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>();
    let nearest = |p: &Vec3| to.iter().map(|q| square(p, q)).fold(f64::MAX, f64::min);
    from.iter().step_by(5).map(nearest).fold(0.0, f64::max).sqrt()
}

/// The numbers of ARM's source code.
#[test]
fn arms_scene_is_arms() {
    let scene = scene("arm");
    let of = |kind: u32| scene.bodies.iter().filter(|b| b.kind == kind).collect::<Vec<_>>();
    let (prisms, balls) = (of(0), of(1));
    assert_eq!((prisms.len(), balls.len()), (160, 24 * 24 * 24));
    let in_the_middle = |v: f32| v.abs() < 4.0;
    assert!(!prisms.iter().any(|b| in_the_middle(b.position[0]) && in_the_middle(b.position[2])));
    let radii = balls.iter().map(|b| b.scale);
    let [least, most] = [radii.clone().fold(f32::MAX, f32::min), radii.fold(0.0, f32::max)];
    assert!((0.15..0.151).contains(&least) && (0.299..=0.3).contains(&most), "{least} {most}");
    let points: Vec<_> = scene.kinds[1].lods.iter().map(|lod| lod.mesh.vertices.len()).collect();
    // Points on a circle, times half as many bands and a row more.
    assert_eq!(points, [24 * 13, 20 * 11, 16 * 9, 12 * 7]);
    let LodRule::Distance { thresholds } = &scene.rule else { panic!("{:?}", scene.rule) };
    for (threshold, depth) in thresholds.iter().zip([0.8, 0.9, 0.95]) {
        // With near 1 and far 500, standard depth is far (w - near) / (w (far - near)).
        let of_threshold = 500.0 * (threshold - 1.0) / (threshold * 499.0);
        assert!((of_threshold - depth).abs() < 1e-12, "{of_threshold} for {depth}");
    }
    let camera = scene.pose(0, 3);
    assert_eq!((camera.eye, scene.near, scene.far), ([0.0, 2.0, 0.0], 1.0, Some(500.0)));
}

/// Patches share the float32 positions of their borders, or sky would show between them.
#[test]
fn patches_meet_without_cracks() {
    let scene = scene("mountains");
    let mut heights: HashMap<[u32; 2], u32> = HashMap::new();
    let mut shared = 0;
    for body in scene.bodies.iter().filter(|body| body.occluder) {
        for vertex in &scene.kinds[body.kind as usize].lods[0].mesh.vertices {
            let [x, y, z] = placed(body, vertex.position).map(f32::to_bits);
            if let Some(other) = heights.insert([x, z], y) {
                shared += 1;
                assert_eq!(other, y);
            }
        }
    }
    // Each inner border has as many vertices as quads, and 20 patches a side have 19 of them.
    assert!(shared > 2 * 19 * 20 * 16, "{shared}");
}
