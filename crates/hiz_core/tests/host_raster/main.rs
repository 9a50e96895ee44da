//! The rasteriser on the host against brute force in float64, and against itself drawn in other
//! ways.
//! Planted faults show that these tests can fail.
//! No device is needed.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/raster_reference.rs"]
mod raster_reference;
mod solids;

use common::{CONVENTIONS, Random};
use hiz_core::testing::RasterFault;
use hiz_core::yardstick::HostRaster;
use hiz_core::{
    Camera, DepthConvention, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection,
};
use raster_reference::{Rays, Seen, Vec3};

/// Triangles of one mesh, in world coordinates.
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

    fn triangle(&mut self, corners: [Vec3; 3]) {
        let corners = corners.map(|p| self.vertex(p));
        self.triangles.extend(corners);
    }

    fn position(&self, v: u32) -> Vec3 {
        std::array::from_fn(|k| self.vertices[3 * v as usize + k])
    }

    fn corners(&self) -> Vec<[Vec3; 3]> {
        let (triangles, _) = self.triangles.as_chunks::<3>();
        triangles.iter().map(|t| t.map(|v| self.position(v))).collect()
    }

    fn surface(&self, cull_mode: FaceCull, transforms: Option<&[f64]>) -> OccluderSurface {
        let data = MeshData {
            vertices: Floats::F64(&self.vertices),
            triangles: &self.triangles,
            transforms: transforms.map(Floats::F64),
        };
        OccluderSurface::from_meshes(&[data], &OccluderOptions { cull_mode }).unwrap()
    }
}

/// How an image is drawn; none of it may change a pixel.
#[derive(Debug, Clone, Copy)]
struct Way {
    grid: [usize; 2],
    threads: usize,
    skip: bool,
}

const PLAIN: Way = Way { grid: [1, 1], threads: 1, skip: false };

fn draw(
    surface: &OccluderSurface,
    camera: &Camera,
    way: Way,
    fault: Option<RasterFault>,
) -> Vec<f32> {
    let size = camera.size();
    let mut raster = HostRaster::with_fault(size, way.grid, fault);
    raster.draw(surface, camera, way.threads, way.skip).unwrap();
    let mut depth = vec![f32::NAN; size.pixels() as usize];
    raster.write(&mut depth, camera, way.threads);
    depth
}

/// A view: a camera with its axes, about which meshes are made.
#[derive(Debug, Clone)]
struct View {
    seen: Seen,
    eye: Vec3,
    /// To the right, up, and into the view.
    axes: [Vec3; 3],
}

impl View {
    /// The world's point with these coordinates to the right, up and into the view.
    fn point(&self, p: Vec3) -> Vec3 {
        std::array::from_fn(|k| self.eye[k] + (0..3).map(|a| self.axes[a][k] * p[a]).sum::<f64>())
    }
}

