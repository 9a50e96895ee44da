//! Counts of pixels against the exact oracle, on scenes that are made to be nearly wrong.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, KINDS, Round};
use common::{CONVENTIONS, camera_along_z, engine, ndc, soak_times};
use hiz_core::headless::Engine;
use hiz_core::{
    Bounds, BoundsKind, Coverage, CullOptions, DepthConvention, Depths, Fit, Floats, Hierarchy,
    InstanceOptions, Outputs, PixelCounts, PyramidOptions,
};
use hiz_ref::{PixelTruth, Volume, pixel_truth};

const PIXELS: Outputs = Outputs { pixels: true, ..Outputs::NONE };

/// What is wrong with counts; `None`: nothing.
fn contradiction(counts: &PixelCounts, truth: &PixelTruth, image: u32) -> Option<&'static str> {
    let PixelCounts { touched, hidden, inside, open, undecided } = *counts;
    if hidden.checked_add(inside).and_then(|sum| sum.checked_add(open)) != Some(touched) {
        Some("touched is no sum")
    } else if touched > image || undecided > inside {
        Some("more than there are")
    } else if touched < truth.touched {
        Some("a touched pixel is not counted")
    } else if touched - hidden < truth.shown {
        Some("a pixel that shows counts as hidden")
    } else if touched - open < truth.not_open {
        Some("a pixel that is not open counts as open")
    } else if inside < truth.inside {
        Some("a pixel counts as inside too rarely")
    } else {
        None
    }
}

fn coverage_of(coverage: Coverage) -> hiz_ref::Coverage {
    match coverage {
        Coverage::Area => hiz_ref::Coverage::Area,
        Coverage::Sample => hiz_ref::Coverage::Sample,
    }
}

#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    hidden: u64,
    open: u64,
    inside: u64,
    /// Exactly inside; what float32 leaves open comes on top.
    must_be_inside: u64,
    touched: u64,
    must_be_touched: u64,
    contradictions: usize,
}

impl Tally {
    fn add(&mut self, round: &Round, volume: &Volume, counts: &PixelCounts) {
        let image = round.view.width * round.view.height;
        let coverage = coverage_of(round.options.coverage);
        let truth = pixel_truth(&round.view, volume, &round.depth, coverage).expect("a view");
        self.cases += 1;
        if let Some(what) = contradiction(counts, &truth, image) {
            if self.contradictions == 0 {
                eprintln!("{what}: {counts:?} {truth:?} {volume:?} {:?}", round.view);
            }
            self.contradictions += 1;
        }
        if counts.is_decided() {
            self.hidden += u64::from(counts.hidden);
            self.open += u64::from(counts.open);
            self.inside += u64::from(counts.inside);
            self.must_be_inside += u64::from(truth.inside);
            self.touched += u64::from(counts.touched);
            self.must_be_touched += u64::from(truth.touched);
        }
    }
}

/// The counts of the volumes of a round; `None` for a camera that float32 cannot hold.
fn counts_of(engine: &Engine, round: &Round, budget: Option<u32>) -> Vec<Option<Vec<PixelCounts>>> {
    // Every other pyramid has both ends, so that a coarse texel decides open pixels, too.
    let depths = if round.number.is_multiple_of(2) { Depths::Both } else { Depths::Farthest };
    let options = PyramidOptions { depths, ..round.pyramid_options(engine) };
    let pyramid = engine.pyramid_with(&round.upload(engine), &options).expect("a pyramid");
    let of_kind = |(kind, volumes): &(BoundsKind, Vec<Volume>)| {
        let arrays = campaign::Arrays::new(volumes);
        let bounds = arrays.bounds(*kind);
        let instances = engine.instances(&bounds, &InstanceOptions::default()).expect("upload");
        let outputs = Outputs { pixel_budget: budget, ..PIXELS };
        let culling =
            engine.cull(&instances, &round.camera, &pyramid, &round.options, &outputs).ok()?;
        Some(culling.pixels().expect("counts"))
    };
    round.volumes.iter().map(of_kind).collect()
}

