//! Random and adversarial culls against the oracle.
//!
//! A round is a camera, a depth image and a few dozen volumes of each kind, made so that something is nearly decided the
//! other way: their nearest points share a depth that the image repeats to within an ulp, and their silhouettes end on pixel
//! borders beside holes. The oracle decides exactly; a volume that the device culls and the oracle calls visible is a false cull.

use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, Camera, Coverage, CullOptions, DepthConvention, Floats, Footprint, ImageSize, InstanceOptions, Pose,
    Projection, VisibleOptions,
};
use hiz_ref::{Options, Verdict, View, Volume};

use crate::common::Random;

/// What a campaign found.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) cases: usize,
    pub(crate) culled: usize,
    /// Culled although visible: must be 0.
    pub(crate) false_culls: usize,
    /// Kept although hidden: the price.
    pub(crate) false_keeps: usize,
}

/// What a cull reads by default.
pub(crate) const PLAIN: &[(Footprint, u32)] = &[(Footprint::Two, 0)];

/// How to run one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Campaign {
    pub(crate) seed: u64,
    pub(crate) rounds: usize,
    /// Volumes of each kind in a round.
    pub(crate) volumes: usize,
    pub(crate) coverage: Coverage,
    /// Footprints and descent budgets to choose from. (Each costs pipelines, and those cost time.)
    pub(crate) modes: &'static [(Footprint, u32)],
    /// Whether false keeps are counted, too (asks the oracle about everything).
    pub(crate) count_keeps: bool,
}

impl Campaign {
    pub(crate) fn run(&self, engine: &Engine) -> Tally {
        let mut tally = Tally::default();
        for round in 0..self.rounds {
            let mut random = Random(self.seed.wrapping_mul(1_000_003).wrapping_add(round as u64));
            self.round(engine, &mut random, round, &mut tally);
        }
        tally
    }

