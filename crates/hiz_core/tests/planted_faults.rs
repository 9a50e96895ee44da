//! Faults planted into the shaders: each must turn the suite red.
//! If a fault stays green, a margin, a clamp or an order is not tested.

mod common;

#[path = "common/documented.rs"]
mod documented;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, Class, HEADER, MISSING_LEVELS, PLAIN, Report};
use common::{CONVENTIONS, Random, camera_along_z};
use documented::{assert_said, is_of_this_driver};
use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, BoundsKind, Coverage, CullOptions, DepthConvention, Fit, Floats, Footprint,
    InstanceOptions, Outputs,
};

fn faulty(faults: &[(&str, &str)]) -> Engine {
    Engine::with_planted_faults(None, faults).expect("the device tests need a Vulkan driver")
}

fn campaign(coverage: Coverage, modes: &'static [(Footprint, u32)]) -> Campaign {
    Campaign { seed: 21, rounds: 6, coverage, modes, ..Campaign::default() }
}

fn assert_red(name: &str, faults: &[(&str, &str)]) {
    assert_red_with(name, faults, PLAIN);
}

fn assert_red_with(name: &str, faults: &[(&str, &str)], modes: &'static [(Footprint, u32)]) {
    assert_report_red(name, &campaign(Coverage::Area, modes).run_until_red(&faulty(faults)));
}

fn assert_report_red(name: &str, report: &Report) {
    let total = report.total();
    let by_class: Vec<String> = report
        .classes
        .iter()
        .filter(|(_, t)| t.false_culls > 0)
        .map(|(class, t)| format!("{class:?} {}", t.false_culls))
        .collect();
    let (cases, false_culls) = (total.cases, total.false_culls);
    eprintln!("{name}: {false_culls} false culls in {cases} cases ({})", by_class.join(", "));
    assert!(false_culls > 0, "{name}: the campaign stayed green: {total:?}");
}

#[test]
fn without_faults_it_is_green() {
    for coverage in [Coverage::Area, Coverage::Sample] {
        assert_eq!(campaign(coverage, PLAIN).run(&faulty(&[])).total().false_culls, 0);
    }
}

/// The campaign's power.
/// Every class notices that there is no margin; all together notice that there is only a 48th.
#[test]
fn cuts_of_the_margin() {
    let is_documented = is_of_this_driver(&faulty(&[]));
    let mut reports = Vec::new();
    for (ulps, rounds) in [("0.0", 25), ("0.25", 10), ("0.5", 20)] {
        let margin = format!("ERROR_ULPS: f32 = {ulps}");
        let engine = faulty(&[("ERROR_ULPS: f32 = 24.0", &margin)]);
        let report = Campaign { seed: 22, rounds, ..Campaign::default() }.run(&engine);
        assert_report_red(&margin, &report);
        reports.push(report.clone());
        if ulps == "0.0" {
            eprintln!("{HEADER}\n{report}");
            let green: Vec<Class> = report
                .classes
                .iter()
                .filter(|(_, t)| t.false_culls == 0)
                .map(|(class, _)| *class)
                .collect();
            assert!(green.is_empty(), "no margin, and green: {green:?}");
        }
    }
    if is_documented {
        let all: Vec<String> = reports
            .iter()
            .map(|r| format!("{} of {}", r.total().false_culls, r.total().cases))
            .collect();
        assert_said(&format!("| **device**, of so many cases | {} |", all.join(" | ")));
        for (k, (class, tally)) in reports[0].classes.iter().enumerate() {
            let counts: Vec<String> =
                reports.iter().map(|r| r.classes[k].1.false_culls.to_string()).collect();
            assert_said(&format!("| {class:?} | {} | {} |", tally.cases, counts.join(" | ")));
        }
    }
}

/// The block's certificates along one axis, as the cull calls them.
const INSIDE_X: &str =
    "inside_block(x, w, ends_x, w_min, block.x, block.z, level, view.half_size.x, view.size.x)";
const INSIDE_Y: &str =
    "inside_block(y, w, ends_y, w_min, block.y, block.w, level, view.half_size.y, view.size.y)";

#[test]
fn a_level_too_fine_without_block_certificates() {
    let finer = (
        "return level + select(0u, 1u, (texels.x | texels.y) >= (1u << FOOTPRINT_LOG2));",
        "return level;",
    );
    assert_red("level", &[finer, (INSIDE_X, "true"), (INSIDE_Y, "true")]);
}

