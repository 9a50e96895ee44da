//! The example renderer in three scenes: with culling and without, pixel for pixel.
//! Also how much slack a driver's depth needs for that.

#[path = "common/cameras.rs"]
mod cameras;
mod common;
#[path = "../examples/renderer/field.rs"]
mod field;
#[path = "../examples/renderer/renderer.rs"]
mod renderer;
#[path = "../examples/renderer/rooms.rs"]
mod rooms;
#[path = "../examples/renderer/scene.rs"]
mod scene;
#[path = "../examples/renderer/town.rs"]
mod town;

use cameras::{KINDS, random_shots};
use common::CONVENTIONS;
use hiz_core::{Camera, Coverage, CullOptions, Fit, Footprint, ImageSize, Vec3};
use renderer::{Culled, Picture, Renderer, Slack, slack};
use scene::{Body, Scene, Shape, Shot};

/// A row of 321 pixels is padded where it is copied.
const SIZES: [(u32, u32); 2] = [(640, 360), (321, 203)];

/// Places where the spacing of float32 is a quarter of a metre, and half a metre.
const FAR_AWAY: Vec3 = [2_345_678.9, 123.4, -3_456_789.1];
const ON_A_PLANET: Vec3 = [6_371_000.1, -31.7, 1_234.5];

/// The number of random cameras for each scene: each kind of camera with each way.
const RANDOM: usize = KINDS.len() * WAYS.len();

/// The number of them in `make soak`.
fn soak() -> usize {
    number("HIZVK_SOAK_CAMERAS", 1000)
}

fn number<T: std::str::FromStr>(variable: &str, default: T) -> T {
    std::env::var(variable).map_or(default, |s| {
        s.parse().unwrap_or_else(|_| panic!("{variable}: expected a number, got {s:?}"))
    })
}

/// One way to cull; the picture has to be the same with each.
type Way = (&'static str, fn(CullOptions) -> CullOptions);

const WAYS: [Way; 6] = [
    ("2x2 texels", |options| options),
    ("8x8 texels", |options| CullOptions { footprint: Footprint::Eight, ..options }),
    ("a descent", |options| CullOptions { descent: 4096, ..options }),
    ("its own outline and depth", |options| CullOptions {
        descent: 4096,
        fit: Fit::Volume,
        ..options
    }),
    ("its own outline and depth at samples", |options| CullOptions {
        coverage: Coverage::Sample,
        guard_px: Some(0.125),
        descent: 4096,
        fit: Fit::Volume,
        ..options
    }),
    // A rasteriser that snaps to sixteenths of a pixel moves an edge by half of one.
    // The guard is four times that.
    ("sample coverage", |options| CullOptions {
        coverage: Coverage::Sample,
        guard_px: Some(0.125),
        descent: 4096,
        ..options
    }),
];

type MakeScene = (fn(Vec3) -> Scene, fn(Vec3, ImageSize) -> hiz_core::Result<Vec<Shot>>, Vec3);

const SCENES: [MakeScene; 4] = [
    (town::scene, town::shots, [0.0; 3]),
    (town::scene, town::shots, FAR_AWAY),
    (rooms::scene, rooms::shots, [0.0; 3]),
    (field::scene, field::shots, ON_A_PLANET),
];

fn open(faults: &[(&str, &str)]) -> Renderer {
    let renderer = Renderer::open(faults).expect("the device tests need a Vulkan driver");
    let adapter = format!(
        "{} ({} {})",
        renderer.adapter.name, renderer.adapter.driver, renderer.adapter.driver_info
    );
    eprintln!("adapter: {adapter}");
    if let Ok(expected) = std::env::var("HIZVK_EXPECT_ADAPTER") {
        assert!(
            adapter.to_lowercase().contains(&expected.to_lowercase()),
            "expected the adapter {expected}, got {adapter}"
        );
    }
    renderer
}

/// What the tests look at: one camera, its picture of everything, and its picture with culling.
struct Seen<'a> {
    scene: &'a Scene,
    shot: &'a Shot,
    way: &'static str,
    all: &'a Picture,
    culled: &'a Culled,
}

