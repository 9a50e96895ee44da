//! Points: 16 bytes each, a guard of half a pixel, and the promise against the exact oracle.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use std::sync::Arc;

use campaign::{Arrays, Campaign, HEADER, PLAIN, POINTS, Report};
use common::{CONVENTIONS, Random, camera_along_z, engine, ndc};
use hiz_core::headless::{AmongSource, CullExtras, Engine};
use hiz_core::{
    ABSENT, Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, Depths, Fit,
    Floats, Footprint, Hierarchy, InstanceOptions, Instances, Order, Outputs, Pyramid,
    PyramidOptions, StoredOrder, Verdict,
};

const ALL: &[(Footprint, u32)] =
    &[(Footprint::One, 0), (Footprint::Two, 0), (Footprint::Eight, 0), (Footprint::Two, 64)];

fn campaign(seed: u64, rounds: usize) -> Campaign {
    Campaign { seed, rounds, kinds: &POINTS, modes: ALL, ..Campaign::default() }
}

fn assert_green(name: &str, report: &Report) {
    eprintln!("{name}\n{HEADER}\n{report}");
    assert_eq!((report.total().false_culls, report.tested.contradictions), (0, 0));
    assert!(report.total().culled > report.total().cases / 10, "{name}: hardly any culls");
}

#[test]
fn no_false_cull_of_points() {
    let engine = engine();
    assert_green("area coverage", &campaign(31, 20).run(&engine));
    assert_green("guards", &Campaign { any_slack: true, ..campaign(32, 6) }.run(&engine));
    assert_green("groups", &Campaign { groups: true, ..campaign(33, 3) }.run(&engine));
    // A point hardly ever lies on the centre of a pixel, so nearly all are outside.
    let sample = Campaign { coverage: Coverage::Sample, ..campaign(34, 3) };
    assert_green("sample coverage", &sample.run(&engine));
    assert_green("volume fit", &Campaign { fit: Fit::Volume, ..campaign(35, 3) }.run(&engine));
}

/// Each fault has to lose points that the oracle sees.
#[test]
fn planted_faults_are_found() {
    const WIDE: &[BoundsKind] = &[BoundsKind::WidePoint];
    for (what, by, name, kinds) in [
        ("ERROR_ULPS: f32 = 24.0", "ERROR_ULPS: f32 = 0.0", "no margin", &POINTS[..]),
        (
            "let bits = corners(level, t);",
            "let bits = corners(level, t.xyxy);",
            "one pixel of four",
            &POINTS,
        ),
        ("size_of(d_hi, 0.0)", "(0.0 * size_of(d_hi, 0.0))", "half of the size", &POINTS),
        ("bar3(lo - view.eye_lo)", "bar3(-view.eye_lo)", "no low half", WIDE),
        ("Volume(d_hi - view.eye_lo", "Volume(d_hi", "the eye's low half", &POINTS[..1]),
    ] {
        let engine = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        let report = Campaign { kinds, ..campaign(36, 6) }.run_until_red(&engine);
        let total = report.total();
        eprintln!("{name}: {} false culls in {} cases", total.false_culls, total.cases);
        assert!(total.false_culls > 0, "{name} stayed green");
    }
}

/// With both ends a point may surely show: never one that the oracle sees covered.
///
/// Returns how many were said to show, and how many of them wrongly.
fn unoccluded(engine: &Engine, seed: u64, rounds: usize) -> [usize; 2] {
    let [mut said, mut wrong] = [0, 0];
    let campaign = Campaign { modes: PLAIN, ..campaign(seed, rounds) };
    for round in campaign.rounds() {
        let image = round.upload(engine);
        let options = PyramidOptions { depths: Depths::Both, ..round.pyramid_options(engine) };
        let pyramid = engine.pyramid_with(&image, &options).expect("pyramid");
        for (kind, volumes) in &round.volumes {
            let arrays = Arrays::new(volumes);
            let bounds = arrays.bounds(*kind);
            let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
            for guard in [0.0, 0.5] {
                let options = CullOptions { guard_px: Some(guard), ..round.options.clone() };
                let outputs = Outputs::default();
                let told = engine.cull(&instances, &round.camera, &pyramid, &options, &outputs);
                let Ok(told) = told else { continue };
                for (volume, verdict) in volumes.iter().zip(told.verdicts().unwrap()) {
                    if verdict != Verdict::Unoccluded {
                        continue;
                    }
                    let (view, depth) = (&round.view, &round.depth);
                    let truth =
                        hiz_ref::is_unoccluded(view, volume, depth, hiz_ref::Coverage::Area);
                    said += 1;
                    wrong += usize::from(!truth.expect("a finite view"));
                }
            }
        }
    }
    [said, wrong]
}

