//! The certificates in every arithmetic that WGSL permits.
//! The shader's steps run on the host, rounding up and down, fusing, reassociating and flushing.
//! A device does one of these, and the margin has to cover all.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;
#[path = "common/mirror/mod.rs"]
mod mirror;

use campaign::{Campaign, Class, POINTS, Round, moved};
use common::{Random, engine};
use hiz_core::{
    BoundsKind, Camera, Coverage, DepthConvention, ERROR_ULPS, Footprint, ImageSize, Pose,
    Projection,
};
use hiz_ref::{Verdict, View, Volume};
use mirror::{Arithmetic, MARGIN_FIRST, Margins, Mirror, STYLES, Style, WITHOUT_BARS};

/// Every footprint.
const FOOTPRINTS: &[(Footprint, u32)] = &[
    (Footprint::One, 0),
    (Footprint::Two, 0),
    (Footprint::Two, 0),
    (Footprint::Four, 0),
    (Footprint::Eight, 0),
];

/// False culls by margin and style.
struct Power {
    margins: Vec<f32>,
    styles: Vec<Style>,
    false_culls: Vec<Vec<usize>>,
    cases: usize,
}

impl Power {
    fn new(margins: &[f32], styles: &[Style]) -> Self {
        let false_culls = vec![vec![0; styles.len()]; margins.len()];
        Self { margins: margins.to_vec(), styles: styles.to_vec(), false_culls, cases: 0 }
    }

    fn add(&mut self, round: &Round) {
        let Some(mirror) = Mirror::new(round) else { return };
        // The oracle is asked once per volume, and only if some arithmetic culls it.
        let mut visible: Vec<Vec<Option<bool>>> =
            round.volumes.iter().map(|(_, v)| vec![None; v.len()]).collect();
        self.cases += visible.iter().map(Vec::len).sum::<usize>();
        for (margin, false_culls) in self.margins.iter().zip(&mut self.false_culls) {
            for (style, count) in self.styles.iter().zip(false_culls) {
                let mut arithmetic = Arithmetic::new(*style, round.seed ^ round.number as u64);
                let masks = mirror.masks(*margin, &mut arithmetic);
                for ((volumes, mask), known) in round.volumes.iter().zip(&masks).zip(&mut visible) {
                    for (i, _) in mask.iter().enumerate().filter(|(_, kept)| !**kept) {
                        let visible = *known[i].get_or_insert_with(|| {
                            round.outcome(&volumes.1[i]).verdict != Verdict::Hidden
                        });
                        *count += usize::from(visible);
                    }
                }
            }
        }
    }

    fn of_campaign(margins: &[f32], styles: &[Style], campaign: Campaign) -> Self {
        let mut power = Self::new(margins, styles);
        campaign.rounds().for_each(|round| power.add(&round));
        power
    }

    fn total(&self, margin: usize) -> usize {
        self.false_culls[margin].iter().sum()
    }
}

impl std::fmt::Display for Power {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:<22}", format!("{} cases", self.cases))?;
        for margin in &self.margins {
            write!(f, "{:>9}", format!("K = {margin}"))?;
        }
        for (k, style) in self.styles.iter().enumerate() {
            write!(f, "\n{:<22}", style.name)?;
            for false_culls in &self.false_culls {
                write!(f, "{:>9}", false_culls[k])?;
            }
        }
        Ok(())
    }
}

/// `round` with each volume twice.
/// One copy is moved to where the full margin just keeps it, the other to where it just culls it.
/// Both are off by a hundredth of the margin.
/// Only there does it show what a term of the margin contributes.
fn at_the_margin(mut round: Round, mirror: &Mirror) -> Round {
    let arithmetic = &mut Arithmetic::new(STYLES[0], 0);
    for ((_, volumes), ways) in round.volumes.iter_mut().zip(&round.away) {
        *volumes = volumes
            .iter()
            .zip(ways)
            .flat_map(|(volume, away)| {
                let at = |s: f64| moved(volume, away.map(|x| x * s));
                let mut culls = |s: f64| mirror.culls_volume(&at(s), ERROR_ULPS as f32, arithmetic);
                let (mut kept, mut culled) = (0.0, 1e-8);
                while culled < 1.0 && !culls(culled) {
                    (kept, culled) = (culled, 2.0 * culled);
                }
                for _ in 0..10 {
                    let middle = 0.5 * (kept + culled);
                    if culls(middle) { culled = middle } else { kept = middle }
                }
                [at(0.99 * kept), at(1.01 * culled)]
            })
            .collect();
    }
    round
}

