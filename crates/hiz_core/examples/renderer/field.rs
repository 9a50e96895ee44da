//! Hills with hexagonal columns, and balls at all heights.
//!
//! Nothing is parallel to an axis.
//! The cull tests spheres, and the renderer draws facets inside of them.

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Vec3};

use crate::scene::{Body, Mesh, Random, Scene, Shape, Shot};

/// Half of the field's side, in metres.
const HALF_SIDE: f64 = 60.0;
/// Quads of the ground per side.
const QUADS: usize = 40;

/// The field around `origin`.
pub(crate) fn scene(origin: Vec3) -> Scene {
    let mut random = Random(23);
    let mut walls = Mesh::default();
    let step = 2.0 * HALF_SIDE / QUADS as f64;
    let ground = |i: usize, j: usize| {
        let [x, z] = [i, j].map(|n| n as f64 * step - HALF_SIDE);
        [x, height(x, z), z]
    };
    for i in 0..QUADS {
        for j in 0..QUADS {
            let [a, b, c, d] =
                [ground(i, j), ground(i, j + 1), ground(i + 1, j), ground(i + 1, j + 1)];
            walls.push_triangle([a, b, c], [0.45, 0.6, 0.35]);
            walls.push_triangle([c, b, d], [0.45, 0.6, 0.35]);
        }
    }
    for _ in 0..70 {
        let at = [0; 2].map(|_| random.range(-HALF_SIDE + 3.0, HALF_SIDE - 3.0));
        let (radius, top, turn) =
            (random.range(0.6, 2.5), random.range(3.0, 12.0), random.range(0.0, 1.0));
        add_column(&mut walls, at, radius, top, turn);
    }
    let crowd: Vec<Body> = (0..4000)
        .map(|_| {
            let [x, z] = [0; 2].map(|_| random.range(-HALF_SIDE, HALF_SIDE));
            let radius = random.range(0.15, 0.3) * random.pick(&[1.0, 1.0, 3.0]);
            // Some are below the ground, and most are just above it.
            let center =
                [x, height(x, z) + random.range(-1.0, 2.0) * random.pick(&[1.0, 1.0, 4.0]), z];
            Body { shape: Shape::Ball { center, radius }, colour: random.colour() }
        })
        .collect();
    Scene::at(origin, "field", &crowd, walls, [HALF_SIDE, 14.0, HALF_SIDE])
}

/// The height of the hills at a place.
fn height(x: f64, z: f64) -> f64 {
    5.0 * (x / 13.0).sin() * (z / 17.0).cos()
        + 3.0 * ((x + 2.0 * z) / 23.0).sin()
        + 0.4 * (x / 2.9).cos() * (z / 3.1).sin()
}

fn add_column(walls: &mut Mesh, [x, z]: [f64; 2], radius: f64, top: f64, turn: f64) {
    let foot = height(x, z);
    let corner = |k: u32, y: f64| {
        let (s, c) = ((f64::from(k) + turn) * std::f64::consts::FRAC_PI_3).sin_cos();
        [x + radius * c, foot + y, z + radius * s]
    };
    for k in 0..6 {
        // The columns reach so deep that no slope shows their lower ends.
        let [a, b, c, d] =
            [corner(k, -4.0), corner(k + 1, -4.0), corner(k, top), corner(k + 1, top)];
        walls.push_triangle([a, b, c], [0.7, 0.62, 0.5]);
        walls.push_triangle([c, b, d], [0.7, 0.62, 0.5]);
        walls.push_triangle([c, d, [x, foot + top, z]], [0.75, 0.7, 0.6]);
    }
}

/// The cameras around `origin`, for images of `size`.
pub(crate) fn shots(origin: Vec3, size: ImageSize) -> hiz_core::Result<Vec<Shot>> {
    let shot = |name, eye: Vec3, target: Vec3, (near, far, convention), crowd_occludes| {
        let [eye, target] = [eye, target].map(|p| [0, 1, 2].map(|k| p[k] + origin[k]));
        let projection = Projection::Perspective { fov_y: 0.9, near, far, convention };
        let camera =
            Camera::look_at(&Pose { eye, target, up: [0.0, 1.0, 0.0] }, &projection, size)?;
        Ok(Shot { name, camera, crowd_occludes })
    };
    let (standard, reversed) =
        ((0.2, Some(300.0), DepthConvention::Standard), (0.1, None, DepthConvention::Reversed));
    Ok(vec![
        shot("field_from_a_valley", [-20.0, 4.5, 40.0], [10.0, 1.0, -20.0], reversed, false)?,
        shot("field_from_above", [-50.0, 25.0, -50.0], [0.0, -2.0, 0.0], standard, false)?,
        shot("field_hides_itself", [12.0, 4.0, 50.0], [0.0, 0.0, -10.0], standard, true)?,
    ])
}
