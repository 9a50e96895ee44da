//! Levels of detail: what the shader chooses never breaks the promise of its rule.
//!
//! Cases come in two sorts:
//!
//! - *Tight* ones are made so that a decision falls within some ulps.
//!   A point lies at a corner of the image, its counterpart at the point of the bounds that is
//!   nearest to the eye, in the direction that moves a pixel most.
//!   Either of the two may be the one that shows; the other lies outside of the image.
//! - *Random* ones take points anywhere in the bounds, and show how often the shader is finer than
//!   it needs to be.
//!
//! Pixels are measured by `hiz_ref`, in float64 and by projecting points.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;
#[path = "common/lod_cases.rs"]
mod lod_cases;
#[path = "common/mirror/mod.rs"]
mod mirror;

use common::{Random, engine};
use hiz_core::headless::Engine;
use hiz_core::testing::words;
use hiz_core::{BoundsKind, CullOptions, LodRule};
use hiz_ref::LodRule as Exact;
use lod_cases::{Case, Cases, KINDS, SETTINGS, Setting};
use mirror::{Arithmetic, LodMirror, NEED_FACTOR, Need, STYLES, WILDEST};

/// The words of the view's uniform from which on the needs follow (`shaders/cull/view.wgsl`).
const NEEDS_WORD: usize = 44;

/// Cases of a setting and kind of bounds in an ordinary run.
const FEW: usize = 6_000;

/// What a run has seen.
#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    /// Cases with a LOD above 0.
    coarse: usize,
    /// The greatest pixel error as a share of what is allowed.
    worst: f64,
    /// How often it was above 1.
    broken: usize,
    /// How often the shader chose a coarser LOD than float64 allows: must be 0.
    coarser: usize,
    /// How often it chose a finer one.
    finer: usize,
}

impl Tally {
    /// A pixel error, as a share of what is allowed.
    /// Float64 has rounded it and the error in world units, hence the room.
    fn measured(&mut self, share: f64) {
        self.worst = self.worst.max(share);
        self.broken += usize::from(share > 1.0 + 1e-9);
    }
}

fn view_words(setting: &Setting, rule: &LodRule) -> Vec<u32> {
    let options = CullOptions { lod: rule.clone(), ..CullOptions::default() };
    words::view(&setting.camera, &options).expect("a camera that float32 holds")
}

/// Chooses by error, and measures.
fn by_error(
    engine: &Engine,
    setting: &Setting,
    cases: &Cases,
    seed: u64,
    plant: impl Fn(&mut [u32]),
) -> Tally {
    let rule = LodRule::Error { pixels: setting.pixels };
    let mut view = view_words(setting, &rule);
    plant(&mut view);
    let chosen = cases.choose(engine, (&rule, &view));
    let mut random = Random(seed);
    let mut tally = Tally { cases: chosen.len(), ..Tally::default() };
    for (i, lod) in chosen.into_iter().enumerate() {
        let case = &cases.all[i];
        let errors = cases.errors_of(i);
        let scale = f64::from(case.scale);
        let exact = Exact::Error { errors: &errors, scale, pixels: setting.pixels };
        let allowed = hiz_ref::coarsest_lod(&setting.view, &case.volume, exact);
        tally.coarser += usize::from(lod > allowed);
        tally.finer += usize::from(lod < allowed);
        tally.coarse += usize::from(lod > 0);
        if lod == 0 {
            continue;
        }
        for [p, q] in case.pairs(&setting.view, errors[lod] * scale, &mut random) {
            if let Some(shift) = hiz_ref::pixel_shift(&setting.view, p, q) {
                tally.measured(shift / setting.pixels);
            }
        }
    }
    tally
}

