//! The third answer, UNOCCLUDED: all of an instance surely shows.
//! The oracle decides whether it is right, and planted faults whether these tests would notice.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

#[path = "common/mirror/mod.rs"]
mod mirror;

use campaign::{Campaign, Class, PLAIN, Pipelines, Round, Shown, shown_by_class, total};
use common::{CONVENTIONS, Random, camera_along_z, engine, ndc};
use hiz_core::headless::{Culling, Engine};
use hiz_core::{
    Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, Depths, ERROR_ULPS, Fit,
    Floats, Footprint, Hierarchy, InstanceOptions, Outputs, PyramidOptions, Verdict,
};
use hiz_ref::{View, Volume};
use mirror::{Arithmetic, Mirror, STYLES};

const DESCENT: &[(Footprint, u32)] = &[(Footprint::Two, 4096)];
const SHORT: &[(Footprint, u32)] = &[(Footprint::Two, 1)];
const ALL_MODES: &[(Footprint, u32)] = &[
    (Footprint::One, 0),
    (Footprint::One, 4096),
    (Footprint::Two, 0),
    (Footprint::Four, 0),
    (Footprint::Two, 4096),
    (Footprint::Eight, 4),
];

const BOXES: &[BoundsKind] = &[BoundsKind::Box];
const SPHERES: &[BoundsKind] = &[BoundsKind::Sphere];
const BOTH_KINDS: &[BoundsKind] = &[BoundsKind::Sphere, BoundsKind::OrientedBox];

/// Classes in which depth decides, and those in which planes and borders do.
const DEPTH: &[Class] = &[Class::EqualDepth, Class::Orthographic, Class::InfiniteReversed];
const POSTS: &[Class] = &[Class::PixelBorders, Class::Holes, Class::Grazing];
const PLANES: &[Class] = &[Class::FrustumPlanes, Class::NearPlane, Class::OffCentre];

/// The block's certificates along one axis, as the cull calls them.
const INSIDE_X: &str =
    "inside_block(x, w, ends_x, w_min, block.x, block.z, level, view.half_size.x, view.size.x)";
const INSIDE_Y: &str =
    "inside_block(y, w, ends_y, w_min, block.y, block.w, level, view.half_size.y, view.size.y)";

fn faulty(faults: &[(&str, &str)]) -> Engine {
    Engine::with_planted_faults(None, faults).expect("the device tests need a Vulkan driver")
}

/// A cull of boxes against both ends of an image.
fn cull(
    engine: &Engine,
    camera: &Camera,
    image: &[f32],
    boxes: &[[f64; 6]],
    options: &CullOptions,
) -> Culling {
    cull_against(engine, Depths::Both, camera, image, boxes, options)
}

