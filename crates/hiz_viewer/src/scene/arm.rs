//! ARM's scene: 160 prisms hide 13,824 spheres.
//!
//! After ARM, Occlusion Culling with Hierarchical-Z (OpenGL ES SDK): the numbers are those of its
//! source code.
//! Spheres have 24, 20, 16 and 12 points on each circle, by view depth.

use hiz_core::{DepthConvention, LodRule};

use crate::mesh::Mesh;
use crate::scene::random::Random;
use crate::scene::{Body, Kind, Leg, Scene, Volumes, by_kind};

const PRISM: u32 = 0;
const BALL: u32 = 1;
const GROUND: u32 = 2;

/// Points on a circle of each LOD.
const POINTS: [u32; 4] = [24, 20, 16, 12];
/// NDC depths at which the LOD changes, with ARM's standard Z.
const DEPTHS: [f64; POINTS.len() - 1] = [0.8, 0.9, 0.95];
const NEAR: f64 = 1.0;
const FAR: Option<f64> = Some(500.0);

/// The scene.
pub(crate) fn scene() -> Scene {
    let mut prism = Mesh::default();
    prism.push_box([-1.0, 0.0, -1.0], [1.0, 8.0, 1.0], [0.72, 0.66, 0.58]);
    let mut ground = Mesh::default();
    ground.push_box([-30.0, -0.25, -30.0], [30.0, 0.0, 30.0], [0.42, 0.46, 0.40]);
    let balls = POINTS.map(|points| Mesh::sphere(points, [1.0; 3])).into();
    let kinds = vec![Kind::of(prism), Kind::of_spheres(balls), Kind::of(ground)];

    let mut bodies = vec![Body::at(GROUND, [0.0; 3], true)];
    for x in 0..13 {
        for z in 0..13 {
            if !((5..8).contains(&x) && (5..8).contains(&z)) {
                let [x, z] = [x, z].map(|k| 3.0 * (k as f32 - 6.0));
                bodies.push(Body::at(PRISM, [x, 0.0, z], true));
            }
        }
    }
    let mut random = Random(24);
    for x in 0..24 {
        for y in 0..24 {
            for z in 0..24 {
                let [x, y, z] = [x, y, z].map(|k| k as f32);
                let shade = random.range(0.75, 1.0) as f32;
                bodies.push(Body {
                    scale: (0.30 * (1.0 - 0.5 * random.range(0.0, 1.0))) as f32,
                    tint: [shade, shade, 0.8 * shade],
                    ..Body::at(BALL, [x - 11.35, 0.1 * y + 0.5, z - 11.45], false)
                });
            }
        }
    }
    let bodies = by_kind(bodies);
    let volumes = spheres(&bodies);
    let rule = LodRule::at_ndc_depths(&DEPTHS, NEAR, FAR, DepthConvention::Standard)
        .expect("the depths ascend");
    let leg = |eyes, targets| Leg { eyes, targets };
    Scene {
        name: "arm",
        kinds,
        bodies,
        volumes,
        rule,
        legs: vec![
            // ARM's eye, turning.
            leg([[0.0, 2.0, 0.0]; 2], [[0.0, 1.4, -8.0], [7.0, 1.4, -4.0]]),
            // Along a corridor between prisms.
            leg([[1.5, 1.7, 15.0], [1.5, 1.6, 11.0]], [[1.5, 1.5, 0.0], [3.0, 1.5, 0.0]]),
            // From a corner, over the prisms.
            leg([[24.0, 12.0, 24.0], [22.0, 11.0, 24.0]], [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]),
        ],
        fov_y: std::f64::consts::FRAC_PI_3,
        near: NEAR,
        far: FAR,
        speed: 4.0,
    }
}

/// ARM's bounds: spheres, also around the prisms.
fn spheres(bodies: &[Body]) -> Volumes {
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    for body in bodies {
        let [x, y, z] = body.position.map(f64::from);
        let (up, radius) = match body.kind {
            // Half of a prism is 1 x 4 x 1.
            PRISM => (4.0, 18.0_f64.sqrt()),
            BALL => (0.0, f64::from(body.scale)),
            _ => (-0.125, 30.0 * 2.0_f64.sqrt() + 0.01),
        };
        centers.extend([x, y + up, z]);
        // What float32 rounds at most 60 m from the origin.
        radii.push(radius + 2e-5);
    }
    Volumes::Spheres { centers, radii }
}
