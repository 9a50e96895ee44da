//! Proxies in meshes and meshes in bounds.
//! There are cases by hand, and random ones.
//! The truth of the latter comes from cutting triangles at boxes in ordinary fractions.

use hiz_ref::{MeshError, TriangleMesh, Volume, check_bounds, check_proxy, contains};
use num_rational::BigRational;
use num_traits::{Signed, Zero};
use proptest::prelude::*;

type Vec3 = [f64; 3];

#[derive(Clone, Debug, Default)]
struct Mesh {
    vertices: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    fn borrowed(&self) -> TriangleMesh<'_> {
        TriangleMesh { vertices: &self.vertices, triangles: &self.triangles }
    }

    fn add_box(&mut self, low: Vec3, high: Vec3) {
        let first = self.vertices.len() as u32;
        for corner in 0..8 {
            self.vertices
                .push(std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] }));
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            self.triangles.extend([[a, b, c], [a, c, d]].map(|t: [u32; 3]| t.map(|v| v + first)));
        }
    }

    fn flipped(mut self) -> Mesh {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }
}

fn box_mesh(low: Vec3, high: Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add_box(low, high);
    mesh
}

fn triangle(corners: [Vec3; 3]) -> Mesh {
    Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] }
}

fn is_inside(proxy: &Mesh, mesh: &Mesh) -> bool {
    check_proxy(&proxy.borrowed(), &mesh.borrowed()).unwrap().triangles.is_empty()
}

#[test]
fn boxes_in_boxes() {
    let mesh = box_mesh([0.0; 3], [1.0; 3]);
    assert!(is_inside(&box_mesh([0.25; 3], [0.75; 3]), &mesh));
    assert!(is_inside(&mesh, &mesh), "touching is inside");
    assert!(is_inside(&mesh.clone().flipped(), &mesh.clone().flipped()));
    let poking = box_mesh([0.25, 0.25, 0.25], [0.75, 0.75, 1.0 + 1e-9]);
    let found = check_proxy(&poking.borrowed(), &mesh.borrowed()).unwrap();
    // The top's two triangles and the eight of the sides; the bottom is inside.
    assert_eq!((found.triangles.len(), found.vertices.as_slice()), (10, &[4, 5, 6, 7][..]));
    assert!((0.5e-9..=1.1e-9).contains(&found.distance), "{}", found.distance);
    assert!(found.witnesses.iter().all(|p| p[2] >= 1.0));
    assert!(!is_inside(&box_mesh([2.0; 3], [3.0; 3]), &mesh), "beside it");
    // The least distance that float64 can stick out.
    assert!(!is_inside(&box_mesh([0.5; 3], [1.0_f64.next_up(); 3]), &mesh));
}

/// A block with a notch from above, and a bridge over the notch.
/// The bridge's vertices are inside the block and its middle is outside.
#[test]
fn a_bridge_over_a_notch_is_outside_with_all_its_vertices_inside() {
    let mut mesh = Mesh::default();
    mesh.add_box([0.0; 3], [3.0, 1.0, 1.0]);
    mesh.add_box([0.0, 0.0, 0.5], [1.0, 1.0, 2.0]);
    mesh.add_box([2.0, 0.0, 0.5], [3.0, 1.0, 2.0]);
    let bridge = triangle([[0.5, 0.25, 1.5], [2.5, 0.25, 1.5], [2.5, 0.75, 1.5]]);
    let found = check_proxy(&bridge.borrowed(), &mesh.borrowed()).unwrap();
    assert_eq!((found.triangles.as_slice(), found.vertices.len()), (&[0][..], 0));
    assert!((1.0..=2.0).contains(&found.witnesses[0][0]));
    assert!(is_inside(&triangle([[0.5, 0.25, 0.75], [2.5, 0.25, 0.75], [2.5, 0.75, 0.75]]), &mesh));
    // On the floor of the notch, and touching it.
    assert!(is_inside(&triangle([[0.5, 0.25, 1.0], [2.5, 0.25, 1.0], [2.5, 0.75, 1.0]]), &mesh));
}