impl Seen<'_> {
    fn differing(&self) -> usize {
        self.all.differing_pixels(&self.culled.picture)
    }

    /// The differing pixels that the rasteriser does not explain.
    /// It explains a pixel in two cases, because faces that are seen edge-on take any depth:
    ///
    /// - the missing body was drawn nearer than its own bounds by more than the slack;
    /// - the depth image was nearer than the picture without culling.
    fn unaccounted(&self, slack: Slack) -> usize {
        let (camera, all) = (&self.shot.camera, self.all);
        let pixels = all
            .ids
            .iter()
            .zip(&self.culled.picture.ids)
            .zip(all.depth.iter().zip(&self.culled.prepass));
        let accounted = |id: u32, depth: f32, prepass: f32| {
            let limit = if is_orthographic(camera) { slack.absolute } else { slack.relative };
            let (depth, prepass) = (f64::from(depth), f64::from(prepass));
            let out_of_bounds = self
                .scene
                .crowd
                .get((id as usize).wrapping_sub(1))
                .and_then(|body| depth_range(body, camera))
                .is_some_and(|range| nearer(camera, nearest(camera, range), depth) > limit);
            out_of_bounds || nearer(camera, depth, prepass) > limit
        };
        pixels
            .filter(|((id, culled), (depth, prepass))| {
                id != culled && !accounted(**id, **depth, **prepass)
            })
            .count()
    }

    fn label(&self) -> String {
        let Self { scene, shot, way, .. } = self;
        format!("{} of {} {}, {way}", shot.name, scene.name, shot.camera.size())
    }
}