/// One texel of a level where two are spanned.
#[test]
fn a_single_texel_too_fine_without_block_certificates() {
    const ONE: &[(Footprint, u32)] = &[(Footprint::One, 0)];
    let finer = ("leading_bit(apart | 1u) + 1u", "leading_bit(apart | 1u)");
    let block = "let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));";
    let one = (block, "let t = (first >> vec2<u32>(level)).xyxy;");
    let faults = [finer, one, (INSIDE_X, "true"), (INSIDE_Y, "true")];
    assert_red_with("one texel", &faults, ONE);
}

#[test]
fn nearest_instead_of_farthest() {
    assert_red(
        "swap",
        &[("select(max(a, b), min(a, b), REVERSED)", "select(min(a, b), max(a, b), REVERSED)")],
    );
}

/// The mean of two depths instead of the farthest.
/// It is planted where a footprint is read, and where four pixels are read.
#[test]
fn a_mean_instead_of_the_farthest() {
    const FOUR: &[(Footprint, u32)] = &[(Footprint::Four, 0)];
    let mean =
        |a: &str, b: &str| format!("bitcast<u32>(0.5 * (bitcast<f32>({a}) + bitcast<f32>({b})))");
    let texels = format!("bits = {};", mean("bits", "here"));
    assert_red_with("mean of a footprint", &[("bits = farthest(bits, here);", &texels)], FOUR);
    let (standard, reversed) = (
        mean("greatest", "min(min(v.x, v.y), min(v.z, v.w))"),
        "(max(below_one.x, below_one.y) / 2u)",
    );
    assert_red(
        "mean of four",
        &[(
            "select(greatest, u32(max(greatest_signed, 0))",
            &format!("select({standard}, u32(max(greatest_signed, 0))"),
        )],
    );
    assert_red(
        "mean of four, reversed",
        &[("max(max(below_one.x, below_one.y), max(below_one.z, below_one.w))", reversed)],
    );
}

/// Which of four slanted plates are culled by their own fit.
/// Each is nearest at one end: left, right, top or bottom.
/// That end is half a pixel inside the pixel where it begins.
/// A tenth of a pixel of it is nearer than the wall, so the plate has to be kept.
fn culled_slanted_plates(faults: &[(&str, &str)]) -> [bool; 4] {
    let engine = faulty(faults);
    // At depth 8 a pixel is a unit.
    // A tenth of a pixel from such an end a plate is at depth 8.1, and two tenths from it at 8.2.
    let camera = camera_along_z(16, 16, DepthConvention::Reversed);
    let image = engine.upload_depth(&[1.0 / 8.1; 256], &camera).unwrap();
    let pyramid = engine.pyramid(&image).unwrap();
    let options = CullOptions { fit: Fit::Volume, descent: 4096, ..CullOptions::default() };
    let c = 0.5_f64.sqrt();
    // Rows run downwards.
    // The top's end is at y = -1/2, half a pixel below a border, and extends downwards.
    [(0, 1.0), (0, -1.0), (1, -1.0), (1, 1.0)].map(|(axis, sign)| {
        let (mut along, mut across, mut end) =
            ([0.0, 0.0, c], [0.0, 0.0, -sign * c], [0.0, 0.0, 8.0]);
        (along[axis], across[axis], end[axis]) = (sign * c, c, 0.5 * sign);
        let mut beside = [1.0, 1.0, 0.0];
        beside[axis] = 0.0;
        let center: Vec<f64> = end.iter().zip(&along).map(|(e, a)| e + a).collect();
        let rotation: Vec<f64> = (0..3).flat_map(|k| [along[k], beside[k], across[k]]).collect();
        let bounds = Bounds::OrientedBoxes {
            centers: Floats::F64(&center),
            half_sizes: Floats::F64(&[1.0, 0.3, 0.02]),
            rotations: Floats::F64(&rotation),
        };
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        let culling =
            engine.cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
        !culling.mask().unwrap()[0]
    })
}

