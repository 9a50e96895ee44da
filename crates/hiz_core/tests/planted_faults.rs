//! Faults planted into the shaders: each must turn the suite red. A fault that stays green means that a margin, a clamp or an
//! order is not tested.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, Class, HEADER, PLAIN, Report};
use common::{CONVENTIONS, Random, camera_along_z};
use hiz_core::headless::Engine;
use hiz_core::{Bounds, Coverage, CullOptions, DepthConvention, Floats, Footprint, InstanceOptions, VisibleOptions};

fn faulty(faults: &[(&str, &str)]) -> Engine {
    Engine::with_planted_faults(None, faults).expect("the device tests need a Vulkan driver")
}

fn campaign(faults: &[(&str, &str)], coverage: Coverage, modes: &'static [(Footprint, u32)]) -> Report {
    Campaign { seed: 21, rounds: 6, coverage, modes, ..Campaign::default() }.run(&faulty(faults))
}

fn assert_red(name: &str, faults: &[(&str, &str)]) {
    assert_red_with(name, faults, PLAIN);
}

fn assert_red_with(name: &str, faults: &[(&str, &str)], modes: &'static [(Footprint, u32)]) {
    assert_report_red(name, &campaign(faults, Coverage::Area, modes));
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
        assert_eq!(campaign(&[], coverage, PLAIN).total().false_culls, 0);
    }
}

/// The campaign's power: every class finds that there is no margin, and all together that there is a 48th of it.
#[test]
fn cuts_of_the_margin() {
    for (ulps, rounds) in [("0.0", 25), ("0.25", 10), ("0.5", 20)] {
        let margin = format!("ERROR_ULPS: f32 = {ulps}");
        let engine = faulty(&[("ERROR_ULPS: f32 = 24.0", &margin)]);
        let report = Campaign { seed: 22, rounds, ..Campaign::default() }.run(&engine);
        assert_report_red(&margin, &report);
        if ulps == "0.0" {
            eprintln!("{HEADER}\n{report}");
            let green: Vec<Class> =
                report.classes.iter().filter(|(_, t)| t.false_culls == 0).map(|(class, _)| *class).collect();
            assert!(green.is_empty(), "no margin, and green: {green:?}");
        }
    }
}

#[test]
fn a_level_too_fine_without_block_certificates() {
    assert_red(
        "level",
        &[
            ("level += 1u;", ""),
            ("if hidden && inside_block(x, w, block.x, block.z, level, view.half_size.x, view.size.x)", "if hidden"),
            ("&& inside_block(y, w, block.y, block.w, level, view.half_size.y, view.size.y)", ""),
        ],
    );
}

#[test]
fn nearest_instead_of_farthest() {
    assert_red("swap", &[("select(max(a, b), min(a, b), REVERSED)", "select(min(a, b), max(a, b), REVERSED)")]);
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
    // The rectangle alone, unwidened: the edges are what certificates are for.
    assert_red(
        "rectangle",
        &[
            (
                "1.25 * error_bound(r, max(abs(interval.x), abs(interval.y)), w) / w_min + 4.0 * EPS * half_size + view.reach",
                "view.reach",
            ),
            ("if hidden && inside_block(x, w, block.x, block.z, level, view.half_size.x, view.size.x)", "if hidden"),
            ("&& inside_block(y, w, block.y, block.w, level, view.half_size.y, view.size.y)", ""),
        ],
    );
}

/// A rectangle 0.7 pixels too small on each side.
const TOO_SMALL: (&str, &str) =
    ("+ 4.0 * EPS * half_size + view.reach;", "+ 4.0 * EPS * half_size + view.reach - 0.7;");

/// The rectangle only chooses what is certified: where it is wrong, less is culled and nothing wrongly. (The level that follows
/// from it is integer arithmetic, and no heuristic: four corners are all texels of a 2 x 2 footprint only.)
#[test]
fn a_rectangle_that_is_too_small_is_harmless() {
    for coverage in [Coverage::Area, Coverage::Sample] {
        let total = campaign(&[TOO_SMALL], coverage, PLAIN).total();
        assert!(total.false_culls == 0 && total.culled > total.cases / 20, "{total:?}");
    }
}

/// Each of the block's four certificates is what makes it harmless.
#[test]
fn each_block_certificate_is_needed() {
    for gone in [
        ("(lo == 0u || surely_above(r, f32(begin) + view.reach - half_size, w))", "true"),
        ("(end >= size || surely_below(r, f32(end) - view.reach - half_size, w))", "true"),
        ("inside_block(x, w, block.x, block.z, level, view.half_size.x, view.size.x)", "true"),
        ("inside_block(y, w, block.y, block.w, level, view.half_size.y, view.size.y)", "true"),
    ] {
        let classes = &[Class::PixelBorders, Class::Grazing, Class::Holes];
        let campaign = Campaign { seed: 23, rounds: 8, classes, ..Campaign::default() };
        assert_report_red(gone.0, &campaign.run(&faulty(&[TOO_SMALL, gone])));
    }
}

