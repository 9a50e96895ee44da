//! `Fit::Volume` against the exact oracle, on depth images that are made to fit.
//! Each pixel holds almost exactly the depth at which it begins to show the volume.
//! So an ulp, or a single pixel, decides the verdict.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, KINDS};
use common::{engine, soak_times};
use hiz_core::headless::Engine;
use hiz_core::{BoundsKind, Coverage, Fit, Footprint};
use hiz_ref::{OwnDepth, Verdict};

/// The counts of a run.
#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    /// Hidden, according to the oracle.
    hidden: usize,
    /// Hidden, but not if all of the volume were at its nearest depth.
    to_gain: usize,
    culled: usize,
    /// Of `to_gain`, those that were culled.
    gained: usize,
    /// Culled although visible: must be 0.
    false_culls: usize,
}

/// What culls of random depth that fits were; with a planted fault, up to the first false cull.
/// For these, each volume is moved to where the oracle's verdict changes.
fn run(
    engine: &Engine,
    kinds: &'static [BoundsKind],
    seed: u64,
    rounds: usize,
    coverage: Coverage,
    modes: &'static [(Footprint, u32)],
    planted: bool,
) -> Tally {
    let mut tally = Tally::default();
    let campaign = Campaign {
        seed,
        rounds,
        volumes: 4,
        coverage,
        modes,
        fit: Fit::Volume,
        ..Campaign::default()
    };
    for round in campaign.fitted(kinds, planted) {
        // `None` for a camera that float32 cannot hold.
        let Some(masks) = round.masks(engine) else { continue };
        let (kind, volume, culled) = (round.volumes[0].0, &round.volumes[0].1[0], !masks[0][0]);
        tally.cases += 1;
        let outcome = round.outcome(volume);
        if outcome.verdict == Verdict::Hidden {
            let gain = round.outcome_as(volume, OwnDepth::Nearest).verdict == Verdict::Visible;
            tally.hidden += 1;
            tally.to_gain += usize::from(gain);
            tally.culled += usize::from(culled);
            tally.gained += usize::from(culled && gain);
        } else if culled {
            if tally.false_culls == 0 {
                eprintln!("first false cull: {}", round.describe(kind, volume));
            }
            tally.false_culls += 1;
            if planted {
                break;
            }
        }
    }
    tally
}

#[test]
fn no_false_cull_on_depth_that_fits() {
    type Kinds = &'static [BoundsKind];
    type Modes = &'static [(Footprint, u32)];
    // Few pipelines, because each takes long to compile.
    // Where the volume's own depth rarely decides, more rounds are needed to see that it does.
    let modes: [(u64, usize, Coverage, Kinds, Modes); 3] = [
        (31, 7, Coverage::Area, &KINDS, &[(Footprint::Two, 4096)]),
        (
            32,
            7,
            Coverage::Sample,
            &[BoundsKind::Sphere, BoundsKind::OrientedBox],
            &[(Footprint::Two, 4096)],
        ),
        (33, 15, Coverage::Area, &[BoundsKind::OrientedBox], &[(Footprint::Eight, 0)]),
    ];
    for (seed, rounds, coverage, kinds, mode) in modes {
        let tally = run(&engine(), kinds, seed, rounds * soak_times(), coverage, mode, false);
        eprintln!("{coverage:?} {mode:?}: {tally:?}");
        assert_eq!(tally.false_culls, 0);
        assert!(tally.gained > tally.to_gain / 100, "{tally:?}");
    }
}

/// Each fault makes the fit too tight somewhere, and a depth image that fits must show it.
/// Each fault compiles its own pipelines, so only one kind of bounds is used.
#[test]
fn planted_faults_turn_it_red() {
    type Faults = [(&'static str, &'static str)];
    let planted: [(&str, &Faults); 4] = [
        (
            "no certificate, no margin",
            &[
                ("small && surely_above(r, offset, p.w)", "small"),
                ("least - GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min", "least"),
            ],
        ),
        (
            "the texel's nearest corner",
            &[(
                "select(left_top, right_bottom, plane.slope >",
                "select(right_bottom, left_top, plane.slope >",
            )],
        ),
        ("a pixel too few", &[("min(end, last + vec2<u32>(1u)), bits)", "min(end, last), bits)")]),
        (
            "a back taken for a front",
            &[(
                "guess.facing != 0.0 || !on_border(guess.own, interval.y",
                "!on_border(guess.own, interval.y",
            )],
        ),
    ];
    for (name, faults) in planted {
        let engine = Engine::with_planted_faults(None, faults)
            .expect("the device tests need a Vulkan driver");
        let tally = run(
            &engine,
            &[BoundsKind::OrientedBox],
            36,
            20,
            Coverage::Area,
            &[(Footprint::Two, 4096)],
            true,
        );
        eprintln!("{name}: {tally:?}");
        assert!(tally.false_culls > 0, "{name}: stayed green: {tally:?}");
    }
}
