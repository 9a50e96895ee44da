//! The volume fit and the descent in every arithmetic that WGSL permits.
//! Slopes and offsets may be anything.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;
#[path = "common/mirror/mod.rs"]
mod mirror;

use campaign::{Campaign, KINDS, Round};
use common::engine;
use hiz_core::headless::Engine;
use hiz_core::{BoundsKind, Coverage, Fit, Footprint};
use hiz_ref::Verdict;
use mirror::{
    Arithmetic, Losses, Margins, Mirror, STYLES, Style, WILDEST, WITHOUT_SLOPE_BARS, texel_loss,
};

const DESCENTS: &[(Footprint, u32)] = &[(Footprint::Two, 4096)];
const MODES: &[(Footprint, u32)] =
    &[(Footprint::Two, 4096), (Footprint::Two, 4096), (Footprint::Eight, 0), (Footprint::Two, 12)];

fn campaign(seed: u64, coverage: Coverage) -> Campaign {
    Campaign { seed, volumes: 2, coverage, modes: MODES, fit: Fit::Volume, ..Campaign::default() }
}

/// False culls by style and margins.
struct Power {
    styles: Vec<Style>,
    margins: Vec<Margins>,
    false_culls: Vec<Vec<usize>>,
    culled: Vec<Vec<usize>>,
    cases: usize,
}

impl Power {
    fn new(styles: &[Style], margins: &[Margins]) -> Self {
        let none = vec![vec![0; margins.len()]; styles.len()];
        Self {
            styles: styles.to_vec(),
            margins: margins.to_vec(),
            false_culls: none.clone(),
            culled: none,
            cases: 0,
        }
    }

    fn of(styles: &[Style], margins: &[Margins], rounds: impl Iterator<Item = Round>) -> Self {
        let mut power = Self::new(styles, margins);
        rounds.for_each(|round| power.add(&round));
        power
    }

    fn add(&mut self, round: &Round) {
        let Some(mirror) = Mirror::new(round) else { return };
        let (kind, volumes) = &round.volumes[0];
        // The oracle is asked only if some arithmetic culls.
        let mut visible = None;
        self.cases += 1;
        for (i, style) in self.styles.iter().enumerate() {
            for (k, margins) in self.margins.iter().enumerate() {
                let mut arithmetic = Arithmetic::new(*style, round.seed ^ round.number as u64);
                if !mirror.masks(*margins, &mut arithmetic)[0][0] {
                    let visible = *visible.get_or_insert_with(|| {
                        round.outcome(&volumes[0]).verdict == Verdict::Visible
                    });
                    if visible
                        && self.false_culls[i][k] == 0
                        && margins.certificate == Margins::FULL.certificate
                    {
                        eprintln!(
                            "{} {margins:?}: {}",
                            style.name,
                            round.describe(*kind, &volumes[0])
                        );
                    }
                    self.false_culls[i][k] += usize::from(visible);
                    self.culled[i][k] += 1;
                }
            }
        }
    }

    fn total(&self) -> usize {
        self.false_culls.iter().flatten().sum()
    }
}

impl std::fmt::Display for Power {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:<22}", format!("{} cases", self.cases))?;
        for Margins { certificate, texel, .. } in &self.margins {
            write!(f, "{:>16}", format!("K {certificate}, {texel} eps"))?;
        }
        for (i, style) in self.styles.iter().enumerate() {
            write!(f, "\n{:<22}", style.name)?;
            for (false_culls, culled) in self.false_culls[i].iter().zip(&self.culled[i]) {
                write!(f, "{:>16}", format!("{false_culls} of {culled}"))?;
            }
        }
        Ok(())
    }
}

/// To nearest the mirror agrees with the device, with random guards and slacks, except for guesses.
/// A device's quotients, roots and sines need not be those of the host.
/// So a plane may be proved by one of them and not by the other.
#[test]
fn to_nearest_it_agrees_with_the_device() {
    let (mut cases, mut culled, mut kept_by_mirror, mut kept_by_device, mut false_culls) =
        (0, 0, 0, 0, 0);
    for (seed, any_slack) in [(51, false), (59, true)] {
        let campaign =
            Campaign { rounds: 6, modes: DESCENTS, any_slack, ..campaign(seed, Coverage::Area) };
        for round in campaign.fitted(&KINDS, false) {
            let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(&engine())) else {
                continue;
            };
            let ours = mirror.masks(Margins::FULL, &mut Arithmetic::new(STYLES[0], 0))[0][0];
            let theirs = device[0][0];
            cases += 1;
            culled += usize::from(!theirs);
            kept_by_mirror += usize::from(ours && !theirs);
            kept_by_device += usize::from(!ours && theirs);
            let sees = || round.outcome(&round.volumes[0].1[0]).verdict == Verdict::Visible;
            false_culls += usize::from((!ours || !theirs) && sees());
        }
    }
    eprintln!(
        "mirror: {cases} cases, {culled} culled, kept by it alone {kept_by_mirror}, \
         by the device alone {kept_by_device}, false culls {false_culls}"
    );
    assert_eq!(false_culls, 0);
    assert!(culled > cases / 5, "few culls prove little");
    assert!(kept_by_mirror + kept_by_device <= cases / 400, "the device computes something else");
}