fn run(engine: &Engine, rounds: impl Iterator<Item = Round>, budget: Option<u32>) -> Tally {
    let mut tally = Tally::default();
    for round in rounds {
        let counts = counts_of(engine, &round, budget);
        for ((_, volumes), counts) in round.volumes.iter().zip(counts) {
            for (volume, counts) in volumes.iter().zip(counts.iter().flatten()) {
                tally.add(&round, volume, counts);
            }
        }
    }
    tally
}

/// Whether some count of these rounds contradicts the oracle.
fn is_red(engine: &Engine, mut rounds: impl Iterator<Item = Round>, budget: Option<u32>) -> bool {
    rounds.any(|round| run(engine, std::iter::once(round), budget).contradictions > 0)
}

fn campaign(seed: u64, rounds: usize, coverage: Coverage) -> Campaign {
    Campaign { seed, rounds, volumes: 4, coverage, fit: Fit::Volume, ..Campaign::default() }
}

#[test]
fn no_count_contradicts_the_oracle() {
    for (seed, coverage) in [(71, Coverage::Area), (72, Coverage::Sample)] {
        let rounds = campaign(seed, soak_times(), coverage).fitted(&KINDS, false);
        let fitted = run(&engine(), rounds, None);
        eprintln!("{coverage:?}, depth that fits: {fitted:?}");
        assert_eq!(fitted.contradictions, 0);
        assert!(fitted.hidden > 0 && fitted.open > 0 && fitted.inside > 0, "{fitted:?}");
        // Most that can be decided is, although the scenes are made to be nearly undecidable.
        assert!(fitted.inside < fitted.must_be_inside + fitted.touched / 4 * 3, "{fitted:?}");
        let small = |round: &Round| round.view.width * round.view.height <= 4096;
        let some = Campaign { volumes: 2, ..campaign(seed + 10, soak_times(), coverage) };
        let rounds = some.rounds().filter(small);
        let loose = run(&engine(), rounds, None);
        eprintln!("{coverage:?}, campaign: {loose:?}");
        assert_eq!(loose.contradictions, 0);
    }
}

#[test]
fn every_budget_leaves_an_upper_bound() {
    for budget in [1, 20] {
        let tally = run(
            &engine(),
            campaign(73, soak_times(), Coverage::Area)
                .fitted(&KINDS, false)
                .take(40 * soak_times()),
            Some(budget),
        );
        assert_eq!(tally.contradictions, 0, "{budget}");
    }
}

#[test]
fn pyramids_without_some_levels_count_the_same() {
    for levels in campaign::MISSING_LEVELS {
        let rounds = campaign(74, 1, Coverage::Area)
            .fitted(&KINDS, false)
            .take(40)
            .map(|round| Round { levels: *levels, ..round });
        assert_eq!(run(&engine(), rounds, None).contradictions, 0, "{levels:?}");
    }
}

/// Boxes whose numbers are worked out by hand, on an image of 64x64 pixels.
#[test]
fn counts_worked_out_by_hand() {
    let engine = engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(64, 64, convention);
        let near = ndc(2.0, convention);
        let wall = ndc(32.0, convention);
        // Columns below 32 show a surface at 2, the others one at 32.
        let depth: Vec<f32> = (0..64 * 64).map(|i| if i % 64 < 32 { near } else { wall }).collect();
        let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
        // At depth 8, a pixel is 1/4 wide.
        let (min, max) = (
            [
                // 16 pixels to either side of the middle, 4 rows.
                -4.0, 0.0, 8.0, // Behind the eye.
                -1.0, -1.0, -3.0, // Across the plane of the eye.
                -1.0, -1.0, -1.0, // The surface lies in it, in the right half.
                0.0, 0.0, 16.0, // Invalid.
                1.0, 0.0, 8.0,
            ],
            [4.0, 1.0, 8.0, 1.0, 1.0, -2.0, 1.0, 1.0, 1.0, 8.0, 8.0, 64.0, 0.0, 1.0, 8.0],
        );
        let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        let options = CullOptions { coverage: Coverage::Sample, ..CullOptions::default() };
        let culling = engine.cull(&instances, &camera, &pyramid, &options, &PIXELS).unwrap();
        let counts = culling.pixels().unwrap();
        let all = 64 * 64;
        assert_eq!(
            counts[..3],
            [
                PixelCounts { touched: 128, hidden: 64, inside: 0, open: 64, undecided: 0 },
                PixelCounts::default(),
                PixelCounts { touched: all, hidden: 0, inside: all, open: 0, undecided: all },
            ],
            "{convention:?}"
        );
        // 16x16 pixels at its front, and 8x8 of them where the surface at 32 is in the volume.
        // Beside these the volume ends before 32.
        let inside = PixelCounts { touched: 256, hidden: 0, inside: 64, open: 192, undecided: 0 };
        assert_eq!(counts[3], inside, "{convention:?}");
        assert_eq!(counts[4].undecided, all);
        assert_eq!(counts[0].fraction_of_others(), 0.5);
    }
}

