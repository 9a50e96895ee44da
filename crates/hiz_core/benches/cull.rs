//! The cull against its yardstick: each kind of bounds, flat and in groups, and each output.
//! Everything that can be made beforehand is made beforehand.
//!
//! The tables of medians come first, then criterion's own figures.
//! Run it with `cargo bench --workspace --bench cull`.
//!
//! - `-- --test` runs everything once.
//! - `-- nothing` prints only the tables.
//! - `HIZVK_BENCH_INSTANCES` is the number of instances, 100000 by default.

mod common;

use std::sync::Arc;

use common::{Way, measure, table};
use hiz_core::headless::{DepthImage, Engine};
use hiz_core::yardstick::{empty_submit_ms, record_uncertified_cull, submitted_ms};
use hiz_core::{
    Bounds, Camera, CullOptions, DepthConvention, Depths, Floats, Hierarchy, ImageSize,
    InstanceOptions, Instances, MeshData, OccluderOptions, Order, Outputs, Pose, Projection,
    Pyramid, PyramidOptions,
};

/// Half the width of the crowd, divided by its distance: well inside the view.
const HALF_WIDTH: f64 = 0.55;
/// The wall's distance.
/// Instances are placed before or behind it.
const WALL: f64 = 100.0;

/// Uniform numbers in 0..1 from a seed.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f64 / f64::from(1 << 24)
    }
}

/// Bounds of all kinds at the same places.
struct Crowd {
    centers: Vec<f32>,
    half_sizes: Vec<f32>,
    radii: Vec<f32>,
    min: Vec<f32>,
    max: Vec<f32>,
    rotations: Vec<f32>,
}

impl Crowd {
    /// Places `count` instances along -z, the share `behind` of them behind the wall.
    #[expect(clippy::cast_possible_truncation, reason = "places for a benchmark")]
    fn new(count: usize, behind: f64) -> Self {
        let mut random = Random(1);
        let mut this = Self {
            centers: Vec::with_capacity(3 * count),
            half_sizes: Vec::with_capacity(3 * count),
            radii: Vec::with_capacity(count),
            min: Vec::with_capacity(3 * count),
            max: Vec::with_capacity(3 * count),
            rotations: Vec::with_capacity(9 * count),
        };
        for _ in 0..count {
            let (near, far) = if random.unit() < behind {
                (1.2 * WALL, 8.0 * WALL)
            } else {
                (0.1 * WALL, 0.9 * WALL)
            };
            let z = (near * near + random.unit() * (far * far - near * near)).sqrt();
            let center =
                [(2.0 * random.unit() - 1.0) * HALF_WIDTH * z, (random.unit() - 0.5) * 0.1 * z, -z];
            let half: [f64; 3] =
                std::array::from_fn(|_| 0.15 + 1.35 * random.unit() * random.unit());
            let (sin, cos) = (6.3 * random.unit()).sin_cos();
            let numbers = |values: &[f64]| values.iter().map(|v| *v as f32).collect::<Vec<_>>();
            this.centers.extend(numbers(&center));
            this.half_sizes.extend(numbers(&half));
            this.radii.push(half.iter().map(|h| h * h).sum::<f64>().sqrt() as f32);
            this.min.extend((0..3).map(|i| (center[i] - half[i]) as f32));
            this.max.extend((0..3).map(|i| (center[i] + half[i]) as f32));
            this.rotations.extend(numbers(&[cos, 0.0, sin, 0.0, 1.0, 0.0, -sin, 0.0, cos]));
        }
        this
    }

    fn bounds(&self) -> [(&'static str, Bounds<'_>); 3] {
        let f32s = |numbers| Floats::F32(numbers);
        [
            ("boxes", Bounds::Boxes { min: f32s(&self.min), max: f32s(&self.max) }),
            ("spheres", Bounds::Spheres { centers: f32s(&self.centers), radii: f32s(&self.radii) }),
            (
                "oriented boxes",
                Bounds::OrientedBoxes {
                    centers: f32s(&self.centers),
                    half_sizes: f32s(&self.half_sizes),
                    rotations: f32s(&self.rotations),
                },
            ),
        ]
    }
}

/// A wall that fills the view.
fn wall(engine: &Engine, camera: &Camera) -> DepthImage {
    let (x, y) = (2.0 * WALL, WALL);
    let vertices = [-x, -y, -WALL, x, -y, -WALL, x, y, -WALL, -x, y, -WALL];
    let mesh = MeshData {
        vertices: Floats::F64(&vertices),
        triangles: &[0, 1, 2, 0, 2, 3],
        transforms: None,
    };
    let occluders = engine.occluders(&[mesh], &OccluderOptions::default()).expect("occluders");
    engine.render_depth(&occluders, camera).expect("a depth image")
}