#[test]
fn no_point_is_falsely_said_to_show() {
    let [said, wrong] = unoccluded(&engine(), 37, 20);
    eprintln!("{said} points surely show, {wrong} wrongly");
    assert!(said > 300 && wrong == 0, "{said} {wrong}");
    for (what, by, name) in [
        ("ERROR_ULPS: f32 = 24.0", "ERROR_ULPS: f32 = 0.0", "no margin"),
        (
            "return surely_above(z, t, w);\n    }\n    return surely_below(z, t, w);",
            "return surely_below(z, t, w);\n    }\n    return surely_above(z, t, w);",
            "hidden for in front",
        ),
        (
            "front = nearest_footprint(level, t);",
            "front = nearest_footprint(level, t.xyxy);",
            "one pixel of four",
        ),
    ] {
        let engine = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        let [said, wrong] = unoccluded(&engine, 37, 8);
        eprintln!("{name}: {wrong} of {said}");
        assert!(wrong > 0, "{name} stayed green");
    }
}

const SIZE: (u32, u32) = (64, 48);

fn upload(engine: &Engine, positions: Floats<'_>) -> Arc<Instances> {
    engine.instances(&Bounds::Points { positions }, &InstanceOptions::default()).unwrap()
}

fn verdicts(
    engine: &Engine,
    (instances, camera, pyramid): (&Arc<Instances>, &Camera, &Arc<Pyramid>),
    options: &CullOptions,
) -> Vec<Verdict> {
    let culling = engine.cull(instances, camera, pyramid, options, &Outputs::default()).unwrap();
    culling.verdicts().unwrap()
}

#[test]
fn a_point_takes_sixteen_bytes_where_float32_holds_it() {
    let engine = engine();
    let numbers: Vec<f64> = (0..3 * 65_536).map(|i| f64::from(i % 1009) / 8.0).collect();
    let singles: Vec<f32> = numbers.iter().map(|v| *v as f32).collect();
    let mut wide = numbers.clone();
    wide[777] = 0.1;
    // 48 bytes for each 64 are the boxes of the groups, and as many for each 64 of these.
    for (positions, kind, bytes) in [
        (Floats::F32(&singles), BoundsKind::Point, 16),
        (Floats::F64(&numbers), BoundsKind::Point, 16),
        (Floats::F64(&wide), BoundsKind::WidePoint, 32),
    ] {
        let instances = upload(&engine, positions);
        assert_eq!(instances.kind(), kind);
        assert_eq!(instances.device_bytes(), 65_536 * bytes + (1024 + 16) * 48, "{kind:?}");
    }
}

/// A plane that is seen at a slant, and points on it.
///
/// Depth of a plane is linear in the image.
/// So the greatest of the depths at four centres bounds that of all points between them, and the
/// default guard loses none.
/// Without it a point that is farther than the centre of its own pixel is lost.
#[test]
fn the_default_guard_loses_no_point_of_a_plane() {
    let engine = engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIZE.0, SIZE.1, convention);
        // z = 4 / (1 - 0.6 u + 0.3 v) at image position (u, v), each in -1..1, v upwards.
        let one_by_z = |u: f64, v: f64| (1.0 - 0.6 * u + 0.3 * v) / 4.0;
        let centre = |i: u32, n: u32| 2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0;
        let image: Vec<f32> = (0..SIZE.0 * SIZE.1)
            .map(|i| {
                let (u, v) = (centre(i % SIZE.0, SIZE.0), -centre(i / SIZE.0, SIZE.1));
                let depth = match convention {
                    DepthConvention::Standard => 1.0 - one_by_z(u, v),
                    DepthConvention::Reversed => one_by_z(u, v),
                };
                depth as f32
            })
            .collect();
        let mut random = Random(7);
        // All pixels around these are inside of the image.
        let positions: Vec<f64> = (0..4000)
            .flat_map(|_| {
                let (u, v) = (random.range(-0.9, 0.9), random.range(-0.9, 0.9));
                let z = 1.0 / one_by_z(u, v);
                [u * z, v * z, z]
            })
            .collect();
        let pyramid = engine.pyramid(&engine.upload_depth(&image, &camera).unwrap()).unwrap();
        let instances = upload(&engine, Floats::F64(&positions));
        let slack = CullOptions { depth_slack: 1e-6, ..CullOptions::default() };
        let lost = |options: &CullOptions| {
            let told = verdicts(&engine, (&instances, &camera, &pyramid), options);
            assert!(told.iter().all(|v| matches!(v, Verdict::Visible | Verdict::Occluded)));
            told.iter().filter(|verdict| **verdict == Verdict::Occluded).count()
        };
        let without = lost(&CullOptions { guard_px: Some(0.0), ..slack.clone() });
        let with = lost(&slack);
        eprintln!("{convention:?}: lost {without} of 4000 without a guard, {with} with it");
        assert!(without > 1000 && with == 0, "{convention:?}: {without}, {with}");
        let explicit =
            |guard: f64, coverage| CullOptions { guard_px: Some(guard), coverage, ..slack.clone() };
        let of =
            |options: &CullOptions| verdicts(&engine, (&instances, &camera, &pyramid), options);
        assert_eq!(of(&slack), of(&explicit(0.5, Coverage::Area)));
        let sample = CullOptions { coverage: Coverage::Sample, ..slack.clone() };
        assert_eq!(of(&sample), of(&explicit(1.0, Coverage::Sample)));
        assert_eq!(lost(&sample), 0);
    }
}