    fn round(&self, engine: &Engine, random: &mut Random, round: usize, tally: &mut Tally) {
        let Some(scene) = Scene::new(random, 48) else { return };
        let depth = scene.depth_image(random);
        let image = engine.upload_depth(&depth, &scene.camera).expect("upload");
        let pyramid = engine.pyramid(&image).expect("pyramid");
        let coverage = match self.coverage {
            Coverage::Area => hiz_ref::Coverage::Area,
            Coverage::Sample => hiz_ref::Coverage::Sample,
        };
        let reference = Options { coverage, ..Options::default() };
        let view = scene.view();
        // No slack: it would hide a margin that is too small.
        let (footprint, descent) = random.pick(self.modes);
        let options = CullOptions {
            coverage: self.coverage,
            depth_slack: 0.0,
            footprint,
            descent,
            statistics: false,
            ..CullOptions::default()
        };
        for kind in [Kind::Sphere, Kind::Box, Kind::OrientedBox] {
            let volumes: Vec<Volume> = (0..self.volumes).map(|_| scene.volume(kind, random)).collect();
            let arrays = Arrays::new(&volumes);
            let instances = engine.instances(&arrays.bounds(kind), &InstanceOptions::default()).expect("instances");
            let culling = match engine.cull(&instances, &scene.camera, &pyramid, &options, &VisibleOptions::default()) {
                Ok(culling) => culling,
                Err(error) => panic!("{error}"),
            };
            let mask = culling.mask().expect("mask");
            for (i, (volume, kept)) in volumes.iter().zip(&mask).enumerate() {
                tally.cases += 1;
                tally.culled += usize::from(!kept);
                if *kept && !self.count_keeps {
                    continue;
                }
                let outcome = hiz_ref::classify_with(&view, volume, &depth, reference).expect("a finite view");
                match (kept, outcome.verdict) {
                    (false, Verdict::Visible | Verdict::Invalid) => {
                        if tally.false_culls == 0 {
                            eprintln!(
                                "first false cull: seed {} round {round} {kind:?} {i}: {volume:?}\n{view:?}\noracle {outcome:?}\ndevice {:?}",
                                self.seed,
                                culling.explain(i as u64)
                            );
                        }
                        tally.false_culls += 1;
                    }
                    (true, Verdict::Hidden) => tally.false_keeps += 1,
                    _ => {}
                }
            }
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Sphere,
    Box,
    OrientedBox,
}

/// A camera, its axes, the depth that volumes begin at and a column and row with holes.
pub(crate) struct Scene {
    pub(crate) camera: Camera,
    eye: [f64; 3],
    /// Right, up, forward.
    pub(crate) axes: [[f64; 3]; 3],
    /// Half the image in world units at view depth 1 (perspective) or anywhere (orthographic), and its middle.
    pub(crate) half: [f64; 2],
    pub(crate) middle: [f64; 2],
    pub(crate) orthographic: bool,
    pub(crate) front: f64,
    near: f64,
    hole: [u32; 2],
    /// Whether the camera's axes are the world's, so that boxes can face it.
    aligned: bool,
}

impl Scene {
    /// With sides of up to `largest` pixels.
    pub(crate) fn new(random: &mut Random, largest: u32) -> Option<Self> {
        let size = ImageSize::new(1 + random.below(largest), 1 + random.below(largest));
        let convention = random.pick(&[DepthConvention::Standard, DepthConvention::Reversed]);
        let far_away = random.pick(&[0.0, 0.0, 1.0, 1e3, 1e6, 1e9]);
        let eye: [f64; 3] = std::array::from_fn(|_| far_away * random.range(-1.0, 1.0));
        let aligned = random.below(2) == 0;
        let direction: [f64; 3] =
            if aligned { [0.0, 0.0, -1.0] } else { std::array::from_fn(|_| random.range(-1.0, 1.0)) };
        let up: [f64; 3] = if aligned { [0.0, 1.0, 0.0] } else { std::array::from_fn(|_| random.range(-1.0, 1.0)) };
        // A target beyond the rounding of a distant eye.
        let reach = 1.0 + far_away;
        let target = std::array::from_fn(|k| eye[k] + reach * direction[k]);
        let near = 10.0_f64.powf(random.range(-3.0, 1.0)) * if far_away > 1e5 { 1e3 } else { 1.0 };
        let far = near * 10.0_f64.powf(random.range(0.5, 8.0));
        let half = [10.0_f64.powf(random.range(-1.5, 0.7)), 10.0_f64.powf(random.range(-1.5, 0.7))];
        let middle = if random.below(2) == 0 {
            [0.0; 2]
        } else {
            [random.range(-1.0, 1.0) * half[0], random.range(-1.0, 1.0) * half[1]]
        };
        let orthographic = random.below(4) == 0;
        let (left, right) = (middle[0] - half[0], middle[0] + half[0]);
        let (bottom, top) = (middle[1] - half[1], middle[1] + half[1]);
        let projection = if orthographic {
            Projection::Orthographic { left, right, bottom, top, near, far, convention }
        } else {
            let far = (random.below(2) == 0).then_some(far);
            Projection::Frustum { left, right, bottom, top, near, far, convention }
        };
        let camera = Camera::look_at(&Pose { eye, target, up }, &projection, size).ok()?;
        // The axes as the camera has them, up to float64.
        let rows = camera.rows();
        let unit = |v: [f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| x / length)
        };
        let lin = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
        let forward = if orthographic {
            unit(lin(2)).map(|x| if convention.is_reversed() { -x } else { x })
        } else {
            unit(lin(3))
        };
        let clean = |r: usize| {
            let along: f64 = (0..3).map(|k| rows[r][k] * forward[k]).sum();
            unit(std::array::from_fn(|k| rows[r][k] - along * forward[k]))
        };
        let axes = [clean(0), clean(1), forward];
        // A bare matrix stands about the world's origin: its constants cancel at the eye, and the rows have to own up to it.
        let camera = if random.below(3) == 0 {
            Camera::from_clip_from_world(camera.clip_from_world(), size, convention).ok()?
        } else {
            camera
        };
        let front = near * 10.0_f64.powf(random.range(-0.05, 3.0)).min(far / near * 1.01);
        let hole = [random.below(size.width), random.below(size.height)];
        Some(Self { camera, eye, axes, half, middle, orthographic, front, near, hole, aligned })
    }

    /// The camera as the oracle takes it.
    pub(crate) fn view(&self) -> View {
        let size = self.camera.size();
        View {
            rows: self.camera.rows(),
            origin: self.camera.origin(),
            width: size.width,
            height: size.height,
            reversed: self.camera.convention().is_reversed(),
        }
    }

    pub(crate) fn world(&self, v: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| self.eye[k] + (0..3).map(|j| self.axes[j][k] * v[j]).sum::<f64>())
    }