/// The mirror computes what the shader computes.
/// Rounding to nearest, it agrees with the device in three kinds of case:
///
/// - those where the last bits decide the oracle's verdict;
/// - those that the margin decides;
/// - those with random guards and slacks.
///
/// The sums at the frustum's planes are taken in the order of the device's compiler.
#[test]
fn to_nearest_it_agrees_with_the_device() {
    let (mut cases, mut culled) = (0, 0);
    // By the order of those sums: kept only by the mirror, kept only by the device.
    let mut differences = [[0; 2]; 2];
    for (seed, coverage, any_slack) in
        [(31, Coverage::Area, false), (36, Coverage::Area, true), (37, Coverage::Sample, true)]
    {
        let campaign = Campaign {
            seed,
            rounds: 3,
            coverage,
            any_slack,
            modes: FOOTPRINTS,
            ..Campaign::default()
        };
        for round in campaign.rounds() {
            let Some(mirror) = Mirror::new(&round) else { continue };
            for round in [
                at_the_margin(campaign.round(round.number).expect("the same again"), &mirror),
                round,
            ] {
                let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(&engine()))
                else {
                    continue;
                };
                cases += device.iter().map(Vec::len).sum::<usize>();
                culled += device.iter().flatten().filter(|kept| !**kept).count();
                for (style, [by_mirror, by_device]) in
                    [STYLES[0], MARGIN_FIRST].iter().zip(&mut differences)
                {
                    let masks = mirror.masks(ERROR_ULPS as f32, &mut Arithmetic::new(*style, 0));
                    for (ours, theirs) in masks.iter().flatten().zip(device.iter().flatten()) {
                        *by_mirror += usize::from(*ours && !theirs);
                        *by_device += usize::from(!ours && *theirs);
                    }
                }
            }
        }
    }
    eprintln!("mirror: {cases} cases, {culled} culled, kept by it alone and by the device alone:");
    eprintln!(
        "in the order that is written {:?}, the margin first {:?}",
        differences[0], differences[1]
    );
    // These drivers round to nearest, fuse nothing and use one of the two orders.
    // Another driver may give different verdicts to volumes within a rounding of the margin.
    let plain = ["llvmpipe", "SwiftShader"]
        .iter()
        .any(|name| engine().adapter().to_string().contains(name));
    let allowed = if plain { 0 } else { cases / 20 };
    let least = differences.map(|d| d[0] + d[1]).into_iter().min().expect("two");
    assert!(least <= allowed, "the device computes something else");
    assert!(culled > cases / 10, "few culls prove little");
}

/// Points of both widths, whose records have no low half or no size.
///
/// To nearest the mirror agrees with the device; in every other arithmetic nothing that shows is
/// culled.
/// With a 24th of the margin something is, so the campaign is sharp.
#[test]
fn points_in_every_arithmetic() {
    let campaign = |seed, rounds, coverage| Campaign {
        seed,
        rounds,
        coverage,
        kinds: &POINTS,
        modes: FOOTPRINTS,
        ..Campaign::default()
    };
    let (mut cases, mut culled) = (0, 0);
    let mut differences = [0; 2];
    for round in campaign(51, 3, Coverage::Area).rounds() {
        let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(&engine())) else {
            continue;
        };
        cases += device.iter().map(Vec::len).sum::<usize>();
        culled += device.iter().flatten().filter(|kept| !**kept).count();
        for (style, count) in [STYLES[0], MARGIN_FIRST].iter().zip(&mut differences) {
            let masks = mirror.masks(ERROR_ULPS as f32, &mut Arithmetic::new(*style, 0));
            let both = masks.iter().flatten().zip(device.iter().flatten());
            *count += both.filter(|(ours, theirs)| ours != theirs).count();
        }
    }
    eprintln!("points: {cases} cases, {culled} culled, {differences:?} differ from the device");
    let plain = ["llvmpipe", "SwiftShader"]
        .iter()
        .any(|name| engine().adapter().to_string().contains(name));
    let allowed = if plain { 0 } else { cases / 20 };
    assert!(differences[0].min(differences[1]) <= allowed && culled > cases / 10);
    for (seed, coverage) in [(52, Coverage::Area), (53, Coverage::Sample)] {
        let margins = [ERROR_ULPS as f32, 1.0, 0.0];
        let power = Power::of_campaign(&margins, &STYLES, campaign(seed, 12, coverage));
        eprintln!("{coverage:?}\n{power}");
        assert_eq!(power.total(0), 0);
        assert!(coverage == Coverage::Sample || power.total(2) > 0, "no margin, and green");
    }
}

#[test]
fn no_arithmetic_gives_a_false_cull() {
    for (seed, coverage) in [(32, Coverage::Area), (33, Coverage::Sample)] {
        let campaign =
            Campaign { seed, rounds: 12, coverage, modes: FOOTPRINTS, ..Campaign::default() };
        let power = Power::of_campaign(&[ERROR_ULPS as f32], &STYLES, campaign);
        eprintln!("{coverage:?}\n{power}");
        assert_eq!(power.total(0), 0);
    }
}

