//! The certificates in every arithmetic that WGSL permits: the shader's steps on the host, rounding up and down, fusing,
//! reassociating and flushing. A device does one of these; the margin has to cover all.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;
#[path = "common/mirror/mod.rs"]
mod mirror;

use campaign::{Campaign, Round};
use common::engine;
use hiz_core::{Coverage, Footprint, ERROR_ULPS};
use hiz_ref::Verdict;
use mirror::{Arithmetic, Mirror, STYLES};

/// Every footprint.
const FOOTPRINTS: &[(Footprint, u32)] =
    &[(Footprint::Two, 0), (Footprint::Two, 0), (Footprint::Four, 0), (Footprint::Eight, 0)];

/// False culls by margin and style.
struct Power {
    margins: Vec<f32>,
    false_culls: Vec<[usize; STYLES.len()]>,
    cases: usize,
}

impl Power {
    fn new(margins: &[f32]) -> Self {
        Self { margins: margins.to_vec(), false_culls: vec![[0; STYLES.len()]; margins.len()], cases: 0 }
    }

    fn add(&mut self, round: &Round) {
        let Some(mirror) = Mirror::new(round) else { return };
        // The oracle is asked once about a volume, and only if somebody culls it.
        let mut visible: Vec<Vec<Option<bool>>> = round.volumes.iter().map(|(_, v)| vec![None; v.len()]).collect();
        self.cases += visible.iter().map(Vec::len).sum::<usize>();
        for (margin, false_culls) in self.margins.iter().zip(&mut self.false_culls) {
            for (style, count) in STYLES.iter().zip(false_culls) {
                let mut arithmetic = Arithmetic::new(*style, round.seed ^ round.number as u64);
                let masks = mirror.masks(*margin, &mut arithmetic);
                for ((volumes, mask), known) in round.volumes.iter().zip(&masks).zip(&mut visible) {
                    for (i, _) in mask.iter().enumerate().filter(|(_, kept)| !**kept) {
                        let visible =
                            *known[i].get_or_insert_with(|| round.outcome(&volumes.1[i]).verdict != Verdict::Hidden);
                        *count += usize::from(visible);
                    }
                }
            }
        }
    }

    fn of_campaign(margins: &[f32], campaign: Campaign) -> Self {
        let mut power = Self::new(margins);
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
        for (k, style) in STYLES.iter().enumerate() {
            write!(f, "\n{:<22}", style.name)?;
            for false_culls in &self.false_culls {
                write!(f, "{:>9}", false_culls[k])?;
            }
        }
        Ok(())
    }
}

/// The mirror is the shader: rounding to nearest it says what the device says.
#[test]
fn to_nearest_it_agrees_with_the_device() {
    let (mut cases, mut kept_by_device, mut kept_by_mirror) = (0, 0, 0);
    for coverage in [Coverage::Area, Coverage::Sample] {
        for round in (Campaign { seed: 31, rounds: 8, coverage, modes: FOOTPRINTS, ..Campaign::default() }).rounds() {
            let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(engine())) else { continue };
            let masks = mirror.masks(ERROR_ULPS as f32, &mut Arithmetic::new(STYLES[0], 0));
            for (ours, theirs) in masks.iter().flatten().zip(device.iter().flatten()) {
                cases += 1;
                kept_by_mirror += usize::from(*ours && !theirs);
                kept_by_device += usize::from(!ours && *theirs);
            }
        }
    }
    eprintln!("mirror: {cases} cases, kept by it alone {kept_by_mirror}, by the device alone {kept_by_device}");
    // A driver may fuse or reorder, and then decides a few otherwise that lie within a rounding of the margin.
    assert!((kept_by_mirror + kept_by_device) * 1000 < cases, "the mirror is another algorithm");
}

#[test]
fn no_arithmetic_gives_a_false_cull() {
    for (seed, coverage) in [(32, Coverage::Area), (33, Coverage::Sample)] {
        let campaign = Campaign { seed, rounds: 12, coverage, modes: FOOTPRINTS, ..Campaign::default() };
        let power = Power::of_campaign(&[ERROR_ULPS as f32], campaign);
        eprintln!("{coverage:?}\n{power}");
        assert_eq!(power.total(0), 0);
    }
}

/// With a 24th of the margin some arithmetic errs: the campaign is sharp enough to tell.
#[test]
fn a_twenty_fourth_of_the_margin_is_too_little() {
    let campaign = Campaign { seed: 34, rounds: 12, ..Campaign::default() };
    let power = Power::of_campaign(&[1.0], campaign);
    eprintln!("{power}");
    assert!(power.total(0) > 0);
    assert_eq!(power.false_culls[0][0], 0, "to nearest it takes less than that");
}
