//! Cases for `lod.rs`: settings, bounds with a mesh each, and pairs of points in them.

use std::sync::Arc;

use hiz_core::headless::Engine;
use hiz_core::testing::lod::{LodCase, choose_lods};
use hiz_core::testing::words;
use hiz_core::{
    Bounds, BoundsKind, Camera, DepthConvention, Floats, ImageSize, InstanceOptions, Instances,
    LodRule, MAX_LODS, Pose, Projection, StoredOrder, Vec3,
};
use hiz_ref::{View, Volume, least_w, stretch_at};

use crate::common::Random;

pub(crate) const KINDS: [BoundsKind; 3] =
    [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// A camera, and the pixel error that is allowed in it.
pub(crate) struct Setting {
    pub(crate) name: &'static str,
    pub(crate) camera: Camera,
    pub(crate) view: View,
    pub(crate) pixels: f64,
    /// Points at the image's corners are inside by this share, so that float64 has them inside.
    inset: f64,
}

pub(crate) const SETTINGS: [fn() -> Setting; 7] = [
    || perspective("fov 60", 60.0, (1920, 1080), 1.0),
    along_z,
    || perspective("fov 100, 21:9", 100.0, (2560, 1080), 0.25),
    off_centre,
    huge_coordinates,
    bare_matrix,
    orthographic,
];

const OBLIQUE: Pose = Pose { eye: [3.0, -1.0, 2.0], target: [5.0, 0.5, -4.0], up: [0.1, 1.0, 0.2] };

fn setting(name: &'static str, camera: Camera, pixels: f64) -> Setting {
    let size = camera.size();
    let view = View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: size.width,
        height: size.height,
        reversed: camera.convention().is_reversed(),
    };
    Setting { name, camera, view, pixels, inset: 1e-8 }
}

fn look_at(pose: &Pose, projection: &Projection, (width, height): (u32, u32)) -> Camera {
    Camera::look_at(pose, projection, ImageSize::new(width, height)).expect("a plain camera")
}

fn perspective(name: &'static str, fov_y_deg: f64, size: (u32, u32), pixels: f64) -> Setting {
    let (fov_y, convention) = (fov_y_deg.to_radians(), DepthConvention::Standard);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: Some(1e4), convention };
    setting(name, look_at(&OBLIQUE, &projection, size), pixels)
}

/// Along an axis of the world, so that rows of float32 are exact.
pub(crate) fn along_z() -> Setting {
    let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let (fov_y, convention) = (90.0_f64.to_radians(), DepthConvention::Reversed);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    setting("fov 90 along z", look_at(&pose, &projection, (1920, 1080)), 1.0)
}

/// The same, and a factor of the errors that float32 holds up to 1e-9 of it.
pub(crate) fn whole_factor() -> Setting {
    let plain = along_z();
    let stretch = hiz_ref::greatest_stretch(&plain.view);
    let factor = f64::from(stretch as f32) * (1.0 - 1e-9);
    Setting { pixels: stretch / factor, ..plain }
}

fn off_centre() -> Setting {
    let projection = Projection::Frustum {
        left: -0.3,
        right: 2.0,
        bottom: -1.5,
        top: 0.1,
        near: 0.05,
        far: None,
        convention: DepthConvention::Reversed,
    };
    setting("off-centre", look_at(&OBLIQUE, &projection, (640, 480)), 4.0)
}

fn huge_coordinates() -> Setting {
    let eye = [1.0e7 + 0.3, -3.0e6 + 0.1, 2.0e7 + 0.7];
    let pose = Pose { eye, target: [eye[0] + 2.0, eye[1] + 1.5, eye[2] - 6.0], ..OBLIQUE };
    let (fov_y, convention) = (60.0_f64.to_radians(), DepthConvention::Reversed);
    let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
    let camera = look_at(&pose, &projection, (1920, 1080));
    Setting { inset: 1e-5, ..setting("huge coordinates", camera, 1.0) }
}

/// A matrix without a pose, and with a w that is not view depth.
fn bare_matrix() -> Setting {
    let posed = perspective("posed", 75.0, (1280, 720), 1.0).camera;
    let matrix = posed.clip_from_world().map(|row| row.map(|v| 3.7 * v));
    let camera = Camera::from_clip_from_world(matrix, posed.size(), posed.convention());
    setting("a bare matrix", camera.expect("a plain camera"), 1.0)
}