fn cull_against(
    engine: &Engine,
    depths: Depths,
    camera: &Camera,
    image: &[f32],
    boxes: &[[f64; 6]],
    options: &CullOptions,
) -> Culling {
    let depth = engine.upload_depth(image, camera).unwrap();
    let pyramid = engine
        .pyramid_with(&depth, &PyramidOptions { depths, ..PyramidOptions::default() })
        .unwrap();
    let (min, max): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
        boxes.iter().map(|b| ([b[0], b[1], b[2]], [b[3], b[4], b[5]])).unzip();
    let (min, max) = (min.as_flattened(), max.as_flattened());
    let bounds = Bounds::Boxes { min: Floats::F64(min), max: Floats::F64(max) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    engine.cull(&instances, camera, &pyramid, options, &Outputs::default()).unwrap()
}

fn verdicts(camera: &Camera, image: &[f32], boxes: &[[f64; 6]]) -> Vec<Verdict> {
    cull(&engine(), camera, image, boxes, &CullOptions::default()).verdicts().unwrap()
}

/// A box in front of a wall at depth 8, one that touches it, one in it and one behind it.
/// Then one outside, one across the eye's plane, and one with NaN.
#[test]
fn five_answers() {
    use Verdict::{Invalid, Occluded, Outside, Unoccluded, Visible};
    for convention in CONVENTIONS {
        let camera = camera_along_z(16, 16, convention);
        let wall = vec![ndc(8.0, convention); 256];
        let at = |near: f64, far: f64| [-0.5, -0.5, near, 0.5, 0.5, far];
        let boxes = [
            at(2.0, 4.0),
            at(2.0, 8.0),
            at(6.0, 9.0),
            at(9.0, 10.0),
            [20.0, 20.0, 2.0, 21.0, 21.0, 3.0],
            at(-1.0, 3.0),
            at(f64::NAN, 4.0),
        ];
        let expected = [Unoccluded, Visible, Visible, Occluded, Outside, Visible, Invalid];
        let culling = cull(&engine(), &camera, &wall, &boxes, &CullOptions::default());
        assert_eq!(culling.verdicts().unwrap(), expected, "{convention:?}");
        let kept = expected.map(Verdict::is_kept);
        assert_eq!(culling.mask().unwrap(), kept);
        let counts = culling.counts().unwrap();
        assert_eq!(
            [counts.outside, counts.occluded, counts.visible, counts.invalid, counts.unoccluded],
            [1, 1, 3, 1, 1]
        );
        assert_eq!((counts.tested, counts.demand), (7, 5));
        assert_eq!(culling.indices().unwrap(), [0, 1, 2, 5, 6]);
        let told = culling.explain(0).unwrap();
        assert_eq!(told.verdict, Unoccluded);
        assert_eq!(told.in_front_of, Some(ndc(8.0, convention)));
        assert!(told.in_front_of_z.is_none_or(|z| (z - 8.0).abs() < 1e-6), "{told:?}");
        assert!(told.reason.starts_with("inside the frustum, and before"), "{}", told.reason);
        assert_eq!(culling.explain(1).unwrap().in_front_of, Some(ndc(8.0, convention)));
        // Without the nearest end there is no third answer.
        let options = CullOptions::default();
        let of_one = cull_against(&engine(), Depths::Farthest, &camera, &wall, &boxes, &options);
        let without = expected.map(|v| if v == Unoccluded { Visible } else { v });
        assert_eq!(of_one.verdicts().unwrap(), without, "{convention:?}");
        assert_eq!(of_one.counts().unwrap().unoccluded, 0);
        assert_eq!(of_one.explain(0).unwrap().in_front_of, None);
    }
}

/// Nothing in the image: what is inside all planes is unoccluded, whatever the slack.
/// What crosses a plane is not.
#[test]
fn background_hides_nothing() {
    for (convention, slack) in CONVENTIONS.into_iter().flat_map(|c| [(c, 0.0), (c, 0.25)]) {
        let z = match convention {
            DepthConvention::Standard => [0.0, 0.0, 1.25, -1.25],
            DepthConvention::Reversed => [0.0, 0.0, -0.25, 1.25],
        };
        // The near plane is at 1 and the far plane at 5.
        let rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]];
        let camera =
            Camera::from_clip_from_world(rows, hiz_core::ImageSize::new(16, 16), convention)
                .unwrap();
        let sky = [convention.far(); 256];
        let boxes = [
            [-0.5, -0.5, 1.01, 0.5, 0.5, 4.99],
            [-0.5, -0.5, 0.99, 0.5, 0.5, 2.0],
            [-0.5, -0.5, 2.0, 0.5, 0.5, 5.01],
            [-2.1, -0.5, 2.0, 0.5, 0.5, 3.0],
            [-0.5, -0.5, 2.0, 2.1, 0.5, 3.0],
            [-0.5, -2.1, 2.0, 0.5, 0.5, 3.0],
            [-0.5, -0.5, 2.0, 0.5, 2.1, 3.0],
            [-1.9, -1.9, 2.0, 1.9, 1.9, 3.0],
        ];
        let options = CullOptions { depth_slack: slack, ..CullOptions::default() };
        let found = cull(&engine(), &camera, &sky, &boxes, &options).verdicts().unwrap();
        let is_inside = [true, false, false, false, false, false, false, true];
        let expected = is_inside.map(|is| if is { Verdict::Unoccluded } else { Verdict::Visible });
        assert_eq!(found, expected, "{convention:?} {slack}");
    }
}

/// One pixel beside the box is nearer, or has no depth: only boxes that touch it are in doubt.
#[test]
fn a_pixel_without_a_depth_is_near() {
    for convention in CONVENTIONS {
        let camera = camera_along_z(16, 16, convention);
        for pixel in [f32::NAN, f32::INFINITY, -1.0, 1.5, f32::NEG_INFINITY] {
            let mut image = [ndc(8.0, convention); 256];
            image[8 * 16 + 8] = pixel;
            // At depth 4 a pixel is half a unit wide, and this one spans x in 0..0.5.
            let found = verdicts(
                &camera,
                &image,
                &[[0.1, -0.4, 4.0, 0.2, -0.3, 4.0], [-0.2, -0.4, 4.0, -0.1, -0.3, 4.0]],
            );
            assert_eq!(found, [Verdict::Visible, Verdict::Unoccluded], "{convention:?} {pixel}");
        }
    }
}