/// The sides of a volume fit's rectangle.
/// Guesses that are a fifth of a pixel too far inside are harmless: certificates refuse them.
/// Without the certificates they cut off something visible.
/// See `proved_ends` in `shaders/cull/supporting_planes.wgsl`.
#[test]
fn sides_of_a_volumes_rectangle_are_proved() {
    let low = ("guess.x - widened", "guess.x - widened + 0.2");
    let high = ("guess.y + widened", "guess.y + widened - 0.2");
    let unproved_low = ("select(-BEYOND, low, surely_above(r, low, w))", "low");
    let unproved_high = ("select(BEYOND, high, surely_below(r, high, w))", "high");
    assert_eq!(culled_slanted_plates(&[]), [false; 4]);
    assert_eq!(culled_slanted_plates(&[low, high]), [false; 4]);
    assert_eq!(culled_slanted_plates(&[low, unproved_low]), [true, false, true, false]);
    assert_eq!(culled_slanted_plates(&[high, unproved_high]), [false, true, false, true]);
}

#[test]
fn a_depth_certificate_at_the_centre_alone() {
    assert_red(
        "depth",
        &[
            ("surely_above(z, t, w)", "z.center - t * w.center > 0.0"),
            ("surely_below(z, t, w)", "z.center - t * w.center < 0.0"),
        ],
    );
}

#[test]
fn a_rectangle_that_is_too_small_without_block_certificates() {
    // The rectangle alone, not widened: the certificates are there for its edges.
    let unwidened =
        ["below", "above"].map(|end| (format!("(extent.{end} * per_w + rounding)"), "view.reach"));
    let [low, high] = unwidened.each_ref().map(|(what, by)| (what.as_str(), *by));
    assert_red("rectangle", &[low, high, (INSIDE_X, "true"), (INSIDE_Y, "true")]);
}

/// The amount that the rectangle is widened by besides its own error.
const WIDENING: &str = "let rounding = WIDENING_ULPS * EPS * half_size + view.reach;";
/// A rectangle 0.7 pixels too small on each side.
const TOO_SMALL: (&str, &str) =
    (WIDENING, "let rounding = WIDENING_ULPS * EPS * half_size + view.reach - 0.7;");

/// The rectangle only chooses what is certified.
/// Where it is wrong, less is culled, and nothing is culled wrongly.
/// The level that follows from it is not a heuristic but integer arithmetic.
/// Only in a 2 x 2 footprint are the four corners all texels.
#[test]
fn a_rectangle_that_is_too_small_is_harmless() {
    for coverage in [Coverage::Area, Coverage::Sample] {
        let total = campaign(coverage, PLAIN).run(&faulty(&[TOO_SMALL])).total();
        assert!(total.false_culls == 0 && total.culled > total.cases / 20, "{total:?}");
    }
}

/// Each of the block's four certificates is needed to make it harmless.
#[test]
fn each_block_certificate_is_needed() {
    for gone in [
        (
            "(lo == 0u | surely_after(r, w, extent, f32(begin) + view.reach - half_size, w_min))",
            "true",
        ),
        (
            "(end >= size | surely_before(r, w, extent, f32(end) - view.reach - half_size, w_min))",
            "true",
        ),
        (INSIDE_X, "true"),
        (INSIDE_Y, "true"),
    ] {
        let classes = &[Class::PixelBorders, Class::Grazing, Class::Holes];
        let campaign = Campaign { seed: 23, rounds: 8, classes, ..Campaign::default() };
        assert_report_red(gone.0, &campaign.run_until_red(&faulty(&[TOO_SMALL, gone])));
    }
}

/// The rectangle's own edges certify a descent, and the end of its budget decides nothing.
#[test]
fn a_descent_without_its_certificates_or_past_its_budget() {
    let (x, y) = ((INSIDE_X, "true"), (INSIDE_Y, "true"));
    let unfinished =
        ("if left == 0u {\n            return false;", "if left == 0u {\n            return true;");
    for (name, faults, modes) in [
        ("descent, columns", &[TOO_SMALL, x][..], &[(Footprint::Two, 4096)]),
        ("descent, rows", &[TOO_SMALL, y][..], &[(Footprint::Two, 4096)]),
        ("descent, budget", &[unfinished][..], &[(Footprint::Two, 1)]),
    ] {
        let classes = &[Class::PixelBorders, Class::Grazing, Class::Holes];
        let campaign = Campaign { seed: 24, rounds: 8, classes, modes, ..Campaign::default() };
        assert_report_red(name, &campaign.run_until_red(&faulty(faults)));
    }
}

