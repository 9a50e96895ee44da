//! The scene: 160 prisms around a clearing, and 24^3 spheres among them.
//!
//! Source: ARM's sample "Occlusion Culling with Hierarchical-Z" (Mali SDK for OpenGL ES).

use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection, Result, Vec3};

/// Where the eye stands, in the middle of the clearing.
pub(crate) const EYE: Vec3 = [0.0, 2.0, 0.0];
pub(crate) const FOV_Y_DEG: f64 = 60.0;
pub(crate) const NEAR: f64 = 1.0;
pub(crate) const FAR: f64 = 500.0;

/// The image of the occluders.
pub(crate) const OCCLUDER_SIZE: ImageSize = ImageSize { width: 256, height: 256 };

/// Spheres along each axis.
const SIDE: u32 = 24;
/// Spheres along each axis of a block: 64 neighbours are stored together, as one group.
const BLOCK: u32 = 4;

/// The boxes of the prisms: least and greatest corner.
pub(crate) fn prisms() -> Vec<[Vec3; 2]> {
    let mut prisms = Vec::new();
    for x in 0..13 {
        for z in 0..13 {
            if (5..=7).contains(&x) && (5..=7).contains(&z) {
                continue;
            }
            let [x, z] = [x, z].map(|k| 3.0 * (f64::from(k) - 6.0));
            prisms.push([[x - 1.0, 0.0, z - 1.0], [x + 1.0, 8.0, z + 1.0]]);
        }
    }
    prisms
}

/// Vertices and triangles of all prisms; front faces run counter-clockwise.
pub(crate) fn mesh(prisms: &[[Vec3; 2]]) -> (Vec<f64>, Vec<u32>) {
    // The corner k takes the greatest x, y and z where bits 0, 1 and 2 of k are set.
    const FACES: [u32; 36] = [
        0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1,
        4, 5, 7, 4, 7, 6,
    ];
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (i, corners) in (0_u32..).zip(prisms) {
        for k in 0..8_usize {
            vertices.extend((0..3).map(|axis| corners[k >> axis & 1][axis]));
        }
        triangles.extend(FACES.map(|corner| 8 * i + corner));
    }
    (vertices, triangles)
}

/// Centre and radius of each sphere, in blocks of 64 neighbours.
pub(crate) fn spheres() -> Vec<[f32; 4]> {
    let mut state = 2015_u64;
    let mut unit = || {
        // Knuth's linear congruential generator (MMIX); its high bits are the good ones.
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let blocks = SIDE / BLOCK;
    let three = |i: u32, side: u32| [i / (side * side), i / side % side, i % side];
    let mut spheres = Vec::new();
    for block in 0..blocks.pow(3) {
        for member in 0..BLOCK.pow(3) {
            let (corner, within) = (three(block, blocks), three(member, BLOCK));
            let [x, y, z] = [0, 1, 2].map(|k| (BLOCK * corner[k] + within[k]) as f32);
            spheres.push([x - 11.35, 0.1 * y + 0.5, z - 11.45, 0.3 * (1.0 - 0.5 * unit())]);
        }
    }
    spheres
}

/// Which way the camera looks: right, up and forward, of length 1.
pub(crate) fn axes(azimuth_deg: f64) -> [Vec3; 3] {
    let (sin, cos) = azimuth_deg.to_radians().sin_cos();
    [[cos, 0.0, sin], [0.0, 1.0, 0.0], [sin, 0.0, -cos]]
}

/// The camera of an image of `size`, whose sides need not be those of the picture.
pub(crate) fn camera(azimuth_deg: f64, picture: ImageSize, size: ImageSize) -> Result<Camera> {
    let [_, up, forward] = axes(azimuth_deg);
    let target = [0, 1, 2].map(|k| EYE[k] + forward[k]);
    let projection = Projection::Perspective {
        fov_y: FOV_Y_DEG.to_radians(),
        near: NEAR,
        far: Some(FAR),
        convention: DepthConvention::Reversed,
    };
    Camera::look_at(&Pose { eye: EYE, target, up }, &projection, picture)?.with_size(size)
}
