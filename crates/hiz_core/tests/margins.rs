//! Margins, slacks and guards have the right size; it is not enough that they exist.
//! An instance a little within a margin is kept, and one a little outside it is culled.
//! Both are tested alone and in groups, whose boxes get the same slack.
//!
//! Every threshold is worked out here in float64 from docs/accuracy.md.
//! A claim `R - t W' > 0` holds where its value exceeds `E = e(R) + |t| e(W')`.
//! Here e is `24 eps (a size + a_3)`, with the magnitudes a that are given beside each threshold.

mod common;

use std::sync::Arc;

use common::{CONVENTIONS, camera_along_z, engine, ndc};
use hiz_core::{
    Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, Fit, Floats, Hierarchy,
    ImageSize, InstanceOptions, Instances, Outputs, StoredOrder, Verdict,
};

const SIDE: u32 = 16;
const VISIBLE: Verdict = Verdict::Visible;
const EPS: f64 = 1.0 / 8_388_608.0;
const KINDS: [BoundsKind; 3] = [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox];

/// A box by its centre and half sizes.
/// As a sphere its radius is the first half size.
#[derive(Debug, Clone, Copy)]
struct Thing {
    center: [f64; 3],
    half: [f64; 3],
}

fn point(center: [f64; 3]) -> Thing {
    Thing { center, half: [0.0; 3] }
}

fn instances(things: &[Thing], kind: BoundsKind) -> Arc<Instances> {
    let all = |of: &dyn Fn(&Thing) -> [f64; 3]| things.iter().flat_map(of).collect::<Vec<f64>>();
    let (centers, half_sizes) = (all(&|t| t.center), all(&|t| t.half));
    let radii: Vec<f64> = things.iter().map(|t| t.half[0]).collect();
    let (min, max) = (
        all(&|t| std::array::from_fn(|k| t.center[k] - t.half[k])),
        all(&|t| std::array::from_fn(|k| t.center[k] + t.half[k])),
    );
    let rotations = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].repeat(things.len());
    let bounds = match kind {
        BoundsKind::Sphere => {
            Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) }
        }
        BoundsKind::Box => Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) },
        BoundsKind::OrientedBox => Bounds::OrientedBoxes {
            centers: Floats::F64(&centers),
            half_sizes: Floats::F64(&half_sizes),
            rotations: Floats::F64(&rotations),
        },
        BoundsKind::Point | BoundsKind::WidePoint => {
            Bounds::Points { positions: Floats::F64(&centers) }
        }
    };
    let options = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
    engine().instances(&bounds, &options).unwrap()
}

/// Asserts which things are kept and which are culled.
/// They are tested alone, and as groups of 64 copies, which are culled as a whole.
fn assert_between(
    what: &str,
    (camera, depth): (&Camera, &[f32]),
    options: &CullOptions,
    kinds: &[BoundsKind],
    (kept, culled): (&[Thing], &[Thing]),
) {
    let pyramid = engine().pyramid(&engine().upload_depth(depth, camera).unwrap()).unwrap();
    let things = [kept, culled].concat();
    let expected: Vec<bool> = (0..things.len()).map(|i| i < kept.len()).collect();
    for kind in kinds {
        let culling = |hierarchy, things: &[Thing]| {
            let options = CullOptions { hierarchy, ..options.clone() };
            let list = instances(things, *kind);
            engine().cull(&list, camera, &pyramid, &options, &Outputs::default()).unwrap()
        };
        let is_kept = |verdicts: Vec<Verdict>| {
            verdicts.into_iter().map(|v| v == VISIBLE).collect::<Vec<bool>>()
        };
        let alone = is_kept(culling(Hierarchy::Never, &things).verdicts().unwrap());
        assert_eq!(alone, expected, "{what}, {kind:?}: {things:?}");
        let crowd: Vec<Thing> = things.iter().flat_map(|thing| [*thing; 64]).collect();
        let groups = culling(Hierarchy::Always, &crowd);
        let of_groups = is_kept(groups.verdicts().unwrap());
        assert!(
            of_groups
                .chunks(64)
                .zip(&expected)
                .all(|(group, kept)| group.iter().all(|k| k == kept)),
            "{what}"
        );
        // A group that is hidden is hidden as a whole.
        assert_eq!(
            groups.counts().unwrap().tested_instances,
            64 * kept.len() as u64,
            "{what}, {kind:?}, groups"
        );
    }
}