/// Whether any of four boxes beside a hole is culled, with a guard of half a pixel.
/// They are a quarter of a pixel away from it: left, right, above and below.
fn culls_within_the_guard(engine: &Engine) -> bool {
    let camera = camera_along_z(16, 16, DepthConvention::Reversed);
    let options = CullOptions { guard_px: Some(0.5), ..CullOptions::default() };
    // At depth 8 a pixel is a unit wide; column 8 is x in 0..1, and row 8 is y in -1..0.
    let (low, high) = ([-1.25, -0.25], [1.25, 2.25]);
    [(0, low), (0, high), (1, low.map(|v: f64| -v)), (1, high.map(|v| -v))].into_iter().any(
        |(axis, span)| {
            let mut depth = [0.25; 256];
            for i in 0..16 {
                depth[if axis == 0 { 16 * i + 8 } else { 128 + i }] = 0.0;
            }
            let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
            let (mut min, mut max) = ([-0.4, -0.4, 8.0], [0.4, 0.4, 8.0]);
            (min[axis], max[axis]) = (span[0].min(span[1]), span[0].max(span[1]));
            let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
            let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
            !engine
                .cull(&instances, &camera, &pyramid, &options, &Outputs::default())
                .unwrap()
                .mask()
                .unwrap()[0]
        },
    )
}

/// The guard in the block's certificates.
/// The rectangle is widened by it, too, so in area coverage no input tests only the certificates.
/// With a rectangle that forgets the guard they have to keep what is within it.
/// In sample coverage the same terms decide what is *culled*: see `outcomes.rs`.
#[test]
fn the_guard_stands_in_the_block_certificates_too() {
    let forgetful = (WIDENING, "let rounding = WIDENING_ULPS * EPS * half_size;");
    assert!(!culls_within_the_guard(&faulty(&[])));
    assert!(!culls_within_the_guard(&faulty(&[forgetful])));
    for sign in [
        ("f32(begin) + view.reach - half_size", "f32(begin) - view.reach - half_size"),
        ("f32(end) - view.reach - half_size", "f32(end) + view.reach - half_size"),
    ] {
        assert!(culls_within_the_guard(&faulty(&[forgetful, sign])), "{sign:?} stayed green");
    }
}

#[test]
fn a_descent_that_forgets_a_column() {
    let faults = [
        ("if (at.x & last_child) < last_child && at.x < last.x {", "if false {"),
        ("let right = siblings(at.x, end.x);", "let right = 0u;"),
    ];
    for fault in faults {
        assert_red_with("descent", &[fault], &[(Footprint::Two, 4096)]);
    }
}

/// A level that is too fine for a rectangle, or that is not stored.
/// Also a descent past missing levels that forgets children.
#[test]
fn wrong_levels_where_some_are_missing() {
    let chosen = "select(clamp(level, first_stored, last_stored), 0u, level == 0u)";
    for (what, by, modes) in [
        ("let fits = finest <= last_stored;", "let fits = true;", PLAIN),
        (chosen, "select(first_stored, 0u, level == 0u)", PLAIN),
        (chosen, "select(clamp(level - 1u, first_stored, last_stored), 0u, level <= 1u)", PLAIN),
        (chosen, "level", PLAIN),
        (
            "let last_child = (1u << first_stored) - 1u;",
            "let last_child = 1u;",
            &[(Footprint::Two, 4096)],
        ),
        ("select(1u, level, level <= first_stored)", "1u", &[(Footprint::Two, 4096)]),
    ] {
        let campaign =
            Campaign { seed: 25, rounds: 8, modes, levels: MISSING_LEVELS, ..Campaign::default() };
        let report = campaign.run_until_red(&faulty(&[(what, by)]));
        assert_report_red(&format!("{what} -> {by}"), &report);
    }
}

#[test]
fn texels_clamped_one_off() {
    assert_red(
        "clamp",
        &[
            ("clamp(floor(high), -1.0, edge - 1.0)", "clamp(floor(high), -1.0, edge - 2.0)"),
            ("end >= size |", "end >= size - 1 |"),
        ],
    );
}