/// Groups hide members as a whole, and the counts are those of the flat cull.
#[test]
fn groups_change_no_count() {
    let engine = engine();
    let camera = camera_along_z(96, 64, DepthConvention::Reversed);
    let depth: Vec<f32> = (0..96 * 64)
        .map(|i| ndc(if i % 96 < 60 { 4.0 } else { 1000.0 }, DepthConvention::Reversed))
        .collect();
    let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
    let mut random = common::Random(5);
    let centers: Vec<f64> = (0..1000)
        .flat_map(|_| {
            [random.range(-30.0, 30.0), random.range(-20.0, 20.0), random.range(10.0, 60.0)]
        })
        .collect();
    let radii = vec![0.8; 1000];
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let counts = [Hierarchy::Never, Hierarchy::Always].map(|hierarchy| {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let outputs = Outputs { mask: true, ..PIXELS };
        let culling = engine.cull(&instances, &camera, &pyramid, &options, &outputs).unwrap();
        (culling.pixels().unwrap(), culling.mask().unwrap())
    });
    assert_eq!(counts[0].0, counts[1].0);
    for (counts, mask) in [&counts[0], &counts[1]].map(|(counts, mask)| (counts, mask)) {
        // What is culled shows nowhere; the reverse need not hold, for the cull is coarser.
        for (counts, kept) in counts.iter().zip(mask) {
            assert!(*kept || counts.most_shown() == 0, "{counts:?}");
        }
    }
}

/// Counts of spheres of many sizes, `at_once` of them per upload.
fn counts_by_parts(engine: &Engine, at_once: usize) -> Vec<PixelCounts> {
    let camera = camera_along_z(96, 64, DepthConvention::Reversed);
    let depth: Vec<f32> = (0..96 * 64)
        .map(|i| ndc(if i % 96 < 60 { 20.0 } else { 1000.0 }, DepthConvention::Reversed))
        .collect();
    let pyramid = engine.pyramid(&engine.upload_depth(&depth, &camera).unwrap()).unwrap();
    let mut random = common::Random(6);
    let balls: Vec<([f64; 3], f64)> = (0..600)
        .map(|_| {
            let x_y_z =
                [random.range(-15.0, 15.0), random.range(-10.0, 10.0), random.range(10.0, 60.0)];
            (x_y_z, random.range(0.1, 5.0))
        })
        .collect();
    let of_part = |part: &[([f64; 3], f64)]| {
        let centers: Vec<f64> = part.iter().flat_map(|ball| ball.0).collect();
        let radii: Vec<f64> = part.iter().map(|ball| ball.1).collect();
        let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        let seen =
            engine.cull(&instances, &camera, &pyramid, &CullOptions::default(), &PIXELS).unwrap();
        seen.pixels().unwrap()
    };
    balls.chunks(at_once).flat_map(of_part).collect()
}