fn unit(v: Vec3) -> Vec3 {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.map(|x| x / length)
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

const SIZES: [(u32, u32); 9] =
    [(1, 1), (7, 3), (8, 8), (65, 63), (65, 63), (40, 100), (130, 47), (1921, 17), (16_384, 3)];

fn view(random: &mut Random) -> View {
    let offset = random.pick(&[0.0, 0.0, 0.0, 1e3, 1e6]);
    let eye = [0; 3].map(|_| random.range(-1.0, 1.0) * offset);
    let toward = if random.below(4) == 0 {
        [0.0, 0.0, -1.0]
    } else {
        unit([0; 3].map(|_| random.range(-1.0, 1.0) + 0.01))
    };
    let pose =
        Pose { eye, target: std::array::from_fn(|k| eye[k] + toward[k]), up: [0.0, 1.0, 0.0] };
    let right = unit(cross(toward, pose.up));
    let axes = [right, cross(right, toward), toward];
    let convention = random.pick(&CONVENTIONS);
    let (width, height) = random.pick(&SIZES);
    let size = ImageSize::new(width, height);
    let aspect = f64::from(width) / f64::from(height);
    let (projection, rays) = match random.below(5) {
        0 => {
            let (near, far) = random.pick(&[(0.0, 20.0), (-1.0, 30.0), (4.0, 4.5), (1.0, 1000.0)]);
            let half = if aspect > 100.0 { 0.02 } else { 3.0 };
            let projection = Projection::Orthographic {
                left: -half * aspect,
                right: half * aspect,
                bottom: -half,
                top: half,
                near,
                far,
                convention,
            };
            (projection, Rays::Along(toward))
        }
        1 => {
            // A range so thin that the terms of nearness are much larger than their sum.
            let projection =
                Projection::Perspective { fov_y: 1.0, near: 5.0, far: Some(5.5), convention };
            (projection, Rays::From(eye))
        }
        _ => {
            let fov_y = if aspect > 100.0 { 0.002 } else { random.range(0.3, 2.0) };
            let near = random.pick(&[0.01, 0.1, 1.0]);
            let far = random.pick(&[None, Some(8.0), Some(1000.0)]);
            let projection = Projection::Perspective { fov_y, near, far, convention };
            (projection, Rays::From(eye))
        }
    };
    let camera = Camera::look_at(&pose, &projection, size).unwrap();
    let culled = random.pick(&[FaceCull::None, FaceCull::None, FaceCull::Back, FaceCull::Front]);
    View { seen: Seen { camera, rays, culled }, eye, axes }
}

fn around(random: &mut Random, center: Vec3, size: f64) -> Vec3 {
    center.map(|v| v + random.range(-size, size))
}

/// A place in front of the eye.
fn ahead(random: &mut Random) -> Vec3 {
    let z = random.pick(&[1.5, 4.2, 5.2, 5.3, 10.0]) * random.range(0.9, 1.1);
    [random.range(-0.8, 0.8) * z, random.range(-0.8, 0.8) * z, z]
}

fn small(random: &mut Random, mesh: &mut Mesh, view: &View) {
    let center = ahead(random);
    let size = random.pick(&[0.01, 0.05, 0.2, 1.0]) * center[2];
    mesh.triangle([0; 3].map(|_| view.point(around(random, center, size))));
}

fn sliver(random: &mut Random, mesh: &mut Mesh, view: &View) {
    let (a, b) = (ahead(random), ahead(random));
    let thin = random.pick(&[0.0, 1e-9, 1e-5, 1e-3, 1e-2]);
    let c = ahead(random);
    let t = random.range(-0.5, 1.5);
    let c = std::array::from_fn(|k| {
        let on = a[k] + t * (b[k] - a[k]);
        on + thin * (c[k] - on)
    });
    mesh.triangle([a, b, c].map(|p| view.point(p)));
}

fn degenerate(random: &mut Random, mesh: &mut Mesh, view: &View) {
    let a = view.point(ahead(random));
    let b = if random.below(2) == 0 { a } else { view.point(ahead(random)) };
    mesh.triangle([a, b, a]);
}

/// Of any size, about the eye: across the near plane, behind the eye, far outside of the image.
fn enormous(random: &mut Random, mesh: &mut Mesh, view: &View) {
    let size = random.pick(&[1.0, 10.0, 1e3, 1e5, 1e7]);
    let center = random.pick(&[[0.0; 3], [0.0, 0.0, 5.0], [0.0, -1.7, 2.0]]);
    let flat = random.pick(&[1.0, 1.0, 1e-3]);
    mesh.triangle([0; 3].map(|_| {
        let p = around(random, center, size);
        view.point([p[0], center[1] + (p[1] - center[1]) * flat, p[2]])
    }));
}

fn behind(random: &mut Random, mesh: &mut Mesh, view: &View) {
    mesh.triangle([0; 3].map(|_| {
        let p = ahead(random);
        view.point([p[0], p[1], -p[2]])
    }));
}

/// A piece of a height field below the eye, whose vertices are shared.
fn field(random: &mut Random, mesh: &mut Mesh, view: &View) {
    let n = 4 + random.below(5);
    let (rough, size) = (random.pick(&[0.0, 0.1, 0.5]), random.pick(&[3.0, 30.0]));
    let at = |k: u32| size * (f64::from(k) / f64::from(n - 1) - 0.5);
    let first = (mesh.vertices.len() / 3) as u32;
    for row in 0..n {
        for column in 0..n {
            let height = random.range(-rough, rough) - 1.0;
            mesh.vertex(view.point([at(column), height, at(row) + size * 0.4]));
        }
    }
    for row in 0..n - 1 {
        for column in 0..n - 1 {
            let a = first + row * n + column;
            mesh.triangles.extend([a, a + n, a + 1, a + 1, a + n, a + n + 1]);
        }
    }
}

const KINDS: [fn(&mut Random, &mut Mesh, &View); 6] =
    [small, sliver, degenerate, enormous, behind, field];

fn scene(random: &mut Random) -> (View, Mesh) {
    let view = view(random);
    let mut mesh = Mesh::default();
    let few = [random.below(6) as usize, random.below(6) as usize];
    for _ in 0..1 + random.below(30) {
        KINDS[random.pick(&few)](random, &mut mesh, &view);
    }
    (view, mesh)
}

/// What was compared.
#[derive(Debug, Default)]
struct Tally {
    /// Pixels that a triangle surely covers, known to a thousandth.
    covered: u64,
    /// Pixels that no triangle can cover.
    empty: u64,
}

/// Compares an image with its ranges; the first pixel that is outside.
fn compare(
    seen: &Seen,
    triangles: &[[Vec3; 3]],
    depth: &[f32],
    tally: &mut Tally,
) -> Result<(), String> {
    let convention = seen.camera.convention();
    for (pixel, (range, depth)) in seen.ranges(triangles).iter().zip(depth).enumerate() {
        let (nearness, rounding) = match convention {
            DepthConvention::Reversed => (f64::from(*depth), 0.0),
            DepthConvention::Standard => (1.0 - f64::from(*depth), 1e-7),
        };
        let is_ndc = (0.0..=1.0).contains(depth);
        if !is_ndc || nearness < range.low - rounding || nearness > range.high + rounding {
            let size = seen.camera.size();
            return Err(format!(
                "expected {range:?}, got {nearness} at pixel {pixel} of {size}, {convention:?}"
            ));
        }
        tally.covered += u64::from(range.low > 0.0 && range.high - range.low < 1e-3 * range.high);
        tally.empty += u64::from(range.high == 0.0);
    }
    Ok(())
}

/// Random scenes against brute force.
fn against_brute_force(
    seeds: std::ops::Range<u64>,
    fault: Option<RasterFault>,
) -> Result<Tally, String> {
    let mut tally = Tally::default();
    for seed in seeds {
        let mut random = Random(seed);
        let (view, mesh) = scene(&mut random);
        let surface = mesh.surface(view.seen.culled, None);
        let depth = draw(&surface, &view.seen.camera, PLAIN, fault);
        compare(&view.seen, &mesh.corners(), &depth, &mut tally)
            .map_err(|error| format!("seed {seed}: {error}"))?;
    }
    Ok(tally)
}

/// A crowded scene in which much is hidden: fields and soup of thousands of triangles.
fn crowd(random: &mut Random) -> (View, Mesh) {
    let view = view(random);
    let mut mesh = Mesh::default();
    // Walls, so that there is something to be hidden behind.
    for _ in 0..4 {
        let z = random.range(4.1, 9.0);
        let [left, low] = [0; 2].map(|_| random.range(-1.0, 0.2) * z);
        let [wide, high] = [0; 2].map(|_| random.range(0.2, 1.5) * z);
        let tilt = random.range(-0.3, 0.3);
        let corner = |x: f64, y: f64| view.point([left + wide * x, low + high * y, z + tilt * x]);
        mesh.triangle([corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0)]);
        mesh.triangle([corner(0.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)]);
    }
    for _ in 0..random.below(40) {
        enormous(random, &mut mesh, &view);
        field(random, &mut mesh, &view);
    }
    for _ in 0..3000 {
        small(random, &mut mesh, &view);
    }
    (view, mesh)
}

