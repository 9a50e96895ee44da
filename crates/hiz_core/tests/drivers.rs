//! One campaign on every adapter that Vulkan lists: none may cull what can be seen, and where their verdicts differ, it is
//! counted. With one driver installed there is nothing to compare; `make test-swiftshader` shows it two.

mod common;

#[path = "common/campaign/mod.rs"]
mod campaign;

use campaign::{Campaign, Class, Report};
use hiz_core::Coverage;
use hiz_core::headless::{Engine, adapters};

#[test]
fn drivers_may_differ_but_none_errs() {
    let engines: Vec<Engine> =
        adapters().iter().map(|a| Engine::new(Some(&a.index.to_string())).expect("an adapter that opens")).collect();
    assert!(!engines.is_empty(), "the device tests need a Vulkan driver");
    let names: Vec<String> = engines.iter().map(|e| e.adapter().to_string()).collect();
    eprintln!("adapters: {names:#?}");
    if engines.len() == 1 {
        eprintln!("one alone: nothing to compare (make test-swiftshader compares two)");
        return;
    }
    let mut reports = vec![Report::new(&Class::ALL, false); engines.len()];
    // Kept by the first and culled by the other, and the reverse.
    let mut differences = vec![[0_usize; 2]; Class::ALL.len()];
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
    eprintln!("{:<18}{:>12}{:>12}", "class", "first keeps", "other keeps");
    for (class, [first, other]) in Class::ALL.iter().zip(&differences) {
        eprintln!("{:<18}{first:>12}{other:>12}", format!("{class:?}"));
    }
    let sum = |side: usize| differences.iter().map(|d| d[side]).sum::<usize>();
    eprintln!("{:<18}{:>12}{:>12} of {} cases", "all", sum(0), sum(1), reports[0].total().cases);
    for (name, report) in names.iter().zip(&reports) {
        eprintln!("{name}\n{}\n{report}", campaign::HEADER);
        assert_eq!(report.total().false_culls, 0, "{name}");
    }
}
