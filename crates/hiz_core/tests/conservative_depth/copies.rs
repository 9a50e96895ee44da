//! Copies of meshes share their edges, and the proof keeps what a search of every pixel keeps.

use hiz_core::{
    Camera, ConservativeDepthOptions, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection,
};

use crate::common::{CONVENTIONS, Random};
use crate::exact_rays::{ExactScene, Facing};
use crate::{Mesh, Vec3, surface};

/// A terrain of several meshlets, in squares of 1, with corners at multiples of 1/4.
fn field(random: &mut Random, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=n {
        for column in 0..=n {
            let is_border = [row, column].iter().any(|k| *k == 0 || *k == n);
            let height = if is_border { 0.0 } else { f64::from(random.below(5)) / 4.0 };
            mesh.vertex([f64::from(column), height, f64::from(row)]);
        }
    }
    for row in 0..n {
        for column in 0..n {
            let a = row * (n + 1) + column;
            mesh.triangles.extend([a, a + n + 1, a + 1, a + 1, a + n + 1, a + n + 2]);
        }
    }
    mesh
}

/// A turn by quarters about y, a mirror image or not, and a shift: exact for multiples of 1/4.
fn place(random: &mut Random, shift: Vec3) -> [f64; 16] {
    let (c, s) = random.pick(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]);
    let mirror = random.pick(&[1.0, -1.0]);
    let rows = [[c * mirror, 0.0, s], [0.0, 1.0, 0.0], [-s * mirror, 0.0, c]];
    let mut m = [0.0; 16];
    for (k, row) in rows.iter().enumerate() {
        m[4 * k..4 * k + 3].copy_from_slice(row);
        m[4 * k + 3] = shift[k];
    }
    m[15] = 1.0;
    m
}

/// Tests that no ray gets past the depths of a surface as it stands; returns how many are not far.
fn deep_and_right(random: &mut Random, surface: &OccluderSurface, camera: &Camera) -> u32 {
    let (positions, triangles) = surface.world();
    let exact = ExactScene::new(camera, positions.as_flattened(), triangles.as_flattened());
    let facing = match surface.cull_mode() {
        FaceCull::None => Facing::Any,
        FaceCull::Back => Facing::CounterClockwise,
        FaceCull::Front => Facing::Clockwise,
    };
    let options = ConservativeDepthOptions { refinement: random.below(3) };
    let depths = surface.conservative_depth(camera, &options).unwrap();
    let (width, far) = (camera.size().width, camera.convention().far());
    let mut deep = 0;
    for (i, depth) in (0..).zip(depths).filter(|(_, depth)| *depth != far) {
        let (x, y) = (f64::from(i % width), f64::from(i / width));
        deep += 1;
        for [dx, dy] in [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.5]] {
            let point = [x + dx, y + dy];
            assert!(exact.blocked(point, depth, facing), "ray {point:?} past {depth}, {camera:?}");
        }
    }
    deep
}

#[test]
fn copies_share_their_edges_until_they_move() {
    let (mut random, mut deep) = (Random(11), [0_u32; 2]);
    for case in 0..24 {
        let n = 9 + random.below(5);
        let mesh = field(&mut random, n);
        let side = f64::from(n);
        // Copies side by side in rows of two, turned and mirrored about their own corners.
        let places = |random: &mut Random, gap: f64| -> Vec<f64> {
            let turned = |random: &mut Random, x: f64, z: f64| {
                let mut m = place(random, [0.0; 3]);
                // The corner with the least coordinates comes to (x, z).
                for (row, at) in [(0, x), (2, z)] {
                    let least: f64 = [0, 2].iter().map(|k| (m[4 * row + k] * side).min(0.0)).sum();
                    m[4 * row + 3] = at - least;
                }
                m
            };
            let mut all = Vec::new();
            for (x, z) in [(0.0, 0.0), (side, 0.0), (0.0, side), (side + gap, side)] {
                all.extend(turned(random, x - side, z - side));
            }
            all
        };
        let transforms = places(&mut random, 0.0);
        let data = |transforms| MeshData {
            vertices: Floats::F64(&mesh.vertices),
            triangles: &mesh.triangles,
            transforms: Some(Floats::F64(transforms)),
        };
        let cull_mode = random.pick(&[FaceCull::None, FaceCull::None, FaceCull::Back]);
        let options = OccluderOptions { cull_mode };
        let surface = OccluderSurface::from_meshes(&[data(&transforms)], &options).unwrap();
        let eye = [random.range(-3.0, 3.0), random.range(2.0, 6.0), random.range(-3.0, 3.0)];
        let target = [random.range(-2.0, 2.0), -2.0, random.range(-2.0, 2.0)];
        let pose = Pose { eye, target, up: [0.1, 1.0, 0.2] };
        let convention = random.pick(&CONVENTIONS);
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(7, 6)).unwrap();
        deep[0] += deep_and_right(&mut random, &surface, &camera);
        // The last copy leaves a gap, and comes back after another one has turned.
        let gap = places(&mut random, 0.5);
        surface.move_mesh(0, Some(Floats::F64(&gap))).unwrap();
        deep[1] += deep_and_right(&mut random, &surface, &camera);
        let fresh = OccluderSurface::from_meshes(&[data(&gap)], &options).unwrap();
        let options = ConservativeDepthOptions::default();
        let moved = surface.conservative_depth(&camera, &options).unwrap();
        let fresh = fresh.conservative_depth(&camera, &options).unwrap();
        let sign = if camera.convention().is_reversed() { -1.0 } else { 1.0 };
        let never_nearer = moved.iter().zip(&fresh).all(|(m, f)| sign * m >= sign * f);
        assert!(never_nearer, "case {case}: a copy that moved shares edges with others");
        surface.move_mesh(0, Some(Floats::F64(&transforms))).unwrap();
        let back = surface.conservative_depth(&camera, &options).unwrap();
        let first =
            OccluderSurface::from_meshes(&[data(&transforms)], &OccluderOptions { cull_mode });
        assert_eq!(back, first.unwrap().conservative_depth(&camera, &options).unwrap());
    }
    println!("{deep:?} pixels with a depth");
    assert!(deep[0] > 800 && deep[1] > 400, "{deep:?}");
}

#[test]
fn the_proof_keeps_what_the_search_of_every_pixel_keeps() {
    let (mut random, mut counts) = (Random(12), [0_u32; 3]);
    for _ in 0..20 {
        let mesh = field(&mut random, 20);
        let eye = [random.range(4.0, 16.0), random.range(1.5, 4.0), random.range(-2.0, 2.0)];
        let pose = Pose { eye, target: [10.0, 0.5, 12.0], up: [0.0, 1.0, 0.0] };
        let convention = random.pick(&CONVENTIONS);
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(48, 32)).unwrap();
        let surface = surface(&mesh, FaceCull::None);
        let options = ConservativeDepthOptions::default();
        let usual = surface.conservative_depth(&camera, &options).unwrap();
        let searched = surface.conservative_depth_searched(&camera, &options, None).unwrap();
        let far = convention.far();
        for (usual, searched) in usual.iter().zip(&searched).filter(|(_, s)| **s != far) {
            counts[0] += 1;
            counts[1] += u32::from(*usual == far);
            counts[2] += u32::from((usual - far).abs() < 0.98 * (searched - far).abs());
        }
    }
    let [deep, missing, farther] = counts;
    println!("of {deep} pixels {missing} have no depth, {farther} one that is 2 % farther");
    assert!(deep > 5000 && missing * 1000 < deep && farther * 50 < deep, "{counts:?}");
}