fn orthographic() -> Setting {
    let projection = Projection::Orthographic {
        left: -30.0,
        right: 50.0,
        bottom: -20.0,
        top: 25.0,
        near: 0.0,
        far: 500.0,
        convention: DepthConvention::Standard,
    };
    setting("orthographic", look_at(&OBLIQUE, &projection, (640, 360)), 1.0)
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn along(p: Vec3, v: Vec3, t: f64) -> Vec3 {
    [0, 1, 2].map(|k| p[k] + t * v[k])
}

fn length(v: Vec3) -> f64 {
    dot(v, v).sqrt()
}

fn unit(v: Vec3) -> Vec3 {
    v.map(|x| x / length(v))
}

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn direction(random: &mut Random) -> Vec3 {
    loop {
        let v = [0; 3].map(|_| random.range(-1.0, 1.0));
        if (0.01..1.0).contains(&length(v)) {
            return unit(v);
        }
    }
}

impl Setting {
    pub(crate) fn is_orthographic(&self) -> bool {
        self.w_lin() == [0.0; 3]
    }

    fn w_lin(&self) -> Vec3 {
        [0, 1, 2].map(|k| self.view.rows[3][k])
    }

    fn half_size(&self) -> [f64; 2] {
        [f64::from(self.view.width) / 2.0, f64::from(self.view.height) / 2.0]
    }

    /// The scale of `ViewRows`: the power of two that brings w's largest coefficient into 1..2.
    fn unit_of_w(&self) -> f64 {
        let largest = self.w_lin().iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        2.0_f64.powi(-(largest.log2().floor() as i32))
    }

    /// Faulty factor: what a unit makes in the middle of the image.
    pub(crate) fn stretch_in_the_middle(&self) -> f64 {
        stretch_at(&self.view, [0.0; 2]).0 * self.unit_of_w()
    }

    /// Faulty factor of peers: half the image's height over the tangent of half the field of view.
    pub(crate) fn vertical_focal_length(&self) -> f64 {
        let y: Vec3 = [0, 1, 2].map(|k| self.view.rows[1][k]);
        // Without the part along the axis, which an off-centre view adds.
        let axis = unit(self.w_lin());
        length(along(y, axis, -dot(y, axis))) * self.half_size()[1] * self.unit_of_w()
    }

    /// How near to the bound the worst of some thousand tight cases comes at least.
    ///
    /// An axis-aligned box around two points has a corner that is nearer than both, unless the
    /// camera looks along an axis or its rays are parallel.
    pub(crate) fn near_to_bound(&self, kind: BoundsKind) -> f64 {
        let aligned = self.w_lin().iter().filter(|v| **v != 0.0).count() < 2;
        if kind != BoundsKind::Box || aligned { 0.9999 } else { 0.99 }
    }

    /// The point at pixel position `t` from the image's middle, and at a w, or with parallel rays
    /// at a z.
    fn point_at(&self, t: [f64; 2], value: f64) -> Vec3 {
        let rows = &self.view.rows;
        let half = self.half_size();
        let third = if self.is_orthographic() { 2 } else { 3 };
        let x = [0, 1, 2, 3].map(|k| half[0] * rows[0][k] - t[0] * rows[3][k]);
        let y = [0, 1, 2, 3].map(|k| -half[1] * rows[1][k] - t[1] * rows[3][k]);
        let z = rows[third];
        let lin = |r: [f64; 4]| -> Vec3 { [r[0], r[1], r[2]] };
        let columns = [cross(lin(y), lin(z)), cross(lin(z), lin(x)), cross(lin(x), lin(y))];
        let determinant = dot(lin(x), columns[0]);
        let mut p = [0.0; 3];
        // The second round takes away what the first has rounded.
        for _ in 0..2 {
            let left = |r: [f64; 4], v: f64| v - (dot(lin(r), p) + r[3]);
            let left = [left(x, 0.0), left(y, 0.0), left(z, value)];
            let step = |k: usize| (0..3).map(|i| left[i] * columns[i][k]).sum::<f64>();
            p = [0, 1, 2].map(|k| p[k] + step(k) / determinant);
        }
        along(p, self.view.origin, 1.0)
    }

    /// A position in the image, mostly near its border.
    fn any_position(&self, random: &mut Random) -> [f64; 2] {
        self.half_size().map(|half| half * random.range(-1.0, 1.0).cbrt())
    }

    fn corner(&self, random: &mut Random) -> [f64; 2] {
        self.half_size().map(|half| half * (1.0 - self.inset) * random.pick(&[-1.0, 1.0]))
    }

    /// A w (parallel rays: a z) over four decades.
    fn any_depth(&self, random: &mut Random) -> f64 {
        if self.is_orthographic() {
            random.range(0.0, 1.0)
        } else {
            10.0_f64.powf(random.range(-0.5, 3.5)) * length(self.w_lin())
        }
    }

    /// The w that counts at this depth.
    fn w_at(&self, depth: f64) -> f64 {
        if self.is_orthographic() { self.view.rows[3][3] } else { depth }
    }
}

/// An instance.
pub(crate) struct Case {
    pub(crate) volume: Volume,
    pub(crate) scale: f32,
    /// How many LODs its mesh has.
    pub(crate) lods: usize,
    mesh: usize,
    /// Two points of the bounds, made to be as far apart in the image as can be.
    /// The first one shows.
    worst: Option<[Vec3; 2]>,
}

pub(crate) struct Cases {
    pub(crate) all: Vec<Case>,
    errors: Vec<[f32; MAX_LODS]>,
    kind: BoundsKind,
}

/// How many meshes there are.
const MESHES: usize = 32;

fn random_errors(random: &mut Random) -> Vec<[f32; MAX_LODS]> {
    let mesh = |_| {
        let mut error = 10.0_f64.powf(random.range(-4.0, -2.0));
        let mut errors = [0.0; MAX_LODS];
        for next in &mut errors[1..] {
            *next = error as f32;
            error *= random.range(1.0, 5.0);
        }
        errors
    };
    (0..MESHES).map(mesh).collect()
}

impl Cases {
    /// Cases in which the error of a LOD is some ulps from the greatest that is allowed.
    pub(crate) fn tight(setting: &Setting, kind: BoundsKind, count: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let errors = random_errors(&mut random);
        let all = (0..count).map(|_| setting.tight_case(kind, &errors, &mut random)).collect();
        Self { all, errors, kind }
    }

    /// Cases of all sizes at all depths, in the image and around it.
    pub(crate) fn random(setting: &Setting, kind: BoundsKind, count: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let errors = random_errors(&mut random);
        let all = (0..count).map(|_| setting.random_case(kind, &mut random)).collect();
        Self { all, errors, kind }
    }

    /// Points at whole depths, and errors some ulps from what is allowed there.
    pub(crate) fn whole_depths(setting: &Setting, count: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let (mut all, mut errors) = (Vec::new(), Vec::new());
        for mesh in 0..count {
            let depth = f64::from(1 + random.below(1 << 20));
            let scale = random.range(0.5, 2.0) as f32;
            let allowed = setting.pixels * depth / hiz_ref::greatest_stretch(&setting.view);
            let error = (allowed / f64::from(scale)) as f32;
            let ulps = random.below(17) as i32 - 12;
            let error = f32::from_bits(error.to_bits().wrapping_add_signed(ulps));
            errors.push([0.0, error, 1e6, 1e6, 1e6, 1e6, 1e6, 1e6]);
            let volume = Volume::Sphere { center: [0.0, 0.0, -depth], radius: 0.0 };
            all.push(Case { volume, scale, lods: 2, mesh, worst: None });
        }
        Self { all, errors, kind: BoundsKind::Sphere }
    }

    /// Bounds of which a part is behind the eye.
    pub(crate) fn at_the_eye(setting: &Setting, kind: BoundsKind, count: usize, seed: u64) -> Self {
        let mut random = Random(seed);
        let errors = vec![[0.0; MAX_LODS]];
        let mut case = || {
            let size = 10.0_f64.powf(random.range(-3.0, 3.0));
            let eye = setting.point_at([0.0; 2], 0.0);
            let volume = any_volume(kind, eye, size, &mut random);
            let reach = -least_w(&setting.view, &volume);
            // The centre is at w 0 now; it moves along the axis by less than the reach.
            let moved = reach * random.range(-3.0, 0.999) / length(setting.w_lin());
            let volume = moved_by(&volume, unit(setting.w_lin()).map(|v| v * moved));
            Case { volume, scale: 1.0, lods: MAX_LODS, mesh: 0, worst: None }
        };
        Self { all: (0..count).map(|_| case()).collect(), errors, kind }
    }

    /// Far points, whose meshes have 0 to 8 LODs.
    pub(crate) fn small_and_far(setting: &Setting, count: usize) -> Self {
        let center = setting.point_at([0.0; 2], 1e5);
        let volume = Volume::Sphere { center, radius: 1e-3 };
        let case = |i| Case { volume, scale: 1.0, lods: i % 9, mesh: 0, worst: None };
        let errors = vec![[0.0, 1e-3, 1e-3, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3]];
        Self { all: (0..count).map(case).collect(), errors, kind: BoundsKind::Sphere }
    }

    /// The errors of the LODs that case `i` has.
    pub(crate) fn errors_of(&self, i: usize) -> Vec<f64> {
        let case = &self.all[i];
        self.errors[case.mesh][..case.lods].iter().map(|e| f64::from(*e)).collect()
    }

    /// The LODs that the shader chooses.
    pub(crate) fn choose(&self, engine: &Engine, rule: (&LodRule, &[u32])) -> Vec<usize> {
        let cases = self.all.iter().map(|case| LodCase {
            mesh: case.mesh as u32,
            count: case.lods as u32,
            scale: case.scale,
            padding: 0,
        });
        let cases: Vec<LodCase> = cases.collect();
        let instances = self.instances(engine);
        let chosen = choose_lods(engine, &instances, rule, &self.errors, &cases);
        chosen.expect("a dispatch").into_iter().map(|lod| lod as usize).collect()
    }

    fn instances(&self, engine: &Engine) -> Arc<Instances> {
        let options = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
        self.with_bounds(|bounds| engine.instances(bounds, &options).expect("valid bounds"))
    }

    /// The words of each record.
    pub(crate) fn records(&self) -> Vec<Vec<u32>> {
        let words = self.with_bounds(|bounds| words::instances(bounds).expect("valid bounds"));
        words.chunks_exact(self.kind.record_bytes() as usize / 4).map(<[u32]>::to_vec).collect()
    }

    fn with_bounds<T>(&self, take: impl FnOnce(&Bounds<'_>) -> T) -> T {
        let mut arrays: [Vec<f64>; 3] = Default::default();
        for case in &self.all {
            match case.volume {
                Volume::Sphere { center, radius } => {
                    arrays[0].extend(center);
                    arrays[1].push(radius);
                }
                Volume::Box { min, max } => {
                    arrays[0].extend(min);
                    arrays[1].extend(max);
                }
                Volume::OrientedBox { center, half_sizes, axes } => {
                    arrays[0].extend(center);
                    arrays[1].extend(half_sizes);
                    arrays[2].extend(axes.as_flattened());
                }
            }
        }
        let [a, b, c] = arrays.each_ref().map(|array| Floats::F64(array));
        let bounds = match self.kind {
            BoundsKind::Sphere => Bounds::Spheres { centers: a, radii: b },
            BoundsKind::Box => Bounds::Boxes { min: a, max: b },
            BoundsKind::OrientedBox => {
                Bounds::OrientedBoxes { centers: a, half_sizes: b, rotations: c }
            }
            BoundsKind::Point | BoundsKind::WidePoint => Bounds::Points { positions: a },
        };
        take(&bounds)
    }
}

/// A volume of about this size around a centre; oriented boxes are sheared at times.
fn any_volume(kind: BoundsKind, center: Vec3, size: f64, random: &mut Random) -> Volume {
    let half_sizes = [0; 3].map(|_| size * random.range(0.0, 1.0));
    match kind {
        BoundsKind::Sphere => Volume::Sphere { center, radius: size },
        BoundsKind::Point | BoundsKind::WidePoint => Volume::Sphere { center, radius: 0.0 },
        BoundsKind::Box => Volume::Box {
            min: along(center, half_sizes, -1.0),
            max: along(center, half_sizes, 1.0),
        },
        BoundsKind::OrientedBox => {
            let mut columns = basis(direction(random), random);
            if random.below(2) == 0 {
                columns[1] = direction(random);
            }
            Volume::OrientedBox { center, half_sizes, axes: transposed(columns) }
        }
    }
}

/// Three orthonormal directions, of which this is the first.
fn basis(first: Vec3, random: &mut Random) -> [Vec3; 3] {
    let second = unit(cross(first, direction(random)));
    [first, second, cross(first, second)]
}

fn transposed(m: [Vec3; 3]) -> [Vec3; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|k| m[k][i]))
}