/// The argument between `low` and `high` at which `excess`, a value minus its error, passes 0.
fn threshold(low: f64, high: f64, excess: impl Fn(f64) -> f64) -> f64 {
    let (mut below, mut above) = (low, high);
    assert!(excess(below) < 0.0 && excess(above) > 0.0, "{} {}", excess(below), excess(above));
    for _ in 0..200 {
        let middle = 0.5 * (below + above);
        if excess(middle) < 0.0 { below = middle } else { above = middle }
    }
    above
}

/// [`camera_along_z`] moved to `eye`.
fn camera_at(eye: [f64; 3], convention: DepthConvention) -> Camera {
    let [x, y, z] = eye;
    let depth = match convention {
        DepthConvention::Standard => [0.0, 0.0, 1.0, -z - 1.0],
        DepthConvention::Reversed => [0.0, 0.0, 0.0, 1.0],
    };
    let m = [[1.0, 0.0, 0.0, -x], [0.0, 1.0, 0.0, -y], depth, [0.0, 0.0, 1.0, -z]];
    Camera::from_clip_from_world(m, ImageSize::new(SIDE, SIDE), convention).unwrap()
}

fn at(eye: [f64; 3], d: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| eye[k] + d[k])
}

const NO_SLACK: f64 = 0.0;

fn plain() -> CullOptions {
    CullOptions { depth_slack: NO_SLACK, ..CullOptions::default() }
}

/// Distances r just within and just outside the margin behind a wall at depth 4.
/// Z' is 1, its constant; W' is r; t is 1/4 up to signs; so the value is r / 4 - 1.
/// `constant` is the magnitude of the constant of Z'.
/// `size` is the volume's size without r, plus the magnitude of the constant of W'.
fn behind_the_wall(constant: f64, size: f64) -> [f64; 2] {
    [0.88, 1.12].map(|share| {
        threshold(3.9, 40.0, |r| {
            r / 4.0 - 1.0 - share * 24.0 * EPS * (constant + 0.25 * (r + size))
        })
    })
}

/// The parts of the margin of a depth's certificate.
/// They belong to the constant, to the distance, to the volume's own size, and to a distant eye.
/// The last is what the two halves of the eye's position cannot hold.
#[test]
fn the_margin_of_depth_is_as_large_as_it_is_derived() {
    let far_away = 2.0_f64.powi(27);
    // eps (1 + 2^-8) of the eye, and its low half: a float32 near 2^27 is a multiple of 8 or 16.
    let halves = 16.0 * (1.0 + 1.0 / 256.0);
    for convention in CONVENTIONS {
        // For an eye far along the view, the constants are what float64 made of them.
        // They have 8 roundings of 2^-53 of twice the eye, which is 2 eps.
        // They have as much again where W' was taken from z.
        let lost = if convention == DepthConvention::Standard { 4.0 } else { 1.0 };
        for (eye, constant, size) in [
            ([0.0; 3], 1.0, 0.0),
            ([far_away, 0.0, 0.0], 1.0, halves),
            ([0.0, far_away + 6.0, 0.0], 1.0, halves + 6.0),
            // Here the distance of 4 is in low halves, which the eye's share covers.
            ([0.0, 0.0, far_away], lost, halves + 2.0 - 4.0),
        ] {
            let camera = camera_at(eye, convention);
            let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
            let [kept, culled] =
                behind_the_wall(constant, size).map(|r| [point(at(eye, [0.0, 0.0, r]))]);
            assert_between(
                &format!("a point behind a wall, seen from {eye:?}"),
                (&camera, &wall),
                &plain(),
                &KINDS,
                (&kept, &culled),
            );
        }
        // A flat box of half sizes 3 has size 6.
        // A sphere of radius 3 has size 9, and its nearest point is 3 nearer.
        // Squares that are compared get a margin of a millionth.
        // Half of it applies to the support 3/4.
        let camera = camera_along_z(SIDE, SIDE, convention);
        let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
        let [kept, culled] = behind_the_wall(1.0, 6.0)
            .map(|r| [Thing { center: [0.0, 0.0, r], half: [3.0, 3.0, 0.0] }]);
        let boxes = &KINDS[1..];
        assert_between(
            "a wide box behind a wall",
            (&camera, &wall),
            &plain(),
            boxes,
            (&kept, &culled),
        );
        let [kept, culled] = [0.88, 1.12].map(|share| {
            threshold(6.0, 40.0, |r| {
                r / 4.0 - 1.0 - share * (24.0 * EPS * (1.0 + 0.25 * (r + 9.0)) + 0.75 * 5e-7) - 0.75
            })
        });
        // In a group it is a box of half sizes 3 at the same depth, which also has size 9.
        let ball = |r: f64| [Thing { center: [0.0, 0.0, r], half: [3.0; 3] }];
        let cull = |r: f64| {
            let pyramid =
                engine().pyramid(&engine().upload_depth(&wall, &camera).unwrap()).unwrap();
            let list = instances(&ball(r), BoundsKind::Sphere);
            engine()
                .cull(&list, &camera, &pyramid, &plain(), &Outputs::default())
                .unwrap()
                .mask()
                .unwrap()[0]
        };
        assert!(cull(kept) && !cull(culled), "a sphere behind a wall, {convention:?}");
    }
}