/// With a 24th of the margin some arithmetic errs, so the campaign is sharp enough to notice.
#[test]
fn a_twenty_fourth_of_the_margin_is_too_little() {
    let campaign = Campaign { seed: 34, rounds: 12, ..Campaign::default() };
    let power = Power::of_campaign(&[1.0], &STYLES, campaign);
    eprintln!("{power}");
    assert!(power.total(0) > 0);
    assert_eq!(power.false_culls[0][0], 0, "to nearest it takes less than that");
}

/// Why the shader has `bar`.
/// A compiler could fold `(hi - eye_hi) + (lo - eye_lo)` or `z - (d - A) w`.
/// That makes false culls that no margin in eps covers.
/// Neither driver at hand folds them, so no other test turns red without the bars.
#[test]
fn without_bars_a_compiler_could_fold_what_cancels() {
    let campaign = Campaign { seed: 35, rounds: 6, ..Campaign::default() };
    let power = Power::of_campaign(&[ERROR_ULPS as f32], &[WITHOUT_BARS], campaign);
    eprintln!("{power}");
    assert!(power.total(0) > 0);
}

/// False culls with these margins, in these arithmetics.
fn false_culls(margins: Margins, styles: &[Style], campaign: Campaign) -> usize {
    let mut false_culls = 0;
    for round in campaign.rounds() {
        let Some(mirror) = Mirror::new(&round) else { continue };
        for style in styles {
            let masks = mirror.masks(margins, &mut Arithmetic::new(*style, round.number as u64));
            for ((_, volumes), mask) in round.volumes.iter().zip(&masks) {
                let tallies =
                    volumes.iter().zip(mask).map(|(v, kept)| round.tally(v, *kept, false));
                false_culls += tallies.map(|tally| tally.false_culls).sum::<usize>();
            }
        }
    }
    false_culls
}

/// Why `below` and `above` of a box's extent are clamped to 0.
/// Beside a wild end the rest of the claim has the other sign.
#[test]
fn an_extent_that_proves_more_than_its_end_says_is_no_use() {
    let wild: Vec<Style> = STYLES.into_iter().filter(|style| style.wild).collect();
    let campaign = Campaign { seed: 39, rounds: 6, modes: FOOTPRINTS, ..Campaign::default() };
    let count = |margins| false_culls(margins, &wild, campaign);
    let (with, without) =
        (count(Margins::FULL), count(Margins { clamped: false, ..Margins::FULL }));
    eprintln!("false culls with extents that end at 0: {with}, without: {without}");
    assert!(with == 0 && without > 0);
}

/// `like` with another camera, all pixels at one depth, and a box there that nearly faces it.
/// The box is a thousand times as wide as its distance.
/// It is moved backwards to the last place where the oracle sees it.
fn facing(like: Round, random: &mut Random) -> Option<Round> {
    let any = |random: &mut Random| [0; 3].map(|_| random.range(-1.0, 1.0));
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let unit = |v: [f64; 3]| v.map(|x| x / dot(v, v).sqrt());
    let (forward, up) = (unit(any(random)), any(random));
    let (right, z) = (unit(cross(forward, up)), random.range(1.2, 1.9));
    let up = cross(right, forward);
    let eye = any(random);
    let pose = Pose { eye, target: [0, 1, 2].map(|k| eye[k] + forward[k]), up };
    let convention = random.pick(&[DepthConvention::Standard, DepthConvention::Reversed]);
    let projection =
        Projection::Perspective { fov_y: 1.0, near: 0.5, far: Some(100.0), convention };
    let camera = Camera::look_at(&pose, &projection, ImageSize::new(8, 8)).ok()?;
    let view = View {
        rows: camera.rows(),
        origin: camera.origin(),
        width: 8,
        height: 8,
        reversed: convention.is_reversed(),
    };
    // A tilt of some eps, so that the box is a little nearer at its ends.
    let tilt = random.range(-1e-6, 1e-6);
    let axes = [0, 1, 2].map(|k| [right[k] + tilt * forward[k], up[k], forward[k]]);
    let half_sizes = [1e3 * z, 1e3 * z, 0.0];
    let at = |s: f64| Volume::OrientedBox {
        center: [0, 1, 2].map(|k| eye[k] + s * z * forward[k]),
        half_sizes,
        axes,
    };
    let ndc = 100.0 / 99.5 * (1.0 - 0.5 / z);
    let depth = vec![if view.reversed { 1.0 - ndc } else { ndc } as f32; 64];
    let mut round = Round { camera, view, depth, ..like };
    round.volumes = vec![(BoundsKind::OrientedBox, vec![at(1.0)])];
    let sees = |s: f64| round.outcome(&at(s)).verdict != Verdict::Hidden;
    let (mut seen, mut hidden) = (0.5, 2.0);
    if !sees(seen) || sees(hidden) {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (seen + hidden);
        if sees(middle) { seen = middle } else { hidden = middle }
    }
    round.volumes = vec![(BoundsKind::OrientedBox, vec![at(seen)])];
    Some(round)
}

