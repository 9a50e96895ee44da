//! Conservative occluder depth against exact rays.
//! Whatever the mesh, no ray through a pixel gets past the depth of that pixel.
//! Planted faults show that these tests can fail.
//! No device is needed.

mod common;
#[path = "common/exact_rays.rs"]
mod exact_rays;

use common::{CONVENTIONS, Random};
use exact_rays::{ExactScene, Facing};
use hiz_core::{
    Camera, ConservativeDepthOptions, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection, testing::PlantedFault,
};

type Vec3 = [f64; 3];

/// A mesh around the origin, about 1 in size, that is seen from about 3 away.
#[derive(Debug, Clone, Default)]
struct Mesh {
    vertices: Vec<f64>,
    triangles: Vec<u32>,
}

impl Mesh {
    fn vertex(&mut self, p: Vec3) -> u32 {
        self.vertices.extend(p);
        (self.vertices.len() / 3) as u32 - 1
    }

    fn quad(&mut self, corners: [Vec3; 4]) {
        let [a, b, c, d] = corners.map(|p| self.vertex(p));
        self.triangles.extend([a, b, c, a, c, d]);
    }
}

fn anywhere(random: &mut Random, size: f64) -> Vec3 {
    std::array::from_fn(|_| random.range(-size, size))
}

/// Triangles among few vertices.
/// They have edges shared by two, three and more, folds, intersections, duplicates and zero areas.
fn tangle(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let vertices = 4 + random.below(8);
    for _ in 0..vertices {
        let p = anywhere(random, 1.5);
        mesh.vertex(p);
    }
    for _ in 0..4 + random.below(24) {
        mesh.triangles.extend([0; 3].map(|_: u32| random.below(vertices)));
    }
    mesh
}

/// Separate triangles, some of them slivers.
fn soup(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..4 + random.below(16) {
        let (a, b) = (anywhere(random, 2.0), anywhere(random, 2.0));
        let thin = random.pick(&[1.0, 1.0, 1e-3, 1e-7, 0.0]);
        let c = anywhere(random, 2.0);
        let c = std::array::from_fn(|k| b[k] + thin * (c[k] - b[k]));
        for p in [a, b, c] {
            let v = mesh.vertex(p);
            mesh.triangles.push(v);
        }
    }
    mesh
}

/// Closed boxes that overlap each other.
fn boxes(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..1 + random.below(4) {
        let (center, half) = (anywhere(random, 1.0), [0; 3].map(|_| random.range(0.05, 1.0)));
        let first = (mesh.vertices.len() / 3) as u32;
        for corner in 0..8 {
            let p = std::array::from_fn(|k| {
                center[k] + if corner >> k & 1 == 0 { -half[k] } else { half[k] }
            });
            mesh.vertex(p);
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            mesh.triangles.extend([a, b, c, a, c, d].map(|v| v + first));
        }
    }
    mesh
}

/// A height field seen from the side, so that it folds over itself in the image.
fn terrain(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let n = 3 + random.below(4);
    let rough = random.pick(&[0.05, 0.3, 1.0]);
    for row in 0..n {
        for column in 0..n {
            let at = |k: u32| 6.0 * (f64::from(k) / f64::from(n - 1) - 0.5);
            let height = random.range(-rough, rough) - 0.2;
            mesh.vertex([at(column), height, at(row)]);
        }
    }
    for row in 0..n - 1 {
        for column in 0..n - 1 {
            let a = row * n + column;
            mesh.triangles.extend([a, a + n, a + 1, a + 1, a + n, a + n + 1]);
        }
    }
    mesh
}

/// A wall of planks with cracks between them, some of which share vertices.
/// The narrowest cracks are hardly above zero width in float64.
fn planks(random: &mut Random) -> Mesh {
    let mut mesh = Mesh::default();
    let mut x = -3.0;
    let z = random.range(-1.0, 1.0);
    while x < 3.0 {
        let next = x + random.range(0.2, 1.5);
        mesh.quad([[x, -3.0, z], [next, -3.0, z], [next, 3.0, z], [x, 3.0, z]]);
        x = next + random.pick(&[0.0, 0.0, 1e-3, 1e-6, 1e-9, 1e-13, -1e-13, -1e-3]);
    }
    mesh
}