/// The margin at the planes of the frustum.
/// Points are to the right of the image, where X' = 8 x, W' = r and t = 8.
/// Others are before the near plane.
#[test]
fn the_margin_of_the_frustums_planes_is_as_large_as_it_is_derived() {
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let open = vec![convention.far(); (SIDE * SIDE) as usize];
        let r = 4.0;
        let beside = |share: f64| {
            threshold(r - 1.0, r + 1.0, |x| {
                8.0 * (x - r) - share * 24.0 * EPS * (8.0 * (x + r) + 8.0 * (x + r))
            })
        };
        // Before the near plane: Z' + W' = r - 1 < 0 with a constant of 1 (standard).
        // Reversed Z has the same with other signs.
        let before =
            |share: f64| -threshold(-1.5, -0.5, |z| 1.0 + z - share * 24.0 * EPS * (1.0 - z));
        let [kept, culled] = [0.85, 1.15].map(|share| {
            let (x, z) = (beside(share), before(share));
            [[x, 0.0, r], [-x, 0.0, r], [0.0, x, r], [0.0, -x, r], [0.0, 0.0, z]].map(point)
        });
        assert_between(
            "the frustum's planes",
            (&camera, &open),
            &plain(),
            &KINDS,
            (&kept, &culled),
        );
    }
}

/// The slack is kappa eps of `sum |M| |p|` for both rows.
/// The linear part counts the distance, and the constant counts the eye's own coordinates.
#[test]
fn transform_slack_is_as_large_as_it_says() {
    let kappa = 65_536.0;
    let q = kappa * EPS;
    let options = CullOptions { transform_slack: kappa, ..plain() };
    for convention in CONVENTIONS {
        for eye in [[0.0; 3], [0.0, 0.0, 100.0], [30.0, -50.0, 100.0]] {
            let camera = camera_at(eye, convention);
            let z = eye[2];
            // Magnitudes, where Z' = z - A w.
            // With A = 1: 2 for a position; |z| + |z + 1| and twice |z| for the constants.
            // With A = 0: 0 for a position and 1 for the constant.
            // W': 1 for a position and twice |z| for the constant.
            let (linear, constant) = match convention {
                DepthConvention::Standard => (2.0, 4.0 * z + 1.0),
                DepthConvention::Reversed => (0.0, 1.0),
            };
            // The halves of the eye count as positions, a little.
            let size = |d: f64| d + EPS * eye.iter().map(|v: &f64| v.abs()).sum::<f64>();
            let depth_error =
                |r: f64, t: f64| q * (linear * size(r) + constant + t * (size(r) + 2.0 * z));
            let behind =
                |share: f64| threshold(3.0, 1e3, |r| r / 4.0 - 1.0 - share * depth_error(r, 0.25));
            let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
            let [kept, culled] =
                [0.98, 1.02].map(|share| [point(at(eye, [0.0, 0.0, behind(share)]))]);
            assert_between(
                &format!("behind a wall, {convention:?}, from {eye:?}"),
                (&camera, &wall),
                &options,
                &KINDS,
                (&kept, &culled),
            );
            // Beside the image: the slack of X' = 8 x' and of t W', t = 8.
            // A row's constant is its coefficients times the eye, twice.
            let open = vec![convention.far(); (SIDE * SIDE) as usize];
            let r = 40.0;
            let beside = |axis: usize, share: f64| {
                threshold(r - 1.0, 4.0 * r, |x| {
                    let (size, own) = (size(x + r), 2.0 * eye[axis].abs());
                    8.0 * (x - r) - share * q * 8.0 * (size + own + size + 2.0 * z)
                })
            };
            let [kept, culled] = [0.98, 1.02].map(|share| {
                let (x, y) = (beside(0, share), beside(1, share));
                [[x, 0.0, r], [-x, 0.0, r], [0.0, y, r], [0.0, -y, r]].map(|d| point(at(eye, d)))
            });
            let what = format!("beside the image, {convention:?}, from {eye:?}");
            assert_between(&what, (&camera, &open), &options, &KINDS, (&kept, &culled));
        }
    }
}