/// The same image, drawn in other ways, and with its triangles in another order.
fn in_other_ways(seeds: std::ops::Range<u64>, fault: Option<RasterFault>) -> Result<(), String> {
    for seed in seeds {
        let mut random = Random(seed);
        let (view, mesh) = match seed % 3 {
            0 => crowd(&mut random),
            1 => scene(&mut random),
            _ => solids::scene(&mut random),
        };
        let culled = view.seen.culled;
        let camera = &view.seen.camera;
        let surface = mesh.surface(culled, None);
        let plain = draw(&surface, camera, PLAIN, fault);
        let check = |depth: &[f32], how: &str| {
            let differs = |(a, b): (&f32, &f32)| a.to_bits() != b.to_bits();
            let pixels = plain.iter().zip(depth).filter(|pair| differs(*pair)).count();
            if pixels == 0 { Ok(()) } else { Err(format!("seed {seed}, {how}: {pixels} pixels")) }
        };
        for (grid, threads, skip) in [
            ([1, 1], 1, true),
            ([1, 2], 1, true),
            ([2, 1], 1, true),
            ([3, 3], 2, false),
            ([5, 2], 4, true),
            ([1, 7], 4, true),
            ([1000, 1000], 2, true),
        ] {
            let way = Way { grid, threads, skip };
            check(&draw(&surface, camera, way, fault), &format!("{way:?}"))?;
        }
        let mut shuffled = mesh.clone();
        let (triangles, _) = shuffled.triangles.as_chunks_mut::<3>();
        for i in (1..triangles.len()).rev() {
            triangles.swap(i, random.below(i as u32 + 1) as usize);
        }
        let way = Way { skip: true, ..PLAIN };
        check(&draw(&shuffled.surface(culled, None), camera, way, fault), "shuffled")?;
    }
    Ok(())
}

