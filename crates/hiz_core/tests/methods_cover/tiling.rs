//! Tiling without depths: coverage bit for bit, and the nearest triangle in each pixel.
//! Planted faults show that these tests can fail.

use hiz_core::methods::tiling::fault::TilingFault;
use hiz_core::methods::tiling::{BspOptions, BspTree};
use hiz_core::{
    Camera, FaceCull, Floats, ImageSize, MeshData, OccluderOptions, OccluderSurface, Pose,
    Projection,
};

use crate::common::{CONVENTIONS, Random};

type Vec3 = [f64; 3];

const NEAR: f64 = 0.25;

struct Scene {
    camera: Camera,
    surface: OccluderSurface,
}

fn scene(seed: u64) -> Scene {
    let mut random = Random(seed ^ 0xB5B);
    let eye = [0; 3].map(|_| random.range(-1.0, 1.0) * random.pick(&[0.0, 5.0, 1e5]));
    let (width, height) = random.pick(&[(1, 1), (7, 3), (64, 64), (65, 63), (130, 47), (600, 70)]);
    let size = ImageSize::new(width, height);
    let convention = random.pick(&CONVENTIONS);
    let projection = if random.below(4) == 0 {
        Projection::Orthographic {
            left: -8.0,
            right: 7.0,
            bottom: -6.0,
            top: 6.5,
            near: NEAR,
            far: 1e4,
            convention,
        }
    } else {
        Projection::Perspective { fov_y: 1.3, near: NEAR, far: None, convention }
    };
    let turn = random.range(-3.0, 3.0);
    let toward = [turn.sin(), random.range(-0.3, 0.3), -turn.cos()];
    let pose =
        Pose { eye, target: std::array::from_fn(|k| eye[k] + toward[k]), up: [0.0, 1.0, 0.0] };
    let camera = Camera::look_at(&pose, &projection, size).unwrap();
    // Triangles that cross each other, some behind the eye, in two copies: one is mirrored.
    let spread = random.pick(&[2.0, 10.0]);
    let mut vertices = Vec::new();
    for _ in 0..random.pick(&[3, 40, 150]) {
        let z = random.range(-2.0, 20.0);
        let middle: Vec3 = [random.range(-1.0, 1.0) * z, random.range(-1.0, 1.0) * z, 0.0];
        for _ in 0..3 {
            let p: Vec3 = std::array::from_fn(|k| {
                let across = [[turn.cos(), 0.0, turn.sin()], [0.0, 1.0, 0.0]];
                middle[0] * across[0][k] + middle[1] * across[1][k] + z * toward[k]
            });
            vertices.extend(p.map(|v| v + random.range(-0.1, 0.1) * spread));
        }
    }
    // A fold: two triangles with a shared edge, and one without an area.
    vertices.extend([0.0, 0.0, -5.0, 1.0, 0.0, -5.0, 0.5, 1.0, -6.0]);
    vertices.extend([1.0, 0.0, -5.0, 0.0, 0.0, -5.0, 0.5, 1.0, -4.0]);
    vertices.extend([0.0, 0.0, -5.0, 1.0, 1.0, -5.0, 2.0, 2.0, -5.0]);
    let triangles: Vec<u32> = (0..vertices.len() as u32 / 3).collect();
    let row = |k: usize, sign: f64| {
        let mut row = [0.0; 4];
        row[k] = sign;
        row[3] = eye[k];
        row
    };
    let last = [0.0, 0.0, 0.0, 1.0];
    let transforms =
        [row(0, 1.0), row(1, 1.0), row(2, 1.0), last, row(0, -1.0), row(1, 1.0), row(2, 1.0), last]
            .concat();
    let mesh = MeshData {
        vertices: Floats::F64(&vertices),
        triangles: &triangles,
        transforms: Some(Floats::F64(&transforms)),
    };
    let cull_mode = random.pick(&[FaceCull::None, FaceCull::Back, FaceCull::Front]);
    let surface = OccluderSurface::from_meshes(&[mesh], &OccluderOptions { cull_mode }).unwrap();
    Scene { camera, surface }
}

const TREES: [BspOptions; 3] = [
    BspOptions { leaf: None, most_parts: 1e9 },
    BspOptions { leaf: Some(4), most_parts: 0.0 },
    BspOptions { leaf: None, most_parts: 1.05 },
];

