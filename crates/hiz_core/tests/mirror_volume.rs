//! The volume fit and the descent in every arithmetic that WGSL permits, over slopes and offsets that may be anything.

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
use mirror::{Arithmetic, Loss, Margins, Mirror, STYLES, Style, WILDEST, WITHOUT_SLOPE_BARS, texel_loss};

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
        Self { styles: styles.to_vec(), margins: margins.to_vec(), false_culls: none.clone(), culled: none, cases: 0 }
    }

    fn of(styles: &[Style], margins: &[Margins], rounds: impl Iterator<Item = Round>) -> Self {
        let mut power = Self::new(styles, margins);
        rounds.for_each(|round| power.add(&round));
        power
    }

    fn add(&mut self, round: &Round) {
        let Some(mirror) = Mirror::new(round) else { return };
        let (kind, volumes) = &round.volumes[0];
        // The oracle is asked only if somebody culls.
        let mut visible = None;
        self.cases += 1;
        for (i, style) in self.styles.iter().enumerate() {
            for (k, margins) in self.margins.iter().enumerate() {
                let mut arithmetic = Arithmetic::new(*style, round.seed ^ round.number as u64);
                if !mirror.masks(*margins, &mut arithmetic)[0][0] {
                    let visible =
                        *visible.get_or_insert_with(|| round.outcome(&volumes[0]).verdict == Verdict::Visible);
                    if visible && self.false_culls[i][k] == 0 && margins.certificate == Margins::FULL.certificate {
                        eprintln!("{} {margins:?}: {}", style.name, round.describe(*kind, &volumes[0]));
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

/// To nearest the mirror says what the device says, with any guard and slack; but for the guesses: nothing demands of a device's
/// quotients, roots and sines what the host's are, and a plane may be proved with the one and not with the other.
#[test]
fn to_nearest_it_agrees_with_the_device() {
    let (mut cases, mut culled, mut kept_by_mirror, mut kept_by_device, mut false_culls) = (0, 0, 0, 0, 0);
    for (seed, any_slack) in [(51, false), (59, true)] {
        let campaign = Campaign { rounds: 6, modes: DESCENTS, any_slack, ..campaign(seed, Coverage::Area) };
        for round in campaign.fitted(&KINDS, false) {
            let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(engine())) else { continue };
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
        "mirror: {cases} cases, {culled} culled, kept by it alone {kept_by_mirror}, by the device alone {kept_by_device}, \
         false culls {false_culls}"
    );
    assert_eq!(false_culls, 0);
    assert!(culled > cases / 5, "few culls prove little");
    assert!(kept_by_mirror + kept_by_device <= cases / 400, "the device computes something else");
}

/// What each planted fault culls beyond the mirror. One kind and one convention: each fault compiles anew.
#[test]
fn it_sees_what_is_planted_in_the_device() {
    type Fault = (&'static str, &'static [(&'static str, &'static str)]);
    let faults: &[Fault] = &[
        ("no slack", &[("bar(occluding_depth(bits) - view.z_slope)", "bar(bitcast<f32>(bits) - view.z_slope)")]),
        ("no guard, left and top", &[("vec2<f32>(begin) - view.reach", "vec2<f32>(begin)")]),
        ("no guard, right and bottom", &[("vec2<f32>(end) + view.reach", "vec2<f32>(end)")]),
        ("an edge's other side", &[("r = Value(-r.center, r.size, -r.half);", "")]),
        ("the other convention's front", &[("return select(1.0, -1.0, REVERSED);", "return 1.0;")]),
        (
            "outlines that bound depth",
            &[("let bound = plane.facing * depth;", "let bound = min(plane.facing, 0.0) * depth;")],
        ),
        (
            "an offset of 0 for edges",
            &[("slope, guess.facing, offset)", "slope, guess.facing, abs(guess.facing) * offset)")],
        ),
        (
            "sides that nothing proves",
            &[
                ("guess.x - widened", "guess.x + widened + 0.1"),
                ("select(-BEYOND, low, surely_above(r, low, w))", "low"),
            ],
        ),
        (
            "a texel's first pixel alone",
            &[("(corner + vec2<u32>(1u)) << vec2<u32>(child)", "(corner << vec2<u32>(child)) + vec2<u32>(1u)")],
        ),
        (
            "no other plane's offset",
            &[(
                "let plane = (*planes).list[i];",
                "var plane = (*planes).list[i]; plane.offset = (*planes).list[0].offset;",
            )],
        ),
        ("a column's fall alone", &[("plane.offset - fall.x - fall.y", "plane.offset - fall.x")]),
        ("one side for both axes", &[("plane.slope > vec2<f32>(0.0)", "vec2<bool>(plane.slope.x > 0.0)")]),
        (
            "no certificate, no margin",
            &[
                ("small && surely_above(r, offset, p.w)", "small"),
                ("bar(least - 3.0 * error_bound(r, least, p.w) / p.w_min)", "least + 1e-4 * extent"),
            ],
        ),
        ("no margin of a texel", &[("let margin = 8.0 * EPS *", "let margin = -8.0 * EPS *")]),
        ("a margin without the slopes", &[("+ abs(slope.x) * p.x.size + abs(slope.y) * p.y.size", "")]),
        ("a 24th of the margin", &[("ERROR_ULPS: f32 = 24.0", "ERROR_ULPS: f32 = 1.0")]),
        ("no steepest", &[("vec2<u32>(STEEPEST_BITS)", "vec2<u32>(0x7f7fffffu)")]),
        ("no largest", &[("if small && surely", "if surely")]),
        (
            "a descent that forgets a row",
            &[(
                "begin = max(corner, first >> vec2<u32>(child));",
                "begin = max(corner + vec2<u32>(0u, 1u), first >> vec2<u32>(child));",
            )],
        ),
        (
            "a descent that ends early",
            &[(
                "if child == 0u || !DESCENT {\n                    return false;",
                "if child == 0u || !DESCENT {\n                    return true;",
            )],
        ),
    ];
    for kind in [BoundsKind::OrientedBox, BoundsKind::Sphere] {
        let kinds: &'static [BoundsKind] =
            if kind == BoundsKind::Sphere { &[BoundsKind::Sphere] } else { &[BoundsKind::OrientedBox] };
        let rounds: Vec<_> = [(61, false), (62, true)]
            .into_iter()
            .flat_map(|(seed, any_slack)| {
                let campaign =
                    Campaign { rounds: 16, volumes: 4, modes: DESCENTS, any_slack, ..campaign(seed, Coverage::Area) };
                campaign.fitted(kinds, false).filter(|round| round.view.reversed)
            })
            .filter_map(|round| {
                let mirror = Mirror::new(&round)?;
                let kept = mirror.masks(Margins::FULL, &mut Arithmetic::new(STYLES[0], 0))[0][0];
                let visible = round.outcome(&round.volumes[0].1[0]).verdict == Verdict::Visible;
                Some((round, kept, visible))
            })
            .collect();
        for (name, planted) in faults {
            let engine = Engine::with_planted_faults(None, planted).expect("the device tests need a Vulkan driver");
            let (mut more, mut fewer, mut false_culls) = (0, 0, 0);
            for (round, kept, visible) in &rounds {
                let theirs = round.masks(&engine).expect("the mirror took it")[0][0];
                more += usize::from(*kept && !theirs);
                fewer += usize::from(!*kept && theirs);
                false_culls += usize::from(!theirs && *visible);
            }
            eprintln!("{kind:?}, {name}: of {} {more} more, {fewer} fewer, {false_culls} false culls", rounds.len());
        }
    }
}

#[test]
fn no_arithmetic_gives_a_false_cull() {
    let styles = [&STYLES[..], &[WILDEST]].concat();
    for (seed, coverage) in [(53, Coverage::Area), (54, Coverage::Sample)] {
        for sharp in [false, true] {
            let start = std::time::Instant::now();
            let rounds = Campaign { rounds: 6, ..campaign(seed, coverage) }.fitted(&KINDS, sharp);
            let power = Power::of(&styles, &[Margins::FULL], rounds);
            eprintln!("{coverage:?}, sharp {sharp}: {:?}\n{power}", start.elapsed());
            assert_eq!(power.total(), 0);
        }
    }
}

#[test]
fn with_less_margin_some_do() {
    let styles = [&STYLES[..], &[WILDEST, WITHOUT_SLOPE_BARS]].concat();
    let margins = [(24.0, 8.0), (24.0, 0.0), (1.0, 8.0), (0.0, 8.0), (1.0, 0.0), (0.0, 0.0)]
        .map(|(certificate, texel)| Margins { certificate, texel, ..Margins::FULL });
    for sharp in [false, true] {
        let start = std::time::Instant::now();
        let rounds = Campaign { rounds: 10, ..campaign(55, Coverage::Area) }.fitted(&KINDS, sharp);
        let power = Power::of(&styles, &margins, rounds);
        eprintln!("sharp {sharp}: {:?}\n{power}", start.elapsed());
    }
}

/// What is lost of the 24 eps of a tilted row's certificate, and of the 8 of a texel's comparison.
#[test]
fn what_certificates_and_texels_lose() {
    let styles = [&STYLES[..], &[WILDEST, WITHOUT_SLOPE_BARS]].concat();
    let mut losses = vec![Loss::default(); styles.len()];
    let start = std::time::Instant::now();
    for round in (Campaign { rounds: 8, volumes: 24, ..campaign(56, Coverage::Area) }).loose(&KINDS) {
        let Some(mirror) = Mirror::new(&round) else { continue };
        for (style, loss) in styles.iter().zip(&mut losses) {
            let mut arithmetic = Arithmetic::new(Style { wild: true, ..*style }, round.seed ^ round.number as u64);
            loss.add(mirror.loss(&round, &mut arithmetic));
        }
    }
    for (style, loss) in styles.iter().zip(&losses) {
        let texel = texel_loss(20_000, &mut Arithmetic::new(*style, 57));
        eprintln!(
            "{:<22} certificates {:5.2} eps of {:6}, texels {:5.2} eps of {}",
            style.name, loss.eps, loss.claims, texel.eps, texel.claims
        );
    }
    eprintln!("{:?}", start.elapsed());
}

/// Why a slope is never subnormal: flushed in one product of a certificate and not in another, it moves a row by more than
/// the floor of the margin where X' is large. A slab across all of an image that holds nothing, on a device that guesses such slopes.
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
        hiz_core::Camera::from_clip_from_world(m, size, hiz_core::DepthConvention::Reversed).expect("a camera");
    (round.view.width, round.view.height, round.view.reversed) = (1, 1, true);
    round.depth = vec![0.0];
    // Just within the camera's coordinate limit, 2^42.
    let across = 0.95 * 2.0_f64.powi(42);
    let slab = hiz_ref::Volume::Box { min: [-1.0, -1.0, 2.0], max: [across, 1.0, 3.0] };
    round.volumes = vec![(hiz_core::BoundsKind::Box, vec![slab])];
    let mirror = Mirror::new(&round).expect("rows that float32 holds");
    let culls = |flattest: f32| {
        let margins = Margins { flattest, ..Margins::FULL };
        (0..4000).filter(|seed| !mirror.masks(margins, &mut Arithmetic::new(WILDEST, *seed))[0][0]).count()
    };
    let (without, with) = (culls(0.0), culls(Margins::FULL.flattest));
    eprintln!("false culls with subnormal slopes {without}, without {with}");
    assert!(with == 0 && without > 0);
}
