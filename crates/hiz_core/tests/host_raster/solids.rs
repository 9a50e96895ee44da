//! Closed parts of meshes, of which the faces by which a ray leaves are not drawn.
//!
//! No pixel may be lost by that, and each depth has to be that of the nearest face.

use super::*;

/// A closed mesh about the origin, of about the size 1.
pub(crate) fn solid(random: &mut Random) -> Mesh {
    let mut mesh = match random.below(5) {
        0 | 1 => prism(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]),
        2 => sphere(1 + random.below(4)),
        3 => torus(4 + random.below(30)),
        // A pentagram, which winds twice about its middle.
        _ => prism(&[0.0, 2.0, 4.0, 1.0, 3.0].map(|k: f64| {
            let (sin, cos) = (k / 5.0 * std::f64::consts::TAU).sin_cos();
            [cos, sin]
        })),
    };
    if random.below(3) == 0 {
        mesh = turned(&mesh);
    }
    if random.below(3) == 0 { apart(&mesh) } else { mesh }
}

/// A prism over a polygon, from z = -1 to z = 1; its caps are fans.
fn prism(polygon: &[[f64; 2]]) -> Mesh {
    let mut mesh = Mesh::default();
    for z in [-1.0, 1.0] {
        for [x, y] in polygon {
            mesh.vertex([*x, *y, z]);
        }
    }
    let n = polygon.len() as u32;
    for i in 0..n {
        let j = (i + 1) % n;
        mesh.triangles.extend([i, j, n + i, j, n + j, n + i]);
        if i > 0 && j > 0 {
            mesh.triangles.extend([0, j, i, n, n + i, n + j]);
        }
    }
    mesh
}

/// An octahedron, cut finer so many times.
fn sphere(times: u32) -> Mesh {
    let mut triangles: Vec<[Vec3; 3]> = (0..8)
        .map(|corner| {
            let sign = |k: u32| if corner >> k & 1 == 0 { 1.0 } else { -1.0 };
            let [x, y, z] = [[sign(0), 0.0, 0.0], [0.0, sign(1), 0.0], [0.0, 0.0, sign(2)]];
            if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] }
        })
        .collect();
    for _ in 0..times {
        let cut = |[a, b, c]: [Vec3; 3]| {
            let middle = |p: Vec3, q: Vec3| unit(std::array::from_fn(|k| p[k] + q[k]));
            let (d, e, f) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        };
        triangles = triangles.into_iter().flat_map(cut).collect();
    }
    let mut mesh = Mesh::default();
    let mut known: Vec<Vec3> = Vec::new();
    for corner in triangles.into_iter().flatten() {
        let vertex = known.iter().position(|p| *p == corner).unwrap_or_else(|| {
            known.push(corner);
            mesh.vertex(corner) as usize
        });
        mesh.triangles.push(vertex as u32);
    }
    mesh
}

fn torus(n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let turn = |k: u32| (f64::from(k) / f64::from(n) * std::f64::consts::TAU).sin_cos();
    for i in 0..n * n {
        let ((s, c), (t, d)) = (turn(i / n), turn(i % n));
        mesh.vertex([(0.7 + 0.3 * d) * c, (0.7 + 0.3 * d) * s, 0.3 * t]);
        let at = |row: u32, column: u32| row % n * n + column % n;
        let (row, column) = (i / n, i % n);
        let [a, b] = [at(row, column), at(row + 1, column)];
        let [c, d] = [at(row, column + 1), at(row + 1, column + 1)];
        mesh.triangles.extend([a, b, c, c, b, d]);
    }
    mesh
}

fn turned(mesh: &Mesh) -> Mesh {
    let mut turned = mesh.clone();
    turned.triangles.as_chunks_mut::<3>().0.iter_mut().for_each(|t| t.swap(1, 2));
    turned
}

/// Each triangle with vertices of its own.
fn apart(mesh: &Mesh) -> Mesh {
    let mut apart = Mesh::default();
    mesh.corners().into_iter().for_each(|corners| apart.triangle(corners));
    apart
}

/// Takes a triangle away, so that the mesh is open.
fn opened(mesh: &Mesh, random: &mut Random) -> Mesh {
    let mut open = mesh.clone();
    let left_out = 3 * random.below(mesh.triangles.len() as u32 / 3) as usize;
    open.triangles.drain(left_out..left_out + 3);
    open
}

/// Two lobes, of which one is inside out wherever the other one is not.
fn bow(random: &mut Random) -> Mesh {
    prism(&[[-1.0, -1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, random.range(-0.8, 0.8)]])
}