/// The claims that the cheaper certificates rely on, each taken away.
#[test]
fn claims_of_the_extent_and_the_sizes() {
    let support = "support(r.half - low * w.half) - (r.center - low * w.center)";
    let other_support = "support(r.half - high * w.half) + (r.center - high * w.center)";
    let beyond = "surely_above(Value(side * r.center, r.error, side * r.half), t, w)";
    let least_w = "w.center - support(w.half) - error_bound(w, 0.0, w)";
    let faults: [(&str, &[(&str, &str)]); 5] = [
        // Needed where the farthest corner for the centre's ratio is not the extreme one.
        (
            "extent, no support",
            &[
                (support, "-(r.center - low * w.center)"),
                (other_support, "(r.center - high * w.center)"),
            ],
        ),
        (
            "extent, no margin",
            &[
                ("+ error_bound(r, low, w), 0.0)", ", 0.0)"),
                ("+ error_bound(r, high, w), 0.0)", ", 0.0)"),
            ],
        ),
        ("least w, no support", &[(least_w, "w.center - error_bound(w, 0.0, w)")]),
        (
            "frustum, half mirrored",
            &[(beyond, "surely_above(Value(side * r.center, r.error, r.half), t, w)")],
        ),
        (
            "another row's margin",
            &[("value_of(view.x, errors.x, volume)", "value_of(view.x, errors.z, volume)")],
        ),
    ];
    for (name, faults) in faults {
        let campaign = Campaign { seed: 25, rounds: 12, ..Campaign::default() };
        assert_report_red(name, &campaign.run_until_red(&faulty(faults)));
    }
}

/// The constants' share of a margin covers what float64 lost in them.
/// That is much where they cancel at a distant eye.
#[test]
fn margins_count_the_constants() {
    let fault = (
        "(volume.size * view.magnitudes + view.constant_magnitudes)",
        "(volume.size * view.magnitudes)",
    );
    let campaign =
        Campaign { seed: 38, rounds: 60, classes: &[Class::BareMatrix], ..Campaign::default() };
    assert_report_red("no constants", &campaign.run_until_red(&faulty(&[fault])));
}

/// Pixels of level 0 are gathered four at a time.
/// Those outside a narrower rectangle are replaced.
/// Left in, they only cost culls; taken in another order, they cause false culls.
#[test]
fn gathered_pixels_beside_the_rectangle() {
    let run = |faults: &[(&str, &str)]| campaign(Coverage::Area, PLAIN).run(&faulty(faults));
    let left_in = [
        ("select(pixels.xxzz, pixels, t.x < t.z)", "pixels"),
        ("select(columns.xyxy, columns, t.y < t.w)", "columns"),
    ];
    let (without, with) = (run(&[]).total(), run(&left_in).total());
    eprintln!("gathered: {} culled, with their neighbours {}", without.culled, with.culled);
    assert!(with.false_culls == 0 && with.culled < without.culled, "{with:?}");
    assert_red("gather", &[(".wzxy;", ";")]);
}

/// In an atlas four texels of a row are read at a time.
#[test]
fn atlas_texels_beside_the_right_ones() {
    for (what, by) in [
        ("textureLoad(atlas, at.zy)[right]", "textureLoad(atlas, at.zy)[left]"),
        ("textureLoad(atlas, at.xw)[left]", "textureLoad(atlas, at.xy)[left]"),
        ("let at = origin.xyxy", "let at = pyramid.origins[0].xyxy"),
    ] {
        assert_red("atlas", &[(what, by)]);
    }
}

/// Uploads hold four pixels of a row per texel, and a rectangle's corner is one of them.
#[test]
fn uploaded_pixels_beside_the_right_ones() {
    for (what, by) in [
        ("textureLoad(source, texel.zy)[right]", "textureLoad(source, texel.zy)[left]"),
        ("textureLoad(source, texel.xw)[left]", "textureLoad(source, texel.xy)[left]"),
    ] {
        assert_red("uploads", &[(what, by)]);
    }
}

/// Faults in groups only.
/// Bounds that are boxes are left out where a fault would reach them, too.
#[test]
fn groups_that_forget_members_or_shrink() {
    const ALL: &[BoundsKind] = &campaign::KINDS;
    const OTHERS: &[BoundsKind] = &[BoundsKind::Sphere, BoundsKind::OrientedBox];
    let half = "let half = bitcast<vec3<f32>>(record_texel(i, 2u).xyz);";
    for (name, fault, kinds) in [
        (
            "a box a little too small",
            (half, "let half = 0.9999 * bitcast<vec3<f32>>(record_texel(i, 2u).xyz);"),
            OTHERS,
        ),
        (
            "the next group's members",
            ("survivor_position(slot)).x, lane", "survivor_position(slot)).x + 1u, lane"),
            ALL,
        ),
        (
            "a survivor's slot one off",
            (
                "textureStore(survivor_list, survivor_position(slot)",
                "textureStore(survivor_list, survivor_position(slot + 1u)",
            ),
            ALL,
        ),
        ("a workgroup too few", ("RUN, TIER == 0u) == 0u", "RUN, TIER == 0u) == 1u"), ALL),
        ("groups of 32, which", ("group * GROUP + share", "group * 32u + share"), ALL),
        ("half of the shares", ("lane % SHARE", "lane % 4u"), ALL),
    ] {
        let campaign = Campaign {
            seed: 26,
            rounds: 3,
            volumes: 12,
            kinds,
            groups: true,
            ..Campaign::default()
        };
        assert_report_red(name, &campaign.run_until_red(&faulty(&[fault])));
    }
}