fn no_error_is_above_its_bound(count: usize) {
    for (s, setting) in SETTINGS.iter().map(|make| make()).enumerate() {
        for (k, kind) in KINDS.into_iter().enumerate() {
            let seed = 100 * s as u64 + k as u64;
            let tight = Cases::tight(&setting, kind, count, seed);
            let tight = by_error(&engine(), &setting, &tight, seed, |_| {});
            let loose = Cases::random(&setting, kind, count, seed + 7);
            let loose = by_error(&engine(), &setting, &loose, seed, |_| {});
            eprintln!(
                "{}, {kind:?}, {} px: {} tight cases, worst {:.6}, {:.1} % coarse; {} random ones, \
                 worst {:.4}, {:.1} % coarse, {} needlessly fine",
                setting.name,
                setting.pixels,
                tight.cases,
                tight.worst,
                100.0 * tight.coarse as f64 / tight.cases as f64,
                loose.cases,
                loose.worst,
                100.0 * loose.coarse as f64 / loose.cases as f64,
                loose.finer,
            );
            for tally in [&tight, &loose] {
                assert_eq!((tally.broken, tally.coarser), (0, 0), "{}: {tally:?}", setting.name);
                assert!(tally.coarse > count / 5, "{}: {tally:?}", setting.name);
            }
            assert!(tight.worst > setting.near_to_bound(kind), "{}: {tight:?}", setting.name);
            assert!(loose.finer * 500 < count, "{}: {loose:?}", setting.name);
        }
    }
}

#[test]
fn no_pixel_error_is_above_the_bound() {
    no_error_is_above_its_bound(FEW);
}

#[test]
#[ignore = "takes minutes: 400,000 cases of each setting and kind of bounds"]
fn no_pixel_error_is_above_the_bound_in_many_cases() {
    no_error_is_above_its_bound(400_000);
}

/// By distance: the exact least view depth of the bounds is above the threshold.
/// By size: no two points of the bounds are farther apart in the image, if one shows.
#[test]
fn distances_and_sizes_keep_their_promises() {
    for (s, setting) in SETTINGS.iter().map(|make| make()).enumerate() {
        for (k, kind) in KINDS.into_iter().enumerate() {
            let seed = 1000 + 100 * s as u64 + k as u64;
            let cases = Cases::random(&setting, kind, FEW, seed);
            let mut random = Random(seed);
            let sizes = vec![400.0, 90.0, 20.0, 5.0];
            let rule = LodRule::Size { pixels: sizes.clone() };
            let chosen = cases.choose(&engine(), (&rule, &view_words(&setting, &rule)));
            let mut tally = Tally { cases: FEW, ..Tally::default() };
            for (lod, case) in chosen.into_iter().zip(&cases.all) {
                let exact = Exact::Size(&sizes);
                let allowed = hiz_ref::coarsest_lod(&setting.view, &case.volume, exact);
                let allowed = allowed.min(case.lods - 1);
                tally.coarser += usize::from(lod > allowed);
                tally.finer += usize::from(lod < allowed);
                tally.coarse += usize::from(lod > 0);
                if lod > 0 {
                    for [p, q] in case.wide_pairs(&setting.view, &mut random) {
                        if let Some(shift) = hiz_ref::pixel_shift(&setting.view, p, q) {
                            tally.measured(shift / sizes[lod - 1]);
                        }
                    }
                }
            }
            eprintln!("{}, {kind:?}, by size: {tally:?}", setting.name);
            assert_eq!((tally.broken, tally.coarser), (0, 0), "{}: {tally:?}", setting.name);
            assert!(tally.coarse > FEW / 20 && tally.finer * 500 < FEW, "{tally:?}");
            if setting.is_orthographic() {
                continue;
            }
            let distances = vec![0.5, 4.96, 9.82, 19.27, 200.0];
            let rule = LodRule::Distance { thresholds: distances.clone() };
            let chosen = cases.choose(&engine(), (&rule, &view_words(&setting, &rule)));
            let mut tally = Tally { cases: FEW, ..Tally::default() };
            for (lod, case) in chosen.into_iter().zip(&cases.all) {
                let exact = Exact::Distance(&distances);
                let allowed = hiz_ref::coarsest_lod(&setting.view, &case.volume, exact);
                let allowed = allowed.min(case.lods - 1);
                tally.coarser += usize::from(lod > allowed);
                tally.finer += usize::from(lod < allowed);
                tally.coarse += usize::from(lod > 0);
                if lod > 0 {
                    let depth = case.least_view_depth(&setting);
                    tally.measured(distances[lod - 1] / depth);
                }
            }
            eprintln!("{}, {kind:?}, by distance: {tally:?}", setting.name);
            assert_eq!((tally.broken, tally.coarser), (0, 0), "{}: {tally:?}", setting.name);
            assert!(tally.coarse > FEW / 20 && tally.finer * 500 < FEW, "{tally:?}");
        }
    }
}