/// With a guard of half a pixel, what is a quarter of a pixel beside a near pixel is in doubt.
/// So is what is a quarter of a pixel from the image's border.
fn shows_within_the_guard(engine: &Engine, coverage: Coverage) -> Vec<bool> {
    let camera = camera_along_z(16, 16, DepthConvention::Reversed);
    let mut image = [0.0; 256];
    for i in 0..16 {
        image[16 * i + 8] = 1.0;
        image[8 * 16 + i] = 1.0;
    }
    // At depth 8 a pixel is a unit wide; column 8 is x in 0..1, and row 8 is y in -1..0.
    // In sample coverage only the pixels' centres count, half a unit farther in.
    let inset = if coverage == Coverage::Sample { 0.5 } else { 0.0 };
    let options = CullOptions { guard_px: Some(0.5), coverage, ..CullOptions::default() };
    let beside = |distance: f64| {
        let (low, high) = (inset - distance, 1.0 - inset + distance);
        [
            [low - 0.1, 4.2, 8.0, low, 4.3, 8.0],
            [high, 4.2, 8.0, high + 0.1, 4.3, 8.0],
            [4.2, -high - 0.1, 8.0, 4.3, -high, 8.0],
            [4.2, -low, 8.0, 4.3, -low + 0.1, 8.0],
        ]
    };
    let border = |distance: f64| {
        let (edge, inner) = (8.0 - distance, 7.0 - distance);
        [
            [-edge, 4.2, 8.0, -inner, 4.3, 8.0],
            [inner, 4.2, 8.0, edge, 4.3, 8.0],
            [4.2, -edge, 8.0, 4.3, -inner, 8.0],
            [4.2, inner, 8.0, 4.3, edge, 8.0],
        ]
    };
    let boxes = [beside(0.25), border(0.25), beside(0.75), border(0.75)].concat();
    let found = cull(engine, &camera, &image, &boxes, &options).verdicts().unwrap();
    found.into_iter().map(|verdict| verdict == Verdict::Unoccluded).collect()
}

#[test]
fn the_guard_keeps_away_from_pixels_and_borders() {
    let expected = [[false; 8], [true; 8]].concat();
    // In sample coverage, the border that counts is still the image's.
    for coverage in [Coverage::Area, Coverage::Sample] {
        assert_eq!(shows_within_the_guard(&engine(), coverage), expected, "{coverage:?}");
        let no_border = faulty(&[("view.half_size - guard", "view.half_size")]);
        let found = shows_within_the_guard(&no_border, coverage);
        assert_eq!(found[4..8], [true; 4], "{coverage:?}: the border's guard");
    }
    let forgetful = (
        "let rounding = WIDENING_ULPS * EPS * half_size + view.reach;",
        "let rounding = WIDENING_ULPS * EPS * half_size;",
    );
    let signs = [
        ("f32(begin) + view.reach - half_size", "f32(begin) - view.reach - half_size"),
        ("f32(end) - view.reach - half_size", "f32(end) + view.reach - half_size"),
    ];
    let found = shows_within_the_guard(&faulty(&[forgetful]), Coverage::Area);
    assert!(found[..4].iter().all(|shows| !shows), "certificates ask for the guard themselves");
    let [low, high] = signs;
    let found = shows_within_the_guard(&faulty(&[forgetful, low, high]), Coverage::Area);
    assert!(found[..4].iter().all(|shows| *shows), "no guard, and green: {found:?}");
}

