//! Conservative occluder depth against exact rays.
//! Whatever the mesh, no ray through a pixel gets past the depth of that pixel.
//! Planted faults show that these tests can fail.
//! No device is needed.

mod borders;
#[path = "../common/mod.rs"]
mod common;
mod copies;
#[path = "../common/exact_rays.rs"]
mod exact_rays;
mod faults;
mod rays;
mod solids;

use hiz_core::testing::PlantedFault;
use hiz_core::{
    Camera, ConservativeDepthOptions, FaceCull, Floats, ImageSize, MeshData, OccluderOptions,
    OccluderSurface, Pose, Projection,
};

use crate::common::{CONVENTIONS, Random};
use crate::exact_rays::{ExactScene, Facing};

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