fn moved_by(volume: &Volume, v: Vec3) -> Volume {
    match *volume {
        Volume::Sphere { center, radius } => {
            Volume::Sphere { center: along(center, v, 1.0), radius }
        }
        Volume::Box { min, max } => {
            Volume::Box { min: along(min, v, 1.0), max: along(max, v, 1.0) }
        }
        Volume::OrientedBox { center, half_sizes, axes } => {
            Volume::OrientedBox { center: along(center, v, 1.0), half_sizes, axes }
        }
    }
}

impl Setting {
    fn random_case(&self, kind: BoundsKind, random: &mut Random) -> Case {
        let t = self.any_position(random).map(|t| 1.1 * t);
        let depth = self.any_depth(random);
        let center = self.point_at(t, depth);
        // Of which some reach behind the eye.
        let most = if self.is_orthographic() { 20.0 } else { depth / length(self.w_lin()) };
        let size = most * 10.0_f64.powf(random.range(-4.0, 0.2));
        let volume = any_volume(kind, center, size, random);
        let scale = 10.0_f64.powf(random.range(-2.0, 2.0)) as f32;
        let lods = 1 + random.below(MAX_LODS as u32) as usize;
        Case { volume, scale, lods, mesh: random.below(MESHES as u32) as usize, worst: None }
    }