/// The settings in which a fault of the factor must show: perspectives, and one kind of bounds.
fn perspectives() -> Vec<Setting> {
    SETTINGS.iter().map(|make| make()).filter(|s| !s.is_orthographic()).collect()
}

/// Faults of the host's factor: the norm elsewhere than at a corner, and a focal length instead.
#[test]
fn faults_of_the_factor_turn_it_red() {
    for setting in perspectives() {
        let cases = Cases::tight(&setting, BoundsKind::Sphere, FEW, 11);
        let [middle, vertical] = [setting.stretch_in_the_middle(), setting.vertical_focal_length()];
        for (name, factor) in [("the image's middle", middle), ("vertical focal length", vertical)]
        {
            let need = (factor / setting.pixels) as f32;
            let plant = |view: &mut [u32]| {
                assert!(f32::from_bits(view[NEEDS_WORD]) > need, "{name}: no fault");
                view[NEEDS_WORD] = need.to_bits();
            };
            let tally = by_error(&engine(), &setting, &cases, 12, plant);
            eprintln!("{}, {name}: {tally:?}", setting.name);
            assert!(tally.broken > 0 && tally.coarser > 0, "{name} in {}", setting.name);
        }
    }
}

/// Faults of the shader.
/// The last is the rule of peers: the distance from the eye instead of w, and the vertical focal
/// length alone (niagara's `drawcull.comp.glsl`, and alike in Bevy's meshlets).
#[test]
fn faults_of_the_shader_turn_it_red() {
    let euclidean = (
        "surely_farther(w, lod_need(radius, mesh, scale, lod))",
        "(length(volume.center) - volume.radius) * length(view.w.xyz)
            > lod_need(radius, mesh, scale, lod)",
    );
    let faults: [(&str, &[(&str, &str)]); 4] = [
        ("the scale dropped", &[(" * max(scale, LEAST_NORMAL)", "")]),
        (
            "the error of the LOD before",
            &[("max(lod_error(mesh, lod)", "max(lod_error(mesh, lod - 1u)")],
        ),
        (
            "the centre's w",
            &[(
                "exceeds_support((w.center - need) - w.error, w.half)",
                "w.center - need - w.error > 0.0",
            )],
        ),
        ("euclidean distance", &[euclidean]),
    ];
    for (name, planted) in faults {
        let engine = Engine::with_planted_faults(None, planted).expect("a driver");
        for setting in perspectives() {
            let tight = Cases::tight(&setting, BoundsKind::Sphere, FEW, 21);
            let loose = Cases::random(&setting, BoundsKind::Sphere, FEW, 22);
            let [tight, loose] =
                [tight, loose].map(|cases| by_error(&engine, &setting, &cases, 23, |_| {}));
            eprintln!("{}, {name}: {tight:?}, {loose:?}", setting.name);
            assert!(tight.broken + loose.broken > 0, "{name} in {}", setting.name);
            assert!(tight.coarser > 0 && loose.coarser > 0, "{name} in {}", setting.name);
        }
    }
    let engine = Engine::with_planted_faults(None, &[euclidean]).expect("a driver");
    for setting in perspectives() {
        let cases = Cases::random(&setting, BoundsKind::Sphere, FEW, 23);
        let need = (setting.vertical_focal_length() / setting.pixels) as f32;
        let plant = |view: &mut [u32]| view[NEEDS_WORD] = need.to_bits();
        let tally = by_error(&engine, &setting, &cases, 24, plant);
        eprintln!("{}, the rule of peers: {tally:?}", setting.name);
        assert!(tally.worst > 1.5 && tally.broken > 0, "{}: {tally:?}", setting.name);
    }
}