/// Verdicts of the members of hidden groups, which are worked out when they are read.
#[test]
fn refined_verdicts() {
    let run = |faults: &[(&str, &str)]| {
        const KIND: &[BoundsKind] = &[BoundsKind::Sphere];
        let campaign = Campaign {
            seed: 26,
            rounds: 2,
            volumes: 12,
            kinds: KIND,
            groups: true,
            ..Campaign::default()
        };
        let green = |report: &Report| report.tested.contradictions == 0;
        campaign.run_while(&faulty(faults), green).tested.contradictions
    };
    assert_eq!(run(&[]), 0);
    for (name, (what, by)) in [
        ("groups of 32", ("let first = group * GROUP;", "let first = group * 32u;")),
        ("half of the members", ("let end = min(first + GROUP,", "let end = min(first + 32u,")),
        ("the group's verdict for all", ("classify(place).verdict == OUTSIDE", "false")),
        ("nobody is occluded", ("if classify(place).verdict == OUTSIDE", "if may_be_outside")),
        ("all are within the view", ("if is_within(group)", "if true")),
    ] {
        let contradictions = run(&[(what, by)]);
        eprintln!("{name}: {contradictions} contradictions");
        assert!(contradictions > 0, "{name}: {what} -> {by}");
    }
}

/// Faults of the reduction, seen in the pyramid itself.
#[test]
fn dropped_rows_and_columns() {
    for (what, by) in [
        // The last row of an odd level.
        // Then the last columns, where a block reaches past the row's padding.
        ("min(2u * y + 1u, level.height - 1u)", "min(2u * y, level.height - 1u)"),
        ("let right = min(BLOCK * x + VECTOR, last);", "let right = left;"),
        ("vec2<u32>(2u * x + 1u, 2u * y + 1u)", "vec2<u32>(2u * x, 2u * y + 1u)"),
        ("f32(2u * x + 1u)", "f32(min(2u * x + 1u, textureDimensions(source).x - 2u))"),
        ("f32(2u * y + 1u)", "f32(min(2u * y + 1u, textureDimensions(source).y - 2u))"),
        // Depth whose bits are no valid depth.
        ("most > ONE_BITS - LEAST_NORMAL_BITS", "most > ONE_BITS"),
        ("greatest == NEGATIVE_ZERO_BITS", "false"),
        ("bits < LEAST_NORMAL_BITS);\n}\n", "false);\n}\n"),
    ] {
        let engine = faulty(&[(what, by)]);
        let mut random = Random(5);
        let (width, height) = (37, 29);
        // Some blocks have one kind of number only.
        // Elsewhere a number that is nearer than the block's other depths would not show.
        let odd = [-0.0, 1e-40, f32::MIN_POSITIVE];
        let depth: Vec<f32> = (0..width * height)
            .map(|i| if i / 4 % 5 == 0 { odd[(i / 4 % 3) as usize] } else { random.unit() as f32 })
            .collect();
        let mut red = false;
        for convention in CONVENTIONS {
            let camera = camera_along_z(width, height, convention);
            let expected = hiz_ref::pyramid(&depth, width, height, convention.is_reversed());
            for image in
                [engine.upload_depth(&depth, &camera), engine.upload_depth_sampled(&depth, &camera)]
            {
                let pyramid = engine.pyramid(&image.unwrap()).unwrap();
                for (k, level) in (0..).zip(&expected) {
                    red |= engine.read_level(&pyramid, k).unwrap() != level.texels;
                }
            }
        }
        assert!(red, "{what} -> {by}: the pyramid stayed the same");
    }
}
