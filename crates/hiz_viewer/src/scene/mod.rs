//! Scenes as data: kinds of meshes with LODs, bodies that are placed meshes, and a camera's path.
//!
//! Nothing here needs a device.
//! Coordinates are right-handed, y points up, and the unit is the metre.

pub(crate) mod arm;
pub(crate) mod castle;
pub(crate) mod city;
pub(crate) mod motion;
mod mountains;
mod npy;
mod random;

use hiz_core::{Camera, DepthConvention, ImageSize, LodRule, Pose, Projection, Vec3};

use crate::Failure;
use crate::mesh::Mesh;

/// One of the meshes that can be drawn for a body.
#[derive(Debug)]
pub(crate) struct Lod {
    pub(crate) mesh: Mesh,
    /// A bound on how far this mesh is from the finest one, at scale 1.
    pub(crate) error: f64,
}

/// A mesh with its LODs, the finest first.
#[derive(Debug)]
pub(crate) struct Kind {
    pub(crate) lods: Vec<Lod>,
}

impl Kind {
    /// A mesh that is always drawn as it is.
    pub(crate) fn of(mesh: Mesh) -> Self {
        Self { lods: vec![Lod { mesh, error: 0.0 }] }
    }

    /// Meshes from the finest to the coarsest, of about `size` across.
    /// How far each is from the first is measured.
    pub(crate) fn with_lods(meshes: Vec<Mesh>, size: f64) -> Self {
        let errors: Vec<_> = meshes
            .iter()
            .enumerate()
            .map(|(i, mesh)| if i == 0 { 0.0 } else { meshes[0].deviation(mesh, size) })
            .collect();
        Self::with_errors(meshes, &errors)
    }

    /// Spheres of radius 1, from the finest to the coarsest.
    ///
    /// Each lies in the shell between the round sphere and the ball inside of it.
    /// A ray from the middle meets two of them no farther apart than the thicker shell.
    pub(crate) fn of_spheres(meshes: Vec<Mesh>) -> Self {
        let thickness = |mesh: &Mesh| 1.0 - mesh.inner_radius();
        let finest = thickness(&meshes[0]);
        let errors: Vec<_> = meshes
            .iter()
            .enumerate()
            .map(|(i, mesh)| if i == 0 { 0.0 } else { thickness(mesh).max(finest) })
            .collect();
        Self::with_errors(meshes, &errors)
    }

    fn with_errors(meshes: Vec<Mesh>, errors: &[f64]) -> Self {
        let lods = meshes.into_iter().zip(errors.iter().copied()).enumerate();
        Self { lods: lods.map(|(i, (mesh, error))| Lod { mesh: mesh.of_lod(i), error }).collect() }
    }
}

/// A mesh at a place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Body {
    /// An index into [`Scene::kinds`].
    pub(crate) kind: u32,
    pub(crate) position: [f32; 3],
    pub(crate) scale: f32,
    /// Sine and cosine of the turn about the y axis.
    pub(crate) turn: [f32; 2],
    /// What the mesh's colours are multiplied with.
    pub(crate) tint: [f32; 3],
    /// Whether it is drawn before a cull that has one pass.
    pub(crate) occluder: bool,
}

impl Body {
    /// A body without turn, of scale 1.
    pub(crate) fn at(kind: u32, position: [f32; 3], occluder: bool) -> Self {
        Self { kind, position, scale: 1.0, turn: [0.0, 1.0], tint: [1.0; 3], occluder }
    }

    /// Where a point of the mesh is in the world; twin: `shaders/scene.wgsl`, `placed`.
    fn placed(&self, [x, y, z]: [f32; 3]) -> Vec3 {
        let [x, y, z] = [x, y, z].map(f64::from);
        let [sin, cos] = self.turn.map(f64::from);
        let turned = [cos * x + sin * z, y, cos * z - sin * x];
        [0, 1, 2].map(|k| f64::from(self.position[k]) + f64::from(self.scale) * turned[k])
    }
}

/// What the cull tests, one per body.
#[derive(Debug)]
pub(crate) enum Volumes {
    /// Least and greatest corners.
    Boxes { min: Vec<f64>, max: Vec<f64> },
    /// Centres and radii.
    Spheres { centers: Vec<f64>, radii: Vec<f64> },
}

/// A piece of a path: the camera moves from one pose to another.
/// Between two legs it jumps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leg {
    pub(crate) eyes: [Vec3; 2],
    pub(crate) targets: [Vec3; 2],
}

/// A scene.
#[derive(Debug)]
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    pub(crate) kinds: Vec<Kind>,
    /// In ascending order of their kinds.
    pub(crate) bodies: Vec<Body>,
    pub(crate) volumes: Volumes,
    /// How a LOD is chosen.
    pub(crate) rule: LodRule,
    pub(crate) legs: Vec<Leg>,
    /// Vertical, in radians.
    pub(crate) fov_y: f64,
    pub(crate) near: f64,
    pub(crate) far: Option<f64>,
    /// Metres per second of a walking camera.
    pub(crate) speed: f64,
}

/// The names of the scenes that need no data.
pub(crate) const NAMES: [&str; 3] = ["mountains", "arm", "city"];