    /// Bounds around two points: `shows` at a corner of the image, and `near`, which is as far from
    /// it as the error allows, and is nearer to the eye than all of the bounds.
    fn tight_case(
        &self,
        kind: BoundsKind,
        errors: &[[f32; MAX_LODS]],
        random: &mut Random,
    ) -> Case {
        let t = self.corner(random);
        let depth = self.any_depth(random);
        let w_lin = self.w_lin();
        let allowed = self.pixels * self.w_at(depth) / hiz_ref::greatest_stretch(&self.view);
        let mesh = random.below(MESHES as u32) as usize;
        let lod = 1 + random.below(MAX_LODS as u32 - 1) as usize;
        let scale = (allowed / f64::from(errors[mesh][lod])) as f32;
        // Mostly within the margin, which is 24 ulps and some of w and of the bounds' size.
        let ulps = 20 - random.below(300) as i32;
        let scale = f32::from_bits(scale.to_bits().wrapping_add_signed(ulps));
        let error = f64::from(errors[mesh][lod]) * f64::from(scale);
        // From the point that shows to the near one.
        let (_, towards) = stretch_at(&self.view, t);
        let towards = if dot(towards, w_lin) > 0.0 { towards.map(|v| -v) } else { towards };
        let shows = self.point_at(t, depth - error * dot(towards, w_lin));
        let shows = if self.is_orthographic() { self.point_at(t, depth) } else { shows };
        let near = along(shows, towards, error * (1.0 - 1e-12));
        let volume = self.around(kind, near, shows, random);
        Case { volume, scale, lods: MAX_LODS, mesh, worst: Some([shows, near]) }
    }