/// A workgroup orders its instances by size, and each of its invocations takes several.
/// Others beside an instance change nothing, so each counts as it does in an upload of few.
#[test]
fn others_change_no_count() {
    let alone = counts_by_parts(&engine(), 30);
    assert!(alone.iter().filter(|counts| counts.touched > 0).count() > 300);
    assert_eq!(counts_by_parts(&engine(), 600), alone);
    for (name, fault) in [
        ("places in a class left out", (" + (key & PLACE_MASK)] =", "] =")),
        ("what comes second left out", ("break if t >= small_count;", "break if t >= lane;")),
    ] {
        let engine = Engine::with_planted_faults(None, &[fault]).expect("a Vulkan driver");
        assert_ne!(counts_by_parts(&engine, 600), alone, "{name}: stayed green");
    }
}

/// A cull that counts nothing else, and what is refused.
#[test]
fn counts_are_an_output_of_their_own() {
    let engine = engine();
    let camera = camera_along_z(64, 64, DepthConvention::Reversed);
    let context = engine.context();
    let depth = engine.upload_depth(&[0.5; 64 * 64], &camera).unwrap();
    let pyramid = engine.pyramid(&depth).unwrap();
    let (centers, radii) = ([0.0, 0.0, 8.0], [1.0]);
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let seen =
        engine.cull(&instances, &camera, &pyramid, &CullOptions::default(), &PIXELS).unwrap();
    let counts = seen.pixels().unwrap()[0];
    assert!(counts.is_decided() && counts.hidden == counts.touched, "{counts:?}");
    // Outputs without pixels have no buffer, and a read of them says so.
    let other =
        engine.cull(&instances, &camera, &pyramid, &CullOptions::default(), &Outputs::ALL).unwrap();
    assert!(other.visible().pixels(0).is_none());
    let error = other.pixels().unwrap_err().to_string();
    assert!(error.contains("asked for pixels"), "{error}");
    let refused = context.create_temporal(&instances, &Outputs { pixels: true, ..Outputs::ALL });
    assert!(refused.unwrap_err().to_string().contains("without pixels"));
}

/// Rectangles of every size are counted by the way of large ones: from coarse levels on.
const ALL_ARE_LARGE: (&str, &str) =
    ("const SMALL_ROWS: u32 = 1023u;", "const SMALL_ROWS: u32 = 0u;");

#[test]
fn large_rectangles_count_like_small_ones() {
    let engine = Engine::with_planted_faults(None, &[ALL_ARE_LARGE]).expect("a Vulkan driver");
    for coverage in [Coverage::Area, Coverage::Sample] {
        let rounds = campaign(76, soak_times(), coverage).fitted(&KINDS, false);
        let rounds = rounds.take(30 * soak_times());
        assert_eq!(run(&engine, rounds, None).contradictions, 0, "{coverage:?}");
    }
    let rounds = campaign(77, soak_times(), Coverage::Area).fitted(&KINDS, false);
    let rounds = rounds.take(15 * soak_times());
    assert_eq!(run(&engine, rounds, Some(20)).contradictions, 0);
    for levels in campaign::MISSING_LEVELS {
        let rounds = campaign(78, 1, Coverage::Area)
            .fitted(&KINDS, false)
            .take(8)
            .map(|round| Round { levels: *levels, ..round });
        assert_eq!(run(&engine, rounds, None).contradictions, 0, "{levels:?}");
    }
}