/// `depth_slack` moves a wall at depth 4 by that share of its stored depth.
#[test]
fn depth_slack_is_as_large_as_it_says() {
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
        for slack in [1e-3, 0.02, 0.2] {
            // The depth at this share of the slack.
            // It follows from 1 - 1 / r = 0.75 (1 + slack), or 1 / r = 0.25 (1 - slack).
            let [kept, culled] = [0.97, 1.03].map(|share| {
                let r = match convention {
                    DepthConvention::Standard => 1.0 / (1.0 - 0.75 * (1.0 + share * slack)),
                    DepthConvention::Reversed => 4.0 / (1.0 - share * slack),
                };
                [point([0.0, 0.0, r])]
            });
            for fit in [Fit::Rectangle, Fit::Volume] {
                let options = CullOptions { depth_slack: slack, fit, ..CullOptions::default() };
                let what = format!("slack {slack}, {convention:?}, {fit:?}");
                // `Fit::Volume` takes long to compile, so one kind of bounds has to be enough.
                let kinds = if fit == Fit::Volume { &KINDS[1..2] } else { &KINDS[..] };
                assert_between(&what, (&camera, &wall), &options, kinds, (&kept, &culled));
            }
        }
    }
}

/// An orthographic camera whose z from 1 to 9 is depth from 0 to 1, or from 1 to 0.
fn orthographic(convention: DepthConvention) -> (Camera, f64, f64) {
    match convention {
        DepthConvention::Standard => parallel(convention, 0.125, -0.125),
        DepthConvention::Reversed => parallel(convention, -0.125, 1.125),
    }
}

/// An orthographic camera whose depth is `slope` times z plus a constant.
fn parallel(convention: DepthConvention, slope: f64, constant: f64) -> (Camera, f64, f64) {
    let m = [
        [0.25, 0.0, 0.0, 0.0],
        [0.0, 0.25, 0.0, 0.0],
        [0.0, 0.0, slope, constant],
        [0.0, 0.0, 0.0, 1.0],
    ];
    (
        Camera::from_clip_from_world(m, ImageSize::new(SIDE, SIDE), convention).unwrap(),
        slope,
        constant,
    )
}

/// `depth_slack_abs` is in units of NDC depth.
/// The cull adds 2^-23, from which the shader's own roundings are taken.
#[test]
fn absolute_slack_is_as_large_as_it_says() {
    for convention in CONVENTIONS {
        let far_sign = orthographic(convention).1.signum();
        // Near depth 0 float32 is fine enough to resolve the slack.
        // The margin is proportional to the distance from the reference point.
        // Here that point is the origin, because the origin is in view.
        // The instance is next to it.
        let small = 2.0_f64.powi(-13);
        for (wall, slack, shares) in [
            (0.25, 1e-3, [0.97, 1.03]),
            (0.25, 0.125, [0.97, 1.03]),
            (0.75, 0.125, [0.97, 1.03]),
            (small, 0.5 * EPS, [0.95, 1.05]),
            (small, 1e-300, [0.95, 1.05]),
        ] {
            let (camera, slope, constant) = if wall == small {
                parallel(convention, 0.125 * far_sign, 2.0 * small)
            } else {
                orthographic(convention)
            };
            let depth = vec![wall as f32; (SIDE * SIDE) as usize];
            let [kept, culled] = shares.map(|share| {
                let ndc = wall + far_sign * share * (slack + EPS);
                [point([0.0, 0.0, (ndc - constant) / slope])]
            });
            let options = CullOptions { depth_slack_abs: slack, ..plain() };
            let what = format!("absolute slack {slack} at {wall}, {convention:?}");
            assert_between(&what, (&camera, &depth), &options, &KINDS, (&kept, &culled));
        }
    }
}