    /// Bounds that contain both points and, as far as their kind can, nothing nearer than `near`.
    fn around(&self, kind: BoundsKind, near: Vec3, shows: Vec3, random: &mut Random) -> Volume {
        let w_lin = self.w_lin();
        let between = along(shows, near, -1.0);
        let error = length(between);
        let more = error * 10.0_f64.powf(random.range(-2.0, 1.0));
        match kind {
            BoundsKind::Point | BoundsKind::WidePoint => panic!("no point contains two others"),
            BoundsKind::Sphere => {
                let (center, radius) = if self.is_orthographic() {
                    (along(near, between, 0.5), 0.5 * error)
                } else {
                    let back = unit(w_lin);
                    // `shows` is inside if the radius is at least this.
                    let least = 0.5 * error * error / dot(between, back);
                    let radius =
                        least * 10.0_f64.powf(f64::from(random.below(2)) * random.range(0.0, 3.0));
                    (along(near, back, radius), radius)
                };
                let reach = [near, shows].map(|p| length(along(p, center, -1.0)));
                Volume::Sphere { center, radius: radius.max(reach[0]).max(reach[1]) }
            }
            BoundsKind::Box => {
                let mut min = [0, 1, 2].map(|k| near[k].min(shows[k]));
                let mut max = [0, 1, 2].map(|k| near[k].max(shows[k]));
                for k in 0..3 {
                    let extra = more * random.unit();
                    if w_lin[k] > 0.0 { max[k] += extra } else { min[k] -= extra }
                }
                Volume::Box { min, max }
            }
            BoundsKind::OrientedBox => {
                let columns = basis(unit(between), random);
                let mut half_sizes = [0; 3].map(|_| more * random.unit());
                half_sizes[0] = 0.5 * error * (1.0 + 1e-12);
                let center = (0..3).fold(near, |p, k| {
                    let back = if dot(columns[k], w_lin) < 0.0 { -1.0 } else { 1.0 };
                    along(p, columns[k], back * half_sizes[k])
                });
                Volume::OrientedBox { center, half_sizes, axes: transposed(columns) }
            }
        }
    }
}

