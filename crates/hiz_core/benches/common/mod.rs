//! What the benches share: a table of medians, all ways taken in turns so that a busy moment hits
//! all of them; then criterion's figures.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion};
use hiz_core::headless::Engine;

/// A name, and what does the work once and returns its milliseconds.
pub(crate) type Way<'a> = (String, Box<dyn FnMut() -> f64 + 'a>);

/// A device.
/// As in the tests, `HIZVK_PLANTED_FAULT` tries a variant of a shader: `what => by what` in the
/// shaders' text, one a line.
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

/// How many rounds a table takes: one where everything is only tried (`-- --test`).
fn rounds() -> usize {
    if std::env::args().any(|argument| argument == "--test") { 1 } else { 25 }
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Milliseconds that all threads of this process have run: on a busy machine steadier than the
/// clock on the wall, and of a software driver the whole of its work.
/// 0 where the system does not say.
fn cpu_ms() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let ran = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    ran.sum::<f64>() / 1e6
}

/// Prints medians; `times_first` heads the column of times of the first way.
pub(crate) fn table(name: &str, times_first: &str, ways: &mut [Way<'_>]) {
    let rounds = rounds();
    let mut times = vec![Vec::new(); ways.len()];
    let mut work = vec![Vec::new(); ways.len()];
    for round in 0..rounds + 3 {
        for (number, (_, run)) in ways.iter_mut().enumerate() {
            let before = cpu_ms();
            let took = run();
            // The first are compilations and page faults.
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

/// The same ways by criterion.
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