type Fault = (&'static str, &'static [(&'static str, &'static str)]);

/// Faults that the oracle does not see in `fit_volume.rs`, because it has neither slack nor guard.
const FAULTS: &[Fault] = &[
    (
        "no slack",
        &[("bar(occluding_depth(bits) - view.z_slope)", "bar(bitcast<f32>(bits) - view.z_slope)")],
    ),
    ("no guard, left and top", &[("vec2<f32>(begin) - view.reach", "vec2<f32>(begin)")]),
    ("no guard, right and bottom", &[("vec2<f32>(end) + view.reach", "vec2<f32>(end)")]),
];

/// More faults, which take a minute.
const MORE_FAULTS: &[Fault] = &[
    ("the other convention's front", &[("return select(1.0, -1.0, REVERSED);", "return 1.0;")]),
    (
        "sides that nothing proves",
        &[
            ("guess.x - widened", "guess.x + widened + 0.1"),
            ("select(-BEYOND, low, surely_above(r, low, w))", "low"),
        ],
    ),
    ("a column's fall alone", &[("plane.offset - fall.x - fall.y", "plane.offset - fall.x")]),
    (
        "an offset of 0 for edges",
        &[("slope, guess.facing, offset)", "slope, guess.facing, abs(guess.facing) * offset)")],
    ),
    (
        "a texel's first pixel alone",
        &[(
            "let end = min((at + vec2<u32>(1u)) << vec2<u32>(level), vec2<u32>(view.size));",
            "let end = begin + vec2<u32>(1u);",
        )],
    ),
    (
        "another plane's offset",
        &[(
            "SupportingPlane(slope, guess.facing, offset);",
            "SupportingPlane(slope, guess.facing, offset); if (*planes).count > 0u { \
             (*planes).list[(*planes).count].offset = (*planes).list[0].offset; }",
        )],
    ),
    (
        "one side for both axes",
        &[("plane.slope > vec2<f32>(0.0)", "vec2<bool>(plane.slope.x > 0.0)")],
    ),
    (
        "no certificate, no margin",
        &[
            ("small && surely_above(r, offset, p.w)", "small"),
            (
                "bar(least - GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min)",
                "least + 1e-4 * extent",
            ),
        ],
    ),
    (
        "a margin without the slopes",
        &[("+ abs(slope.x) * p.x.error + abs(slope.y) * p.y.error", "")],
    ),
    (
        "a descent that forgets a row",
        &[
            ("if (at.y & last_child) < last_child && at.y < last.y {", "if false {"),
            ("let below = siblings(at.y, end.y);", "let below = 0u;"),
        ],
    ),
];

/// With each fault the device culls more beyond the mirror than without any.
/// One kind of bounds and one convention, because each fault compiles its own pipelines.
fn assert_seen(kinds: &'static [BoundsKind], faults: &[Fault]) {
    let rounds: Vec<_> = [(61, false), (62, true), (63, true), (64, true)]
        .into_iter()
        .flat_map(|(seed, any_slack)| {
            let campaign = Campaign {
                rounds: 8,
                volumes: 4,
                modes: DESCENTS,
                any_slack,
                ..campaign(seed, Coverage::Area)
            };
            campaign.fitted(kinds, false).filter(|round| round.view.reversed)
        })
        .filter_map(|round| {
            let kept =
                Mirror::new(&round)?.masks(Margins::FULL, &mut Arithmetic::new(STYLES[0], 0))[0][0];
            Some((round, kept))
        })
        .collect();
    let more = |engine: &Engine| {
        let culled = |(round, kept): &&(Round, bool)| {
            *kept && !round.masks(engine).expect("the mirror took it")[0][0]
        };
        rounds.iter().filter(culled).count()
    };
    let without = more(&engine());
    for (name, planted) in faults {
        let with = more(
            &Engine::with_planted_faults(None, planted)
                .expect("the device tests need a Vulkan driver"),
        );
        eprintln!(
            "{name}: of {} the device culls {with} beyond the mirror, without the fault {without}",
            rounds.len()
        );
        assert!(with > without, "{name}: stayed green");
    }
}

#[test]
fn it_sees_what_is_planted_in_the_device() {
    assert_seen(&[BoundsKind::Sphere], FAULTS);
}

#[test]
#[ignore = "a minute: make soak"]
fn it_sees_more_of_what_is_planted_in_the_device() {
    assert_seen(&[BoundsKind::OrientedBox], MORE_FAULTS);
}

/// Every arithmetic, and the one that does everything at once.
fn styles() -> Vec<Style> {
    [&STYLES[..], &[WILDEST]].concat()
}

