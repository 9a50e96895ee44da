//! Locks, and work that is split between threads.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::available_parallelism;

use rayon_core::{ThreadPool, ThreadPoolBuilder};

/// A value behind a lock that ignores poisoning.
///
/// That is safe here: values are replaced as a whole, so a panic leaves no half-written one.
#[derive(Debug, Default)]
pub(crate) struct Locked<T>(Mutex<T>);

impl<T> Locked<T> {
    pub(crate) fn new(value: T) -> Self {
        Self(Mutex::new(value))
    }

    /// Waits for the lock.
    pub(crate) fn lock(&self) -> MutexGuard<'_, T> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How many threads this process may run at once; asked of the system once.
pub(crate) fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    *CORES.get_or_init(|| available_parallelism().map_or(1, usize::from))
}

/// How many threads to use for work that takes one thread about so many nanoseconds.
///
/// A thread that sleeps takes 20 to 100 microseconds until it works.
/// So each one has to take over more than that.
pub(crate) fn worth_it(nanoseconds: u64) -> usize {
    cores().min(1 + usize::try_from(nanoseconds / 100_000).unwrap_or(usize::MAX))
}

/// The threads that help, one for each core; `None` where they cannot be had.
///
/// They stay behind where the process that made them forks, so its forks have none.
fn helpers() -> Option<&'static ThreadPool> {
    static OWNER: AtomicU32 = AtomicU32::new(0);
    static HELPERS: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let me = std::process::id();
    // First, because a fork must not wait for a thread of its parent that makes them.
    let owner = OWNER.compare_exchange(0, me, Ordering::Relaxed, Ordering::Relaxed);
    if owner.is_err_and(|owner| owner != me) {
        return None;
    }
    let made = HELPERS.get_or_init(|| {
        let named = ThreadPoolBuilder::new().thread_name(|number| format!("hiz_core {number}"));
        named.num_threads(cores()).build().ok()
    });
    made.as_ref()
}

/// Runs `work` on every part, on about `threads` threads; this one is the first of them.
///
/// The parts are handed out in their order, each to the next thread that is free.
/// So more parts than threads even out parts of unequal size.
/// Where no thread can be had, this one does the work.
///
/// The threads that help stay, because a new one costs more than some work is worth.
/// One more is woken than is needed: a system may wake a thread on the core of the one that wakes
/// it, where it waits until that one is done, although another core is idle.
/// Linux does so in a virtual machine whose idle cores were handed back to the host.
pub(crate) fn on_threads<T: Send>(
    threads: usize,
    parts: impl IntoIterator<Item = T, IntoIter: Send>,
    work: impl Fn(T) + Sync,
) {
    let waiting = Locked::new(parts.into_iter());
    let next = || waiting.lock().next();
    let run = || {
        while let Some(part) = next() {
            work(part);
        }
    };
    let helpers = if threads > 1 { helpers() } else { None };
    let Some(helpers) = helpers else { return run() };
    helpers.in_place_scope(|scope| {
        (0..threads.min(cores())).for_each(|_| scope.spawn(|_| run()));
        run();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_done_once_on_any_number_of_threads() {
        for threads in [1, 2, 5] {
            let mut numbers = [0; 37];
            on_threads(threads, numbers.chunks_mut(5), |part| {
                part.iter_mut().for_each(|n| *n += 1);
            });
            assert_eq!(numbers, [1; 37]);
        }
        on_threads(cores(), std::iter::empty::<usize>(), |_| unreachable!());
    }
}
