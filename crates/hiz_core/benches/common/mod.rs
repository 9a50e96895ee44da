//! What the benches share: a table of medians, then criterion's own figures.
//! All ways are run in turns, so that a busy moment hits all of them.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion};
use hiz_core::headless::Engine;

/// A name, and a function that does the work once and returns its milliseconds.
pub(crate) type Way<'a> = (String, Box<dyn FnMut() -> f64 + 'a>);

/// Opens a device.
/// As in the tests, `HIZVK_PLANTED_FAULT` tries a variant of a shader.
/// Each of its lines reads `old text => new text`.
pub(crate) fn engine() -> Engine {
    let edits = std::env::var("HIZVK_PLANTED_FAULT").unwrap_or_default().replace("\\n", "\n");
    let edits: Vec<_> = edits.lines().filter_map(|line| line.split_once(" => ")).collect();
    let engine = Engine::with_planted_faults(None, &edits).expect("a Vulkan device");
    println!("adapter: {}", engine.adapter());
    engine
}

pub(crate) fn criterion() -> Criterion {
    Criterion::default().without_plots().sample_size(20).configure_from_args()
}

/// How many rounds a table takes: one where everything is only tried out (`-- --test`).
fn rounds() -> usize {
    if std::env::args().any(|argument| argument == "--test") { 1 } else { 25 }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// CPU milliseconds of all threads of this process so far.
/// On a busy machine they are steadier than wall-clock time.
/// With a software driver they are the whole of its work.
/// 0 where the system does not report them.
fn cpu_ms() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let ran = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    ran.sum::<f64>() / 1e6
}

/// Prints medians.
/// `times_first` heads the column that divides each time by the first way's.
pub(crate) fn table(name: &str, times_first: &str, ways: &mut [Way<'_>]) {
    let rounds = rounds();
    let mut times = vec![Vec::new(); ways.len()];
    let mut work = vec![Vec::new(); ways.len()];
    for round in 0..rounds + 3 {
        for (number, (_, run)) in ways.iter_mut().enumerate() {
            let before = cpu_ms();
            let took = run();
            // The first rounds pay for compilations and page faults.
            if round >= 3 {
                times[number].push(took);
                work[number].push(cpu_ms() - before);
            }
        }
    }
    let first = median(&mut times[0]);
    println!("\n{name}: milliseconds of {rounds} rounds in turns; of all threads together");
    println!("{:<32}{:>9}{:>9}{times_first:>13}{:>9}", "", "median", "least", "threads");
    for (((way, _), times), work) in ways.iter().zip(&mut times).zip(&mut work) {
        let (median, work) = (median(times), median(work));
        println!("{way:<32}{median:>9.3}{:>9.3}{:>13.2}{work:>9.2}", times[0], median / first);
    }
}

/// Measures the same ways with criterion.
pub(crate) fn measure(criterion: &mut Criterion, name: &str, ways: &mut [Way<'_>]) {
    let mut group = criterion.benchmark_group(name);
    for (way, run) in ways {
        group.bench_function(BenchmarkId::from_parameter(way), |bencher| {
            bencher.iter_custom(|rounds| {
                (0..rounds).map(|_| Duration::from_secs_f64(run() / 1e3)).sum()
            });
        });
    }
    group.finish();
}