const KINDS: [fn(&mut Random) -> Mesh; 5] = [tangle, soup, boxes, terrain, planks];

/// A view of the mesh, and the mesh moved to that place, near to or far from the world's origin.
fn viewed(random: &mut Random, mesh: &Mesh) -> (Camera, Mesh) {
    let offset = random.pick(&[0.0, 0.0, 1e3, 1e6, 1e7]);
    let place = anywhere(random, offset);
    let mut moved = mesh.clone();
    for (i, v) in moved.vertices.iter_mut().enumerate() {
        *v += place[i % 3];
    }
    let distance = random.pick(&[0.3, 1.5, 3.0, 3.0, 6.0]);
    let toward = [random.range(-1.0, 1.0), random.range(-0.5, 0.5), random.pick(&[-1.0, 1.0])];
    let eye = std::array::from_fn(|k| place[k] + distance * toward[k]);
    let pose = Pose { eye, target: place, up: [0.0, 1.0, 0.1] };
    let convention = random.pick(&CONVENTIONS);
    let size = ImageSize::new(1 + random.below(7), 1 + random.below(6));
    let near = random.pick(&[1e-3, 0.1, 1.0]);
    let far = random.pick(&[None, Some(4.0), Some(100.0)]);
    let projection = match random.below(4) {
        0 => Projection::Orthographic {
            left: -1.5,
            right: 1.0,
            bottom: -1.0,
            top: 1.5,
            near: random.pick(&[-1.0, 0.0, 1.0]),
            far: far.unwrap_or(8.0),
            convention,
        },
        1 => Projection::Frustum {
            left: -1.0,
            right: 0.3,
            bottom: -0.2,
            top: 0.8,
            near,
            far,
            convention,
        },
        _ => Projection::Perspective { fov_y: random.range(0.2, 2.0), near, far, convention },
    };
    let camera = Camera::look_at(&pose, &projection, size).unwrap();
    // In a bare matrix constants cancel, so that errors scale with the size of the world.
    let camera = if random.below(3) == 0 {
        Camera::from_clip_from_world(camera.clip_from_world(), size, convention).unwrap()
    } else {
        camera
    };
    (camera, moved)
}

/// Image points of the closed pixel.
/// They are its corners, its centre, random ones, and ones a hair beside an edge drawn through it.
fn points(
    random: &mut Random,
    camera: &Camera,
    mesh: &Mesh,
    column: u32,
    row: u32,
) -> Vec<[f64; 2]> {
    let (x, y) = (f64::from(column), f64::from(row));
    let mut points: Vec<[f64; 2]> =
        (0..9).map(|k| [x + f64::from(k % 3) / 2.0, y + f64::from(k / 3) / 2.0]).collect();
    points.extend((0..4).map(|_| [x + random.unit(), y + random.unit()]));
    let size = camera.size();
    let image = |v: u32| {
        let p: Vec3 =
            std::array::from_fn(|k| mesh.vertices[3 * v as usize + k] - camera.origin()[k]);
        let [cx, cy, _, w] = camera.rows().map(|r| r[0] * p[0] + r[1] * p[1] + r[2] * p[2] + r[3]);
        (w > 0.0).then(|| {
            [
                (cx / w + 1.0) * f64::from(size.width) / 2.0,
                (1.0 - cy / w) * f64::from(size.height) / 2.0,
            ]
        })
    };
    let inside = |p: &[f64; 2]| (x..=x + 1.0).contains(&p[0]) && (y..=y + 1.0).contains(&p[1]);
    for triangle in mesh.triangles.chunks_exact(3) {
        let k = random.below(3) as usize;
        let (Some(a), Some(b)) = (image(triangle[k]), image(triangle[(k + 1) % 3])) else {
            continue;
        };
        for t in [0.0, random.unit(), random.unit()] {
            let on = [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
            if inside(&on) {
                let hair = random.pick(&[1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12, 1e-14]);
                let side = [random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
                points.extend(
                    [on, [on[0] + hair * side[0], on[1] + hair * side[1]]]
                        .into_iter()
                        .filter(inside),
                );
            }
        }
    }
    // Multiples of 2^-60 pixels, which the exact integers can hold.
    let grid = 2.0_f64.powi(60);
    points.iter().map(|p| p.map(|v| (v * grid).round() / grid)).filter(inside).collect()
}

#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    pixels: u32,
    /// Pixels with a depth other than far.
    deep: u32,
    /// Pixels where every ray that was cast is blocked before the far plane.
    full: u32,
    rays: u32,
    /// Rays that get past their pixel's depth.
    past: u32,
}

fn surface(mesh: &Mesh, cull_mode: FaceCull) -> OccluderSurface {
    let data = MeshData {
        vertices: Floats::F64(&mesh.vertices),
        triangles: &mesh.triangles,
        transforms: None,
    };
    OccluderSurface::from_meshes(&[data], &OccluderOptions { cull_mode }).unwrap()
}

/// How conservative depth is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// As for every caller: a proof by thresholds, then a search.
    Usual,
    /// With arbitrary depths for the pixels' centres, which choose the thresholds.
    AnyCentres,
    /// By a search of every pixel.
    Search,
}