/// Draws every shot of a scene without culling, and with it in each way.
fn draw_each(
    renderer: &Renderer,
    scene: &Scene,
    shots: &[Shot],
    ways: &[Way],
    mut look: impl FnMut(&Seen<'_>),
) {
    let stage = renderer.build(scene).unwrap();
    for shot in shots {
        let all = renderer.draw_all(&stage, shot);
        for (way, change) in ways {
            let options = change(renderer.cull_options(&shot.camera));
            let culled = renderer.draw_culled(&stage, shot, &options).unwrap();
            look(&Seen { scene, shot, way, all: &all, culled: &culled });
        }
    }
}

/// The example's cameras.
fn example_shots((_, shots, origin): &MakeScene) -> Vec<Shot> {
    SIZES
        .iter()
        .flat_map(|(width, height)| shots(*origin, ImageSize::new(*width, *height)).unwrap())
        .collect()
}

#[test]
fn pictures_with_culling_equal_those_without() {
    let renderer = open(&[]);
    for make in &SCENES {
        let (scene, shots) = (make.0(make.2), example_shots(make));
        draw_each(&renderer, &scene, &shots, &WAYS[..1], |seen| {
            let (label, counts, crowd) =
                (seen.label(), seen.culled.counts, seen.scene.crowd.len() as u32);
            assert_eq!(seen.differing(), 0, "{label}");
            assert_eq!(counts.drawn, counts.kept, "{label}");
            assert_eq!(counts.kept + counts.occluded + counts.outside, crowd);
            // Equal pictures prove nothing where nothing is hidden or no body is visible.
            assert!(
                counts.kept < 2 * crowd / 3 && counts.occluded > crowd / 8,
                "{label}: {counts:?}"
            );
            assert!(
                seen.all.ids.iter().any(|id| (1..=crowd).contains(id)),
                "{label}: nobody there"
            );
        });
    }
}

/// Random cameras, each in some of the ways.
/// Fails with all cameras whose pictures differ by more than the rasteriser explains.
/// Fails, too, if the rasteriser has to explain more than one pixel in a hundred pictures.
/// With lavapipe it explains none.
/// `SwiftShader` snaps to sixteenths of a pixel.
/// Where a face is thinner than that, it sometimes draws a fragment of depth 0.
fn random_cameras(number: usize, seed: u64, ways: impl Fn(usize) -> Vec<Way>) {
    let renderer = open(&[]);
    let (mut differing, mut tolerated, mut pictures) = (Vec::new(), 0, 0);
    for (place, (scene, _, origin)) in SCENES.iter().enumerate() {
        let scene = scene(*origin);
        // How many bodies there were, and how many were kept and hidden.
        let (mut total, mut kept, mut occluded) = (0_u64, 0_u64, 0_u64);
        for (i, shot) in random_shots(&scene, number, seed + place as u64).into_iter().enumerate() {
            let shots = [shot];
            draw_each(&renderer, &scene, &shots, &ways(i), |seen| {
                let counts = seen.culled.counts;
                total += seen.scene.crowd.len() as u64;
                kept += u64::from(counts.kept);
                occluded += u64::from(counts.occluded);
                pictures += 1;
                let pixels = seen.differing();
                if pixels > 0 && seen.unaccounted(slack(&renderer.adapter, &seen.shot.camera)) == 0
                {
                    tolerated += pixels;
                } else if pixels > 0 {
                    let label = seen.label();
                    eprintln!(
                        "{pixels} pixels differ: {label}, number {i} of seed {}: {:?}",
                        seed + place as u64,
                        seen.shot
                    );
                    differing.push(label);
                }
            });
        }
        eprintln!(
            "{} at {origin:?}: {number} cameras, {total} bodies, {kept} kept, \
             {occluded} occluded, {} outside",
            scene.name,
            total - kept - occluded
        );
        assert!(
            occluded > total / 50 && kept > total / 100,
            "{}: nothing is hidden or seen",
            scene.name
        );
    }
    eprintln!(
        "{pictures} pictures, {tolerated} pixels differ where a face was drawn out of its bounds"
    );
    assert!(differing.is_empty(), "{differing:?}");
    assert!(100 * tolerated <= pictures, "{tolerated} pixels in {pictures} pictures");
}

#[test]
fn so_do_those_of_random_cameras() {
    // Every kind of camera is combined with every way.
    random_cameras(RANDOM, 3, |i| vec![WAYS[(i % KINDS.len() + i / KINDS.len()) % WAYS.len()]]);
}

#[test]
#[ignore = "minutes: make soak"]
fn so_do_those_of_thousands_of_random_cameras() {
    random_cameras(soak(), number("HIZVK_SOAK_SEED", 1000), |_| WAYS.to_vec());
}

/// Labels of the example's pictures that differ under a fault, in one way.
fn red(faults: &[(&str, &str)], way: Way) -> Vec<(String, usize)> {
    let renderer = open(faults);
    let mut differing = Vec::new();
    for make in &SCENES {
        let mut shots = make.1(make.2, ImageSize::new(SIZES[1].0, SIZES[1].1)).unwrap();
        let scene = make.0(make.2);
        shots.extend(random_shots(&scene, 8, 5));
        draw_each(&renderer, &scene, &shots, &[way], |seen| {
            differing.push((seen.label(), seen.differing()));
        });
    }
    differing.retain(|(_, pixels)| *pixels > 0);
    eprintln!(
        "{faults:?}, {}: {} pictures differ, {:?}",
        way.0,
        differing.len(),
        differing.iter().take(6).collect::<Vec<_>>()
    );
    differing
}

/// The comparison would notice a false cull.
/// With this fault the pyramid holds the nearest depth instead of the farthest.
#[test]
fn a_pyramid_upside_down_is_seen() {
    let fault =
        ("select(max(a, b), min(a, b), REVERSED)", "select(min(a, b), max(a, b), REVERSED)");
    assert!(red(&[fault], WAYS[0]).len() >= 12);
}

/// It notices even a single body that the draw forgets, the last of each list.
#[test]
fn a_forgotten_body_is_seen() {
    let fault = (
        "instance_count = min(sums[lane], room());",
        "instance_count = max(1u, min(sums[lane], room())) - 1u;",
    );
    assert!(!red(&[fault], WAYS[0]).is_empty());
}

/// A footprint one texel to the right.
#[test]
fn a_shifted_footprint_is_seen() {
    let faults = [
        (
            "let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));",
            "let t = vec4<u32>(min((first >> vec2<u32>(level)) + vec2<u32>(1u, 0u), \
             last >> vec2<u32>(level)), last >> vec2<u32>(level));",
        ),
        ("return (lo == 0u | surely_after", "return (true | surely_after"),
    ];
    assert!(red(&faults, WAYS[0]).len() >= 12);
}

/// With neither margin nor slack, bodies are hidden by their own depth.
/// Without slack alone that needs faces seen edge-on, which is one picture in thousands.
#[test]
fn no_margin_and_no_slack_is_seen() {
    let none: Way =
        ("no slack", |options| CullOptions { depth_slack: 0.0, depth_slack_abs: 0.0, ..options });
    assert!(!red(&[("ERROR_ULPS: f32 = 24.0", "ERROR_ULPS: f32 = 0.0")], none).is_empty());
}

/// The least and greatest depth of a body's bounds in float64.
/// `None` if they cross the near or far plane.
fn depth_range(body: &Body, camera: &Camera) -> Option<[f64; 2]> {
    let rows = camera.rows();
    let dot = |a: Vec3, b: Vec3| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let linear = |r: usize| [rows[r][0], rows[r][1], rows[r][2]];
    let norm = |v: Vec3| dot(v, v).sqrt();
    // A row's least and greatest value.
    let ends = |r: usize| {
        let m = linear(r);
        let (center, reach) = match body.shape {
            Shape::Box { min, max } => (
                [0, 1, 2].map(|k| (min[k] + max[k]) / 2.0),
                (0..3).map(|k| (m[k] * (max[k] - min[k]) / 2.0).abs()).sum(),
            ),
            Shape::Turned { center, half, rotation: q } => {
                (center, (0..3).map(|k| (dot(m, [q[k], q[3 + k], q[6 + k]]) * half[k]).abs()).sum())
            }
            Shape::Ball { center, radius } => (center, radius * norm(m)),
        };
        let middle = dot(m, [0, 1, 2].map(|k| center[k] - camera.origin()[k])) + rows[r][3];
        [middle - reach, middle + reach]
    };
    let [w, z] = [ends(3), ends(2)];
    if is_orthographic(camera) {
        let range = z.map(|z| z / w[0]);
        return (range[0] >= 0.0 && range[1] <= 1.0).then_some(range);
    }
    // z = slope w + constant for every point, so depth is monotonic in w.
    let slope = dot(linear(2), linear(3)) / dot(linear(3), linear(3));
    let constant = rows[2][3] - slope * rows[3][3];
    if w[0] <= 0.0 {
        return None;
    }
    let [a, b] = w.map(|w| slope + constant / w);
    (a.min(b) >= 0.0 && a.max(b) <= 1.0).then_some([a.min(b), a.max(b)])
}

/// How much nearer depth `b` is than `a`: relative, or absolute for orthographic cameras.
fn nearer(camera: &Camera, a: f64, b: f64) -> f64 {
    match (is_orthographic(camera), camera.convention().is_reversed()) {
        (true, false) => a - b,
        (true, true) => b - a,
        (false, false) => a / b - 1.0,
        (false, true) => 1.0 - a / b,
    }
}

/// The nearest end of a range of depths.
fn nearest(camera: &Camera, [least, greatest]: [f64; 2]) -> f64 {
    if camera.convention().is_reversed() { greatest } else { least }
}

fn is_orthographic(camera: &Camera) -> bool {
    camera.rows()[3][..3] == [0.0; 3]
}

/// The greatest errors of a kind of camera.
#[derive(Debug, Clone, Copy, Default)]
struct Worst {
    /// How much nearer than their bounds bodies were drawn.
    bodies: f64,
    /// How much farther than in the prepass its occluders were drawn.
    prepass: f64,
    /// Fragments that were measured, and those that were off by more than the slack.
    fragments: u64,
    beyond: u64,
}

/// Measures the greatest errors for three kinds of camera, with standard and reversed depth.
/// They are perspective (relative), those whose eye may be in a face's plane, and orthographic
/// (absolute).
fn measure(renderer: &Renderer, number: usize, seed: u64) -> [[Worst; 2]; 3] {
    let mut worst = [[Worst::default(); 2]; 3];
    for (place, make) in SCENES.iter().enumerate() {
        let scene = make.0(make.2);
        let shots: Vec<_> = example_shots(make)
            .into_iter()
            .chain(random_shots(&scene, number, seed + place as u64))
            .collect();
        draw_each(renderer, &scene, &shots, &WAYS[..1], |seen| {
            let camera = &seen.shot.camera;
            let kind = match seen.shot.name {
                "grazing" | "touching" | "rooms_on_a_wall" => 1,
                _ if is_orthographic(camera) => 2,
                _ => 0,
            };
            let ranges: Vec<_> = scene.crowd.iter().map(|body| depth_range(body, camera)).collect();
            let Slack { relative, absolute } = slack(&renderer.adapter, camera);
            let limit = relative.max(absolute);
            let worst = &mut worst[kind][usize::from(camera.convention().is_reversed())];
            let pixels = seen.all.ids.iter().zip(&seen.all.depth).zip(&seen.culled.prepass);
            for ((id, depth), prepass) in pixels.filter(|((id, _), _)| **id > 0) {
                let (depth, prepass) = (f64::from(*depth), f64::from(*prepass));
                let body = *id as usize - 1;
                let (mut off, mut farther) = (0.0_f64, 0.0_f64);
                if body >= scene.crowd.len() || seen.shot.crowd_occludes {
                    farther = nearer(camera, depth, prepass).max(0.0);
                }
                if let Some(range) = ranges.get(body).copied().flatten() {
                    off = nearer(camera, nearest(camera, range), depth).max(0.0);
                }
                worst.prepass = worst.prepass.max(farther);
                worst.bodies = worst.bodies.max(off);
                worst.fragments += 1;
                worst.beyond += u64::from(off + farther + off * farther > limit);
            }
        });
    }
    worst
}

/// Checks what [`slack`] has to cover.
/// A culled body is exactly behind the prepass.
/// It stays invisible only if two errors together are within the slack:
///
/// - its own rasterised depth may be nearer than its bounds;
/// - the walls' may be farther than in the prepass.
///
/// The same keeps a body from being hidden by itself.
///
/// At most `share` of the fragments may be off by more.
/// The nearer to edge-on a face is, the larger its error, without a bound.
fn check_slack(number: usize, seed: u64, share: f64) {
    let renderer = open(&[]);
    let worst = measure(&renderer, number, seed);
    let mut enough = true;
    for (kind, pair) in worst.iter().enumerate() {
        for (convention, Worst { bodies, prepass, fragments, beyond }) in
            CONVENTIONS.into_iter().zip(pair)
        {
            let Slack { relative, absolute } = example_slack(&renderer, kind == 2, convention);
            let given = relative.max(absolute);
            let name =
                ["perspective", "perspective, the eye in a face's plane", "orthographic"][kind];
            eprintln!(
                "{name}, {convention:?}: bodies {bodies:.2e} nearer than their bounds, \
                 {prepass:.2e} farther than in the prepass, slack {given:.0e}, \
                 beyond it {beyond} of {fragments} fragments"
            );
            // A face whose plane contains the eye takes any depth.
            // Its error is printed, but no slack covers it.
            enough &= kind == 1 || *beyond as f64 <= share * *fragments as f64;
        }
    }
    assert!(enough, "{worst:?}");
}

/// [`slack`] for any camera of a kind.
fn example_slack(
    renderer: &Renderer,
    orthographic: bool,
    convention: hiz_core::DepthConvention,
) -> Slack {
    let scene = SCENES[0].0([0.0; 3]);
    let shots = random_shots(&scene, 100, 1);
    let camera = shots.iter().map(|shot| &shot.camera).find(|camera| {
        is_orthographic(camera) == orthographic && camera.convention() == convention
    });
    slack(&renderer.adapter, camera.expect("a hundred cameras are of every kind"))
}

#[test]
fn the_slack_covers_the_driver() {
    check_slack(60, 7, 0.0);
}

#[test]
#[ignore = "minutes: make soak"]
fn the_slack_covers_the_driver_in_thousands_of_pictures() {
    check_slack(soak(), number("HIZVK_SOAK_SEED", 2000), 1e-6);
}
