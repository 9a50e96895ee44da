//! `Fit::Volume` against the exact oracle, on depth images made to fit: each pixel holds just about the depth at which it begins
//! to show the volume, so that an ulp, or one pixel of them all, decides.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Arrays, Campaign, KINDS, Round};
use common::{Random, engine};
use hiz_core::headless::Engine;
use hiz_core::{BoundsKind, Coverage, CullOptions, Fit, Footprint, InstanceOptions, VisibleOptions};
use hiz_ref::{Options, OwnDepth, Verdict, View, Volume};

/// What a run found.
#[derive(Debug, Default)]
struct Tally {
    cases: usize,
    /// Says the oracle.
    hidden: usize,
    /// Hidden, but not if all of the volume had its nearest depth.
    to_gain: usize,
    culled: usize,
    /// Culled of those to gain.
    gained: usize,
    /// Culled although visible: must be 0.
    false_culls: usize,
}

/// Some steps of float32 nearer (below 0) or farther, within 0..=1.
fn moved(depth: f32, steps: i64, reversed: bool) -> f32 {
    let steps = if reversed { -steps } else { steps };
    f32::from_bits((i64::from(depth.to_bits()) + steps).clamp(0, i64::from(1.0_f32.to_bits())) as u32)
}

/// Depth that is nearer than what a volume shows in each pixel, by a few ulps or by a share of the way to the nearest depth of all;
/// often one pixel is spoilt.
fn tight_image(random: &mut Random, view: &View, volume: &Volume, coverage: hiz_ref::Coverage) -> Vec<f32> {
    let own: Vec<Option<f32>> = (0..view.height)
        .flat_map(|y| (0..view.width).map(move |x| [x, y]))
        .map(|pixel| hiz_ref::own_depth(view, volume, coverage, pixel).expect("a finite view"))
        .collect();
    let nearest = own.iter().flatten().copied().reduce(if view.reversed { f32::max } else { f32::min });
    let ulps = random.pick(&[0, 1, 20, 1000, 30_000]);
    let share = random.pick(&[0.0, 0.0, 0.02, 0.2, 0.6]);
    // The pixels that it does not touch: far beyond it (they must be told apart), or in front of it.
    let outside = random.pick(&[0.0, 1.0]);
    let mut depth: Vec<f32> = own
        .iter()
        .map(|own| match (own, nearest) {
            (Some(own), Some(nearest)) => moved(own + share * (nearest - own), -ulps, view.reversed),
            _ => outside,
        })
        .collect();
    if random.below(2) == 0 {
        let pixel = random.below(view.width * view.height) as usize;
        depth[pixel] = moved(own[pixel].unwrap_or(outside), random.pick(&[0, 1, 20, 1000, 30_000]), view.reversed);
    }
    depth
}

/// Boxes at every angle, and plates that recede before the eye: faces that recede are what the fit is for.
fn tilted(random: &mut Random, round: &Round, volume: &Volume) -> Volume {
    let Volume::OrientedBox { center, half_sizes, .. } = *volume else { return *volume };
    let minus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] - b[k]);
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let unit = |v: [f64; 3]| v.map(|x| x / length(v));
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let mut any = || [0; 3].map(|_| random.range(-1.0, 1.0));
    let (a, b) = (unit(any()), any());
    let to_eye = minus(round.camera.origin(), center);
    if random.below(2) == 0 || length(to_eye) == 0.0 {
        let c = unit(cross(a, b));
        return Volume::OrientedBox { center, half_sizes, axes: [a, cross(c, a), c] };
    }
    // Its normal is up to 60 degrees off the line to the eye; thin or flat.
    let toward = unit(to_eye);
    let normal = unit([0, 1, 2].map(|k| toward[k] + 0.8 * a[k]));
    let side = unit(cross(normal, b));
    let up = cross(normal, side);
    let wide = 0.3 * length(to_eye);
    Volume::OrientedBox {
        center,
        half_sizes: [wide, wide, random.pick(&[0.0, 0.01]) * wide],
        axes: [0, 1, 2].map(|k| [side[k], up[k], normal[k]]),
    }
}