    /// World units of one pixel at view depth `z`, and the view-space coordinates of a pixel position.
    fn pixel(&self, z: f64) -> [f64; 2] {
        let scale = if self.orthographic { 1.0 } else { z };
        let size = self.camera.size();
        [2.0 * self.half[0] * scale / f64::from(size.width), 2.0 * self.half[1] * scale / f64::from(size.height)]
    }

    fn at(&self, x: f64, y: f64, z: f64) -> [f64; 2] {
        let scale = if self.orthographic { 1.0 } else { z };
        let size = self.camera.size();
        [
            (self.middle[0] + (2.0 * x / f64::from(size.width) - 1.0) * self.half[0]) * scale,
            (self.middle[1] + (1.0 - 2.0 * y / f64::from(size.height)) * self.half[1]) * scale,
        ]
    }

    /// NDC depth of view depth `z`.
    fn ndc(&self, z: f64) -> f64 {
        let p = self.world([0.0, 0.0, z]);
        let rows = self.camera.rows();
        let clip = |r: usize| (0..3).map(|k| rows[r][k] * (p[k] - self.camera.origin()[k])).sum::<f64>() + rows[r][3];
        clip(2) / clip(3)
    }

    /// Depth that is the front's to within two ulps, with holes in a column and a row; sometimes anything.
    fn depth_image(&self, random: &mut Random) -> Vec<f32> {
        let size = self.camera.size();
        let far = self.camera.convention().far();
        let style = random.below(8);
        let mut equal = self.ndc(self.front) as f32;
        let ulps = random.below(5) as i32 - 2;
        for _ in 0..ulps.abs() {
            equal = if ulps > 0 { equal.next_up() } else { equal.next_down() };
        }
        let clear = self.ndc(self.near + 0.5 * (self.front - self.near).max(0.0)) as f32;
        let base = if style < 3 { equal } else { clear };
        (0..size.height)
            .flat_map(|y| (0..size.width).map(move |x| (x, y)))
            .map(|(x, y)| {
                if style == 7 {
                    random.unit() as f32
                } else if style >= 3 && (x == self.hole[0] || y == self.hole[1]) {
                    far
                } else {
                    base
                }
            })
            .collect()
    }