/// The block's corner touches the triangle in the very point that would otherwise be tested.
#[test]
fn a_triangle_that_a_corner_touches_is_outside() {
    let mesh = box_mesh([0.0, 3.0, 1.0], [2.0, 4.0, 2.0]);
    assert!(!is_inside(&triangle([[2.0, 5.0, 0.0], [3.0, 2.0, 3.0], [1.0, 0.0, 1.0]]), &mesh));
}

#[test]
fn a_cavity_is_outside_but_may_be_enclosed() {
    let mut hollow = box_mesh([0.0; 3], [9.0; 3]);
    let hole = box_mesh([3.0; 3], [6.0; 3]).flipped();
    hollow.triangles.extend(hole.triangles.iter().map(|t| t.map(|v| v + 8)));
    hollow.vertices.extend(hole.vertices);
    assert!(!is_inside(&box_mesh([4.0; 3], [5.0; 3]), &hollow));
    // Its surface is in the shell, and rays meet the shell first.
    assert!(is_inside(&box_mesh([2.0; 3], [7.0; 3]), &hollow));
}

#[test]
fn meshes_without_an_inside_are_refused() {
    let mut open = box_mesh([0.0; 3], [1.0; 3]);
    open.triangles.pop();
    let proxy = triangle([[0.1; 3], [0.2, 0.1, 0.1], [0.1, 0.2, 0.1]]);
    let error = check_proxy(&proxy.borrowed(), &open.borrowed()).unwrap_err();
    assert!(matches!(error, MeshError::Open { edges: 3, .. }), "{error}");
    let mut inconsistent = box_mesh([0.0; 3], [1.0; 3]);
    inconsistent.triangles[4].swap(0, 1);
    assert!(matches!(
        check_proxy(&proxy.borrowed(), &inconsistent.borrowed()).unwrap_err(),
        MeshError::Open { edges: 3, .. }
    ));
    // The proxy may be open, and a triangle without area does not count.
    let closed = box_mesh([0.0; 3], [1.0; 3]);
    assert!(is_inside(&proxy, &closed));
    assert!(is_inside(&triangle([[5.0; 3], [6.0; 3], [7.0; 3]]), &closed));
    let nan = triangle([[f64::NAN; 3], [0.0; 3], [1.0; 3]]);
    assert_eq!(
        check_proxy(&nan.borrowed(), &closed.borrowed()).unwrap_err(),
        MeshError::NonFinite(0)
    );
    let index = Mesh { triangles: vec![[0, 1, 3]], ..proxy };
    assert_eq!(
        check_proxy(&index.borrowed(), &closed.borrowed()).unwrap_err(),
        MeshError::Index { vertices: 3, index: 3 }
    );
}

type Q = BigRational;
type Polygon = Vec<[Q; 3]>;

fn q(x: f64) -> Q {
    Q::from_float(x).expect("finite")
}

/// The part of a convex polygon where `sign * (p[axis] - at) >= 0`.
fn clipped(polygon: &Polygon, axis: usize, at: f64, sign: i32) -> Polygon {
    let height = |p: &[Q; 3]| (p[axis].clone() - q(at)) * q(f64::from(sign));
    let mut out = Polygon::new();
    for (k, p) in polygon.iter().enumerate() {
        let next = &polygon[(k + 1) % polygon.len()];
        let (hp, hn) = (height(p), height(next));
        if !hp.is_negative() {
            out.push(p.clone());
        }
        if (hp.is_positive() && hn.is_negative()) || (hp.is_negative() && hn.is_positive()) {
            let t = hp.clone() / (hp - hn);
            out.push(std::array::from_fn(|i| {
                p[i].clone() + (next[i].clone() - p[i].clone()) * t.clone()
            }));
        }
    }
    out
}

fn has_area(polygon: &Polygon) -> bool {
    let Some(first) = polygon.first() else { return false };
    let to = |p: &[Q; 3]| -> [Q; 3] { std::array::from_fn(|i| p[i].clone() - first[i].clone()) };
    polygon.windows(2).any(|pair| {
        let (u, v) = (to(&pair[0]), to(&pair[1]));
        [(0, 1), (1, 2), (2, 0)].iter().any(|(i, j)| {
            !(u[*i].clone() * v[*j].clone() - u[*j].clone() * v[*i].clone()).is_zero()
        })
    })
}