/// The depth of a triangle's plane at a pixel's centre, as NDC.
fn depth_at(camera: &Camera, corners: [Vec3; 3], x: u32, y: u32) -> f64 {
    let m = camera.rows();
    let clip = corners.map(|p| {
        let d: Vec3 = std::array::from_fn(|k| p[k] - camera.origin()[k]);
        m.map(|r| r[0] * d[0] + r[1] * d[1] + r[2] * d[2] + r[3])
    });
    let size = camera.size();
    let px = (f64::from(x) + 0.5) / f64::from(size.width) * 2.0 - 1.0;
    let py = 1.0 - (f64::from(y) + 0.5) / f64::from(size.height) * 2.0;
    // Weights of the corners whose sum lies on the ray: x - px w and y - py w vanish.
    let u = clip.map(|c| c[0] - px * c[3]);
    let v = clip.map(|c| c[1] - py * c[3]);
    let weights = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let sum = |k: usize| (0..3).map(|i| weights[i] * clip[i][k]).sum::<f64>();
    sum(2) / sum(3)
}

/// Coverage is that of the rasteriser, and each pixel's owner is the nearest triangle there.
fn against_the_rasteriser(
    seeds: std::ops::Range<u64>,
    fault: Option<TilingFault>,
) -> Result<(), String> {
    let (mut splits, mut hidden, mut wrong, mut pixels) = (0, 0, 0, 0);
    for seed in seeds {
        let Scene { camera, surface } = scene(seed);
        let depth = surface.depth(&camera).unwrap();
        let convention = camera.convention();
        let (positions, triangles) = surface.world();
        for options in TREES {
            let tree = BspTree::with_fault(&surface, &options, fault).unwrap();
            assert_eq!(tree.num_triangles(), triangles.len());
            let seen = tree.draw_with_owners(&surface, &camera).unwrap();
            let owners = seen.owners().unwrap();
            for (number, covered) in seen.coverage().enumerate() {
                // Standard depth rounds to 1 far away; nothing here is that far.
                if covered != (depth[number] != convention.far()) {
                    return Err(format!("seed {seed}, {options:?}: pixel {number} is {covered}"));
                }
                if covered != (owners[number] != u32::MAX) {
                    return Err(format!("seed {seed}: pixel {number} and its owner"));
                }
                if !covered {
                    continue;
                }
                let corners = triangles[owners[number] as usize].map(|v| positions[v as usize]);
                let width = camera.size().width;
                let (x, y) = (number as u32 % width, number as u32 / width);
                let found = depth_at(&camera, corners, x, y);
                let nearest = f64::from(depth[number]);
                let behind =
                    if convention.is_reversed() { nearest - found } else { found - nearest };
                // Rounded corners move a border, and float32 moves a plane, by a little.
                pixels += 1;
                wrong += u32::from(behind > 1e-2 * (1.0 - nearest.min(0.99)).max(nearest));
            }
            splits += tree.num_parts() - tree.num_triangles();
            hidden += seen.hidden_nodes;
        }
    }
    // Where a triangle is seen from the side, its plane says little about a pixel.
    if wrong * 5000 > pixels {
        return Err(format!("{wrong} of {pixels} pixels belong to a farther triangle"));
    }
    if fault.is_none() {
        assert!(splits > 1000 && hidden > 5 && pixels > 20_000, "{splits} {hidden} {pixels}");
        eprintln!("{splits} splits, {hidden} hidden nodes, {wrong} of {pixels} owners are farther");
    }
    Ok(())
}

#[test]
fn coverage_is_that_of_the_rasteriser_and_owners_are_nearest() {
    against_the_rasteriser(0..30, None).unwrap();
}

#[test]
fn planted_faults_are_seen() {
    for fault in [
        TilingFault::BackToFront,
        TilingFault::CutsIgnored,
        TilingFault::OneSideOfCuts,
        TilingFault::FullByOnePart,
        TilingFault::BoxOfOneSide,
        TilingFault::NeverSplit,
    ] {
        let seen = against_the_rasteriser(0..24, Some(fault));
        eprintln!("{fault:?}: {seen:?}");
        assert!(seen.is_err(), "{fault:?}");
    }
}

/// One tree, an octree, and a tree that is given up; nothing to draw is drawn, too.
#[test]
fn kinds_of_trees() {
    let Scene { surface, camera } = scene(2);
    let made = TREES.map(|options| BspTree::new(&surface, &options).unwrap());
    assert_eq!(made.each_ref().map(BspTree::is_octree), [false, true, true]);
    assert!(made[0].num_parts() > made[0].num_triangles());
    assert!(made.iter().all(|tree| tree.num_nodes() > 0 && tree.host_bytes() > 0));
    let mesh = MeshData { vertices: Floats::F64(&[]), triangles: &[], transforms: None };
    let empty = OccluderSurface::from_meshes(&[mesh], &OccluderOptions::default()).unwrap();
    let seen = BspTree::new(&empty, &TREES[0]).unwrap().draw(&empty, &camera).unwrap();
    assert!(seen.coverage().all(|covered| !covered));
    assert_eq!((seen.num_visible(), seen.parts), (0, 0));
    assert!(seen.owners().is_none());
}