#[test]
fn no_arithmetic_gives_a_false_cull() {
    for (seed, coverage, sharp) in
        [(53, Coverage::Area, false), (54, Coverage::Sample, false), (55, Coverage::Area, true)]
    {
        let rounds = Campaign { rounds: 8, ..campaign(seed, coverage) }.fitted(&KINDS, sharp);
        let power = Power::of(&styles(), &[Margins::FULL], rounds);
        eprintln!("{coverage:?}, sharp {sharp}\n{power}");
        assert_eq!(power.total(), 0);
        assert!(power.culled[0][0] > power.cases / 20, "few culls prove little");
    }
}

/// With a 24th of the margin, and with none for texels, some arithmetics err.
/// With no margin at all each of them does.
#[test]
fn with_less_margin_some_do() {
    let margins = [(1.0, 8.0), (1.0, 0.0), (0.0, 8.0), (0.0, 0.0)]
        .map(|(certificate, texel)| Margins { certificate, texel, ..Margins::FULL });
    let rounds = Campaign { rounds: 8, ..campaign(55, Coverage::Area) }.fitted(&KINDS, true);
    let power = Power::of(&styles(), &margins, rounds);
    eprintln!("{power}");
    let bent = |k: usize| power.false_culls.iter().map(|counts| counts[k]).sum::<usize>();
    assert!(bent(0) > 0, "a 24th of the margin, and green");
    assert!(bent(3) > bent(2), "no margin for texels, and the same");
    assert!(power.false_culls.iter().all(|counts| counts[3] > 0), "no margin, and green");
}

/// How much is really lost of the 24 eps of a tilted row's certificate.
/// The same of the 8 eps of a texel's comparison.
#[test]
fn what_certificates_and_texels_lose() {
    let styles = [&styles()[..], &[WITHOUT_SLOPE_BARS]].concat();
    let mut losses = vec![Losses::default(); styles.len()];
    for round in (Campaign { rounds: 3, volumes: 16, ..campaign(56, Coverage::Area) }).loose(&KINDS)
    {
        let Some(mirror) = Mirror::new(&round) else { continue };
        for (style, sum) in styles.iter().zip(&mut losses) {
            let mut arithmetic =
                Arithmetic::new(Style { wild: true, ..*style }, round.seed ^ round.number as u64);
            sum.add(mirror.losses(&round, &mut arithmetic));
        }
    }
    for (style, Losses { planes, extents, least_w }) in styles.iter().zip(&losses) {
        let texels = texel_loss(10_000, &mut Arithmetic::new(*style, 57));
        eprintln!(
            "{:<22} planes {:5.2} eps of {:6}, extents {:5.2} of {:6}, \
             least w {:5.2} of {:6}, texels {:5.2} of {}",
            style.name,
            planes.eps,
            planes.claims,
            extents.eps,
            extents.claims,
            least_w.eps,
            least_w.claims,
            texels.eps,
            texels.claims
        );
        // Half of the losses counted by hand leaves room for cases that are not tried.
        for (loss, most) in [(planes, 10.25), (extents, 9.25), (least_w, 6.75), (&texels, 2.5)] {
            assert!(loss.claims > 1000 && loss.eps < most, "{}: {loss:?}", style.name);
        }
    }
    let folded = losses.last().expect("styles").planes.eps;
    let barred = losses[styles.len() - 2].planes.eps;
    assert!(folded > barred, "a folded slope costs more: {folded} {barred}");
}

/// Why a slope is never subnormal.
/// It could be flushed in one product of a certificate and not in another.
/// Where X' is large, that moves a row by more than the floor of the margin.
/// The case is a slab across an empty image, on a device that guesses such slopes.
#[test]
fn subnormal_slopes_would_be_two_slopes() {
    let mut round = campaign(58, Coverage::Area).rounds().next().expect("a round");
    let m = [
        [2.0_f64.powi(17), 0.0, 0.0, 0.0],
        [0.0, 2.0_f64.powi(17), 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0, 0.0],
    ];
    let size = hiz_core::ImageSize::new(1, 1);
    round.camera =
        hiz_core::Camera::from_clip_from_world(m, size, hiz_core::DepthConvention::Reversed)
            .expect("a camera");
    (round.view.width, round.view.height, round.view.reversed) = (1, 1, true);
    round.depth = vec![0.0];
    // Just within the camera's coordinate limit, 2^42.
    // It is so far away that it does not count as crossing the eye's plane.
    let (across, away) = (0.95 * 2.0_f64.powi(42), 2.0_f64.powi(25));
    let slab = hiz_ref::Volume::Box {
        min: [-0.5 * away, -0.5 * away, away],
        max: [across, 0.5 * away, 1.5 * away],
    };
    round.volumes = vec![(hiz_core::BoundsKind::Box, vec![slab])];
    let mirror = Mirror::new(&round).expect("rows that float32 holds");
    let culls = |flattest: f32| {
        let margins = Margins { flattest, ..Margins::FULL };
        (0..4000)
            .filter(|seed| !mirror.masks(margins, &mut Arithmetic::new(WILDEST, *seed))[0][0])
            .count()
    };
    let (without, with) = (culls(0.0), culls(Margins::FULL.flattest));
    eprintln!("false culls with subnormal slopes {without}, without {with}");
    assert!(with == 0 && without > 0);
}