#[test]
fn planted_faults_turn_it_red() {
    let planted: [(&str, &[(&str, &str)]); 8] = [
        (
            "an edge pixel dropped",
            &[(
                "return Prepared(none, vec4<u32>(f, l), true);",
                "return Prepared(none, vec4<u32>(f, max(l, f + vec2<u32>(1u)) - vec2<u32>(1u)), true);",
            )],
        ),
        (
            "open and hidden swapped",
            &[
                (
                    "(*walk).hidden += pixels_of(sure.hidden",
                    "(*walk).open += pixels_of(sure.hidden",
                ),
                ("(*walk).open += pixels_of(sure.open", "(*walk).hidden += pixels_of(sure.open"),
            ],
        ),
        (
            "a texel's pixels outside the rectangle counted",
            &[
                ALL_ARE_LARGE,
                (
                    "max(columns << vec4<u32>(level), vec4<u32>(first.x))",
                    "columns << vec4<u32>(level)",
                ),
            ],
        ),
        (
            "another texel entered",
            &[ALL_ARE_LARGE, ("| (VECTOR * at.x + k);", "| (VECTOR * at.x);")],
        ),
        (
            "a sign of a difference reversed",
            &[("signs_of(surface + most_over", "signs_of(-surface - most_over")],
        ),
        (
            "the depths of the first row",
            &[("read_depths(at), r", "read_depths(r.xy >> vec2<u32>(VECTOR_LOG2, 0u)), r")],
        ),
        (
            "the front taken for the back",
            &[(
                "select(NO_PLANE, offset, is_front), select(NO_PLANE, offset, is_back));",
                "select(NO_PLANE, offset, is_back), select(NO_PLANE, offset, is_front));",
            )],
        ),
        (
            "no margin of a plane",
            &[
                ("surely_above(r, offset, p.w);\n    let magnitudes", "true;\n    let magnitudes"),
                (
                    "GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min);\n    let holds",
                    "-2.0 * GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min);\n    let holds",
                ),
            ],
        ),
    ];
    for (name, faults) in planted {
        let engine = Engine::with_planted_faults(None, faults).expect("a Vulkan driver");
        let rounds = campaign(75, 3, Coverage::Area).fitted(&[BoundsKind::OrientedBox], false);
        assert!(is_red(&engine, rounds, None), "{name}: stayed green");
    }
    let name = "the budget's rest counted as hidden";
    let fault = (
        "walk.hidden, inside, walk.open, undecided);",
        "walk.hidden + undecided, inside - undecided, walk.open, 0u);",
    );
    let engine = Engine::with_planted_faults(None, &[fault]).expect("a Vulkan driver");
    let rounds = campaign(75, 3, Coverage::Area).fitted(&[BoundsKind::OrientedBox], false);
    assert!(is_red(&engine, rounds, Some(2)), "{name}: stayed green");
}

/// One pixel of 4096 that is near or no depth keeps its texel from being open at once, and is not
/// open itself.
#[test]
fn both_ends_decide_no_pixel_that_is_not_open() {
    let engine = engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(64, 64, convention);
        let far = ndc(512.0, convention);
        let (center, radius) = ([0.0, 0.0, 8.0], [4.0]);
        let bounds = Bounds::Spheres { centers: Floats::F64(&center), radii: Floats::F64(&radius) };
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        let volume = Volume::Sphere { center, radius: radius[0] };
        for (pixel, odd) in [(0, far), (2080, ndc(2.0, convention)), (2081, ndc(8.0, convention))]
            .into_iter()
            .chain([(2079, f32::NAN), (1950, -1.0), (2100, f32::INFINITY)])
        {
            let mut depth = vec![far; 64 * 64];
            depth[pixel] = odd;
            let image = engine.upload_depth(&depth, &camera).unwrap();
            let counts = [Depths::Farthest, Depths::Both].map(|depths| {
                let options = PyramidOptions { depths, ..PyramidOptions::default() };
                let pyramid = engine.pyramid_with(&image, &options).unwrap();
                let options = CullOptions::default();
                let seen = engine.cull(&instances, &camera, &pyramid, &options, &PIXELS).unwrap();
                seen.pixels().unwrap()[0]
            });
            assert_eq!(counts[0], counts[1], "{convention:?} {pixel} {odd}");
            let rows = camera.rows();
            let view = hiz_ref::View {
                rows,
                origin: camera.origin(),
                width: 64,
                height: 64,
                reversed: convention.is_reversed(),
            };
            let truth = pixel_truth(&view, &volume, &depth, hiz_ref::Coverage::Area).unwrap();
            assert_eq!(contradiction(&counts[0], &truth, 4096), None, "{counts:?} {truth:?}");
            // What is left is what a pixel at the outline cannot tell.
            assert!(counts[0].inside <= truth.not_open + 8, "{pixel} {odd} {counts:?}");
        }
    }
}