impl Scene {
    /// A scene by its name.
    ///
    /// # Errors
    /// For other names, and for a castle whose data is not there.
    pub(crate) fn by_name(name: &str) -> Result<Self, Failure> {
        match name {
            "mountains" => Ok(mountains::scene()),
            "arm" => Ok(arm::scene()),
            "city" => Ok(city::scene()),
            "castle" => castle::scene(),
            _ => {
                Err(format!("--scene: expected one of {}, castle, got {name:?}", NAMES.join(", "))
                    .into())
            }
        }
    }

    /// The scene with the finest LOD of each kind alone.
    pub(crate) fn without_lods(mut self) -> Self {
        for kind in &mut self.kinds {
            kind.lods.truncate(1);
        }
        self
    }

    /// The bodies of a kind.
    pub(crate) fn range_of(&self, kind: usize) -> std::ops::Range<u32> {
        let first = self.bodies.partition_point(|b| (b.kind as usize) < kind);
        let end = self.bodies.partition_point(|b| b.kind as usize <= kind);
        first as u32..end as u32
    }

    /// Triangles of all bodies, each at its finest.
    pub(crate) fn num_triangles(&self) -> u64 {
        let of = |b: &Body| self.kinds[b.kind as usize].lods[0].mesh.num_triangles() as u64;
        self.bodies.iter().map(of).sum()
    }

    /// The corners of the boxes around the bounds, in turns least and greatest.
    pub(crate) fn corners(&self) -> Vec<[f32; 4]> {
        let point = |p: [f64; 3]| [p[0] as f32, p[1] as f32, p[2] as f32, 1.0];
        match &self.volumes {
            Volumes::Boxes { min, max } => min
                .chunks_exact(3)
                .zip(max.chunks_exact(3))
                .flat_map(|(a, b)| [point([a[0], a[1], a[2]]), point([b[0], b[1], b[2]])])
                .collect(),
            Volumes::Spheres { centers, radii } => centers
                .chunks_exact(3)
                .zip(radii)
                .flat_map(|(c, r)| [-r, *r].map(|r| point([c[0] + r, c[1] + r, c[2] + r])))
                .collect(),
        }
    }

    /// Whether the camera jumps to frame `frame` of a path of `frames`.
    pub(crate) fn is_cut(&self, frame: usize, frames: usize) -> bool {
        frame.is_multiple_of(self.frames_per_leg(frames))
    }

    fn frames_per_leg(&self, frames: usize) -> usize {
        frames.div_ceil(self.legs.len()).max(1)
    }

    /// The pose of frame `frame` of a path of `frames`.
    pub(crate) fn pose(&self, frame: usize, frames: usize) -> Pose {
        let per_leg = self.frames_per_leg(frames);
        let leg = &self.legs[frame / per_leg % self.legs.len()];
        let t = (frame % per_leg) as f64 / per_leg as f64;
        let mix = |[a, b]: [Vec3; 2]| [0, 1, 2].map(|k| a[k] + t * (b[k] - a[k]));
        Pose { eye: mix(leg.eyes), target: mix(leg.targets), up: [0.0, 1.0, 0.0] }
    }

    /// The camera at a pose: reversed Z, and float32 coordinates of the eye.
    ///
    /// # Errors
    /// For a pose that looks straight up or down, and for an image of no pixels.
    pub(crate) fn camera(&self, pose: &Pose, size: ImageSize) -> hiz_core::Result<Camera> {
        // The vertex shader subtracts the eye in float32, so the eye has to be one.
        let eye = pose.eye.map(|v| f64::from(v as f32));
        let target = [0, 1, 2].map(|k| pose.target[k] + (eye[k] - pose.eye[k]));
        let projection = Projection::Perspective {
            fov_y: self.fov_y,
            near: self.near,
            far: self.far,
            convention: DepthConvention::Reversed,
        };
        Camera::look_at(&Pose { eye, target, up: pose.up }, &projection, size)
    }
}

/// The boxes around bodies, rounded outwards: all LODs as the device places them in float32.
fn boxes(kinds: &[Kind], bodies: &[Body]) -> Volumes {
    let (mut least, mut greatest) = (Vec::new(), Vec::new());
    for body in bodies {
        let (mut min, mut max) = ([f64::MAX; 3], [f64::MIN; 3]);
        let meshes = kinds[body.kind as usize].lods.iter().map(|lod| &lod.mesh);
        for vertex in meshes.flat_map(|mesh| &mesh.vertices) {
            let p = body.placed(vertex.position);
            for k in 0..3 {
                min[k] = min[k].min(p[k]);
                max[k] = max[k].max(p[k]);
            }
        }
        for k in 0..3 {
            // A few roundings of the greatest number on the way, each at most 2^-24 of it.
            let reach = min[k].abs().max(max[k].abs()) + (max[k] - min[k]);
            let pad = reach * 2.0_f64.powi(-21);
            least.push(min[k] - pad);
            greatest.push(max[k] + pad);
        }
    }
    Volumes::Boxes { min: least, max: greatest }
}

/// Puts bodies into ascending order of their kinds.
fn by_kind(mut bodies: Vec<Body>) -> Vec<Body> {
    bodies.sort_by_key(|body| body.kind);
    bodies
}