impl Way {
    fn depth(
        self,
        random: &mut Random,
        surface: &OccluderSurface,
        camera: &Camera,
        options: &ConservativeDepthOptions,
        fault: Option<PlantedFault>,
    ) -> Vec<f32> {
        match self {
            Self::Usual => surface.conservative_depth_with_fault(camera, options, fault),
            Self::Search => surface.conservative_depth_searched(camera, options, fault),
            Self::AnyCentres => {
                // Depths that occur, one for another, and some that do not.
                let usual = surface.conservative_depth_with_fault(camera, options, None).unwrap();
                let far = camera.convention().far();
                let centres: Vec<f32> = usual
                    .iter()
                    .map(|own| match random.below(6) {
                        0 => random.pick(&usual),
                        1 => far + (own - far) * random.range(0.5, 1.5) as f32,
                        2 => random.unit() as f32,
                        _ => *own,
                    })
                    .collect();
                surface.conservative_depth_by_centres(camera, options, &centres, fault)
            }
        }
        .unwrap()
    }
}

fn examine(
    random: &mut Random,
    (way, fault): (Way, Option<PlantedFault>),
    camera: &Camera,
    mesh: &Mesh,
    cull_mode: FaceCull,
    options: &ConservativeDepthOptions,
    tally: &mut Tally,
) {
    let depth = way.depth(random, &surface(mesh, cull_mode), camera, options, fault);
    let exact = ExactScene::new(camera, &mesh.vertices, &mesh.triangles);
    let facing = match cull_mode {
        FaceCull::None => Facing::Any,
        FaceCull::Back => Facing::CounterClockwise,
        FaceCull::Front => Facing::Clockwise,
    };
    let far = camera.convention().far();
    for row in 0..camera.size().height {
        for column in 0..camera.size().width {
            let depth = depth[(row * camera.size().width + column) as usize];
            let points = points(random, camera, mesh, column, row);
            tally.pixels += 1;
            if depth == far {
                let sample = &points[..9];
                tally.full += u32::from(sample.iter().all(|p| exact.blocked(*p, far, facing)));
                continue;
            }
            tally.deep += 1;
            tally.full += 1;
            for point in points {
                tally.rays += 1;
                if !exact.blocked(point, depth, facing) {
                    tally.past += 1;
                    if fault.is_none() {
                        eprintln!(
                            "pixel ({column}, {row}), depth {depth}, ray {point:?}\n\
                             {camera:?}\n{mesh:?}"
                        );
                    }
                }
            }
        }
    }
}

