//! Three kinds of arithmetic give the same answers.
//! They are float64 with error bounds, float64 with exact escalation, and exact throughout.

mod common;

use common::Random;
use common::scenes::{image, scene, volume};
use hiz_ref::{
    Arithmetic, Coverage, Options, OwnDepth, Verdict, classify_with, hides, touched_pixels,
};

#[test]
fn all_arithmetics_agree_on_scenes() {
    let mut random = Random(2);
    let (mut undecided, mut visible, mut hidden) = (0, 0, 0);
    const CASES: usize = 4000;
    for number in 0..CASES {
        let scene = scene(&mut random, 8, 6);
        let volume = volume(&mut random, &scene);
        let view = &scene.view;
        let own_depth = if number % 2 == 0 { OwnDepth::Nearest } else { OwnDepth::PerPixel };
        let run = |depth: &[f32], arithmetic, coverage| {
            let options = Options { arithmetic, coverage, own_depth };
            classify_with(view, &volume, depth, options).expect("valid")
        };
        let probe = run(&[0.5; 48], Arithmetic::Float, Coverage::Area);
        let depth = image(&mut random, view, probe.nearest_depth);
        for coverage in [Coverage::Area, Coverage::Sample] {
            let escalated = run(&depth, Arithmetic::Escalate, coverage);
            let exact = run(&depth, Arithmetic::Exact, coverage);
            let float = run(&depth, Arithmetic::Float, coverage);
            let name = || format!("case {number} {coverage:?}: {view:?} {volume:?} {depth:?}");
            assert_eq!(escalated.verdict, exact.verdict, "{}", name());
            assert_eq!(escalated.outside, exact.outside, "{}", name());
            if float.verdict == Verdict::Undecided {
                undecided += 1;
            } else {
                assert_eq!(float.verdict, exact.verdict, "{}", name());
            }
            match exact.verdict {
                Verdict::Visible => visible += 1,
                Verdict::Hidden if exact.outside == Some(false) => hidden += 1,
                _ => {}
            }
            // Area coverage sees at least what samples see.
            if coverage == Coverage::Area && exact.verdict == Verdict::Hidden {
                let sample = run(&depth, Arithmetic::Escalate, Coverage::Sample);
                assert_eq!(sample.verdict, Verdict::Hidden, "{}", name());
            }
        }
    }
    println!(
        "{visible} visible, {hidden} occluded, {undecided} undecided in float64, of {}",
        2 * CASES
    );
    assert!(visible > 500 && hidden > 500);
    assert!(undecided < 2 * CASES / 50, "float64 leaves {undecided} open");
}

/// The search with its shortcuts against the definition, pixel by pixel with nothing left out.
#[test]
fn the_search_agrees_with_the_definition() {
    let mut random = Random(3);
    for number in 0..3000 {
        let scene = scene(&mut random, 16, 11);
        let volume = volume(&mut random, &scene);
        let view = &scene.view;
        for coverage in [Coverage::Area, Coverage::Sample] {
            let options = Options { coverage, ..Options::default() };
            let all_far = vec![if view.reversed { 0.0 } else { 1.0 }; 16 * 11];
            let probe = classify_with(view, &volume, &all_far, options).expect("valid");
            let depth = image(&mut random, view, probe.nearest_depth);
            let touched = touched_pixels(view, &volume, coverage).expect("valid");
            assert_eq!(probe.verdict == Verdict::Visible, !touched.is_empty());
            let open = |&[x, y]: &[u32; 2]| {
                !hides(view, &volume, depth[(y * 16 + x) as usize]).expect("valid")
            };
            let outcome = classify_with(view, &volume, &depth, options).expect("valid");
            let visible = touched.iter().any(open);
            let name = format!("case {number} {coverage:?}: {view:?} {volume:?}");
            assert_eq!(outcome.verdict == Verdict::Visible, visible, "{name}");
            if let Some(witness) = outcome.witness {
                assert!(touched.contains(&witness) && open(&witness), "{name}");
            }
        }
    }
}
