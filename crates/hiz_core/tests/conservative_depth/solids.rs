//! Closed convex parts of meshes, which an image takes as a whole, against exact rays.

use hiz_core::testing::PlantedFault;
use hiz_core::{
    Camera, ConservativeDepthOptions, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection,
};

use crate::common::{CONVENTIONS, Random};
use crate::exact_rays::{ExactScene, Facing};
use crate::{Mesh, Tally, Vec3, Way, anywhere, examine, terrain, viewed};

/// A prism or a frustum of 3 to 6 sides around `centre`, of about this size.
///
/// Some are hardly thicker than nothing, some are inside out, some hardly convex any more.
fn solid(random: &mut Random, mesh: &mut Mesh, centre: Vec3, size: f64) {
    let n = 3 + random.below(4);
    let thin = random.pick(&[1.0, 1.0, 1.0, 1e-2, 1e-4, 1e-7]);
    let noise = size * random.pick(&[0.0, 0.0, 0.0, 1e-12, 1e-7, 1e-5]);
    let axes = [0; 3].map(|_: u32| anywhere(random, size));
    let taper = random.pick(&[1.0, 1.0, 0.5]);
    let first = (mesh.vertices.len() / 3) as u32;
    for (height, scale) in [(-1.0, 1.0), (1.0, taper)] {
        for k in 0..n {
            let (sin, cos) = (f64::from(k) / f64::from(n) * std::f64::consts::TAU).sin_cos();
            let shares = [scale * cos, scale * sin, thin * height];
            let jitter = anywhere(random, noise);
            mesh.vertex(std::array::from_fn(|i| {
                let along: f64 = (0..3).map(|axis| shares[axis] * axes[axis][i]).sum();
                centre[i] + along + jitter[i]
            }));
        }
    }
    let is_inside_out = random.below(2) == 0;
    let mut push = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| v + first);
        mesh.triangles.extend(if is_inside_out { [a, c, b] } else { [a, b, c] });
    };
    for k in 1..n - 1 {
        push([0, k + 1, k]);
        push([n, n + k, n + k + 1]);
    }
    for k in 0..n {
        let next = (k + 1) % n;
        push([k, next, n + next]);
        push([k, n + next, n + k]);
    }
}

/// Boxes in a row with corners at the same places, some with vertices of their own.
fn row(random: &mut Random, mesh: &mut Mesh) {
    let (low, depth) = (anywhere(random, 0.5), random.range(0.1, 1.0));
    let high = random.range(0.2, 1.0);
    let mut x = low[0];
    for _ in 0..2 + random.below(3) {
        let next = x + random.range(0.1, 0.8);
        let top = random.pick(&[high, high, high, 0.5 * high]);
        let first = (mesh.vertices.len() / 3) as u32;
        for corner in 0..8_u32 {
            mesh.vertex([
                if corner & 1 == 0 { x } else { next },
                low[1] + if corner & 2 == 0 { 0.0 } else { top },
                low[2] + if corner & 4 == 0 { 0.0 } else { depth },
            ]);
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            mesh.triangles.extend([a, b, c, a, c, d].map(|v: u32| v + first));
        }
        x = next;
    }
}

/// Solids, before a terrain or not.
fn solids(random: &mut Random) -> Mesh {
    let mut mesh = if random.below(4) == 0 { terrain(random) } else { Mesh::default() };
    for _ in 0..1 + random.below(4) {
        if random.below(3) == 0 {
            row(random, &mut mesh);
        } else {
            let (centre, size) = (anywhere(random, 1.0), random.pick(&[0.05, 0.5, 1.5]));
            solid(random, &mut mesh, centre, size);
        }
    }
    mesh
}

fn campaign(way: Way, cases: u32, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(21), Tally::default());
    for _ in 0..cases {
        let mesh = solids(&mut random);
        let (camera, mesh) = viewed(&mut random, &mesh);
        let cull_mode =
            random.pick(&[FaceCull::None, FaceCull::None, FaceCull::None, FaceCull::Back]);
        let options = ConservativeDepthOptions { refinement: random.below(4) };
        examine(&mut random, (way, fault), &camera, &mesh, cull_mode, &options, &mut tally);
    }
    tally
}

#[test]
fn no_ray_gets_past_a_solid() {
    for way in [Way::Usual, Way::AnyCentres] {
        let tally = campaign(way, 600, None);
        println!("{way:?}: {tally:?}");
        assert_eq!(tally.past, 0, "{way:?}");
        assert!(tally.deep > 600 && tally.rays > 10_000, "{way:?}: {tally:?}");
    }
}

#[test]
fn planted_faults_of_solids_let_rays_through() {
    for fault in [
        PlantedFault::SideOfOutlineIgnored,
        PlantedFault::OnePlaneOfSolid,
        PlantedFault::PlaneWithoutReach,
        PlantedFault::CentreForSquare,
        PlantedFault::CentreForQuarter,
        PlantedFault::RoundedToNearest,
    ] {
        let of = |way| campaign(way, 300, Some(fault)).past;
        let (usual, any) = (of(Way::Usual), of(Way::AnyCentres));
        println!("{fault:?}: {usual} and {any} rays past a pixel's depth");
        assert!(usual + any > 0, "{fault:?}: stayed green");
    }
}