fn campaign(way: Way, seed: u64, cases: u32, fault: Option<PlantedFault>) -> Vec<Tally> {
    let mut random = Random(seed);
    let mut tallies = vec![Tally::default(); KINDS.len()];
    for case in 0..cases {
        let kind = case as usize % KINDS.len();
        let mesh = KINDS[kind](&mut random);
        let (camera, mesh) = viewed(&mut random, &mesh);
        let cull_mode =
            random.pick(&[FaceCull::None, FaceCull::None, FaceCull::Back, FaceCull::Front]);
        let options = ConservativeDepthOptions { refinement: random.below(4) };
        examine(&mut random, (way, fault), &camera, &mesh, cull_mode, &options, &mut tallies[kind]);
    }
    tallies
}

#[test]
fn no_ray_gets_past_a_pixels_depth() {
    let ways = [(Way::Usual, 1500), (Way::AnyCentres, 1500), (Way::Search, 500)];
    for (way, cases) in ways {
        no_ray_gets_past(way, cases);
    }
}

fn no_ray_gets_past(way: Way, cases: u32) {
    let tallies = campaign(way, 1, cases, None);
    for (name, tally) in ["tangle", "soup", "boxes", "terrain", "planks"].iter().zip(&tallies) {
        println!("{way:?}, {name}: {tally:?}");
        assert_eq!(tally.past, 0, "{way:?}, {name}");
        assert!(
            tally.deep > cases / 8 && tally.rays > 2 * cases,
            "a test without depths proves nothing: {way:?}, {name} {tally:?}"
        );
    }
}

#[test]
#[ignore = "minutes: make soak"]
fn no_ray_gets_past_a_pixels_depth_in_many_cases() {
    for seed in 100..140 {
        let way = [Way::Usual, Way::AnyCentres][seed as usize % 2];
        let tallies = campaign(way, seed, 2500, None);
        println!("seed {seed}: {:?}", tallies.iter().map(|t| t.rays).sum::<u32>());
        assert!(tallies.iter().all(|t| t.past == 0), "seed {seed}: {tallies:?}");
    }
}

/// A wall whose border is within a rounding of a pixel's, in cameras whose constants cancel.
fn borders(way: Way, seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
    let mut random = Random(seed);
    let mut tally = Tally::default();
    for _ in 0..cases {
        let (width, height) = (2 + random.below(6), 2 + random.below(6));
        let convention = random.pick(&CONVENTIONS);
        let size = ImageSize::new(width, height);
        let scale = random.pick(&[1.0, 1e3, 1e6]);
        let place = anywhere(&mut random, scale);
        let pose =
            Pose { eye: place, target: [place[0], place[1], place[2] - 1.0], up: [0.0, 1.0, 0.0] };
        let fov_y = random.range(0.5, 2.0);
        let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
        let camera = Camera::look_at(&pose, &projection, size).unwrap();
        let camera = if random.below(2) == 0 {
            Camera::from_clip_from_world(camera.clip_from_world(), size, convention).unwrap()
        } else {
            camera
        };
        let z = random.range(1.0, 9.0);
        let unit = 2.0 * (fov_y / 2.0).tan() / f64::from(height) * z;
        // The right border of a pixel column in world units, as exact as float64 has it.
        let column = f64::from(1 + random.below(width - 1)) - f64::from(width) / 2.0;
        let right = place[0] + column * unit;
        let mut mesh = Mesh::default();
        let (left, low, high) = (place[0] - 99.0, place[1] - 99.0, place[1] + 99.0);
        mesh.quad(
            [[left, low, -z], [right, low, -z], [right, high, -z], [left, high, -z]]
                .map(|p| [p[0], p[1], place[2] + p[2]]),
        );
        let options = ConservativeDepthOptions { refinement: random.below(2) };
        examine(&mut random, (way, fault), &camera, &mesh, FaceCull::None, &options, &mut tally);
    }
    tally
}

#[test]
fn borders_that_rounding_cannot_place_do_not_count() {
    for way in [Way::Usual, Way::AnyCentres, Way::Search] {
        let tally = borders(way, 2, 300, None);
        println!("{way:?}: {tally:?}");
        assert_eq!(tally.past, 0, "{way:?}");
        assert!(tally.deep > 1000, "{way:?}");
    }
}

