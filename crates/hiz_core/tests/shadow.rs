//! Shadow casters: the swept certificate against exact arithmetic, and culls against brute force.

#[path = "common/campaign/mod.rs"]
mod campaign;
mod common;
#[path = "common/mirror/mod.rs"]
mod mirror;

use std::sync::Arc;

use common::{CONVENTIONS, Random, engine};
use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, BoundsKind, Camera, CullOptions, Depths, DirectionalLight, Fit, Floats, Footprint,
    Hierarchy, ImageSize, InstanceOptions, Outputs, Pose, Projection, PyramidOptions, Vec3,
    Verdict,
};
use hiz_ref::{SweptPlane, View, Volume, swept_side};
use mirror::{Arithmetic, STYLES, ShadowMirror};

fn scaled(v: Vec3, s: f64) -> Vec3 {
    v.map(|x| x * s)
}

fn plus(a: Vec3, b: Vec3) -> Vec3 {
    [0, 1, 2].map(|k| a[k] + b[k])
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn unit(v: Vec3) -> Vec3 {
    scaled(v, 1.0 / dot(v, v).sqrt())
}

fn direction(random: &mut Random) -> Vec3 {
    loop {
        let v = [0; 3].map(|_| random.range(-1.0, 1.0));
        if dot(v, v) > 1e-3 {
            return unit(v);
        }
    }
}

fn ref_view(camera: &Camera) -> View {
    View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: camera.size().width,
        height: camera.size().height,
        reversed: camera.convention().is_reversed(),
    }
}

fn camera(random: &mut Random, size: ImageSize, far_away: f64) -> Camera {
    let convention = random.pick(&CONVENTIONS);
    let eye = [0; 3].map(|_| random.range(-far_away, far_away));
    let pose = Pose { eye, target: plus(eye, direction(random)), up: [0.1, 1.0, 0.2] };
    let projection = if random.below(4) == 0 {
        let half = random.range(2.0, 20.0);
        Projection::Orthographic {
            left: -half,
            right: half,
            bottom: -half,
            top: half,
            near: 0.0,
            far: random.range(20.0, 100.0),
            convention,
        }
    } else {
        let far = (random.below(2) == 0).then(|| random.range(50.0, 500.0));
        Projection::Perspective { fov_y: random.range(0.5, 2.0), near: 0.1, far, convention }
    };
    Camera::look_at(&pose, &projection, size).expect("a plain camera")
}

/// A caster, its kind, and its record as the shader reads it.
fn caster(random: &mut Random, center: Vec3) -> (BoundsKind, Volume, Vec<u32>) {
    let single = |v: f64| f64::from(v as f32);
    let center = center.map(single);
    let size = 10.0_f64.powf(random.range(-2.0, 1.0));
    let words = |bounds: &Bounds<'_>| hiz_core::testing::words::instances(bounds).expect("one");
    if random.below(2) == 0 {
        let radius = single(size);
        let record = words(&Bounds::Spheres {
            centers: Floats::F64(&center),
            radii: Floats::F64(&[radius]),
        });
        return (BoundsKind::Sphere, Volume::Sphere { center, radius }, record);
    }
    // A centre and half sizes that float32 holds are not rounded.
    let half = [0; 3].map(|_| single(size * random.range(0.1, 1.0)));
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let record = words(&Bounds::OrientedBoxes {
        centers: Floats::F64(&center),
        half_sizes: Floats::F64(&half),
        rotations: Floats::F64(axes.as_flattened()),
    });
    (BoundsKind::OrientedBox, Volume::OrientedBox { center, half_sizes: half, axes }, record)
}