/// A box's radius is that of its longest diagonal.
#[test]
fn the_longest_diagonal_counts() {
    let planted = [("max(max(dot(a, a), dot(b, b)), max(dot(c, c), dot(d, d)))", "dot(a, a)")];
    let engine = Engine::with_planted_faults(None, &planted).expect("a driver");
    let setting = SETTINGS[0]();
    let cases = Cases::random(&setting, BoundsKind::OrientedBox, FEW, 31);
    let sizes = vec![200.0, 50.0, 12.0];
    let rule = LodRule::Size { pixels: sizes.clone() };
    let chosen = cases.choose(&engine, (&rule, &view_words(&setting, &rule)));
    let coarser = chosen.into_iter().zip(&cases.all).filter(|(lod, case)| {
        let allowed = hiz_ref::coarsest_lod(&setting.view, &case.volume, Exact::Size(&sizes));
        *lod > allowed.min(case.lods - 1)
    });
    assert!(coarser.count() > FEW / 1000);
}

/// Without the certificates' margin, the roundings of the need itself decide.
/// Here w is a whole number, and the factor is one of float32, so neither has any.
/// With the needs' own factor no LOD is too coarse; with needs that are rounded down some are.
#[test]
fn needs_are_never_too_small() {
    let no_margin = ("const ERROR_ULPS: f32 = 24.0;", "const ERROR_ULPS: f32 = 0.0;");
    let down =
        ("const NEED_FACTOR: f32 = 1.0 + 4.0 * EPS;", "const NEED_FACTOR: f32 = 1.0 - 2.0 * EPS;");
    for (planted, is_right) in [(&[no_margin][..], true), (&[no_margin, down], false)] {
        let engine = Engine::with_planted_faults(None, planted).expect("a driver");
        let setting = lod_cases::whole_factor();
        let cases = Cases::whole_depths(&setting, 20_000, 41);
        let tally = by_error(&engine, &setting, &cases, 42, |_| {});
        eprintln!("{planted:?}: {tally:?}");
        assert!(tally.coarse > 0 && tally.coarse < tally.cases, "{tally:?}");
        assert_eq!(tally.coarser == 0, is_right, "{planted:?}: {tally:?}");
    }
}

/// How often a LOD is allowed that float64 does not allow, over all styles of arithmetic.
///
/// By error, the need is that of tight cases.
/// By size, the limit in pixels is made for each case, to lie some ulps from its width.
fn allowed_in_vain(count: usize, margin: f32, need_factor: f32) -> [usize; 2] {
    let mut in_vain = [0; 2];
    for (s, setting) in SETTINGS.iter().map(|make| make()).enumerate() {
        // Float64 has rounded positions that are far from the origin.
        let room = 1.0 + if s == 4 { 1e-8 } else { 1e-12 };
        for (k, kind) in KINDS.into_iter().enumerate() {
            let cases = Cases::tight(&setting, kind, count, 61 + 10 * s as u64 + k as u64);
            let mut random = Random(62);
            let rule = LodRule::Error { pixels: setting.pixels };
            let by_error = LodMirror::new(&view_words(&setting, &rule), NEEDS_WORD);
            let records = cases.records();
            let stretch = hiz_ref::greatest_stretch(&setting.view);
            for (i, (case, record)) in cases.all.iter().zip(records).enumerate() {
                let w = hiz_ref::least_w(&setting.view, &case.volume);
                let limit = 2.0 * hiz_ref::radius(&case.volume) * stretch / w;
                let ulps = random.range(-1.0, 1.0) * random.pick(&[2.0, 8.0, 100.0]);
                let limit = limit * (1.0 + ulps / 8_388_608.0);
                let by_size = (1e-2..3e4).contains(&limit).then(|| {
                    let rule = LodRule::Size { pixels: vec![limit] };
                    LodMirror::new(&view_words(&setting, &rule), NEEDS_WORD)
                });
                for style in STYLES.iter().chain([&WILDEST]) {
                    let mut arithmetic = Arithmetic::new(*style, i as u64);
                    for (lod, error) in cases.errors_of(i).into_iter().enumerate().skip(1) {
                        let need = Need::Error(error as f32, case.scale);
                        let factors = (margin, need_factor);
                        let exact = error * f64::from(case.scale) * stretch / setting.pixels;
                        let nearly = (exact / w - 1.0).abs() < 1e-3;
                        if nearly
                            && by_error.allows((kind, &record), need, factors, &mut arithmetic)
                        {
                            in_vain[0] += usize::from(exact > w * room);
                            assert!(lod < case.lods);
                        }
                    }
                    let size = by_size.as_ref().is_some_and(|by_size| {
                        let factors = (margin, need_factor);
                        by_size.allows((kind, &record), Need::Size, factors, &mut arithmetic)
                    });
                    let exact = 2.0 * hiz_ref::radius(&case.volume) * stretch / limit;
                    in_vain[1] += usize::from(size && exact > w * room);
                }
            }
        }
    }
    in_vain
}

