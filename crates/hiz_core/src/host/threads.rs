//! Locks, and work that is split between threads.

use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread::{Builder, available_parallelism, scope};

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
/// A thread has to be scheduled, which takes milliseconds where another process is at work.
/// So each one has to take over a quarter of a millisecond.
pub(crate) fn worth_it(nanoseconds: u64) -> usize {
    cores().min(1 + usize::try_from(nanoseconds / 250_000).unwrap_or(usize::MAX))
}

/// Runs `work` on every part, on at most `threads` threads; this one is the first of them.
///
/// The parts are handed out in their order, each to the next thread that is free.
/// So more parts than threads even out parts of unequal size.
/// Where no thread can be spawned, fewer do the work.
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
    scope(|scope| {
        let helpers: Vec<_> =
            (1..threads).map_while(|_| Builder::new().spawn_scoped(scope, run).ok()).collect();
        run();
        for helper in helpers {
            helper.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        }
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