/// How often the certificate claims what is not so, beside the number of its claims.
///
/// The planes are chosen within a few ulps of touching the swept volume.
fn false_claims(ulps: f32, style: usize, cases: u32) -> (u32, u32) {
    let mut random = Random(14 + style as u64);
    let mut f = Arithmetic::new(STYLES[style], 6);
    let (mut wrong, mut claims) = (0, 0);
    for _ in 0..cases {
        let camera = camera(&mut random, ImageSize::new(640, 480), 1e3);
        let (eye, light) = (camera.origin(), direction(&mut random));
        // Before the eye, within the view and somewhat beside it.
        let toward = plus(middle_axis(&camera), scaled(direction(&mut random), 0.6));
        let center = plus(eye, scaled(unit(toward), 10.0_f64.powf(random.range(0.0, 3.0))));
        let (kind, volume, record) = caster(&mut random, center);
        let room = 10.0_f64.powf(random.range(0.0, 3.0));
        let sun = DirectionalLight::new(light, center.map(|v| v - room), center.map(|v| v + room));
        let options = CullOptions { shadow: Some(sun), ..CullOptions::default() };
        let Some(mirror) = ShadowMirror::new(&camera, &options) else { continue };
        let Some(swept) = mirror.swept(kind, &record, ulps, &mut f) else { continue };
        let view = ref_view(&camera);
        let sweep = (f64::from(swept.length), light);
        let row = random.below(3) as usize;
        let below = random.below(2) == 0;
        let is_so = |t: f32| {
            let plane = match row {
                0 => SweptPlane::Column(f64::from(t)),
                1 => SweptPlane::Row(f64::from(t)),
                _ => SweptPlane::Depth(f64::from(mirror.z_slope()) + f64::from(t)),
            };
            swept_side(&view, &volume, sweep, plane, below)
        };
        // Where w is positive the claim holds up to some t, or from some t on.
        let (mut yes, mut no) = if below { (1e4_f32, -1e4_f32) } else { (-1e4, 1e4) };
        if !is_so(yes) || is_so(no) {
            continue;
        }
        while (yes - no).abs() > yes.abs().max(no.abs()) * 1e-7 {
            let middle = yes / 2.0 + no / 2.0;
            if middle == yes || middle == no {
                break;
            }
            if is_so(middle) { yes = middle } else { no = middle }
        }
        // Within a few ulps of touching, and farther away, where claims begin with a margin.
        let powers = (0..20).map(|k| 1_i32 << k);
        for ulps in powers.flat_map(|n| [-n, n]).chain([0]) {
            let bits = yes.to_bits() as i32 + ulps;
            let t = f32::from_bits(bits as u32);
            if !t.is_finite() || (t < 0.0) != (yes < 0.0) {
                continue;
            }
            let sign = if below { -1.0 } else { 1.0 };
            if mirror.surely(kind, &swept, (sign, row, t), &mut f) {
                claims += 1;
                wrong += u32::from(!is_so(t));
            }
        }
    }
    (wrong, claims)
}

/// Exact rationals decide; without a margin many claims are wrong.
#[test]
fn the_swept_certificate_never_claims_what_is_not_so() {
    let (wrong, claims) = false_claims(0.0, 0, 1500);
    println!("without a margin: {wrong} of {claims} claims are wrong");
    assert!(wrong > 200, "without a margin {wrong} are wrong: the cases lie too far away");
    for (style, named) in STYLES.iter().enumerate() {
        let (wrong, claims) = false_claims(24.0, style, if style == 0 { 3000 } else { 800 });
        println!("{}: {wrong} of {claims}", named.name);
        assert_eq!(wrong, 0, "{}, of {claims}", named.name);
        assert!(claims > 1000, "{}: only {claims} claims", named.name);
    }
}

/// A view, what it shows, and a light; casters of one kind.
struct Scene {
    camera: Camera,
    depth: Vec<f32>,
    light: DirectionalLight,
    boxes: Vec<[Vec3; 2]>,
}

const SIDE: u32 = 12;