/// The margin covers every arithmetic that WGSL permits, and a margin of nothing does not.
#[test]
fn no_arithmetic_allows_too_much() {
    let whole = allowed_in_vain(300, 24.0, NEED_FACTOR);
    let nothing = allowed_in_vain(300, 0.0, 1.0);
    eprintln!("allowed in vain by error and by size: {whole:?}; without a margin: {nothing:?}");
    assert_eq!(whole, [0, 0]);
    assert!(nothing.iter().all(|in_vain| *in_vain > 20), "{nothing:?}");
}

/// Rounding to nearest, the mirror allows what the device allows.
#[test]
fn the_mirror_agrees_with_the_device() {
    let mut different = 0;
    for setting in SETTINGS.iter().map(|make| make()) {
        for kind in KINDS {
            let cases = Cases::tight(&setting, kind, 1_000, 71);
            let rule = LodRule::Error { pixels: setting.pixels };
            let view = view_words(&setting, &rule);
            let mirror = LodMirror::new(&view, NEEDS_WORD);
            let chosen = cases.choose(&engine(), (&rule, &view));
            let lod_of = |i: usize, case: &Case, record: &[u32]| {
                let allows = |error: &f64| {
                    let need = Need::Error(*error as f32, case.scale);
                    let arithmetic = &mut Arithmetic::new(STYLES[0], 0);
                    mirror.allows((kind, record), need, (24.0, NEED_FACTOR), arithmetic)
                };
                cases.errors_of(i)[1..].iter().take_while(|error| allows(error)).count()
            };
            let records = cases.all.iter().zip(cases.records()).enumerate();
            different += records
                .zip(chosen)
                .filter(|((i, (case, record)), chosen)| lod_of(*i, case, record) != *chosen)
                .count();
        }
    }
    eprintln!("different LODs: {different} of {}", 1_000 * KINDS.len() * SETTINGS.len());
    // A compiler may order sums in another way.
    assert!(different < 1_000 * KINDS.len() * SETTINGS.len() / 100, "{different}");
}

/// Bounds that cross the plane of the eye, and those behind it, get LOD 0 from every rule.
#[test]
fn bounds_at_the_eye_get_the_full_mesh() {
    for setting in perspectives() {
        for kind in KINDS {
            let cases = Cases::at_the_eye(&setting, kind, 3_000, 51);
            for rule in [
                LodRule::Error { pixels: 32_768.0 },
                LodRule::Distance { thresholds: vec![0.0, 1.0] },
                LodRule::Size { pixels: vec![32_768.0] },
            ] {
                let chosen = cases.choose(&engine(), (&rule, &view_words(&setting, &rule)));
                assert!(chosen.iter().all(|lod| *lod == 0), "{}, {kind:?}", setting.name);
            }
        }
    }
}

/// No LOD past those of the mesh or of the rule, and none without a rule.
#[test]
fn the_number_of_lods_ends_the_choice() {
    let setting = lod_cases::along_z();
    let cases = Cases::small_and_far(&setting, 400);
    for (rule, most) in [
        (LodRule::Finest, 0),
        (LodRule::Error { pixels: 1.0 }, 7),
        (LodRule::Distance { thresholds: vec![1.0, 2.0] }, 2),
        (LodRule::Size { pixels: vec![9.0, 8.0, 7.0, 6.0, 5.0, 4.0, 3.0] }, 7),
    ] {
        let chosen = cases.choose(&engine(), (&rule, &view_words(&setting, &rule)));
        for (lod, case) in chosen.into_iter().zip(&cases.all) {
            assert_eq!(lod, most.min(case.lods.saturating_sub(1)), "{rule:?}: {}", case.lods);
        }
    }
}