fn run(
    engine: &Engine,
    kinds: &[BoundsKind],
    seed: u64,
    rounds: usize,
    coverage: Coverage,
    (footprint, descent): (Footprint, u32),
) -> Tally {
    let reference = match coverage {
        Coverage::Area => hiz_ref::Coverage::Area,
        Coverage::Sample => hiz_ref::Coverage::Sample,
    };
    let cull_options = CullOptions {
        coverage,
        // Sample coverage without its guard: the oracle has none.
        guard_px: Some(0.0),
        depth_slack: 0.0,
        footprint,
        descent,
        fit: Fit::Volume,
        statistics: false,
        ..CullOptions::default()
    };
    let mut tally = Tally::default();
    let campaign = Campaign { seed, rounds, volumes: 4, coverage, ..Campaign::default() };
    // The depth of each pixel is searched for; large images take long.
    for round in campaign.rounds().filter(|round| round.view.width * round.view.height <= 400) {
        let mut random = Random(seed ^ round.number as u64);
        for (kind, volumes) in round.volumes.iter().filter(|(kind, _)| kinds.contains(kind)) {
            for volume in volumes {
                let volume = tilted(&mut random, &round, volume);
                let depth = tight_image(&mut random, &round.view, &volume, reference);
                let image = engine.upload_depth(&depth, &round.camera).expect("upload");
                let pyramid = engine.pyramid(&image).expect("pyramid");
                let arrays = Arrays::new(std::slice::from_ref(&volume));
                let instances =
                    engine.instances(&arrays.bounds(*kind), &InstanceOptions::default()).expect("instances");
                let Ok(culling) =
                    engine.cull(&instances, &round.camera, &pyramid, &cull_options, &VisibleOptions::default())
                else {
                    // A camera that float32 cannot hold.
                    continue;
                };
                let culled = !culling.mask().expect("mask")[0];
                let oracle = |own_depth| {
                    let options = Options { coverage: reference, own_depth, ..Options::default() };
                    hiz_ref::classify_with(&round.view, &volume, &depth, options).expect("a finite view")
                };
                tally.cases += 1;
                let outcome = oracle(OwnDepth::PerPixel);
                if outcome.verdict == Verdict::Hidden {
                    let gain = oracle(OwnDepth::Nearest).verdict == Verdict::Visible;
                    tally.hidden += 1;
                    tally.to_gain += usize::from(gain);
                    tally.culled += usize::from(culled);
                    tally.gained += usize::from(culled && gain);
                } else if culled {
                    if tally.false_culls == 0 {
                        eprintln!("first false cull: seed {seed} round {} {kind:?}: {outcome:?}", round.number);
                        eprintln!("{volume:?}\n{:?}", round.view);
                    }
                    tally.false_culls += 1;
                }
            }
        }
    }
    tally
}

#[test]
fn no_false_cull_on_depth_that_fits() {
    // Few pipelines: each takes long to compile.
    for (seed, coverage, kinds, mode) in [
        (31, Coverage::Area, &KINDS[..], (Footprint::Two, 4096)),
        (32, Coverage::Sample, &KINDS[..], (Footprint::Two, 4096)),
        (33, Coverage::Area, &[BoundsKind::OrientedBox], (Footprint::Eight, 0)),
    ] {
        let tally = run(engine(), kinds, seed, 30, coverage, mode);
        eprintln!("{coverage:?} {mode:?}: {tally:?}");
        assert_eq!(tally.false_culls, 0);
        assert!(tally.gained > tally.to_gain / 50, "{tally:?}");
    }
}

/// Each fault makes the fit too tight somewhere; a depth image that fits must show it. (One kind: each fault compiles anew.)
#[test]
fn planted_faults_turn_it_red() {
    type Faults = [(&'static str, &'static str)];
    let planted: [(&str, &Faults); 4] = [
        (
            "no certificate, no margin",
            &[
                ("small && surely_above(r, offset, p.w)", "small"),
                ("least - 3.0 * error_bound(r, least, p.w) / p.w_min", "least"),
            ],
        ),
        (
            "the texel's nearest corner",
            &[("select(left_top, right_bottom, plane.slope >", "select(right_bottom, left_top, plane.slope >")],
        ),
        ("a pixel too few", &[("min(end, last + vec2<u32>(1u)), bits)", "min(end, last), bits)")]),
        (
            "a back taken for a front",
            &[("guess.facing != 0.0 || !on_border(guess.own, interval.y", "!on_border(guess.own, interval.y")],
        ),
    ];
    for (name, faults) in planted {
        let engine = Engine::with_planted_faults(None, faults).expect("the device tests need a Vulkan driver");
        let tally = run(&engine, &[BoundsKind::OrientedBox], 34, 60, Coverage::Area, (Footprint::Two, 4096));
        eprintln!("{name}: {tally:?}");
        assert!(tally.false_culls > 0, "{name}: stayed green: {tally:?}");
    }
}