/// A column, or a row, of open pixels in a wall, approached from either side.
/// A box that stays `guard_px` away from it is hidden, and one that does not is kept.
/// In sample coverage the distance is from the pixels' centres.
#[test]
fn guards_of_pixels_are_as_large_as_they_say() {
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        for coverage in [Coverage::Area, Coverage::Sample] {
            for guard in [None, Some(0.25), Some(2.0)] {
                let (rim, default) = match coverage {
                    Coverage::Area => (0.5, 0.0),
                    Coverage::Sample => (0.0, 1.0 / 64.0),
                };
                let size = guard.unwrap_or(default);
                for axis in [0, 1] {
                    let mut depth = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
                    for i in 0..SIDE as usize {
                        depth[if axis == 0 { 16 * i + 8 } else { 16 * 8 + i }] = convention.far();
                    }
                    // At depth 8 a pixel is a unit: column 8 is x in 0..1, row 8 is y in -1..0.
                    // There is a box of 1.1 pixels on each side of it.
                    let middle = if axis == 0 { 0.5 } else { -0.5 };
                    let [kept, culled] = [0.97 * size - 2e-3, 1.03 * size + 2e-3].map(|distance| {
                        [-1.0, 1.0].map(|side| {
                            let mut thing =
                                Thing { center: [0.3, 0.3, 8.0], half: [0.55, 0.55, 0.0] };
                            thing.center[axis] = middle + side * (rim + distance + 0.55);
                            thing
                        })
                    });
                    // Descends to single pixels: a footprint alone reads others beside them.
                    let options =
                        CullOptions { coverage, guard_px: guard, descent: 4096, ..plain() };
                    let what = format!("guard {guard:?} {coverage:?} {convention:?} axis {axis}");
                    assert_between(
                        &what,
                        (&camera, &depth),
                        &options,
                        &KINDS[1..2],
                        (&kept, &culled),
                    );
                }
            }
        }
    }
}

/// The guard beyond the image's border, and between pixel centres.
#[test]
fn guards_of_the_image_are_as_large_as_they_say() {
    let convention = DepthConvention::Reversed;
    let camera = camera_along_z(SIDE, SIDE, convention);
    let open = vec![convention.far(); (SIDE * SIDE) as usize];
    for (coverage, guard, rim) in [
        (Coverage::Area, 0.25, 8.0),
        (Coverage::Area, 3.0, 8.0),
        (Coverage::Sample, 0.25, 7.5),
        (Coverage::Sample, 3.0, 7.5),
    ] {
        let options = CullOptions { coverage, guard_px: Some(guard), ..plain() };
        let [kept, culled] = [0.99 * guard, 1.01 * guard].map(|beyond| {
            // At depth 8 a pixel is a unit.
            let x = rim + beyond;
            // In sample coverage a point has to be at the height of a pixel centre.
            // Otherwise it is between two rows of centres.
            [[x, 0.5, 8.0], [-x, 0.5, 8.0], [0.5, x, 8.0], [0.5, -x, 8.0]].map(point)
        });
        let what = format!("guard {guard} {coverage:?} beside the image");
        assert_between(&what, (&camera, &open), &options, &KINDS, (&kept, &culled));
    }
    for guard in [None, Some(0.25)] {
        let size = guard.unwrap_or(1.0 / 64.0);
        let [kept, culled] = [0.97, 1.03].map(|share| {
            // On both sides of the centre of column 8 and of row 8.
            let d = share * size;
            [[0.5 + d, 0.5, 8.0], [0.5 - d, 0.5, 8.0], [0.5, -0.5 + d, 8.0], [0.5, -0.5 - d, 8.0]]
                .map(point)
        });
        let options = CullOptions { coverage: Coverage::Sample, guard_px: guard, ..plain() };
        let what = format!("guard {guard:?} between centres");
        assert_between(&what, (&camera, &open), &options, &KINDS, (&kept, &culled));
    }
}