/// A point is decided on level 0, by two columns and two rows at most.
/// Only one that lies on the very centre of a pixel's row or column touches three.
#[test]
fn level_0_decides_about_a_point() {
    let engine = engine();
    let camera = camera_along_z(SIZE.0, SIZE.1, DepthConvention::Reversed);
    let wall = vec![ndc(4.0, DepthConvention::Reversed); (SIZE.0 * SIZE.1) as usize];
    let pyramid = engine.pyramid(&engine.upload_depth(&wall, &camera).unwrap()).unwrap();
    let mut random = Random(3);
    let positions: Vec<f32> = (0..500)
        .flat_map(|_| {
            let (u, v) = (random.range(-0.9, 0.9), random.range(-0.9, 0.9));
            [(8.0 * u) as f32, (8.0 * v) as f32, 8.0]
        })
        .collect();
    let instances = upload(&engine, Floats::F32(&positions));
    let options = CullOptions { statistics: true, ..CullOptions::default() };
    let culling =
        engine.cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
    let counts = culling.counts().unwrap();
    assert_eq!((counts.occluded, counts.levels[0]), (500, 500), "{:?}", counts.levels);
    assert!(counts.texels_read <= 4 * 500 && counts.texels_read >= 3 * 500);
}

/// What every option does is what it does for spheres of radius 0 with the same guard.
#[test]
fn points_pass_everywhere_where_spheres_do() {
    let engine = engine();
    let camera = camera_along_z(SIZE.0, SIZE.1, DepthConvention::Standard);
    let mut random = Random(5);
    let image: Vec<f32> = (0..SIZE.0 * SIZE.1)
        .map(|i| ndc(if i / 8 % 3 == 0 { 3.0 } else { 9.0 }, DepthConvention::Standard))
        .collect();
    let pyramid = engine.pyramid(&engine.upload_depth(&image, &camera).unwrap()).unwrap();
    let count = 1500_usize;
    let mut positions: Vec<f64> = (0..3 * count).map(|_| random.range(-6.0, 12.0)).collect();
    positions[3 * 70] = f64::NAN;
    positions[3 * 71 + 1] = f64::INFINITY;
    positions[3 * 72 + 2] = 1e19;
    let mesh_ids: Vec<u32> = (0..count).map(|i| if i % 97 == 0 { ABSENT } else { 0 }).collect();
    let radii = vec![0.0; count];
    let asked: Vec<bool> = (0..count).map(|i| i * i % 7 < 3).collect();
    let singles: Vec<f64> = positions.iter().map(|v| f64::from(*v as f32)).collect();
    for (numbers, kind) in [(&positions, BoundsKind::WidePoint), (&singles, BoundsKind::Point)] {
        for order in [StoredOrder::Morton, StoredOrder::Given] {
            let make = |bounds: &Bounds<'_>| {
                let options = InstanceOptions {
                    order,
                    mesh_ids: Some(&mesh_ids),
                    piece_capacity: Some(640),
                    ..InstanceOptions::default()
                };
                engine.instances(bounds, &options).unwrap()
            };
            let centers = Floats::F64(numbers);
            let points = make(&Bounds::Points { positions: centers });
            let spheres = make(&Bounds::Spheres { centers, radii: Floats::F64(&radii) });
            assert_eq!(points.kind(), kind);
            assert_eq!(points.invalid().unwrap(), [70, 71, 72]);
            for (hierarchy, fit, descent, list) in [
                (Hierarchy::Never, Fit::Rectangle, 0, Order::Stable),
                (Hierarchy::Always, Fit::Rectangle, 32, Order::Any),
                (Hierarchy::Always, Fit::Volume, 0, Order::Stable),
            ] {
                let options = CullOptions {
                    hierarchy,
                    fit,
                    descent,
                    order: list,
                    guard_px: Some(0.5),
                    ..CullOptions::default()
                };
                let told = |instances: &Arc<Instances>, among: bool| {
                    let asked = engine.among(instances, &AmongSource::Mask(&asked)).unwrap();
                    let extras =
                        CullExtras { among: among.then_some(&asked), ..CullExtras::default() };
                    let culling = engine
                        .cull_given(instances, &camera, &pyramid, &options, &Outputs::ALL, &extras)
                        .unwrap();
                    let mut listed = culling.indices().unwrap();
                    listed.sort_unstable();
                    (culling.verdicts().unwrap(), culling.mask().unwrap(), listed)
                };
                for among in [false, true] {
                    let (seen, expected) = (told(&points, among), told(&spheres, among));
                    assert!(seen == expected, "{kind:?} {order:?} {options:?} {among}");
                    assert!(
                        seen.0.contains(&Verdict::Occluded) && seen.0.contains(&Verdict::Visible)
                    );
                }
            }
        }
    }
}