/// A camera whose pixels are the world's units: pixel (i, j) has its centre at (i + 0.5, j + 0.5).
///
/// Nearness is 0.5 at z = 0, and grows by `slope`, which must not be 0.
fn unit_pixels(side: u32, slope: f64) -> Camera {
    let convention = DepthConvention::Reversed;
    let n = f64::from(side);
    let rows = [
        [2.0 / n, 0.0, 0.0, -1.0],
        [0.0, -2.0 / n, 0.0, 1.0],
        [0.0, 0.0, slope, 0.5],
        [0.0, 0.0, 0.0, 1.0],
    ];
    Camera::from_clip_from_world(rows, ImageSize::new(side, side), convention).unwrap()
}

/// Each triangle drawn alone: how often each pixel is covered.
fn times_covered(camera: &Camera, triangles: &[[Vec3; 3]], fault: Option<RasterFault>) -> Vec<u32> {
    let mut times = vec![0; camera.size().pixels() as usize];
    for triangle in triangles {
        let mut mesh = Mesh::default();
        mesh.triangle(*triangle);
        let depth = draw(&mesh.surface(FaceCull::None, None), camera, PLAIN, fault);
        for (times, depth) in times.iter_mut().zip(depth) {
            *times += u32::from(depth > 0.0);
        }
    }
    times
}