/// A view that loses as much as float64 can lose so far from the origin.
/// Its matrix is a bare one, and its axes are in no special direction.
struct Lossy {
    camera: Camera,
    place: Vec3,
    /// Right, up, forward.
    axes: [Vec3; 3],
    /// Half the image's width and height at depth 1.
    half: [f64; 2],
}

impl Lossy {
    fn new(random: &mut Random, near: f64) -> Self {
        let place: Vec3 = [0; 3].map(|_| random.range(-1e7, 1e7));
        let cross = |a: Vec3, b: Vec3| {
            [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
        };
        let unit = |v: Vec3| v.map(|x| x / v.iter().map(|x| x * x).sum::<f64>().sqrt());
        let (forward, up) = (unit(anywhere(random, 1.0)), anywhere(random, 1.0));
        let right = unit(cross(forward, up));
        let axes = [right, cross(right, forward), forward];
        let convention = random.pick(&CONVENTIONS);
        let size = ImageSize::new(2 + random.below(4), 2 + random.below(4));
        let fov_y = random.range(0.5, 2.0);
        let projection = Projection::Perspective { fov_y, near, far: None, convention };
        // About the origin the axes are as accurate as float64 allows.
        // Then one matrix moves them to their place.
        let pose = Pose { eye: [0.0; 3], target: forward, up: axes[1] };
        let mut m = Camera::look_at(&pose, &projection, size).unwrap().clip_from_world();
        for row in &mut m {
            row[3] -= (0..3).map(|k| row[k] * place[k]).sum::<f64>();
        }
        let camera = Camera::from_clip_from_world(m, size, convention).unwrap();
        let top = (fov_y / 2.0).tan();
        let half = [top * f64::from(size.width) / f64::from(size.height), top];
        Self { camera, place, axes, half }
    }

    /// The world position of (right, up, forward).
    fn at(&self, v: Vec3) -> Vec3 {
        std::array::from_fn(|k| self.place[k] + (0..3).map(|j| self.axes[j][k] * v[j]).sum::<f64>())
    }
}

/// Walls that face such a camera from a few near planes away.
/// Their depth is uncertain in float64.
fn facing_walls(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..40 {
        let near = 1e-4;
        let view = Lossy::new(&mut random, near);
        let z = near * random.range(1.5, 9.0);
        let mut mesh = Mesh::default();
        mesh.quad(
            [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
                .map(|[x, y]| view.at([x * z, y * z, z])),
        );
        let options = ConservativeDepthOptions { refinement: random.below(2) };
        examine(
            &mut random,
            (way, fault),
            &view.camera,
            &mesh,
            FaceCull::None,
            &options,
            &mut tally,
        );
    }
    tally
}

/// Walls so near to the near plane that float64 cannot decide on which side they are.
fn walls_at_the_near_plane(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..300 {
        let near = 1e-5;
        let view = Lossy::new(&mut random, near);
        let z = near + random.range(-3e-9, 3e-9);
        let mut mesh = Mesh::default();
        mesh.quad(
            [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]
                .map(|[x, y]| view.at([x * z, y * z, z])),
        );
        let options = ConservativeDepthOptions { refinement: 0 };
        examine(
            &mut random,
            (way, fault),
            &view.camera,
            &mesh,
            FaceCull::None,
            &options,
            &mut tally,
        );
    }
    tally
}

/// Walls whose right border is a column's, as exact as float64 has it.
/// The near plane cuts that border in the middle of the image.
/// The border's other end is a thousand times as far away, and its place is far more certain.
fn cut_borders(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..150 {
        let near = 1e-3;
        let view = Lossy::new(&mut random, near);
        let ImageSize { width, height } = view.camera.size();
        let column = f64::from(1 + random.below(width - 1));
        let x = (2.0 * column / f64::from(width) - 1.0) * view.half[0];
        // The cut is in the first row or above; the far end below the image.
        let y = (1.0 - random.range(-1.0, 1.0) / f64::from(height)) * view.half[1];
        let (cut, far) =
            ([x * near, y * near, near], [x, -2.0 * view.half[1], 1.0].map(|v| 1e3 * near * v));
        let before: Vec3 = std::array::from_fn(|k| cut[k] - 1e-3 * (far[k] - cut[k]));
        let left = |p: Vec3| [p[0] - 9.0, p[1], p[2]];
        let mut mesh = Mesh::default();
        mesh.quad([left(before), left(far), far, before].map(|v| view.at(v)));
        let options = ConservativeDepthOptions { refinement: 0 };
        examine(
            &mut random,
            (way, fault),
            &view.camera,
            &mesh,
            FaceCull::None,
            &options,
            &mut tally,
        );
    }
    tally
}

/// A wall with a crack, closed by a triangle that faces away.
/// The triangle is so narrow that float64 cannot decide which way it faces.
/// It does not occlude, so rays through the crack have to get through.
fn closed_from_behind(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..600 {
        let view = Lossy::new(&mut random, 1e-3);
        let ImageSize { width, height } = view.camera.size();
        let x = random.range(-0.9, 0.9) * view.half[0];
        let crack = x + random.pick(&[1e-9, 2e-9, 4e-9, 8e-9]);
        let mut mesh = Mesh::default();
        let corner = |x: f64, y: f64| view.at([x, y, 1.0]);
        let [a, b, c, d] = [(-9.0, -9.0), (x, -9.0), (x, 9.0), (-9.0, 9.0)]
            .map(|(x, y)| mesh.vertex(corner(x, y)));
        let [f, g, h] =
            [(9.0, -9.0), (9.0, 9.0), (crack, 9.0)].map(|(x, y)| mesh.vertex(corner(x, y)));
        // Counter-clockwise as seen, except for the triangle in the crack.
        mesh.triangles.extend([a, b, c, a, c, d, b, f, g, b, g, h, b, c, h]);
        let options = ConservativeDepthOptions { refinement: 0 };
        let surface = surface(&mesh, FaceCull::Back);
        let depth = way.depth(&mut random, &surface, &view.camera, &options, fault);
        let exact = ExactScene::new(&view.camera, &mesh.vertices, &mesh.triangles);
        let middle = (0.5 * (x + crack) / view.half[0] + 1.0) * f64::from(width) / 2.0;
        let row = random.below(height);
        let depth = depth[(row * width + middle as u32) as usize];
        tally.pixels += 1;
        tally.deep += u32::from(depth != view.camera.convention().far());
        for k in -40..=40 {
            let grid = 2.0_f64.powi(60);
            let at = ((middle + f64::from(k) * 4e-10 * f64::from(width)) * grid).round() / grid;
            tally.rays += 1;
            let sees = depth == view.camera.convention().far()
                || exact.blocked([at, f64::from(row) + 0.5], depth, Facing::CounterClockwise);
            tally.past += u32::from(!sees);
        }
    }
    tally
}

/// Four things that float64 cannot always decide:
///
/// - a depth;
/// - the place of a cut at the near plane;
/// - the side of that plane on which a point is;
/// - the way that a triangle faces.
#[test]
fn what_float64_is_not_sure_of_does_not_count() {
    for way in [Way::Usual, Way::Search] {
        not_sure(way);
    }
}

fn not_sure(way: Way) {
    for (name, tally, deep) in [
        ("walls", facing_walls(way, 3, None), 300),
        ("walls at the near plane", walls_at_the_near_plane(way, 9, None), 5),
        // Where a cut's place matters it is not certain to lie behind the near plane.
        // Such triangles are dropped.
        ("cut borders", cut_borders(way, 4, None), 0),
        ("cracks", closed_from_behind(way, 5, None), 0),
    ] {
        println!("{way:?}, {name}: {tally:?}");
        assert!(tally.past == 0 && tally.deep >= deep, "{way:?}, {name}: {tally:?}");
    }
}

#[test]
fn planted_faults_of_the_search_let_rays_through() {
    let way = Way::Search;
    let past = |tallies: &[Tally]| tallies.iter().map(|t| t.past).sum::<u32>();
    let with = |fault| past(&campaign(way, 1, 150, Some(fault)));
    let contours = with(PlantedFault::ContoursIgnored);
    let centre = with(PlantedFault::DepthAtCentre);
    let folds = with(PlantedFault::FoldsIgnored);
    let nearest = with(PlantedFault::RoundedToNearest);
    let exact = borders(way, 2, 300, Some(PlantedFault::NoWidening)).past;
    for (name, past) in [
        ("before the near plane", with(PlantedFault::BeforeNear)),
        ("a cut's side joined", past(&campaign(way, 1, 1000, Some(PlantedFault::CutSidesJoined)))),
        (
            "points at the near plane unproved",
            walls_at_the_near_plane(way, 9, Some(PlantedFault::NearPointsUnproved)).past,
        ),
        ("exact depths", facing_walls(way, 3, Some(PlantedFault::DepthsExact)).past),
        (
            "exact depths of corners",
            facing_walls(way, 3, Some(PlantedFault::CornerDepthsExact)).past,
        ),
        ("exact cuts", cut_borders(way, 4, Some(PlantedFault::CutPointsExact)).past),
        ("facing unproved", closed_from_behind(way, 5, Some(PlantedFault::FacingUnproved)).past),
    ] {
        println!("{name}: {past} rays past");
        assert!(past > 0, "{name}: stayed green");
    }
    println!(
        "rays past a pixel's depth: contours ignored {contours}, depth at the centre {centre}, \
         folds ignored {folds}, rounded to nearest {nearest}, no widening {exact}"
    );
    assert!(contours > 100 && centre > 100 && exact > 10, "{contours} {centre} {exact}");
    assert!(folds > 10 && nearest > 10, "{folds} {nearest}");
}

/// Pixels that no threshold proves are searched with facets in integers.
#[test]
fn planted_faults_of_the_search_in_integers_let_rays_through() {
    for fault in
        [PlantedFault::ContoursIgnored, PlantedFault::DepthAtCentre, PlantedFault::FoldsIgnored]
    {
        let of = |way| campaign(way, 1, 600, Some(fault)).iter().map(|t| t.past).sum::<u32>();
        let (usual, any) = (of(Way::Usual), of(Way::AnyCentres));
        println!("{fault:?}: {usual} and {any} rays past a pixel's depth");
        assert!(usual > 0 && any > 0, "{fault:?}: stayed green");
    }
}

#[test]
fn planted_faults_of_the_proof_let_rays_through() {
    for fault in [
        PlantedFault::BordersIgnored,
        PlantedFault::PlaneWithoutReach,
        PlantedFault::FoldsCancel,
        PlantedFault::RoundedToNearest,
        PlantedFault::BeforeNear,
        PlantedFault::VerticesInFloat32,
        PlantedFault::LeftOutNeighboursIgnored,
    ] {
        let of = |way| campaign(way, 1, 600, Some(fault)).iter().map(|t| t.past).sum::<u32>();
        let (usual, any) = (of(Way::Usual), of(Way::AnyCentres));
        println!("{fault:?}: {usual} and {any} rays past a pixel's depth");
        assert!(usual > 0 && any > 0, "{fault:?}: stayed green");
    }
    let slanted = |fault| slanted_borders(6, 1500, fault);
    let (sound, faulty) = (slanted(None), slanted(Some(PlantedFault::NoEdgeMargin)).past);
    println!("no edge margin: {faulty} rays past a pixel's depth; without the fault {sound:?}");
    assert!(faulty > 0 && sound.past == 0 && sound.deep > 100, "no edge margin");
    let rounded = |fault| rounded_thresholds(7, 200, fault);
    let (sound, faulty) = (rounded(None), rounded(Some(PlantedFault::MembershipInFloat32)).past);
    println!("membership in float32: {faulty} rays past a pixel's depth; without {sound:?}");
    assert!(faulty > 0 && sound.past == 0 && sound.deep > 10, "membership in float32");
}

/// A camera at the origin that looks along -z, and half the image's height at depth 1.
fn along_z(random: &mut Random, size: ImageSize) -> (Camera, f64) {
    let convention = random.pick(&CONVENTIONS);
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let fov_y = random.range(0.5, 1.5);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    (Camera::look_at(&pose, &projection, size).unwrap(), (fov_y / 2.0).tan())
}

/// A wall whose slanted border passes a pixel's corner less than half a 256th of a pixel inside.
fn slanted_borders(seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..cases {
        let size = ImageSize::new(4, 4);
        let (camera, half) = along_z(&mut random, size);
        let z = random.range(1.0, 9.0);
        let unit = half * z / 2.0;
        // In pixels from the image's centre, x right and y up.
        let corner = [f64::from(random.below(3)) - 1.0, f64::from(random.below(3)) - 1.0];
        let inside = random.range(0.05, 0.45) / 256.0;
        let slope = random.range(0.2, 2.0) * random.pick(&[-1.0, 1.0]);
        let x = |y: f64| corner[0] - inside + slope * (y - corner[1]);
        let (low, high) = (random.range(-4.0, -2.5), random.range(2.5, 4.0));
        let mut mesh = Mesh::default();
        mesh.quad(
            [[-9.0, low], [x(low), low], [x(high), high], [-9.0, high]]
                .map(|[x, y]| [x * unit, y * unit, -z]),
        );
        let options = ConservativeDepthOptions { refinement: 0 };
        let way = Way::Usual;
        examine(&mut random, (way, fault), &camera, &mesh, FaceCull::None, &options, &mut tally);
    }
    tally
}

/// An oblique wall with a border in the only pixel, whose threshold is as far as the wall reaches.
fn rounded_thresholds(seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..cases {
        let (camera, half) = along_z(&mut random, ImageSize::new(1, 1));
        // Both ends of the whole wall are outside of the image.
        let slope = random.range(0.1, 0.8) / half;
        let z = random.range(2.0, 9.0);
        let at = |x: f64, y: f64| [x, y, -z + slope * x];
        let wide = half * z;
        let (left, right) = (-900.0 * wide, random.range(-0.4, 0.4) * wide);
        let (low, high) = (-9e3 * wide, 9e3 * wide);
        let mut mesh = Mesh::default();
        mesh.quad([at(left, low), at(right, low), at(right, high), at(left, high)]);
        let options = ConservativeDepthOptions { refinement: 0 };
        let wall = surface(&mesh, FaceCull::None);
        let far = camera.convention().far();
        let depth = |centre: f32, fault| {
            wall.conservative_depth_by_centres(&camera, &options, &[centre], fault).unwrap()[0]
        };
        // Where borders are ignored a depth says that the wall is in a slab.
        // Thresholds between the near and the far plane are halved until they are neighbours.
        let is_in = |centre| depth(centre, Some(PlantedFault::BordersIgnored)) != far;
        let between = |t: f32| far + (1.0 - 2.0 * far) * t;
        let (mut most, mut least) = (0.0_f32, 1.0_f32);
        while most.next_up() < least {
            let middle = f32::from_bits(most.to_bits().midpoint(least.to_bits()));
            if is_in(between(middle)) {
                most = middle;
            } else {
                least = middle;
            }
        }
        let exact = ExactScene::new(&camera, &mesh.vertices, &mesh.triangles);
        let centre = between(most);
        tally.pixels += 1;
        tally.deep += u32::from(is_in(centre));
        let depth = depth(centre, fault);
        for point in [[0.5, 0.5], [1.0, 0.5], [0.0, 0.0], [1.0, 1.0], [0.0, 0.5]] {
            tally.rays += 1;
            let is_past = depth != far && !exact.blocked(point, depth, Facing::Any);
            tally.past += u32::from(is_past);
        }
    }
    tally
}

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