/// Spheres of radius 0 pass through a single cull as points, with the guard of spheres.
///
/// One sphere has a size: its own part of 65,536 is culled as spheres.
#[test]
fn a_single_cull_keeps_spheres_of_radius_0_as_a_resident_one_does() {
    let engine = engine();
    let camera = camera_along_z(SIZE.0, SIZE.1, DepthConvention::Standard);
    let mut random = Random(11);
    let image: Vec<f32> = (0..SIZE.0 * SIZE.1)
        .map(|i| ndc(if i / 8 % 3 == 0 { 3.0 } else { 9.0 }, DepthConvention::Standard))
        .collect();
    let pyramid = engine.pyramid(&engine.upload_depth(&image, &camera).unwrap()).unwrap();
    let (count, large) = (140_000, 100_000);
    let mut positions: Vec<f64> = (0..3 * count).map(|_| random.range(-6.0, 12.0)).collect();
    positions[3 * 70] = f64::NAN;
    positions[3 * 71 + 2] = 1e19;
    // Behind the nearer stripes, and so large that it shows beside them.
    positions[3 * large..3 * large + 3].copy_from_slice(&[0.5, 0.5, 5.0]);
    let singles: Vec<f32> = positions.iter().map(|v| *v as f32).collect();
    let mut radii = vec![0.0; count];
    radii[3] = -0.0;
    radii[large] = 2.0;
    let narrow: Vec<f32> = radii.iter().map(|r| *r as f32).collect();
    for (centers, radii) in [
        (Floats::F64(&positions), Floats::F64(&radii)),
        (Floats::F32(&singles), Floats::F32(&narrow)),
        (Floats::F32(&singles), Floats::F64(&radii)),
    ] {
        let spheres = Bounds::Spheres { centers, radii };
        let instances = engine.instances(&spheres, &InstanceOptions::default()).unwrap();
        for (coverage, guard_px) in [
            (Coverage::Area, None),
            (Coverage::Area, Some(0.5)),
            (Coverage::Sample, None),
            (Coverage::Sample, Some(1.0)),
        ] {
            let options = CullOptions {
                coverage,
                guard_px,
                hierarchy: Hierarchy::Never,
                ..CullOptions::default()
            };
            let once = engine.cull_once(&spheres, &camera, &pyramid, &options).unwrap();
            let culling =
                engine.cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
            assert!(once.mask == culling.mask().unwrap(), "{coverage:?} {guard_px:?}");
            assert!(once.mask[large], "{coverage:?} {guard_px:?}");
            let first = &culling.verdicts().unwrap()[..once.first_counts.tested as usize];
            let told = |verdict| first.iter().filter(|one| **one == verdict).count() as u64;
            let counts = once.first_counts;
            assert_eq!(
                [counts.invalid, counts.occluded, counts.visible],
                [Verdict::Invalid, Verdict::Occluded, Verdict::Visible].map(told)
            );
            assert!(counts.invalid == 2 && counts.occluded > 100 || coverage == Coverage::Sample);
        }
    }
}