/// Whether closed boxes together cover a triangle.
/// Cuts each box out and looks whether any area is left.
fn covered(corners: [Vec3; 3], boxes: &[(Vec3, Vec3)]) -> bool {
    let mut left: Vec<Polygon> = vec![corners.iter().map(|p| p.map(q)).collect()];
    for (low, high) in boxes {
        let mut still = Vec::new();
        for mut polygon in left {
            for axis in 0..3 {
                for (at, inner) in [(low[axis], 1), (high[axis], -1)] {
                    let outer = clipped(&polygon, axis, at, -inner);
                    // A polygon on the border is cut to itself on both sides.
                    // It belongs to the closed box.
                    let beyond = |p: &[Q; 3]| p[axis] != q(at);
                    if has_area(&outer) && outer.iter().any(beyond) {
                        still.push(outer);
                    }
                    polygon = clipped(&polygon, axis, at, inner);
                }
            }
        }
        left = still;
    }
    !left.iter().any(has_area)
}

fn corner() -> impl Strategy<Value = Vec3> {
    [0_i32..6, 0..6, 0..6].prop_map(|p| p.map(f64::from))
}

fn some_box() -> impl Strategy<Value = (Vec3, Vec3)> {
    (corner(), [1_i32..6, 1..6, 1..6])
        .prop_map(|(low, size)| (low, std::array::from_fn(|k| low[k] + f64::from(size[k]))))
}

/// Shears a point, so that planes are slanted; in whole numbers, so that nothing rounds.
fn sheared(p: Vec3, shear: [i32; 4]) -> Vec3 {
    let [a, b, c, d] = shear.map(f64::from);
    let [x, y, z] = p;
    let x = x + a * y + b * z;
    let y = y + c * x;
    [x, y, z + d * y]
}

/// Undoes [`sheared`].
fn straightened([x, y, z]: Vec3, shear: [i32; 4]) -> Vec3 {
    let [a, b, c, d] = shear.map(f64::from);
    let z = z - d * y;
    let y = y - c * x;
    [x - a * y - b * z, y, z]
}