/// A descent is certified by the rectangle's own edges, and its budget's end decides nothing.
#[test]
fn a_descent_without_its_certificates_or_past_its_budget() {
    let (x, y) = (
        ("inside_block(x, w, block.x, block.z, level, view.half_size.x, view.size.x)", "true"),
        ("inside_block(y, w, block.y, block.w, level, view.half_size.y, view.size.y)", "true"),
    );
    let unfinished = ("if left == 0u {\n            return false;", "if left == 0u {\n            return true;");
    for (name, faults, modes) in [
        ("descent, columns", &[TOO_SMALL, x][..], &[(Footprint::Two, 4096)]),
        ("descent, rows", &[TOO_SMALL, y][..], &[(Footprint::Two, 4096)]),
        ("descent, budget", &[unfinished][..], &[(Footprint::Two, 1)]),
    ] {
        let classes = &[Class::PixelBorders, Class::Grazing, Class::Holes];
        let campaign = Campaign { seed: 24, rounds: 8, classes, modes, ..Campaign::default() };
        assert_report_red(name, &campaign.run(&faulty(faults)));
    }
}

/// Boxes a quarter of a pixel beside a hole, left, right, above and below of it, with half a pixel of guard: are any culled?
fn culls_within_the_guard(engine: &Engine) -> bool {
    let camera = camera_along_z(16, 16, DepthConvention::Reversed);
    let options = CullOptions { guard_px: Some(0.5), ..CullOptions::default() };
    // At depth 8 a pixel is a unit wide; column 8 is x in 0..1, and row 8 is y in -1..0.
    let (low, high) = ([-1.25, -0.25], [1.25, 2.25]);
    [(0, low), (0, high), (1, low.map(|v: f64| -v)), (1, high.map(|v| -v))].into_iter().any(|(axis, span)| {
        let mut depth = [0.25; 256];
        for i in 0..16 {
            depth[if axis == 0 { 16 * i + 8 } else { 128 + i }] = 0.0;
        }
        let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
        let (mut min, mut max) = ([-0.4, -0.4, 8.0], [0.4, 0.4, 8.0]);
        (min[axis], max[axis]) = (span[0].min(span[1]), span[0].max(span[1]));
        let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        !engine.cull(&instances, &camera, &pyramid, &options, &VisibleOptions::default()).unwrap().mask().unwrap()[0]
    })
}

/// The guard in the block's certificates. The rectangle is widened by it as well, so that in area coverage no input reaches them
/// alone; with a rectangle that forgets the guard they have to keep what lies within it. (In sample coverage the same terms decide
/// what is *culled*: `outcomes.rs`.)
#[test]
fn the_guard_stands_in_the_block_certificates_too() {
    let forgetful = ("+ 4.0 * EPS * half_size + view.reach;", "+ 4.0 * EPS * half_size;");
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
    let fault = ("if at.x % 2u == 0u && at.x < end.x {", "if false {");
    assert_red_with("descent", &[fault], &[(Footprint::Two, 4096)]);
}

#[test]
fn texels_clamped_one_off() {
    assert_red(
        "clamp",
        &[("clamp(last, -1, size - 1)", "clamp(last, -1, size - 2)"), ("end >= size ||", "end >= size - 1 ||")],
    );
}

/// Reduction faults, seen by the pyramid itself.
#[test]
fn dropped_rows_and_columns() {
    for (what, by) in [
        // The last column or row of an odd level: the neighbour before it is read twice.
        ("min(2u * x + 1u, level.width - 1u)", "min(2u * x, level.width - 1u)"),
        ("min(2u * y + 1u, level.height - 1u)", "min(2u * y, level.height - 1u)"),
        ("f32(2u * x + 1u)", "f32(min(2u * x + 1u, textureDimensions(source).x - 2u))"),
        ("f32(2u * y + 1u)", "f32(min(2u * y + 1u, textureDimensions(source).y - 2u))"),
    ] {
        let engine = faulty(&[(what, by)]);
        let mut random = Random(5);
        let (width, height) = (37, 29);
        let depth: Vec<f32> = (0..width * height).map(|_| random.unit() as f32).collect();
        let mut red = false;
        for convention in CONVENTIONS {
            let image = engine.upload_depth(&depth, &camera_along_z(width, height, convention)).unwrap();
            let pyramid = engine.pyramid(&image).unwrap();
            for (k, level) in hiz_ref::pyramid(&depth, width, height, convention.is_reversed()).iter().enumerate() {
                red |= engine.read_level(&pyramid, k as u32).unwrap() != level.texels;
            }
        }
        assert!(red, "{what} -> {by}: the pyramid stayed the same");
    }
}