/// The named outcomes, worked out by hand: a wall at depth 4, the eye at the origin.
#[test]
fn named_outcomes() {
    let engine = engine();
    for convention in CONVENTIONS {
        let camera = camera_along_z(16, 16, convention);
        let wall = [ndc(4.0, convention); 256];
        let pyramid = engine.pyramid(&engine.upload_depth(&wall, &camera).unwrap()).unwrap();
        let cases: [([f64; 3], Verdict); 12] = [
            ([0.0, 0.0, 8.0], Verdict::Occluded),
            ([0.3, -0.2, 2.0], Verdict::Visible),
            // On the wall itself.
            ([0.3, -0.2, 4.0], Verdict::Visible),
            ([0.0, 0.0, -5.0], Verdict::Outside),
            ([9.0, 0.0, 2.0], Verdict::Outside),
            // The eye, and what lies before the near plane.
            ([0.0, 0.0, 0.0], Verdict::Outside),
            ([0.0, 0.0, 0.5], Verdict::Outside),
            // Subnormals count as the 0 that they may be flushed to.
            ([1e-40, -1e-310, 8.0], Verdict::Occluded),
            ([-0.0, -0.0, 8.0], Verdict::Occluded),
            ([f64::NAN, 0.0, 8.0], Verdict::Invalid),
            ([0.0, f64::NEG_INFINITY, 8.0], Verdict::Invalid),
            ([0.0, 0.0, 1.2e18], Verdict::Invalid),
        ];
        let positions: Vec<f64> = cases.iter().flat_map(|case| case.0).collect();
        let singles: Vec<f32> = positions.iter().map(|v| *v as f32).collect();
        let mut wide = positions.clone();
        wide.extend([0.1, 0.1, 8.0]);
        let expected: Vec<Verdict> = cases.iter().map(|case| case.1).collect();
        for positions in [Floats::F64(&positions), Floats::F32(&singles), Floats::F64(&wide)] {
            let instances = upload(&engine, positions);
            let options = CullOptions::default();
            let told = verdicts(&engine, (&instances, &camera, &pyramid), &options);
            assert_eq!(told[..12], expected, "{convention:?} {:?}", instances.kind());
            assert_eq!(instances.invalid().unwrap(), [9, 10, 11]);
        }
    }
}

#[test]
fn updates_keep_the_width_of_the_records() {
    let engine = engine();
    let camera = camera_along_z(16, 16, DepthConvention::Reversed);
    let wall = [ndc(4.0, DepthConvention::Reversed); 256];
    let pyramid = engine.pyramid(&engine.upload_depth(&wall, &camera).unwrap()).unwrap();
    let at = |z: f64, count: usize| [[0.0, 0.0, z]].repeat(count).concat();
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    let (narrow, wide) = (at(8.0, 200), at(2.1, 200));
    for (before, after, kind) in
        [(&narrow, &at(2.0, 5), BoundsKind::Point), (&wide, &at(8.0, 5), BoundsKind::WidePoint)]
    {
        let instances = upload(&engine, Floats::F64(before));
        let positions = Floats::F64(after);
        engine.update(&instances, 30, &Bounds::Points { positions }, true).unwrap();
        let told = verdicts(&engine, (&instances, &camera, &pyramid), &options);
        let (was, is) = match kind {
            BoundsKind::Point => (Verdict::Occluded, Verdict::Visible),
            _ => (Verdict::Visible, Verdict::Occluded),
        };
        let expected: Vec<_> =
            (0..200).map(|i| if (30..35).contains(&i) { is } else { was }).collect();
        assert_eq!(told, expected, "{kind:?}");
        assert_eq!(instances.kind(), kind);
    }
    let instances = upload(&engine, Floats::F64(&narrow));
    let positions = Floats::F64(&wide);
    let refused = engine.update(&instances, 0, &Bounds::Points { positions }, false).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "bounds: expected positions that float32 holds, as all were when these points were \
         uploaded, got positions that need two float32: round them to float32, or upload all of \
         them again"
    );
    let told = verdicts(&engine, (&instances, &camera, &pyramid), &options);
    assert_eq!(told, [Verdict::Occluded; 200], "nothing has changed");
    let radii = Floats::F64(&[0.0]);
    let sphere = Bounds::Spheres { centers: Floats::F64(&[0.0; 3]), radii };
    let refused = engine.update(&instances, 0, &sphere, false).unwrap_err();
    assert_eq!(refused.to_string(), "bounds: expected the instances' kind, Point, got Sphere");
}