/// Spheres of many triangles, whose coordinates are as irregular as real ones.
/// Some of them nearly cancel.
#[test]
fn witnesses_of_crooked_meshes_are_outside() {
    let sphere = |rings: u32| {
        let mut mesh =
            Mesh { vertices: vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]], ..Mesh::default() };
        let around = 2 * rings;
        for i in 1..rings {
            for k in 0..around {
                let (theta, phi) = [(i, rings), (2 * k, around)]
                    .map(|(n, of)| f64::from(n) / f64::from(of) * std::f64::consts::PI)
                    .into();
                mesh.vertices.push([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()]);
            }
        }
        let at = |i: u32, k: u32| {
            if i == 0 {
                0
            } else if i == rings {
                1
            } else {
                2 + (i - 1) * around + k % around
            }
        };
        for i in 0..rings {
            for k in 0..around {
                let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
                mesh.triangles.extend(
                    [[a, b, c], [a, c, d]]
                        .into_iter()
                        .filter(|[a, b, c]| a != b && b != c && c != a),
                );
            }
        }
        mesh
    };
    let (coarse, fine) = (sphere(12), sphere(100));
    // Where y is 1e-16 instead of 0, cuts nearly run along the triangle's border.
    let crooked = coarse.triangles.iter().copied().filter(|t| {
        let corners = t.map(|v| coarse.vertices[v as usize]);
        corners.iter().filter(|p| p[0] < 0.0 && p[1].abs() < 1e-10).count() >= 2
    });
    let proxy = Mesh { triangles: crooked.collect(), vertices: coarse.vertices.clone() };
    let found = check_proxy(&proxy.borrowed(), &fine.borrowed()).unwrap();
    assert!(found.triangles.len() > 10 && found.triangles.len() == proxy.triangles.len());
    // A chord of 1.8 degrees is 0.00012 below its arc, and that counts in both directions.
    for witness in &found.witnesses {
        let radius = witness.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!(radius > 0.9997, "{witness:?}");
    }
    assert!(found.distance < 0.0003);
    let smaller = |mut mesh: Mesh| {
        mesh.vertices.iter_mut().for_each(|p| *p = p.map(|x| 0.99 * x));
        mesh
    };
    assert!(is_inside(&smaller(sphere(8)), &sphere(30)));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn proxies_agree_with_cutting_boxes_out(
        boxes in prop::collection::vec(some_box(), 1..4),
        proxies in prop::collection::vec([corner(), corner(), corner()], 6),
        shear in [-2_i32..3, -2..3, -2..3, -2..3],
        flip in any::<bool>(),
    ) {
        let mut mesh = Mesh::default();
        for (low, high) in &boxes {
            mesh.add_box(*low, *high);
        }
        for v in &mut mesh.vertices {
            *v = sheared(*v, shear);
        }
        let mesh = if flip { mesh.flipped() } else { mesh };
        // Some triangles that are likely to be inside: between the corners of a box.
        let (low, high) = boxes[0];
        let within = |p: Vec3| -> Vec3 {
            std::array::from_fn(|k| low[k] + (high[k] - low[k]) * p[k].min(4.0) / 4.0)
        };
        for corners in proxies.iter().copied().chain(proxies.iter().map(|t| t.map(within))) {
            let proxy = triangle(corners.map(|p| sheared(p, shear)));
            let found = check_proxy(&proxy.borrowed(), &mesh.borrowed()).unwrap();
            let inside = covered(corners, &boxes);
            prop_assert_eq!(found.triangles.is_empty(), inside, "{:?} in {:?}", corners, boxes);
            for witness in found.witnesses {
                let p = straightened(witness, shear);
                let deep = |(low, high): &(Vec3, Vec3)|
                    (0..3).all(|k| low[k] + 1e-9 < p[k] && p[k] < high[k] - 1e-9);
                prop_assert!(
                    !boxes.iter().any(deep),
                    "{:?} is no witness for {:?} in {:?}",
                    p,
                    corners,
                    boxes
                );
            }
        }
    }

    /// Points made of half axes are in an oriented box, solid or flat.
    /// Points beyond its farthest point in some direction are not.
    #[test]
    fn oriented_boxes_contain_their_points_and_no_others(
        center in [-9_i32..9, -9..9, -9..9],
        axes in [[-3_i32..4, -3..4, -3..4], [-3_i32..4, -3..4, -3..4], [-3_i32..4, -3..4, -3..4]],
        half_sizes in [0_i32..4, 0..4, 0..4],
        place in [-4_i32..5, -4..5, -4..5],
        direction in [-3_i32..4, -3..4, -3..4],
    ) {
        let center = center.map(f64::from);
        let axes = axes.map(|row| row.map(f64::from));
        let half_sizes = half_sizes.map(f64::from);
        let volume = Volume::OrientedBox { center, half_sizes, axes };
        let at = |u: Vec3| -> Vec3 {
            std::array::from_fn(|i|
                center[i] + (0..3).map(|k| axes[i][k] * half_sizes[k] * u[k]).sum::<f64>())
        };
        prop_assert!(contains(&volume, at(place.map(|x| f64::from(x) / 4.0))));
        prop_assert_eq!(check_bounds(&volume, &[at([1.0; 3]), center], None), None);
        let n = direction.map(f64::from);
        prop_assume!(n != [0.0; 3]);
        let farthest = at(std::array::from_fn(|k|
            (0..3).map(|i| n[i] * axes[i][k]).sum::<f64>().signum()));
        let beyond: Vec3 = std::array::from_fn(|i| farthest[i] + n[i] / 1024.0);
        prop_assert!(!contains(&volume, beyond));
        let distance = check_bounds(&volume, &[center, beyond], None).unwrap();
        let step = n.iter().map(|x| x * x).sum::<f64>().sqrt() / 1024.0;
        prop_assert!(distance > 0.0 && distance <= step * 1.001, "{} {}", distance, step);
    }
}