/// The margin has to grow with the volume's own size.
/// Without it, it is too small for a volume that is large beside its distance.
#[test]
fn sizes_count_the_volume() {
    let campaign = Campaign { seed: 44, ..Campaign::default() };
    let random = &mut Random(44);
    let (mut cases, mut with, mut without) = (0, 0, 0);
    for _ in 0..300 {
        let like = campaign.round(0).expect("a round");
        let Some(round) = facing(like, random) else { continue };
        let Some(mirror) = Mirror::new(&round) else { continue };
        cases += 1;
        for style in STYLES {
            let culls =
                |margins: Margins| !mirror.masks(margins, &mut Arithmetic::new(style, cases))[0][0];
            with += usize::from(culls(Margins::FULL));
            without += usize::from(culls(Margins { own: 0.0, ..Margins::FULL }));
        }
    }
    eprintln!("{cases} boxes: false culls {with}, without their own size {without}");
    assert!(cases > 100 && with == 0 && without > 0);
}

/// The magnitudes include what float64 lost on the host (`view.rs`).
/// Without that share, constants that cancel at a distant eye make false culls.
/// That happens even to nearest and with the full margin.
#[test]
fn the_hosts_error_share_is_needed() {
    let campaign =
        Campaign { seed: 38, rounds: 60, classes: &[Class::BareMatrix], ..Campaign::default() };
    let mut false_culls = [0; 2];
    for round in campaign.rounds() {
        let mirrors = [Mirror::new(&round), Mirror::new(&round).map(Mirror::without_error_share)];
        for (mirror, count) in mirrors.into_iter().flatten().zip(&mut false_culls) {
            let masks = mirror.masks(ERROR_ULPS as f32, &mut Arithmetic::new(STYLES[0], 0));
            for ((_, volumes), mask) in round.volumes.iter().zip(&masks) {
                *count += volumes
                    .iter()
                    .zip(mask)
                    .map(|(v, kept)| round.tally(v, *kept, false).false_culls)
                    .sum::<usize>();
            }
        }
    }
    eprintln!("false culls with and without the host's share: {false_culls:?}");
    assert!(false_culls[0] == 0 && false_culls[1] > 0, "{false_culls:?}");
}

/// How much of the margin is needed.
/// Prints false culls by style and margin, and by style with the full margin.
/// The former takes a tenth of `HIZVK_SOAK_CASES` (1,000,000) cases of each kind, the latter all.
/// Seeds start at `HIZVK_SOAK_SEED` (2000).
#[test]
#[ignore = "minutes: make soak"]
fn power() {
    let setting = |name: &str, default: usize| match std::env::var(name) {
        Ok(text) => {
            text.parse().unwrap_or_else(|_| panic!("{name}: expected a number, got {text:?}"))
        }
        Err(_) => default,
    };
    let (seed, cases) =
        (setting("HIZVK_SOAK_SEED", 2000) as u64, setting("HIZVK_SOAK_CASES", 1_000_000));
    for (margins, share) in
        [(&[0.0, 0.25, 0.5, 1.0, 2.0, 3.0, 4.0][..], 10), (&[ERROR_ULPS as f32][..], 1)]
    {
        let mut power = Power::new(margins, &STYLES);
        let wanted = 3 * cases / share;
        for chunk in 0.. {
            let coverage = if chunk % 4 == 3 { Coverage::Sample } else { Coverage::Area };
            let campaign = Campaign {
                seed: seed + chunk,
                rounds: 4,
                coverage,
                modes: FOOTPRINTS,
                ..Campaign::default()
            };
            campaign.rounds().for_each(|round| power.add(&round));
            eprintln!("power: {} of {wanted} cases", power.cases);
            if power.cases >= wanted {
                break;
            }
        }
        eprintln!("{power}");
        let full = margins.iter().position(|m| *m == ERROR_ULPS as f32);
        assert!(full.is_none_or(|k| power.total(k) == 0), "a false cull with the full margin");
        let one = margins.iter().position(|m| *m == 1.0);
        assert!(one.is_none_or(|k| power.total(k) > 0), "a 24th of the margin, and green");
    }
}