/// Receivers at random depths in patches, background between them, casters around the light's rays
/// to them.
fn scene(seed: u64, light: impl Fn(&mut Random) -> DirectionalLight) -> Scene {
    let mut random = Random(seed);
    let camera = camera(&mut random, ImageSize::new(SIDE, SIDE), 50.0);
    let reversed = camera.convention().is_reversed();
    let mut light = light(&mut random);
    let patches: Vec<(u32, u32, u32, f64)> = (0..3)
        .map(|_| {
            let [x, y] = [0; 2].map(|_| random.below(SIDE));
            (x, y, 2 + random.below(6), random.range(3.0, 40.0))
        })
        .collect();
    let mut depth = vec![if reversed { 0.0 } else { 1.0 }; (SIDE * SIDE) as usize];
    let ahead = |z: f64| {
        // The depth of a point z in front of the eye, along the middle of the image.
        let rows = camera.rows();
        let forward = middle_axis(&camera);
        let p = scaled(forward, z);
        let at = |r: usize| dot([rows[r][0], rows[r][1], rows[r][2]], p) + rows[r][3];
        at(2) / at(3)
    };
    for (x, y, side, z) in patches {
        for row in y..(y + side).min(SIDE) {
            for column in x..(x + side).min(SIDE) {
                let d = ahead(z * random.range(1.0, 1.05)) as f32;
                if (0.0..=1.0).contains(&d) {
                    depth[(row * SIDE + column) as usize] = d;
                }
            }
        }
    }
    let points = receivers(&camera, &depth);
    let corner = |pick: fn(f64, f64) -> f64| {
        let first = points.first().map_or([0.0; 3], |p| *p);
        points.iter().fold(first, |m, p| [0, 1, 2].map(|k| pick(m[k], p[k])))
    };
    // The box is exact, so that nothing but the filter reaches beyond it.
    (light.receivers_min, light.receivers_max) = (corner(f64::min), corner(f64::max));
    let boxes = (0..600)
        .map(|_| {
            let p = random.pick(&points);
            let back = 10.0_f64.powf(random.range(-2.0, 1.7));
            let toward = scaled(unit(light.direction), -back);
            let beside = scaled(direction(&mut random), 10.0_f64.powf(random.range(-2.0, 1.0)));
            let center = plus(plus(p, toward), beside);
            let half = [0; 3].map(|_| 10.0_f64.powf(random.range(-2.0, 0.3)));
            [[0, 1, 2].map(|k| center[k] - half[k]), plus(center, half)]
        })
        .collect();
    Scene { camera, depth, light, boxes }
}

/// The unit vector along which x and y are 0.
fn middle_axis(camera: &Camera) -> Vec3 {
    let rows = camera.rows();
    let [x, y] = [0, 1].map(|r| [rows[r][0], rows[r][1], rows[r][2]]);
    let across = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
    let across = unit(across);
    let depth = [rows[2][0], rows[2][1], rows[2][2]];
    let w = [rows[3][0], rows[3][1], rows[3][2]];
    // Forward is where w grows; with parallel rays, where depth goes towards far.
    let grows = if dot(w, w) > 0.0 {
        dot(w, across)
    } else if camera.convention().is_reversed() {
        -dot(depth, across)
    } else {
        dot(depth, across)
    };
    scaled(across, grows.signum())
}

/// The point of a pixel position and a depth, by elimination in float64.
fn unprojected(camera: &Camera, column: f64, row: f64, depth: f64) -> Vec3 {
    let rows = camera.rows();
    let size = camera.size();
    let t = [
        2.0 * column / f64::from(size.width) - 1.0,
        1.0 - 2.0 * row / f64::from(size.height),
        depth,
    ];
    // rows[k] - t[k] rows[3] = 0 for k = 0, 1, 2.
    let mut m: [[f64; 4]; 3] =
        [0, 1, 2].map(|k| [0, 1, 2, 3].map(|j| rows[k][j] - t[k] * rows[3][j]));
    for i in 0..3 {
        let pivot = (i..3).max_by(|a, b| m[*a][i].abs().total_cmp(&m[*b][i].abs())).expect("one");
        m.swap(i, pivot);
        for j in (0..3).filter(|j| *j != i) {
            let factor = m[j][i] / m[i][i];
            m[j] = [0, 1, 2, 3].map(|k| m[j][k] - factor * m[i][k]);
        }
    }
    plus(camera.origin(), [0, 1, 2].map(|i| -m[i][3] / m[i][i]))
}

/// The pixels' middles and points near their corners, at their depths.
fn receivers(camera: &Camera, depth: &[f32]) -> Vec<Vec3> {
    let far = if camera.convention().is_reversed() { 0.0 } else { 1.0 };
    let mut points = Vec::new();
    for (i, d) in depth.iter().enumerate().filter(|(_, d)| **d != far) {
        let (column, row) = (f64::from(i as u32 % SIDE), f64::from(i as u32 / SIDE));
        for (x, y) in [(0.5, 0.5), (0.01, 0.01), (0.99, 0.01), (0.01, 0.99), (0.99, 0.99)] {
            points.push(unprojected(camera, column + x, row + y, f64::from(*d)));
        }
    }
    points
}