/// A cull into buffers of its own.
fn way<'a>(
    engine: &'a Engine,
    (name, instances): (String, &Arc<Instances>),
    (camera, pyramid): (&'a Camera, &'a Arc<Pyramid>),
    options: CullOptions,
    outputs: Outputs,
    certified: bool,
) -> Way<'a> {
    let output = outputs;
    let visible = engine.context().create_visible(instances, &output).expect("buffers");
    let instances = Arc::clone(instances);
    let run = move || {
        submitted_ms(engine, |encoder| {
            if certified {
                engine
                    .context()
                    .record_cull(encoder, &instances, camera, pyramid, &visible, &options)
            } else {
                record_uncertified_cull(
                    engine, encoder, &instances, camera, pyramid, &visible, &options,
                )
            }
        })
        .expect("a cull")
    };
    (name, Box::new(run))
}

const MASK: Outputs = Outputs { mask: true, ..Outputs::NONE };

/// Each kind of bounds, flat and in groups, with the mask as the only output.
/// Boxes also in several tiers, and with both ends of the pyramid.
fn kinds<'a>(
    engine: &'a Engine,
    crowd: &Crowd,
    (camera, pyramid): (&'a Camera, &'a Arc<Pyramid>),
    both: &'a Arc<Pyramid>,
) -> Vec<Way<'a>> {
    let seen = (camera, pyramid);
    let mut ways = Vec::new();
    for (kind, bounds) in crowd.bounds() {
        let instances = engine.instances(&bounds, &InstanceOptions::default()).expect("instances");
        let mut add = |name: String, hierarchy, certified| {
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            ways.push(way(engine, (name, &instances), seen, options, MASK, certified));
        };
        if matches!(bounds, Bounds::Boxes { .. }) {
            add("boxes, uncertified".to_owned(), Hierarchy::Never, false);
        }
        add(format!("{kind}, flat"), Hierarchy::Never, true);
        add(format!("{kind}, groups"), Hierarchy::Always, true);
        if matches!(bounds, Bounds::Boxes { .. }) {
            for (tiers, end, pyramid) in [
                (2, "", pyramid),
                (3, "", pyramid),
                (0, ", both ends", both),
                (1, ", both ends", both),
                (2, ", both ends", both),
            ] {
                let hierarchy = Hierarchy::Tiers(tiers);
                let options = CullOptions { hierarchy, ..CullOptions::default() };
                let name = format!("{kind}, {tiers} tiers{end}");
                let seen = (camera, pyramid);
                ways.push(way(engine, (name, &instances), seen, options, MASK, true));
            }
        }
    }
    ways.push(("empty submit".to_owned(), Box::new(|| empty_submit_ms(engine).expect("a submit"))));
    ways
}

/// Boxes with different outputs.
fn outputs<'a>(
    engine: &'a Engine,
    crowd: &Crowd,
    seen: (&'a Camera, &'a Arc<Pyramid>),
    hierarchy: Hierarchy,
) -> Vec<Way<'a>> {
    let [(_, boxes), ..] = crowd.bounds();
    let instances = engine.instances(&boxes, &InstanceOptions::default()).expect("instances");
    let draws = Outputs { draws: true, ..Outputs::NONE };
    let indices = Outputs { indices: true, ..draws.clone() };
    [
        ("everything, stable", Order::Stable, Outputs::ALL),
        ("everything, any order", Order::Any, Outputs::ALL),
        ("indices, stable", Order::Stable, indices.clone()),
        ("indices, any order", Order::Any, indices),
        ("draws", Order::Any, draws),
        ("verdicts", Order::Stable, Outputs { verdicts: true, ..Outputs::NONE }),
        ("mask", Order::Stable, MASK),
    ]
    .map(|(name, order, outputs)| {
        let options = CullOptions { order, hierarchy, ..CullOptions::default() };
        way(engine, (name.to_owned(), &instances), seen, options, outputs, true)
    })
    .into()
}

fn main() {
    let engine = common::engine();
    let mut criterion = common::criterion();
    let count = std::env::var("HIZVK_BENCH_INSTANCES")
        .ok()
        .map_or(100_000, |text| text.parse().expect("a number"));
    let pose = Pose { eye: [0.0, 0.0, 0.0], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
    let projection = Projection::Perspective {
        fov_y: 1.05,
        near: 0.1,
        far: None,
        convention: DepthConvention::Reversed,
    };
    let camera =
        Camera::look_at(&pose, &projection, ImageSize::new(1920, 1080)).expect("a plain camera");
    let pyramid = engine.pyramid(&wall(&engine, &camera)).expect("a pyramid");
    let seen = (&camera, &pyramid);
    let options = PyramidOptions { depths: Depths::Both, ..PyramidOptions::default() };
    let both = engine.pyramid_with(&wall(&engine, &camera), &options).expect("a pyramid");
    for (hidden, behind) in [("95 % hidden", 0.95), ("0 % hidden", 0.0)] {
        let crowd = Crowd::new(count, behind);
        let name = format!("{count} instances, {hidden}");
        let mut ways = kinds(&engine, &crowd, seen, &both);
        table(&name, "uncertified", &mut ways);
        measure(&mut criterion, &name, &mut ways);
        for (hierarchy, how) in [(Hierarchy::Never, "flat"), (Hierarchy::Always, "groups")] {
            let name = format!("{name}, outputs, {how}");
            let mut ways = outputs(&engine, &crowd, seen, hierarchy);
            table(&name, "everything", &mut ways);
            measure(&mut criterion, &name, &mut ways);
        }
    }
    criterion.final_summary();
}
