//! What float64 cannot place exactly: borders on the rays of pixels, walls, thresholds.

use hiz_core::testing::PlantedFault;
use hiz_core::{Camera, ConservativeDepthOptions, FaceCull, ImageSize, Pose, Projection};

use crate::common::{CONVENTIONS, Random};
use crate::exact_rays::{ExactScene, Facing};
use crate::{Mesh, Tally, Vec3, Way, anywhere, examine, surface};

/// A wall whose border is within a rounding of a pixel's, in cameras whose constants cancel.
pub(crate) fn borders(way: Way, seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
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

    /// The corners of a wall across the view at depth `z`, in the view's own axes.
    fn wall(z: f64) -> [Vec3; 4] {
        [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]].map(|[x, y]| [x * z, y * z, z])
    }

    /// Examines a quad whose corners are in the view's own axes.
    fn examine(
        &self,
        random: &mut Random,
        how: (Way, Option<PlantedFault>),
        refinement: u32,
        corners: [Vec3; 4],
        tally: &mut Tally,
    ) {
        let mut mesh = Mesh::default();
        mesh.quad(corners.map(|v| self.at(v)));
        let options = ConservativeDepthOptions { refinement };
        examine(random, how, &self.camera, &mesh, FaceCull::None, &options, tally);
    }
}

/// Walls that face such a camera from a few near planes away.
/// Their depth is uncertain in float64.
pub(crate) fn facing_walls(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..40 {
        let near = 1e-4;
        let view = Lossy::new(&mut random, near);
        let z = near * random.range(1.5, 9.0);
        let refinement = random.below(2);
        view.examine(&mut random, (way, fault), refinement, Lossy::wall(z), &mut tally);
    }
    tally
}

/// Walls so near to the near plane that float64 cannot decide on which side they are.
pub(crate) fn walls_at_the_near_plane(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
    let (mut random, mut tally) = (Random(seed), Tally::default());
    for _ in 0..300 {
        let near = 1e-5;
        let view = Lossy::new(&mut random, near);
        let z = near + random.range(-3e-9, 3e-9);
        view.examine(&mut random, (way, fault), 0, Lossy::wall(z), &mut tally);
    }
    tally
}

/// Walls whose right border is a column's, as exact as float64 has it.
/// The near plane cuts that border in the middle of the image.
/// The border's other end is a thousand times as far away, and its place is far more certain.
pub(crate) fn cut_borders(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
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
        let corners = [left(before), left(far), far, before];
        view.examine(&mut random, (way, fault), 0, corners, &mut tally);
    }
    tally
}

/// A wall with a crack, closed by a triangle that faces away.
/// The triangle is so narrow that float64 cannot decide which way it faces.
/// It does not occlude, so rays through the crack have to get through.
pub(crate) fn closed_from_behind(way: Way, seed: u64, fault: Option<PlantedFault>) -> Tally {
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

/// A camera at the origin that looks along -z, and half the image's height at depth 1.
fn along_z(random: &mut Random, size: ImageSize) -> (Camera, f64) {
    let convention = random.pick(&CONVENTIONS);
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let fov_y = random.range(0.5, 1.5);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    (Camera::look_at(&pose, &projection, size).unwrap(), (fov_y / 2.0).tan())
}

/// A wall whose slanted border passes a pixel's corner less than half a 256th of a pixel inside.
pub(crate) fn slanted_borders(seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
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
pub(crate) fn rounded_thresholds(seed: u64, cases: u32, fault: Option<PlantedFault>) -> Tally {
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