    pub(crate) fn volume(&self, kind: Kind, random: &mut Random) -> Volume {
        let size = self.camera.size();
        let z = self.front;
        // An interval in pixels: random, or ending a hair beside a pixel border of the hole.
        let interval = |side: u32, hole: u32, random: &mut Random| {
            let hair = random.pick(&[0.0, 1e-7, -1e-7, 3e-6, -3e-6, 1e-4, -1e-4, 1e-12, -1e-12]);
            let length =
                random.pick(&[0.0, 0.01, 0.5, 1.0, 2.0, 4.0]) + f64::from(random.below(side + 1)) * random.unit();
            match random.below(4) {
                0 => (f64::from(hole) - length, f64::from(hole) + hair),
                1 => (f64::from(hole + 1) + hair, f64::from(hole + 1) + length),
                2 => {
                    let k = random.below(5);
                    let begin = f64::from(random.below(side + 1) >> k << k);
                    (begin + hair, begin + f64::from(1_u32 << random.below(5)) - hair)
                }
                _ => {
                    let begin = random.range(-0.2, 1.2) * f64::from(side);
                    (begin, begin + length)
                }
            }
        };
        let (x0, x1) = interval(size.width, self.hole[0], random);
        let (y0, y1) = interval(size.height, self.hole[1], random);
        let ([left, top], [right, bottom]) = (self.at(x0.min(x1), y0.min(y1), z), self.at(x0.max(x1), y0.max(y1), z));
        let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
        let half = [0.5 * (right - left).abs(), 0.5 * (top - bottom).abs()];
        let [pixel_x, _] = self.pixel(z);
        let thickness = random.pick(&[0.0, 1e-3, 1.0, 30.0]) * pixel_x;
        match kind {
            Kind::Sphere => {
                let radius = half[0].min(half[1]).max(1e-3 * pixel_x) * random.pick(&[1.0, 0.3, 1e-3]);
                Volume::Sphere { center: self.world([middle[0], middle[1], z + radius]), radius }
            }
            Kind::Box if self.aligned => {
                // The camera looks along -z of the world with y up: view (x, y, depth) is world (x, y, -depth).
                let a = self.world([left.min(right), top.min(bottom), z + thickness]);
                let b = self.world([left.max(right), top.max(bottom), z]);
                Volume::Box {
                    min: std::array::from_fn(|k| a[k].min(b[k])),
                    max: std::array::from_fn(|k| a[k].max(b[k])),
                }
            }
            Kind::Box => {
                let center = self.world([middle[0], middle[1], z + thickness]);
                let h: [f64; 3] = std::array::from_fn(|_| random.unit() * half[0].max(half[1]));
                Volume::Box {
                    min: std::array::from_fn(|k| center[k] - h[k]),
                    max: std::array::from_fn(|k| center[k] + h[k]),
                }
            }
            Kind::OrientedBox => {
                let (right, up, forward) = (self.axes[0], self.axes[1], self.axes[2]);
                let mut axes: [[f64; 3]; 3] = std::array::from_fn(|k| [right[k], up[k], forward[k]]);
                let mut center = [middle[0], middle[1], z + thickness];
                if random.below(3) == 0 {
                    // A roll about the view keeps the front where it is.
                    let (s, c) = random.range(0.0, 6.3).sin_cos();
                    axes = std::array::from_fn(|k| {
                        [c * right[k] + s * up[k], c * up[k] - s * right[k], forward[k] * random.pick(&[1.0, -1.0])]
                    });
                    center[2] = z + thickness;
                }
                Volume::OrientedBox { center: self.world(center), half_sizes: [half[0], half[1], thickness], axes }
            }
        }
    }
}

/// Volumes as the engine's flat arrays.
#[derive(Default)]
pub(crate) struct Arrays {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Arrays {
    pub(crate) fn new(volumes: &[Volume]) -> Self {
        let mut arrays = Self::default();
        for volume in volumes {
            match volume {
                Volume::Sphere { center, radius } => {
                    arrays.a.extend(center);
                    arrays.b.push(*radius);
                }
                Volume::Box { min, max } => {
                    arrays.a.extend(min);
                    arrays.b.extend(max);
                }
                Volume::OrientedBox { center, half_sizes, axes } => {
                    arrays.a.extend(center);
                    arrays.b.extend(half_sizes);
                    arrays.c.extend(axes.as_flattened());
                }
            }
        }
        arrays
    }

    pub(crate) fn bounds(&self, kind: Kind) -> Bounds<'_> {
        let (a, b, c) = (Floats::F64(&self.a), Floats::F64(&self.b), Floats::F64(&self.c));
        match kind {
            Kind::Sphere => Bounds::Spheres { centers: a, radii: b },
            Kind::Box => Bounds::Boxes { min: a, max: b },
            Kind::OrientedBox => Bounds::OrientedBoxes { centers: a, half_sizes: b, rotations: c },
        }
    }
}