/// A check of vertices alone would miss this case, and cutting finds it.
#[test]
fn a_triangle_across_a_corner_is_outside_with_all_its_vertices_inside() {
    let boxes = [([0.0, 0.0, 0.0], [2.0, 5.0, 5.0]), ([0.0, 0.0, 0.0], [5.0, 2.0, 5.0])];
    let corners = [[1.0, 4.0, 1.0], [4.0, 1.0, 1.0], [1.0, 4.0, 4.0]];
    let mut mesh = Mesh::default();
    boxes.iter().for_each(|(low, high)| mesh.add_box(*low, *high));
    let found = check_proxy(&triangle(corners).borrowed(), &mesh.borrowed()).unwrap();
    assert!(!covered(corners, &boxes) && found.triangles == [0] && found.vertices.is_empty());
}

/// Verdicts are exact at any size.
/// The reported distances and witnesses have to be near the truth there, too.
#[test]
fn distances_and_witnesses_hold_at_any_size() {
    for size in [1.0, 1e100, 1e-100, 1e160, 1e-160, 1e300, 1e-300] {
        let times = |p: Vec3| p.map(|x| x * size);
        let mesh = box_mesh(times([-1.0, 1.0, 0.0]), times([2.0; 3]));
        let proxy = triangle([[-1.0, 1.0, 1.0], [-0.5, 2.0, -0.5], [-1.0, 2.0, 2.0]].map(times));
        let found = check_proxy(&proxy.borrowed(), &mesh.borrowed()).unwrap();
        // Its lowest corner is half a unit below the box.
        assert!((found.distance / size - 0.5).abs() < 1e-9, "{size:e}: {found:?}");
        assert!(found.witnesses[0][2] < 0.0, "{size:e}: {found:?}");
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for volume in [
            Volume::Sphere { center: [0.0; 3], radius: size },
            Volume::Box { min: [0.0; 3], max: [size; 3] },
            Volume::OrientedBox { center: [0.0; 3], half_sizes: [size; 3], axes },
        ] {
            let outside = check_bounds(&volume, &[times([0.0, 0.0, 2.0])], None).unwrap();
            assert!((outside / size - 1.0).abs() < 1e-9, "{size:e}: {outside:e} of {volume:?}");
        }
    }
}

#[test]
fn bounds_at_the_last_bit() {
    let third = 1.0 / 3.0;
    let sphere = Volume::Sphere { center: [third; 3], radius: 5.0 };
    // A 3-4-5 triangle about a centre of integers is on the sphere exactly.
    let whole = Volume::Sphere { center: [1.0, 2.0, 3.0], radius: 5.0 };
    assert_eq!(check_bounds(&whole, &[[4.0, 6.0, 3.0], [1.0, -1.0, 7.0]], None), None);
    let off = check_bounds(&whole, &[[4.0, 6.0_f64.next_up(), 3.0]], None).unwrap();
    assert!(off > 0.0 && off < 1e-14);
    assert!(contains(&sphere, [third, third, third + 4.9]));
    let cube = Volume::Box { min: [0.0; 3], max: [1.0; 3] };
    assert_eq!(check_bounds(&cube, &[[0.0; 3], [1.0; 3], [0.5, 1.0, 0.0]], None), None);
    assert_eq!(check_bounds(&cube, &[[0.0, 0.0, -0.25], [1.0; 3]], None), Some(0.25));
    // In exact numbers 0.1 times 10 is more than 1; float64 rounds it to 1.
    let mut ten = [0.0; 16];
    for k in 0..4 {
        ten[5 * k] = if k < 3 { 10.0 } else { 1.0 };
    }
    assert!(check_bounds(&cube, &[[0.1; 3]], Some(&ten)).is_some());
    assert_eq!(check_bounds(&cube, &[[0.1_f64.next_down(); 3]], Some(&ten)), None);
    for bad in [
        Volume::Sphere { center: [0.0; 3], radius: -1.0 },
        Volume::Sphere { center: [f64::NAN; 3], radius: 1.0 },
        Volume::Box { min: [1.0; 3], max: [0.0; 3] },
    ] {
        assert_eq!(check_bounds(&bad, &[[0.0; 3]], None), Some(f64::INFINITY));
        assert!(!contains(&bad, [0.0; 3]));
    }
    assert_eq!(check_bounds(&cube, &[[f64::NAN; 3]], None), Some(f64::INFINITY));
}
