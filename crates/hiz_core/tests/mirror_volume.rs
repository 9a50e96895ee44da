//! The volume fit and the descent in every arithmetic that WGSL permits, over slopes and offsets that may be anything.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;
#[path = "common/mirror/mod.rs"]
mod mirror;

use campaign::{Campaign, KINDS, Round};
use common::engine;
use hiz_core::{Coverage, ERROR_ULPS, Fit, Footprint};
use hiz_ref::Verdict;
use mirror::{Arithmetic, Margins, Mirror, STYLES, Style, WILDEST, WITHOUT_BARS};

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
                    if visible && self.false_culls[i][k] == 0 {
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
        for Margins { certificate, texel } in &self.margins {
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

/// To nearest the mirror says what the device says.
#[test]
fn to_nearest_it_agrees_with_the_device() {
    for kind in KINDS {
        let kinds: &'static [_] = Box::leak(Box::new([kind]));
        let (mut cases, mut kept_by_device, mut kept_by_mirror, mut culled) = (0, 0, 0, 0);
        for (seed, coverage) in [(51, Coverage::Area), (52, Coverage::Sample)] {
            let campaign = Campaign { rounds: 10, modes: DESCENTS, ..campaign(seed, coverage) };
            for round in campaign.fitted(kinds, false) {
                let (Some(mirror), Some(device)) = (Mirror::new(&round), round.masks(engine())) else { continue };
                let kept = mirror.masks(Margins::FULL, &mut Arithmetic::new(STYLES[0], 0))[0][0];
                cases += 1;
                culled += usize::from(!device[0][0]);
                kept_by_mirror += usize::from(kept && !device[0][0]);
                kept_by_device += usize::from(!kept && device[0][0]);
            }
        }
        eprintln!(
            "{kind:?}: {cases} cases, {culled} culled, kept by the mirror alone {kept_by_mirror}, by the device alone {kept_by_device}"
        );
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
    let styles = [&STYLES[..], &[WILDEST, WITHOUT_BARS]].concat();
    let margins = [(24.0, 8.0), (24.0, 0.0), (1.0, 8.0), (0.0, 8.0), (1.0, 0.0), (0.0, 0.0)]
        .map(|(certificate, texel)| Margins { certificate, texel });
    for sharp in [false, true] {
        let start = std::time::Instant::now();
        let rounds = Campaign { rounds: 10, ..campaign(55, Coverage::Area) }.fitted(&KINDS, sharp);
        let power = Power::of(&styles, &margins, rounds);
        eprintln!("sharp {sharp}: {:?}\n{power}", start.elapsed());
    }
}
