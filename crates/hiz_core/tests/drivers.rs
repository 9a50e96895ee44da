//! One campaign on every adapter that Vulkan lists.
//! None may cull anything visible, and differences between their verdicts are counted.
//! With one driver installed there is nothing to compare; `make test-swiftshader` provides two.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, Class, Report};
use hiz_core::Coverage;
use hiz_core::headless::{Engine, adapters};

/// A campaign's report for each engine.
/// Then, by class, how many volumes the first engine keeps and another culls, and the reverse.
fn compare(engines: &[Engine]) -> (Vec<Report>, Vec<[usize; 2]>) {
    let mut reports = vec![Report::new(&Class::ALL, false); engines.len()];
    let mut differences = vec![[0; 2]; Class::ALL.len()];
    for (seed, coverage) in [(41, Coverage::Area), (42, Coverage::Sample)] {
        for round in (Campaign { seed, rounds: 12, coverage, ..Campaign::default() }).rounds() {
            let masks: Option<Vec<_>> = engines.iter().map(|e| round.masks(e)).collect();
            let Some(masks) = masks else { continue };
            for (report, mask) in reports.iter_mut().zip(&masks) {
                for ((_, volumes), mask) in round.volumes.iter().zip(mask) {
                    for (volume, kept) in volumes.iter().zip(mask) {
                        report.add(round.class, round.tally(volume, *kept, false));
                    }
                }
            }
            for other in &masks[1..] {
                for (a, b) in masks[0].iter().flatten().zip(other.iter().flatten()) {
                    differences[round.class as usize][0] += usize::from(*a && !b);
                    differences[round.class as usize][1] += usize::from(!a && *b);
                }
            }
        }
    }
    (reports, differences)
}

#[test]
fn drivers_may_differ_but_none_errs() {
    let names: Vec<String> = adapters().iter().map(ToString::to_string).collect();
    assert!(!names.is_empty(), "the device tests need a Vulkan driver");
    eprintln!("adapters: {names:#?}");
    if names.len() == 1 {
        eprintln!("one alone: nothing to compare (make test-swiftshader compares two)");
        return;
    }
    // Without the margin, too.
    // There single roundings decide verdicts, and drivers that round differently would show.
    for (margin, faults) in
        [("full", &[][..]), ("none", &[("ERROR_ULPS: f32 = 24.0", "ERROR_ULPS: f32 = 0.0")][..])]
    {
        let engines: Vec<Engine> = (0..names.len())
            .map(|i| {
                Engine::with_planted_faults(Some(&i.to_string()), faults)
                    .expect("an adapter that opens")
            })
            .collect();
        let (reports, differences) = compare(&engines);
        eprintln!("margin {margin}\n{:<18}{:>12}{:>12}", "class", "first keeps", "other keeps");
        for (class, [first, other]) in Class::ALL.iter().zip(&differences) {
            eprintln!("{:<18}{first:>12}{other:>12}", format!("{class:?}"));
        }
        let sum = |side: usize| differences.iter().map(|d| d[side]).sum::<usize>();
        eprintln!(
            "{:<18}{:>12}{:>12} of {} cases",
            "all",
            sum(0),
            sum(1),
            reports[0].total().cases
        );
        for (name, report) in names.iter().zip(&reports) {
            eprintln!("margin {margin}, {name}\n{}\n{report}", campaign::HEADER);
            assert!(margin == "none" || report.total().false_culls == 0, "{name}");
        }
    }
}