/// A wall of a solid whose slanted border passes a pixel's corner, see `slanted_borders`.
fn slanted_solids(cases: u32, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(22), Tally::default());
    for _ in 0..cases {
        let convention = random.pick(&CONVENTIONS);
        let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
        let fov_y = random.range(0.5, 1.5);
        let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(4, 4)).unwrap();
        let z = random.range(1.0, 9.0);
        let unit = (fov_y / 2.0).tan() * z / 2.0;
        let corner = [f64::from(random.below(3)) - 1.0, f64::from(random.below(3)) - 1.0];
        let inside = random.range(0.05, 0.45) / 256.0;
        let slope = random.range(0.2, 2.0) * random.pick(&[-1.0, 1.0]);
        let x = |y: f64| corner[0] - inside + slope * (y - corner[1]);
        let (low, high) = (random.range(-4.0, -2.5), random.range(2.5, 4.0));
        let mut mesh = Mesh::default();
        // The other end is smaller, so that it is hidden.
        for [dz, scale] in [[0.0, 1.0], [1.0, 0.5]] {
            for [x, y] in [[-9.0, low], [x(low), low], [x(high), high], [-9.0, high]] {
                mesh.vertex([scale * x * unit, scale * y * unit, -z - dz]);
            }
        }
        for [a, b, c, d] in
            [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
        {
            mesh.triangles.extend([a, b, c, a, c, d]);
        }
        let options = ConservativeDepthOptions { refinement: 0 };
        let how = (Way::Usual, fault);
        examine(&mut random, how, &camera, &mesh, FaceCull::None, &options, &mut tally);
    }
    tally
}

#[test]
fn outlines_are_as_uncertain_as_the_grid() {
    let (sound, faulty) =
        (slanted_solids(1500, None), slanted_solids(1500, Some(PlantedFault::NoEdgeMargin)));
    println!("without a fault {sound:?}, without a margin {} rays past", faulty.past);
    assert!(sound.past == 0 && sound.deep > 100 && faulty.past > 0);
}

/// Solids show what a search of all triangles shows, also where copies are mirrored or touch.
#[test]
fn solids_show_what_a_search_of_every_pixel_shows() {
    let (mut random, mut counts) = (Random(23), [0_u32; 3]);
    for case in 0..40 {
        let mut mesh = Mesh::default();
        for _ in 0..12 {
            if random.below(3) == 0 {
                row(&mut random, &mut mesh);
            } else {
                let centre = anywhere(&mut random, 2.0);
                solid(&mut random, &mut mesh, centre, 0.8);
            }
        }
        // As it is, turned by half, and mirrored.
        let mut transforms = Vec::new();
        for (x, z) in [(1.0, 1.0), (-1.0, -1.0), (-1.0, 1.0)] {
            let shift = random.range(-1.0, 1.0);
            transforms.extend([x, 0.0, 0.0, shift, 0.0, 1.0, 0.0, 0.0]);
            transforms.extend([0.0, 0.0, z, 0.0, 0.0, 0.0, 0.0, 1.0]);
        }
        let data = MeshData {
            vertices: Floats::F64(&mesh.vertices),
            triangles: &mesh.triangles,
            transforms: (case % 2 == 0).then_some(Floats::F64(&transforms)),
        };
        let surface = OccluderSurface::from_meshes(&[data], &OccluderOptions::default()).unwrap();
        let eye = [random.range(-2.0, 2.0), random.range(-1.0, 3.0), random.range(4.0, 6.0)];
        let pose = Pose { eye, target: [0.0; 3], up: [0.0, 1.0, 0.1] };
        let convention = random.pick(&CONVENTIONS);
        let projection = Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(48, 32)).unwrap();
        let options = ConservativeDepthOptions::default();
        let usual = surface.conservative_depth(&camera, &options).unwrap();
        let searched = surface.conservative_depth_searched(&camera, &options, None).unwrap();
        let far = convention.far();
        for (usual, searched) in usual.iter().zip(&searched).filter(|(_, s)| **s != far) {
            counts[0] += 1;
            counts[1] += u32::from(*usual == far);
            counts[2] += u32::from((usual - far).abs() < 0.98 * (searched - far).abs());
        }
        let (positions, triangles) = surface.world();
        let exact = ExactScene::new(&camera, positions.as_flattened(), triangles.as_flattened());
        for (i, depth) in (0..).zip(usual).filter(|(_, depth)| *depth != far) {
            let (x, y) = (f64::from(i % 48), f64::from(i / 48));
            for point in [[x, y], [x + 1.0, y + 1.0], [x + 0.5, y + 0.5]] {
                assert!(exact.blocked(point, depth, Facing::Any), "case {case}: {point:?}");
            }
        }
    }
    let [deep, missing, farther] = counts;
    println!("of {deep} pixels {missing} have no depth, {farther} one that is 2 % farther");
    assert!(deep > 5000 && missing * 200 < deep && farther * 50 < deep, "{counts:?}");
}