/// Nets over the image whose vertices lie on pixels' centres, and so do many of their edges.
fn on_centres(fault: Option<RasterFault>) -> Result<(), String> {
    let mut random = Random(7);
    for (side, step) in [(32, 4), (64, 16), (64, 8), (128, 64), (256, 200), (1024, 500)] {
        let camera = unit_pixels(side, 0.25);
        let n = side / step + 3;
        let mut at = |k: u32| {
            let jitter = random.below(step / 2 + 1);
            f64::from(k * step + jitter) - f64::from(step) + 0.5
        };
        let vertices: Vec<Vec3> = (0..n * n).map(|i| [at(i % n), at(i / n), 0.0]).collect();
        let mut triangles = Vec::new();
        for row in 0..n - 1 {
            for column in 0..n - 1 {
                let a = row * n + column;
                let [a, b, c, d] = [a, a + 1, a + n, a + n + 1].map(|v| vertices[v as usize]);
                // Either diagonal, in either order.
                triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
        let times = times_covered(&camera, &triangles, fault);
        if let Some(pixel) = times.iter().position(|times| *times != 1) {
            return Err(format!("side {side}: pixel {pixel} is covered {} times", times[pixel]));
        }
    }
    // A closed fan about a centre: its border is part of it on the left and on top.
    let camera = unit_pixels(64, 0.25);
    let middle = [20.5, 30.5, 0.0];
    let ring = [[28.5, 30.5], [20.5, 38.5], [12.5, 30.5], [20.5, 22.5]].map(|[x, y]| [x, y, 0.0]);
    let triangles: Vec<[Vec3; 3]> = (0..4).map(|k| [middle, ring[k], ring[(k + 1) % 4]]).collect();
    let times = times_covered(&camera, &triangles, fault);
    for (pixel, times) in (0..64 * 64).zip(times) {
        let (x, y) = (pixel % 64 - 20, pixel / 64 - 30);
        let expected = match i32::abs(x) + i32::abs(y) {
            // The left corner's two edges are left edges, and the tip on top begins none.
            8 => u32::from(x < 0),
            sum => u32::from(sum < 8),
        };
        if times != expected {
            return Err(format!("the fan covers ({x}, {y}) {times} times, expected {expected}"));
        }
    }
    Ok(())
}

/// A net whose triangles reach far outside of the image, so that some of them are clipped.
///
/// No centre lies on an edge here; the vertices are no multiples of 1/256 pixel.
fn across_the_guard_band(fault: Option<RasterFault>) -> Result<(), String> {
    let camera = unit_pixels(64, 0.25);
    let mut random = Random(11);
    for _ in 0..40 {
        let middle = [random.range(0.0, 64.0), random.range(0.0, 64.0), 0.0];
        let n = 3 + random.below(6);
        let ring: Vec<Vec3> = (0..n)
            .map(|k| {
                let turn = (f64::from(k) + random.range(-0.2, 0.2)) / f64::from(n);
                let far = random.pick(&[200.0, 7000.0, 9000.0, 1e5]);
                let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
                [middle[0] + far * cos, middle[1] + far * sin, 0.0]
            })
            .collect();
        let triangles: Vec<[Vec3; 3]> =
            (0..ring.len()).map(|k| [middle, ring[k], ring[(k + 1) % ring.len()]]).collect();
        let times = times_covered(&camera, &triangles, fault);
        // The nearest points of the ring are outside of the image for n > 3.
        if n > 4 && times.contains(&0) || times.iter().filter(|times| **times > 1).count() > 2 {
            return Err(format!("a fan of {n} covers its pixels {times:?} times"));
        }
    }
    Ok(())
}

/// Copies at random places, some mirrored and some flattened, against the same copies in world
/// coordinates.
fn copies(seeds: std::ops::Range<u64>, fault: Option<RasterFault>) -> Result<(), String> {
    for seed in seeds {
        let mut random = Random(seed);
        let view = view(&mut random);
        let mut mesh = Mesh::default();
        if seed % 2 == 0 {
            mesh = solids::solid(&mut random);
        }
        for _ in 0..20 {
            let center = around(&mut random, [0.0; 3], 1.0);
            mesh.triangle([0; 3].map(|_| around(&mut random, center, 0.5)));
        }
        let (mut matrices, mut world) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            let mut linear = [0; 3].map(|_| [0; 3].map(|_| random.range(-1.0, 1.0)));
            let is_flat = random.below(4) == 0;
            if is_flat {
                linear[2] = std::array::from_fn(|k| linear[0][k] + linear[1][k]);
            }
            let place = view.point(ahead(&mut random));
            for k in 0..3 {
                matrices.extend(linear[k]);
                matrices.push(place[k]);
            }
            matrices.extend([0.0, 0.0, 0.0, 1.0]);
            let columns: [Vec3; 3] = std::array::from_fn(|c| linear.map(|row| row[c]));
            let normal = cross(columns[0], columns[1]);
            let is_mirrored = (0..3).map(|k| normal[k] * columns[2][k]).sum::<f64>() < 0.0;
            if is_flat && view.seen.culled != FaceCull::None {
                // Which side of a flattened copy is its front depends on roundings.
                matrices.truncate(matrices.len() - 16);
                continue;
            }
            world.extend(mesh.corners().into_iter().map(|corners| {
                let [a, b, c] = corners.map(|p| {
                    std::array::from_fn(|i| {
                        (0..3).map(|k| linear[i][k] * p[k]).sum::<f64>() + place[i]
                    })
                });
                if is_mirrored { [a, c, b] } else { [a, b, c] }
            }));
        }
        let surface = mesh.surface(view.seen.culled, Some(&matrices));
        let depth = draw(&surface, &view.seen.camera, PLAIN, fault);
        compare(&view.seen, &world, &depth, &mut Tally::default())
            .map_err(|error| format!("seed {seed}: {error}"))?;
    }
    Ok(())
}

#[test]
fn coverage_and_depth_are_those_of_brute_force() {
    let tally = against_brute_force(0..3000, None).unwrap();
    assert!(tally.covered > 1_000_000 && tally.empty > 1_000_000, "{tally:?}");
}

#[test]
fn copies_are_drawn_where_their_matrices_put_them() {
    copies(0..300, None).unwrap();
}

#[test]
fn each_centre_of_a_net_is_covered_once() {
    on_centres(None).unwrap();
    across_the_guard_band(None).unwrap();
}

#[test]
fn panes_threads_order_and_skipping_change_no_bit() {
    in_other_ways(0..90, None).unwrap();
}

#[test]
fn the_depth_of_a_surface_is_the_same_image() {
    for seed in 0..20 {
        let (view, mesh) = crowd(&mut Random(seed));
        let surface = mesh.surface(view.seen.culled, None);
        let plain = draw(&surface, &view.seen.camera, PLAIN, None);
        assert_eq!(surface.depth(&view.seen.camera).unwrap(), plain, "seed {seed}");
    }
}

#[test]
fn one_image_is_cut_anew_for_the_threads_of_each_drawing() {
    for seed in 0..20 {
        let (view, mesh) = crowd(&mut Random(seed));
        let (surface, camera) = (mesh.surface(view.seen.culled, None), &view.seen.camera);
        let plain = draw(&surface, camera, PLAIN, None);
        let mut raster = HostRaster::usual(camera.size());
        for threads in [1, 4, 2, 1] {
            raster.draw(&surface, camera, threads, true).unwrap();
            let mut depth = vec![f32::NAN; plain.len()];
            raster.write(&mut depth, camera, threads);
            assert_eq!(depth, plain, "seed {seed}, {threads} threads");
        }
    }
}

/// The image may be as large as an image can be, and the wall reaches to its last pixel.
#[test]
fn the_largest_image_is_drawn_to_its_borders() {
    for (width, height) in [(32_768, 1), (1, 32_768), (32_768, 9)] {
        let size = ImageSize::new(width, height);
        let camera = common::camera_along_z(width, height, DepthConvention::Reversed);
        assert_eq!(camera.size(), size);
        for reach in [4.0, 4.5, 1e6] {
            let mut mesh = Mesh::default();
            let (r, z) = (reach, 4.0);
            mesh.triangle([[-r, -r, z], [r, -r, z], [r, r, z]]);
            mesh.triangle([[-r, -r, z], [r, r, z], [-r, r, z]]);
            let depth = draw(&mesh.surface(FaceCull::None, None), &camera, PLAIN, None);
            assert!(depth.iter().all(|depth| *depth == 0.25), "{size} {reach}");
        }
    }
}

/// Positions at the ends of what is accepted: nothing panics, and nothing is nearer than the eye
/// plane allows.
#[test]
fn any_accepted_position_is_safe() {
    let scales = [0.0, 1e-320, 1e-30, 1e-3, 1.0, 1e7, 1e9, 1e12, 1e20, 9.9e29];
    for seed in 0..300 {
        let mut random = Random(seed);
        let view = view(&mut random);
        let mut mesh = Mesh::default();
        for _ in 0..40 {
            mesh.triangle(
                [0; 3].map(|_| [0; 3].map(|_| random.range(-1.0, 1.0) * random.pick(&scales))),
            );
        }
        let surface = mesh.surface(view.seen.culled, None);
        let plain = draw(&surface, &view.seen.camera, PLAIN, None);
        assert!(plain.iter().all(|depth| (0.0..=1.0).contains(depth)), "seed {seed}");
        let way = Way { grid: [2, 3], threads: 1, skip: true };
        assert_eq!(plain, draw(&surface, &view.seen.camera, way, None), "seed {seed}");
    }
}

/// The first test that sees a fault.
fn seen_by(fault: RasterFault) -> Option<String> {
    let fault = Some(fault);
    against_brute_force(0..3000, fault)
        .map(|_| ())
        .and_then(|()| on_centres(fault))
        .and_then(|()| across_the_guard_band(fault))
        .and_then(|()| copies(0..300, fault))
        .and_then(|()| in_other_ways(0..90, fault))
        .and_then(|()| solids::against_brute_force(0..1500, fault).map(|_| ()))
        .and_then(|()| solids::no_pixel_is_lost(0..1500, fault).map(|_| ()))
        .err()
}

#[test]
fn planted_faults_are_seen() {
    let faults = [
        RasterFault::EdgesOfBothSides,
        RasterFault::EdgesOfNoSide,
        RasterFault::PlaneOfRoundedCorners,
        RasterFault::FacingOfRoundedCorners,
        RasterFault::NoCap,
        RasterFault::BeyondFar,
        RasterFault::FarthestInTheMiddle,
        RasterFault::BoxesByTheirFarthest,
        RasterFault::RenewedTooNear,
        RasterFault::RemaindersDropped,
        RasterFault::CellOfOneTile,
        RasterFault::NearUnclipped,
        RasterFault::GuardClamped,
        RasterFault::ClippedInFloat32,
        RasterFault::MasksShifted,
        RasterFault::OrderOfOnePixel,
        RasterFault::LayersOverlap,
        RasterFault::WayByPane,
        RasterFault::PanesShifted,
        RasterFault::MirrorsIgnored,
        RasterFault::EnteringLeftOut,
        RasterFault::OpenCountsAsClosed,
        RasterFault::ClosedBeforeTheEye,
        RasterFault::ClosedIgnoreMirrors,
        RasterFault::SidesOfUnroundedCorners,
    ];
    let unseen: Vec<RasterFault> = faults
        .into_iter()
        .filter(|fault| {
            let seen = seen_by(*fault);
            eprintln!("{fault:?}: {seen:?}");
            seen.is_none()
        })
        .collect();
    assert!(unseen.is_empty(), "{unseen:?}");
}