/// Whether some box point lies on the ray from `point` against `direction`.
/// The box is a hair smaller, so that roundings here accuse nobody.
fn shadows([min, max]: [Vec3; 2], point: Vec3, direction: Vec3) -> bool {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for k in 0..3 {
        let hair = 1e-6 * (max[k] - min[k]) + 1e-7 * point[k].abs();
        let (low, high) = (min[k] + hair, max[k] - hair);
        if low > high {
            return false;
        }
        if direction[k] == 0.0 {
            if point[k] < low || point[k] > high {
                return false;
            }
            continue;
        }
        let (a, b) = ((point[k] - low) / direction[k], (point[k] - high) / direction[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    enter <= leave
}

/// Directions of the light's disc, and places where a filter looks.
fn rays(light: &DirectionalLight) -> (Vec<Vec3>, Vec<Vec3>) {
    let middle = unit(light.direction);
    let other = if middle[0].abs() < 0.6 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
    let a = unit(plus(other, scaled(middle, -dot(other, middle))));
    let b = [
        middle[1] * a[2] - middle[2] * a[1],
        middle[2] * a[0] - middle[0] * a[2],
        middle[0] * a[1] - middle[1] * a[0],
    ];
    let (mut directions, mut offsets) = (vec![middle], vec![[0.0; 3]]);
    for k in 0..8 {
        let angle = f64::from(k) * std::f64::consts::FRAC_PI_4;
        let around = plus(scaled(a, angle.cos()), scaled(b, angle.sin()));
        if light.angular_radius > 0.0 {
            directions.push(unit(plus(middle, scaled(around, light.angular_radius.tan()))));
        }
        if light.filter_radius > 0.0 {
            offsets.push(scaled(around, light.filter_radius));
        }
    }
    if light.filter_radius > 0.0 {
        offsets.extend([-1.0, 1.0].map(|sign| scaled(middle, sign * light.filter_radius)));
    }
    (directions, offsets)
}

/// What a cull of casters keeps, and how many culled casters shadow a receiver.
struct Found {
    culled: usize,
    wrong: usize,
}

fn verdicts(engine: &Engine, scene: &Scene, options: &CullOptions) -> Vec<bool> {
    let depth = engine.upload_depth(&scene.depth, &scene.camera).expect("an image");
    let of = PyramidOptions { depths: Depths::Receivers, ..PyramidOptions::default() };
    let pyramid = engine.pyramid_with(&depth, &of).expect("a pyramid");
    let flat = |end: usize| scene.boxes.iter().flat_map(|b| b[end]).collect::<Vec<_>>();
    let (min, max) = (flat(0), flat(1));
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let casters: Arc<_> = engine.instances(&bounds, &InstanceOptions::default()).expect("casters");
    let options = CullOptions { shadow: Some(scene.light), ..options.clone() };
    let culling = engine
        .cull(&casters, &scene.camera, &pyramid, &options, &Outputs::default())
        .expect("a cull");
    culling.mask().expect("a mask").to_vec()
}

fn found(engine: &Engine, scene: &Scene, options: &CullOptions) -> Found {
    let mask = verdicts(engine, scene, options);
    let points = receivers(&scene.camera, &scene.depth);
    let (directions, offsets) = rays(&scene.light);
    let wrong = |bounds: &[Vec3; 2]| {
        points.iter().any(|p| {
            offsets.iter().any(|v| {
                let at = plus(*p, *v);
                directions.iter().any(|d| shadows(*bounds, at, *d))
            })
        })
    };
    let culled: Vec<_> = scene.boxes.iter().zip(&mask).filter(|(_, kept)| !**kept).collect();
    Found { culled: culled.len(), wrong: culled.iter().filter(|(bounds, _)| wrong(bounds)).count() }
}

fn hard(random: &mut Random) -> DirectionalLight {
    DirectionalLight::new(direction(random), [0.0; 3], [0.0; 3])
}

fn soft(random: &mut Random) -> DirectionalLight {
    DirectionalLight { angular_radius: random.range(0.02, 0.15), ..hard(random) }
}

fn filtered(random: &mut Random) -> DirectionalLight {
    DirectionalLight { filter_radius: random.range(0.1, 2.0), ..hard(random) }
}

fn along_an_axis(random: &mut Random) -> DirectionalLight {
    let mut direction = [0.0; 3];
    direction[random.below(3) as usize] = if random.below(2) == 0 { 1.0 } else { -1.0 };
    DirectionalLight { filter_radius: 0.3, ..DirectionalLight::new(direction, [0.0; 3], [0.0; 3]) }
}

/// Flat ground, seen from above, and thin casters high over it whose shadows all reach it.
/// Nothing but the very end of a sweep meets the ground.
fn flat(seed: u64) -> Scene {
    let mut random = Random(seed);
    let convention = random.pick(&CONVENTIONS);
    let pose = Pose { eye: [0.0, 20.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0] };
    let (left, right, bottom, top, near, far) = (-8.0, 8.0, -8.0, 8.0, 0.0, 40.0);
    let projection = Projection::Orthographic { left, right, bottom, top, near, far, convention };
    let camera = Camera::look_at(&pose, &projection, ImageSize::new(SIDE, SIDE)).unwrap();
    let direction = [random.range(-0.7, 0.7), -1.0, random.range(-0.7, 0.7)];
    let light = DirectionalLight::new(direction, [-9.0, 0.0, -9.0], [9.0, 0.0, 9.0]);
    let depth = vec![0.5; (SIDE * SIDE) as usize];
    let points = receivers(&camera, &depth);
    let boxes = (0..600)
        .map(|_| {
            let at = random.pick(&points);
            let center = plus(at, scaled(unit(direction), -random.range(5.0, 15.0)));
            let half = [0.1, random.range(0.005, 0.02), 0.1];
            [[0, 1, 2].map(|k| center[k] - half[k]), plus(center, half)]
        })
        .collect();
    Scene { camera, depth, light, boxes }
}

/// The same ground under a soft light that comes from low, with casters before the image's edge.
/// Only the flattest of the light's directions carry their shadows into the image.
fn flat_and_soft(seed: u64) -> Scene {
    let mut random = Random(seed);
    let camera = flat(seed).camera;
    let (angle, radius) = (random.range(0.0, std::f64::consts::TAU), random.range(0.08, 0.12));
    let direction = [angle.cos(), -random.range(0.4, 0.6), angle.sin()];
    let light = DirectionalLight {
        angular_radius: radius,
        ..DirectionalLight::new(direction, [-30.0, 0.0, -30.0], [30.0, 0.0, 30.0])
    };
    let depth = vec![0.5; (SIDE * SIDE) as usize];
    let points = receivers(&camera, &depth);
    let (directions, _) = rays(&light);
    let boxes = (0..600)
        .map(|_| {
            let (at, ray) = (random.pick(&points), random.pick(&directions));
            let center = plus(at, scaled(ray, -random.range(5.0, 15.0)));
            let half = [0.02, random.range(0.005, 0.02), 0.02];
            [[0, 1, 2].map(|k| center[k] - half[k]), plus(center, half)]
        })
        .collect();
    Scene { camera, depth, light, boxes }
}

type Make = fn(u64) -> Scene;
const SCENES: [(&str, Make); 6] = [
    ("hard", |seed| scene(seed, hard)),
    ("soft", |seed| scene(seed, soft)),
    ("filtered", |seed| scene(seed, filtered)),
    ("along an axis", |seed| scene(seed, along_an_axis)),
    ("flat ground", flat),
    ("flat ground, soft", flat_and_soft),
];
const HARD: Make = SCENES[0].1;
const SOFT: Make = SCENES[1].1;
const FILTERED: Make = SCENES[2].1;
const ALONG_AN_AXIS: Make = SCENES[3].1;

fn campaign(engine: &Engine, make: Make, scenes: u64) -> Found {
    let mut all = Found { culled: 0, wrong: 0 };
    for seed in 0..scenes {
        let scene = make(seed);
        let hierarchy = if seed % 3 == 0 { Hierarchy::Always } else { Hierarchy::Never };
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let Found { culled, wrong } = found(engine, &scene, &options);
        all = Found { culled: all.culled + culled, wrong: all.wrong + wrong };
    }
    all
}

#[test]
fn no_culled_caster_shadows_a_receiver() {
    let engine = engine();
    for (name, make) in SCENES {
        let Found { culled, wrong } = campaign(&engine, make, 24);
        println!("{name}: {culled} of {} culled", 24 * 600);
        assert_eq!(wrong, 0, "{name}: of {culled} culled");
        // Every shadow of the flat scene shows.
        let is_flat = name.starts_with("flat ground");
        assert!(if is_flat { culled == 0 } else { culled > 500 }, "{name}: {culled}");
    }
}

/// A receiver lies within the filter's radius of the exit face, and a caster beyond the face.
#[test]
fn a_filter_reaches_beyond_the_exit_face() {
    let pose = Pose { eye: [0.0, 10.0, 0.0], target: [0.0; 3], up: [0.0, 0.0, -1.0] };
    for convention in CONVENTIONS {
        let projection = Projection::Orthographic {
            left: -4.0,
            right: 4.0,
            bottom: -4.0,
            top: 4.0,
            near: 0.0,
            far: 20.0,
            convention,
        };
        let camera = Camera::look_at(&pose, &projection, ImageSize::new(SIDE, SIDE)).unwrap();
        // The ground at y = 0, and a box that begins 0.5 below it: light goes down.
        let depth = vec![0.5; (SIDE * SIDE) as usize];
        let boxes = vec![[[-1.0, -2.0, -1.0], [1.0, -0.5, 1.0]]];
        let of = |filter_radius| {
            let light = DirectionalLight {
                filter_radius,
                ..DirectionalLight::new([0.0, -1.0, 0.0], [-50.0, 0.0, -50.0], [50.0, 0.0, 50.0])
            };
            let scene =
                Scene { camera: camera.clone(), depth: depth.clone(), light, boxes: boxes.clone() };
            verdicts(&engine(), &scene, &CullOptions::default())
        };
        assert_eq!(of(0.45), [false]);
        assert_eq!(of(0.55), [true]);
    }
}

/// Each fault makes a cull lose a shadow.
#[test]
fn planted_faults_lose_shadows() {
    let faults: [(&str, Make, (&str, &str)); 10] = [
        (
            "s 1 % short",
            flat,
            (
                "return min(min(bounds.x, bounds.y), bounds.z);",
                "return 0.99 * min(min(bounds.x, bounds.y), bounds.z);",
            ),
        ),
        ("the disc's growth dropped", SOFT, ("growth * view.steepness", "0.0 * view.steepness")),
        ("the filter's dropped", FILTERED, ("growth * view.steepness", "0.0 * view.steepness")),
        ("no fourth axis", flat, ("abs(r.along - t * w.along)", "0.0")),
        (
            "near and far swapped",
            HARD,
            (
                "surely_clear_of(bits, nearest_texel(level, at.x, at.y), z, w)",
                "surely_clear_of(nearest_texel(level, at.x, at.y), bits, z, w)",
            ),
        ),
        (
            "the box's other side",
            HARD,
            ("view.exits - volume.center", "volume.center - view.exits"),
        ),
        ("f left out of s", ALONG_AN_AXIS, ("view.filter_radius + rounding", "rounding")),
        ("the disc left out of g", SOFT, ("+ s * view.light_slope", "+ s * 0.0")),
        // From the speed L - slope sqrt(1 - L^2) towards a face back to L alone.
        (
            "the disc left out of inv",
            flat_and_soft,
            (
                "let ways = (view.exits - volume.center) * view.exit_rates + reach * \
                 abs(view.exit_rates);",
                "let slope = vec3<f32>(view.light_slope);
                let speeds = 1.0 / max(abs(view.exit_rates), vec3<f32>(1e-9));
                let square = vec3<f32>(1.0) + slope * slope;
                let middle = (speeds + slope * sqrt(square - speeds * speeds)) / square;
                let rates = sign(view.exit_rates) / middle;
                let ways = (view.exits - volume.center) * rates + reach * abs(rates);",
            ),
        ),
        (
            "background as nearest receiver",
            HARD,
            (
                "farthest_sanitized4(foreground4(pixels)), nearest_sanitized4(pixels))",
                "farthest_sanitized4(foreground4(pixels)), select(nearest_sanitized4(pixels), \
                 far_bits(), any(pixels == vec4<u32>(far_bits()))))",
            ),
        ),
    ];
    for (name, make, text) in faults {
        let engine = Engine::with_planted_faults(None, &[text]).expect("the text is there");
        let Found { culled, wrong } = campaign(&engine, make, 24);
        println!("{name}: {wrong} of {culled} wrong");
        assert!(wrong > 0, "{name}: nothing is wrong among {culled}");
    }
}

#[test]
fn groups_cull_like_their_members() {
    let engine = engine();
    let (mut flat_kept, mut grouped_kept) = (0, 0);
    for seed in 0..6 {
        let scene = scene(seed, hard);
        let of = |hierarchy| {
            let options = CullOptions { hierarchy, ..CullOptions::default() };
            verdicts(&engine, &scene, &options).iter().filter(|kept| **kept).count()
        };
        flat_kept += of(Hierarchy::Never);
        grouped_kept += of(Hierarchy::Always);
    }
    // A group's box may prove what a member's budget cannot, and never the other way round.
    assert!(grouped_kept <= flat_kept, "{grouped_kept} {flat_kept}");
}

#[test]
fn what_a_cull_of_casters_does_not_take_is_refused() {
    let engine = engine();
    let scene = scene(1, hard);
    let depth = engine.upload_depth(&scene.depth, &scene.camera).unwrap();
    let plain = engine.pyramid(&depth).unwrap();
    let of = PyramidOptions { depths: Depths::Receivers, ..PyramidOptions::default() };
    let receivers = engine.pyramid_with(&depth, &of).unwrap();
    let bounds = Bounds::Spheres { centers: Floats::F64(&[0.0; 3]), radii: Floats::F64(&[1.0]) };
    let casters = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let error = |pyramid, options: &CullOptions| {
        engine
            .cull(&casters, &scene.camera, pyramid, options, &Outputs::default())
            .unwrap_err()
            .to_string()
    };
    let with = |shadow| CullOptions { shadow: Some(shadow), ..CullOptions::default() };
    let light = scene.light;
    assert!(error(&plain, &with(light)).contains("Depths::Receivers"));
    assert!(error(&receivers, &CullOptions::default()).contains("Receivers"));
    let fit = CullOptions { fit: Fit::Volume, ..with(light) };
    assert!(error(&receivers, &fit).contains("Fit::Rectangle"));
    let bad = [
        (DirectionalLight { direction: [0.0; 3], ..light }, "shadow.direction"),
        (DirectionalLight { direction: [f64::NAN; 3], ..light }, "shadow.direction"),
        (DirectionalLight { receivers_min: [f64::NAN; 3], ..light }, "shadow.receivers"),
        (DirectionalLight { receivers_max: [-1e9; 3], ..light }, "shadow.receivers"),
        (DirectionalLight { angular_radius: 0.6, ..light }, "shadow.angular_radius"),
        (DirectionalLight { filter_radius: -1.0, ..light }, "shadow.filter_radius"),
    ];
    for (light, name) in bad {
        assert!(error(&receivers, &with(light)).contains(name), "{name}");
    }
}

/// Verdicts are told apart for members of hidden groups, too.
#[test]
fn members_of_hidden_groups_have_verdicts() {
    let engine = engine();
    let scene = scene(2, hard);
    let depth = engine.upload_depth(&scene.depth, &scene.camera).unwrap();
    let of = PyramidOptions { depths: Depths::Receivers, ..PyramidOptions::default() };
    let pyramid = engine.pyramid_with(&depth, &of).unwrap();
    let flat = |end: usize| scene.boxes.iter().flat_map(|b| b[end]).collect::<Vec<_>>();
    let (min, max) = (flat(0), flat(1));
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let casters = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let told = |hierarchy| {
        let options =
            CullOptions { shadow: Some(scene.light), hierarchy, ..CullOptions::default() };
        let culling =
            engine.cull(&casters, &scene.camera, &pyramid, &options, &Outputs::default()).unwrap();
        culling.verdicts().unwrap().to_vec()
    };
    let (alone, grouped) = (told(Hierarchy::Never), told(Hierarchy::Always));
    for (alone, grouped) in alone.iter().zip(&grouped) {
        assert!(
            alone == grouped || (*grouped == Verdict::Occluded && *alone == Verdict::Visible),
            "{alone:?} {grouped:?}"
        );
    }
}

/// A footprint of one texel, and of many: no culled caster shadows a receiver.
#[test]
fn every_footprint_keeps_what_shadows() {
    let engine = engine();
    for footprint in [Footprint::One, Footprint::Four, Footprint::Eight] {
        let (mut culled_of_all, mut wrong_of_all) = (0, 0);
        for (_, make) in SCENES {
            for (seed, hierarchy) in [(3, Hierarchy::Never), (4, Hierarchy::Always)] {
                let options = CullOptions { footprint, hierarchy, ..CullOptions::default() };
                let Found { culled, wrong } = found(&engine, &make(seed), &options);
                culled_of_all += culled;
                wrong_of_all += wrong;
            }
        }
        println!("{footprint:?}: {culled_of_all} culled");
        assert!(culled_of_all > 200 && wrong_of_all == 0, "{footprint:?}: {wrong_of_all}");
    }
}