/// Adds a mesh, turned somehow, where it is seen from outside, from inside, or across the near
/// plane.
fn add(random: &mut Random, mesh: &mut Mesh, part: &Mesh, view: &View) {
    let (center, size) = match random.below(6) {
        0 => ([0.0; 3], random.pick(&[2.0, 10.0, 1e3])),
        1 => (around(random, [0.0; 3], 1.5), 1.0),
        2 => ([random.range(-9.0, 9.0), 0.0, 0.0], random.pick(&[1.0, 8.0])),
        _ => {
            let center = ahead(random);
            (center, random.pick(&[0.02, 0.1, 0.3, 1.0]) * center[2])
        }
    };
    let x = unit([0; 3].map(|_| random.range(-1.0, 1.0) + 1e-3));
    let y = unit(cross(x, [0; 3].map(|_| random.range(-1.0, 1.0))));
    let z = cross(x, y);
    let stretch = [0; 3].map(|_| size * random.pick(&[1.0, 1.0, 0.1]));
    let first = (mesh.vertices.len() / 3) as u32;
    for v in 0..part.vertices.len() / 3 {
        let p = part.position(v as u32);
        mesh.vertex(view.point(std::array::from_fn(|k| {
            center[k]
                + x[k] * p[0] * stretch[0]
                + y[k] * p[1] * stretch[1]
                + z[k] * p[2] * stretch[2]
        })));
    }
    mesh.triangles.extend(part.triangles.iter().map(|v| v + first));
}

/// Closed parts, open ones and others, seen from anywhere.
pub(crate) fn scene(random: &mut Random) -> (View, Mesh) {
    let view = view(random);
    let mut mesh = Mesh::default();
    for _ in 0..1 + random.below(4) {
        let part = match random.below(8) {
            0 => bow(random),
            1 | 2 => {
                let part = solid(random);
                opened(&part, random)
            }
            _ => solid(random),
        };
        add(random, &mut mesh, &part, &view);
    }
    if random.below(3) == 0 {
        small(random, &mut mesh, &view);
    }
    (view, mesh)
}

/// Solids whose corners lie within a unit of pixels' centres, so that centres lie on slivers.
///
/// All depths are equal, as planes of slivers are too steep to tell anything.
fn on_centres(random: &mut Random) -> (Camera, Mesh) {
    let mut mesh = Mesh::default();
    for _ in 0..10 {
        let part = if random.below(2) == 0 { sphere(3) } else { torus(16) };
        let center = [0; 2].map(|_| random.range(10.0, 54.0));
        let size = random.range(4.0, 16.0);
        let first = (mesh.vertices.len() / 3) as u32;
        for v in 0..part.vertices.len() / 3 {
            let [x, y, z] = part.position(v as u32);
            let mut jitter = || random.range(-1.0, 1.0) / 256.0;
            let mut near = |center: f64, x: f64| (center + size * x).floor() + 0.5 + jitter();
            mesh.vertex([near(center[0], x), near(center[1], y), z]);
        }
        mesh.triangles.extend(part.triangles.iter().map(|v| v + first));
    }
    (unit_pixels(64, 1e-12), mesh)
}

/// Scenes against brute force, in which every face counts.
pub(crate) fn against_brute_force(
    seeds: std::ops::Range<u64>,
    fault: Option<RasterFault>,
) -> Result<Tally, String> {
    let mut tally = Tally::default();
    for seed in seeds {
        let (view, mesh) = scene(&mut Random(seed));
        let depth = draw(&mesh.surface(view.seen.culled, None), &view.seen.camera, PLAIN, fault);
        compare(&view.seen, &mesh.corners(), &depth, &mut tally)
            .map_err(|error| format!("seed {seed}: {error}"))?;
    }
    Ok(tally)
}

/// An image of all faces covers the pixels of its fronts and those of its backs, and no pixel is
/// nearer than the nearer one of both.
///
/// Culled images are the other way to leave faces out.
pub(crate) fn no_pixel_is_lost(
    seeds: std::ops::Range<u64>,
    fault: Option<RasterFault>,
) -> Result<u64, String> {
    let mut farther = 0;
    for seed in seeds {
        let mut random = Random(seed);
        let (camera, mesh) = if seed % 8 == 0 {
            on_centres(&mut random)
        } else {
            let (view, mesh) = scene(&mut random);
            (view.seen.camera, mesh)
        };
        let camera = &camera;
        let image = |culled| draw(&mesh.surface(culled, None), camera, PLAIN, fault);
        let nearness = |depth: f32| match camera.convention() {
            DepthConvention::Reversed => depth,
            DepthConvention::Standard => 1.0 - depth,
        };
        let (all, fronts, backs) =
            (image(FaceCull::None), image(FaceCull::Back), image(FaceCull::Front));
        for (pixel, all) in all.iter().enumerate() {
            let [all, front, back] = [*all, fronts[pixel], backs[pixel]].map(nearness);
            let nearest = front.max(back);
            if (all > 0.0) != (nearest > 0.0) || all > nearest {
                return Err(format!("seed {seed}: {all}, not {nearest}, at pixel {pixel}"));
            }
            farther += u64::from(all < nearest);
        }
    }
    Ok(farther)
}

#[test]
fn closed_parts_are_drawn_as_if_all_of_their_faces_were() {
    let tally = against_brute_force(0..1500, None).unwrap();
    assert!(tally.covered > 500_000 && tally.empty > 500_000, "{tally:?}");
}

#[test]
fn no_pixel_of_a_closed_part_is_lost() {
    let farther = no_pixel_is_lost(0..1500, None).unwrap();
    // Only where roundings decide, at silhouettes.
    assert!(farther < 1000, "{farther}");
}