fn describe(found: &[(Class, Shown)]) -> String {
    let lines = found.iter().map(|(class, s)| {
        let name = format!("{class:?}");
        format!("{name:<18}{:>8}{:>8}{:>8}{:>8}", s.cases, s.exactly, s.claimed, s.false_claims)
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// 0 false answers of volumes that miss being unoccluded by 1e-10 of a way.
#[test]
fn no_answer_is_false() {
    eprintln!("class                cases exactly claimed   false");
    for (seed, coverage, modes, fit, rounds) in [
        (61, Coverage::Area, ALL_MODES, Fit::Rectangle, 4),
        (62, Coverage::Sample, ALL_MODES, Fit::Rectangle, 4),
        (63, Coverage::Sample, DESCENT, Fit::Volume, 2),
    ] {
        let campaign =
            Campaign { seed, rounds, volumes: 10, coverage, modes, fit, ..Campaign::default() };
        let found = shown_by_class(&engine(), &campaign.covered_rounds(), Pipelines::Any);
        eprintln!("{coverage:?} {fit:?}\n{}", describe(&found));
        let Shown { cases, exactly, claimed, false_claims } = total(&found);
        assert_eq!(false_claims, 0);
        // Of the volumes that are left unoccluded, by little or by far, most are found.
        assert!(exactly > cases / 50 && 2 * claimed > exactly, "{cases} {exactly} {claimed}");
    }
}

/// Boxes and spheres of some classes, for engines with planted faults.
fn rounds_of(
    classes: &'static [Class],
    kinds: &'static [BoundsKind],
    modes: &'static [(Footprint, u32)],
) -> Vec<Round> {
    let campaign =
        Campaign { seed: 64, rounds: 8, volumes: 16, classes, kinds, modes, ..Campaign::default() };
    campaign.covered_rounds()
}

fn assert_red(name: &str, rounds: &[Round], faults: &[(&str, &str)]) {
    let found = shown_by_class(&faulty(faults), rounds, Pipelines::Few);
    let Shown { cases, false_claims, .. } = total(&found);
    eprintln!("{name}: {false_claims} false of {cases}");
    assert!(false_claims > 0, "{name}: the campaign stayed green:\n{}", describe(&found));
}

#[test]
fn cuts_of_the_margin_are_seen() {
    let rounds = [DEPTH, POSTS, PLANES].map(|classes| rounds_of(classes, BOTH_KINDS, PLAIN));
    for ulps in ["0.0", "0.25"] {
        let margin = format!("ERROR_ULPS: f32 = {ulps}");
        let engine = faulty(&[("ERROR_ULPS: f32 = 24.0", &margin)]);
        for rounds in &rounds {
            let found = shown_by_class(&engine, rounds, Pipelines::Few);
            eprintln!("{margin}\n{}", describe(&found));
            assert!(total(&found).false_claims > 0, "{margin}: the campaign stayed green");
        }
    }
}

#[test]
fn each_plane_is_needed() {
    let rounds = rounds_of(PLANES, BOXES, PLAIN);
    // Where all is background, the certificate of depth is that of the far plane once more.
    let depth = (
        "fn surely_in_front(bits: u32, z: Value, w: Value) -> bool {",
        "fn surely_in_front(bits: u32, z: Value, w: Value) -> bool { \
         if bits == far_bits() { return true; }",
    );
    for plane in [
        "surely_below(x, border.x, w)",
        "surely_above(x, -border.x, w)",
        "surely_below(y, border.y, w)",
        "surely_above(y, -border.y, w)",
        "surely_above(z, bar(-a), w)",
        "surely_below(z, bar(1.0 - a), w)",
    ] {
        assert_red(plane, &rounds, &[(plane, "true"), depth]);
    }
}

#[test]
fn near_and_far_one_texel_and_the_centre() {
    let posts = rounds_of(POSTS, BOXES, PLAIN);
    let footprint = "front = nearest_footprint(level, t);";
    assert_red("the farthest end", &posts, &[(footprint, "front = out.farthest_bits;")]);
    let swapped =
        ("select(min(a, b), max(a, b), REVERSED)", "select(max(a, b), min(a, b), REVERSED)");
    assert_red("near and far swapped", &posts, &[swapped]);
    let one = "front = nearest_footprint(level, t.xyxy);";
    assert_red("one texel of four", &posts, &[(footprint, one)]);
    let borders = [
        (INSIDE_X, "true"),
        (INSIDE_Y, "true"),
        ("(extent.below * per_w + rounding)", "view.reach"),
        ("(extent.above * per_w + rounding)", "view.reach"),
    ];
    assert_red("a rectangle too small", &posts, &borders);
    let at_centre = [
        ("return surely_above(z, t, w);", "return z.center - t * w.center > 0.0;"),
        ("return surely_below(z, t, w);", "return z.center - t * w.center < 0.0;"),
    ];
    assert_red("the centre's depth", &rounds_of(DEPTH, SPHERES, PLAIN), &at_centre);
}

/// Both ends of a texel lie side by side, so a texel is two words, and the second one is nearest.
#[test]
fn the_ends_of_a_texel_are_told_apart() {
    let posts = rounds_of(POSTS, BOXES, PLAIN);
    let narrow = [("let left = words_of(t.x);", "let left = t.x;")];
    assert_red("words taken for texels", &posts, &narrow);
    let first = ("2u * column + end, BOTH", "2u * column, BOTH");
    let found = total(&shown_by_class(&faulty(&[first]), &posts, Pipelines::Any));
    assert!(found.false_claims > 0, "the atlas' farthest end taken for the nearest: {found:?}");
}

/// The walk down the nearest end asks for all texels of the rectangle, and for the frustum.
#[test]
fn the_walk_down_the_nearest_end_is_complete() {
    let forgets = [
        ("if (at.x & last_child) < last_child && at.x < last.x {", "if false {"),
        ("let right = siblings(at.x, end.x);", "let right = 0u;"),
    ];
    assert_red("a column forgotten", &rounds_of(POSTS, BOXES, DESCENT), &forgets);
    let ends = (
        "    var decided = far_bits();\n    loop {\n        if left == 0u {\n            \
         return false;",
        "    var decided = far_bits();\n    loop {\n        if left == 0u {\n            \
         return true;",
    );
    assert_red("the budget's end", &rounds_of(POSTS, BOXES, SHORT), &[ends]);
    let outside = ("if !hidden && !in_front && is_inside && level", "if !hidden && level");
    let no_footprint = ("!hidden && surely_inside(x, y, z, w);", "false;");
    assert_red("outside", &rounds_of(PLANES, BOXES, DESCENT), &[outside, no_footprint]);
}

/// A depth that was moved away from the eye by as much as the slack allows.
#[test]
fn slack_is_taken_off_towards_the_eye() {
    let rounds = rounds_of(DEPTH, BOTH_KINDS, PLAIN);
    let run = |engine: &Engine| {
        let mut sum = Shown::default();
        for (round, absolute) in rounds.iter().zip([false, true].into_iter().cycle()) {
            let reversed = round.view.reversed;
            let moved = |d: f32| {
                let by = if absolute { 1e-3 } else { 1e-3 * f64::from(d) };
                let far = if reversed { 0.0 } else { 1.0 };
                let to = f64::from(d) + if reversed { -by } else { by };
                // What would be background stays as it is.
                if d == far || !(0.0..=1.0).contains(&to) || to as f32 == far {
                    d
                } else {
                    to as f32
                }
            };
            let image: Vec<f32> = round.depth.iter().copied().map(moved).collect();
            let mut round = round.copied();
            (round.options.depth_slack, round.options.depth_slack_abs) =
                if absolute { (0.0, 1.001e-3) } else { (1.003e-3, 0.0) };
            sum.add(round.shown(engine, &image, Pipelines::Few).unwrap_or_default());
        }
        sum
    };
    let right = run(&engine());
    assert_eq!(right.false_claims, 0, "{right:?}");
    for (name, fault) in [
        ("the factor of the other end", ("* view.near_factor", "* view.depth_factor")),
        ("the offset of the other end", ("+ view.near_offset", "+ view.depth_offset")),
        ("no factor", ("* view.near_factor", "")),
        ("no offset", ("+ view.near_offset", "")),
    ] {
        let wrong = run(&faulty(&[fault]));
        eprintln!("{name}: {} false of {}", wrong.false_claims, wrong.cases);
        assert!(wrong.false_claims > 0, "{name} stayed green");
    }
}

/// Both ends cull what the farthest alone culls, and nothing else.
/// In groups a member's answer is as right as its own.
#[test]
fn the_other_answers_stay_as_they_are() {
    let campaign = Campaign {
        seed: 66,
        rounds: 1,
        volumes: 16,
        kinds: BOXES,
        any_slack: true,
        ..Campaign::default()
    };
    let pipelines = Pipelines::Few;
    let (mut found, mut grouped) = (0, 0);
    for (coverage, fit, modes) in
        [(Coverage::Area, Fit::Rectangle, PLAIN), (Coverage::Sample, Fit::Volume, DESCENT)]
    {
        let campaign = Campaign { coverage, fit, modes, ..campaign };
        for mut round in campaign.rounds().flat_map(|r| [r.copied().barely_covered(), r]) {
            let engine = &engine();
            let image = round.depth.clone();
            let Some(one) = round.verdicts(engine, &image, Depths::Farthest, pipelines) else {
                continue;
            };
            let both =
                round.verdicts(engine, &image, Depths::Both, pipelines).expect("the same camera");
            for (one, both) in one.iter().flatten().zip(both.iter().flatten()) {
                found += usize::from(*both == Verdict::Unoccluded);
                let is_same =
                    one == both || (*one, *both) == (Verdict::Visible, Verdict::Unoccluded);
                assert!(is_same, "{one:?} with one end, {both:?} with both");
            }
            round.options.hierarchy = Hierarchy::Always;
            let shown = round.shown(engine, &image, pipelines).expect("the same camera");
            assert_eq!(shown.false_claims, 0);
            grouped += shown.claimed;
        }
    }
    assert!(found > 30 && grouped > 30, "{found} {grouped}");
}

/// In every arithmetic that WGSL permits, no answer is false.
/// With a 24th of the margin some is.
#[test]
fn no_arithmetic_gives_a_false_answer() {
    let false_claims = |seed, rounds, margin: f32, coverage| {
        let (mut cases, mut claimed, mut wrong) = (0, 0, 0);
        let campaign = Campaign { seed, rounds, volumes: 6, coverage, ..Campaign::default() };
        for round in campaign.rounds().map(campaign::Round::barely_covered) {
            let Some(mirror) = Mirror::new(&round) else { continue };
            for style in STYLES {
                let mut arithmetic = Arithmetic::new(style, round.number as u64);
                let shows = mirror.unoccluded(&round.depth, margin, &mut arithmetic);
                for ((_, volumes), shows) in round.volumes.iter().zip(&shows) {
                    for (volume, _) in volumes.iter().zip(shows).filter(|(_, shows)| **shows) {
                        claimed += 1;
                        wrong += usize::from(!round.is_unoccluded(volume));
                    }
                    cases += volumes.len();
                }
            }
        }
        eprintln!("K = {margin}, {coverage:?}: {cases} cases, {claimed} claimed, {wrong} false");
        wrong
    };
    for coverage in [Coverage::Area, Coverage::Sample] {
        assert_eq!(false_claims(67, 2, ERROR_ULPS as f32, coverage), 0);
    }
    assert!(false_claims(68, 3, 1.0, Coverage::Area) > 0);
}

/// How many of those that are exactly unoccluded are found.
/// Spheres before, behind and in front of a wavy wall, which fills a part of the image.
#[test]
fn most_of_what_is_unoccluded_is_found() {
    let random = &mut Random(69);
    let camera = camera_along_z(160, 90, DepthConvention::Reversed);
    let view = View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: 160,
        height: 90,
        reversed: true,
    };
    let depth: Vec<f32> = (0..90)
        .flat_map(|y| (0..160).map(move |x| (f64::from(x), f64::from(y))))
        .map(|(x, y)| {
            let wave = 20.0 + 8.0 * (0.13 * x).sin() * (0.21 * y).cos();
            if y < 25.0 { 0.0 } else { (1.0 / wave) as f32 }
        })
        .collect();
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    for _ in 0..3000 {
        let z = random.range(2.0, 30.0);
        centers.extend([z * random.range(-1.0, 1.0), z * random.range(-1.0, 1.0), z]);
        radii.push(random.range(0.01, 0.6));
    }
    let volumes: Vec<Volume> = (0..radii.len())
        .map(|i| Volume::Sphere {
            center: [centers[3 * i], centers[3 * i + 1], centers[3 * i + 2]],
            radius: radii[i],
        })
        .collect();
    let exactly: Vec<bool> = volumes
        .iter()
        .map(|v| hiz_ref::is_unoccluded(&view, v, &depth, hiz_ref::Coverage::Area).unwrap())
        .collect();
    let count = exactly.iter().filter(|is| **is).count();
    let engine = engine();
    let both = PyramidOptions { depths: Depths::Both, ..PyramidOptions::default() };
    let image = engine.upload_depth(&depth, &camera).unwrap();
    let pyramid = engine.pyramid_with(&image, &both).unwrap();
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let mut shares = Vec::new();
    for descent in [0, 4096] {
        let options = CullOptions { descent, ..CullOptions::default() };
        let culling =
            engine.cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
        let found: Vec<bool> =
            culling.verdicts().unwrap().iter().map(|v| *v == Verdict::Unoccluded).collect();
        assert!(found.iter().zip(&exactly).all(|(found, is)| *is || !found), "a false answer");
        shares.push(found.iter().filter(|is| **is).count() as f64 / count as f64);
    }
    eprintln!("of {count} that are unoccluded: {shares:.3?} without and with a descent");
    assert!(count > 500 && shares[0] > 0.8 && shares[1] > 0.95);
}
