//! How many verdicts per second one core gives.
//! Run it with `cargo run --release -p hiz_ref --example throughput`.

#[path = "../tests/common/mod.rs"]
mod common;

use common::Random;
use common::scenes::{image, scene, volume};
use hiz_ref::{Arithmetic, Coverage, Options, Verdict, classify_with};
use std::time::{Duration, Instant};

const CASES: usize = 100_000;

fn main() {
    for (width, height, cases) in [(64, 64, CASES), (640, 360, CASES / 20)] {
        for coverage in [Coverage::Area, Coverage::Sample] {
            let mut random = Random(7);
            let mut spent = [Duration::ZERO; 2];
            let mut counts = [0usize; 4];
            for _ in 0..cases {
                let scene = scene(&mut random, width, height);
                let volume = volume(&mut random, &scene);
                let run = |depth: &[f32], arithmetic| {
                    let options = Options { arithmetic, coverage, ..Options::default() };
                    let start = Instant::now();
                    let outcome = classify_with(&scene.view, &volume, depth, options);
                    (outcome.expect("valid"), start.elapsed())
                };
                let blank = vec![0.5; (width * height) as usize];
                let nearest = run(&blank, Arithmetic::Float).0.nearest_depth;
                let depth = image(&mut random, &scene.view, nearest);
                let (escalated, time) = run(&depth, Arithmetic::Escalate);
                spent[0] += time;
                let (float, time) = run(&depth, Arithmetic::Float);
                spent[1] += time;
                let kind = match (escalated.verdict, escalated.outside) {
                    (Verdict::Visible, _) => 0,
                    (_, Some(false)) => 1,
                    _ => 2,
                };
                counts[kind] += 1;
                counts[3] += usize::from(float.verdict == Verdict::Undecided);
            }
            let [visible, occluded, outside, undecided] = counts;
            let [escalate, float] = spent.map(|time| time.as_secs_f64() * 1e6 / cases as f64);
            println!(
                "{width}x{height} {coverage:?}: {cases} cases, {visible} visible, \
                 {occluded} occluded, {outside} outside; {escalate:.1} us each; \
                 float64 alone {float:.1} us and {undecided} undecided"
            );
        }
    }
}
