//! Random cameras for a scene.
//! Some stress rasterisers and float32, some make depths tie, and the rest are anywhere.

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Vec3};

use crate::scene::{Mesh, Random, Scene, Shot, normal};

/// The kinds of camera, taken in turn.
pub(crate) const KINDS: [&str; 8] = [
    // Along an axis: faces are edge-on or parallel to the image, where depths tie.
    "straight",
    "anywhere",
    // The eye is in a face's plane or next to it and looks along it at less than a degree.
    "grazing",
    "off_centre",
    // In no special direction.
    // lavapipe gives arbitrary depth to faces that are exactly edge-on (`docs/accuracy.md`).
    "orthographic",
    // The eye is on a body or inside it.
    "touching",
    // A near plane metres away that cuts through bodies.
    "cutting",
    // An orthographic camera inside the scene, whose near plane cuts bodies.
    "orthographic_inside",
];

const SIZES: [(u32, u32); 10] = [
    (321, 203),
    (320, 180),
    (257, 129),
    (127, 255),
    (128, 128),
    (321, 203),
    (199, 101),
    (65, 63),
    (33, 17),
    (5, 3),
];

const CONVENTIONS: [DepthConvention; 2] = [DepthConvention::Standard, DepthConvention::Reversed];

fn along(p: Vec3, v: Vec3, t: f64) -> Vec3 {
    [0, 1, 2].map(|k| p[k] + t * v[k])
}

fn unit(v: Vec3) -> Vec3 {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

fn direction(random: &mut Random) -> Vec3 {
    unit([0; 3].map(|_| random.range(-1.0, 1.0) + 1e-9))
}

fn axis(random: &mut Random) -> Vec3 {
    let mut v = [0.0; 3];
    v[random.below(3)] = random.pick(&[-1.0, 1.0]);
    v
}

/// A point of a random triangle, the triangle's normal, and a direction in its plane.
fn on_a_face(mesh: &Mesh, random: &mut Random) -> (Vec3, Vec3, Vec3) {
    let corners =
        mesh.triangles[random.below(mesh.triangles.len())].map(|v| mesh.vertices[v as usize]);
    let [a, b, c] = corners;
    let [u, v] = [random.range(0.0, 0.5), random.range(0.0, 0.5)];
    let [to_b, to_c] = [b, c].map(|p| along(p, a, -1.0));
    let n = normal(corners).map(|x| x * random.pick(&[-1.0, 1.0]));
    (along(along(a, to_b, u), to_c, v), n, unit(random.pick(&[to_b, to_c])))
}

/// `count` cameras for `scene`.
pub(crate) fn random_shots(scene: &Scene, count: usize, seed: u64) -> Vec<Shot> {
    let mut random = Random(seed);
    (0..count).map(|i| random_shot(scene, KINDS[i % KINDS.len()], &mut random)).collect()
}

fn random_shot(scene: &Scene, name: &'static str, random: &mut Random) -> Shot {
    let mut eye: Vec3 =
        [0, 1, 2].map(|k| scene.origin[k] + random.range(-1.1, 1.1) * scene.reach[k]);
    if random.below(4) > 0 {
        eye[1] = scene.origin[1] + random.range(0.2, 1.0) * scene.reach[1];
    }
    let mut forward = direction(random);
    match name {
        "straight" => forward = axis(random),
        "off_centre" if random.below(2) == 0 => forward = axis(random),
        "grazing" => {
            let bodies = Mesh::of_bodies([&random.pick(&scene.crowd)]);
            let mesh = if random.below(3) == 0 { &bodies } else { &scene.walls };
            let (point, away, tangent) = on_a_face(mesh, random);
            eye = along(
                along(point, away, random.pick(&[0.0, 1e-6, 1e-3, 0.03])),
                tangent,
                -random.range(0.0, 3.0),
            );
            forward = unit(along(tangent, away, random.pick(&[0.0, 1e-4, -1e-3, -1e-2])));
        }
        "touching" => {
            let bodies = Mesh::of_bodies([&random.pick(&scene.crowd)]);
            let (point, away, tangent) = on_a_face(&bodies, random);
            eye = along(point, away, random.pick(&[0.0, 1e-5, 0.05, -1e-5, -0.05]));
            forward =
                unit(along(along(tangent, away, random.range(-1.0, 1.0)), direction(random), 0.3));
        }
        "cutting" => {
            forward = unit(along(
                direction(random),
                unit([0, 1, 2].map(|k| scene.origin[k] - eye[k] + 1e-3)),
                1.0,
            ));
        }
        _ => {}
    }
    let convention = random.pick(&CONVENTIONS);
    let far = random.pick(&[None, Some(90.0), Some(400.0)]);
    let near = if name == "cutting" {
        random.range(0.5, 8.0)
    } else {
        10.0_f64.powf(random.range(-3.0, 0.0))
    };
    let (width, height) = random.pick(&SIZES);
    let aspect = f64::from(width) / f64::from(height);
    let projection = match name {
        "off_centre" => {
            let [left, bottom] = [0; 2].map(|_| random.range(-1.0, 0.5));
            Projection::Frustum {
                left: left * aspect,
                right: (left + random.range(0.3, 1.5)) * aspect,
                bottom,
                top: bottom + random.range(0.3, 1.5),
                near,
                far,
                convention,
            }
        }
        "orthographic" | "orthographic_inside" => {
            let half = random.range(1.0, 0.6 * scene.reach[0]);
            let depth = 4.0 * scene.reach[0];
            let inside = name == "orthographic_inside";
            let length = if inside { random.range(0.2, 1.0) * depth } else { depth };
            if !inside {
                eye = along(scene.origin, forward, -0.5 * depth);
            }
            // The eye is where depth is 0.
            // The engine's own prepass has its origin there, too, and rounds as the picture does.
            let (near, far) = if convention.is_reversed() { (-length, 0.0) } else { (0.0, length) };
            if convention.is_reversed() {
                eye = along(eye, forward, length);
            }
            Projection::Orthographic {
                left: -half * aspect,
                right: half * aspect,
                bottom: -half,
                top: half,
                near,
                far,
                convention,
            }
        }
        _ => Projection::Perspective { fov_y: random.range(0.3, 2.0), near, far, convention },
    };
    // Upright or rolled; along another axis where the view is straight up or down.
    let mut up = if random.below(2) == 0 { [0.0, 1.0, 0.0] } else { direction(random) };
    if forward[1].abs() > 0.999 {
        up = [1.0, 0.0, 0.0];
    }
    let pose = Pose { eye, target: along(eye, forward, 7.0), up };
    let camera = Camera::look_at(&pose, &projection, ImageSize::new(width, height))
        .expect("a camera that can be used");
    Shot { name, camera, crowd_occludes: random.below(2) == 0 }
}