impl Case {
    /// Pairs of points of the bounds that are at most `error` apart.
    pub(crate) fn pairs(&self, view: &View, error: f64, random: &mut Random) -> Vec<[Vec3; 2]> {
        let mut pairs = Vec::new();
        let mut add = |p: Vec3, towards: Vec3| {
            let whole = along(towards, p, -1.0);
            let share = (error * (1.0 - 1e-12) / length(whole)).min(1.0);
            let q = along(p, whole, share);
            // Far from the origin of the world float64 has rounded the step.
            if length(along(q, p, -1.0)) <= error {
                pairs.push([p, q]);
            }
        };
        if let Some([shows, near]) = self.worst {
            add(shows, near);
            add(near, shows);
        }
        for _ in 0..3 {
            let p = self.point(random);
            add(p, self.point(random));
            let half = [f64::from(view.width) / 2.0, f64::from(view.height) / 2.0];
            let t = half.map(|half| half * random.range(-1.0, 1.0));
            let (_, v) = stretch_at(view, t);
            let v = v.map(|v| v * random.pick(&[-1.0, 1.0]));
            add(p, self.farthest_along(v));
        }
        pairs
    }

    /// Pairs of opposite points.
    pub(crate) fn wide_pairs(&self, view: &View, random: &mut Random) -> Vec<[Vec3; 2]> {
        let mut pairs = Vec::new();
        for _ in 0..3 {
            let half = [f64::from(view.width) / 2.0, f64::from(view.height) / 2.0];
            let (_, v) = stretch_at(view, half.map(|half| half * random.range(-1.0, 1.0)));
            for v in [v, direction(random)] {
                pairs.push([self.farthest_along(v), self.farthest_along(v.map(|v| -v))]);
            }
        }
        pairs
    }

    /// The least view depth of the bounds.
    pub(crate) fn least_view_depth(&self, setting: &Setting) -> f64 {
        least_w(&setting.view, &self.volume) / length(setting.w_lin())
    }

    /// Any point of the bounds.
    fn point(&self, random: &mut Random) -> Vec3 {
        let local = [0; 3].map(|_| random.range(-1.0, 1.0));
        match self.volume {
            Volume::Sphere { center, radius } => {
                along(center, direction(random), radius * random.unit().cbrt())
            }
            Volume::Box { min, max } => {
                [0, 1, 2].map(|k| min[k] + (max[k] - min[k]) * 0.5 * (local[k] + 1.0))
            }
            Volume::OrientedBox { center, half_sizes, axes } => (0..3)
                .fold(center, |p, k| along(p, axes.map(|row| row[k]), local[k] * half_sizes[k])),
        }
    }

    /// The point of the bounds that is farthest along a direction.
    fn farthest_along(&self, v: Vec3) -> Vec3 {
        match self.volume {
            Volume::Sphere { center, radius } => along(center, unit(v), radius),
            Volume::Box { min, max } => [0, 1, 2].map(|k| if v[k] > 0.0 { max[k] } else { min[k] }),
            Volume::OrientedBox { center, half_sizes, axes } => (0..3).fold(center, |p, k| {
                let axis = axes.map(|row| row[k]);
                along(p, axis, half_sizes[k] * dot(axis, v).signum())
            }),
        }
    }
}
