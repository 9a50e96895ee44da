//! Locks, and work that is split between threads.

use std::sync::atomic::{AtomicU32, AtomicUsize, Ordering};
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
    let wanted = if threads > 1 { threads.min(cores()) } else { 0 };
    let taken = Taken::new(wanted);
    let helpers = if taken.0 > 0 { helpers() } else { None };
    let Some(helpers) = helpers else { return run() };
    helpers.in_place_scope(|scope| {
        (0..taken.0).for_each(|_| scope.spawn(|_| run()));
        run();
    });
}

/// So many helpers, taken until this is dropped.
///
/// No more are taken than there are, so none has to end the work of another call first.
/// Where all are taken, a call works alone: it never waits for another one.
struct Taken(usize);

/// How many helpers are taken by all calls together.
static TAKEN: AtomicUsize = AtomicUsize::new(0);

impl Taken {
    /// As many as there are left, up to `wanted`.
    fn new(wanted: usize) -> Self {
        let mut taken = 0;
        let _ = TAKEN.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |all| {
            taken = wanted.min(cores().saturating_sub(all));
            Some(all + taken)
        });
        Self(taken)
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        TAKEN.fetch_sub(self.0, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::sync::atomic::AtomicBool;

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

    /// Else a short call would wait for a long one, and for what that one waits for.
    #[test]
    fn a_call_does_not_wait_for_another_one() {
        let (begun, may_end) = (Barrier::new(2), Barrier::new(2));
        std::thread::scope(|scope| {
            scope.spawn(|| {
                // Each thread that takes a part waits for the second call to end.
                let first = AtomicBool::new(true);
                on_threads(cores() + 1, 0..64, |_| {
                    if first.swap(false, Ordering::Relaxed) {
                        begun.wait();
                        may_end.wait();
                    } else {
                        while !IS_OVER.load(Ordering::Relaxed) {
                            std::thread::yield_now();
                        }
                    }
                });
            });
            begun.wait();
            on_threads(cores(), 0..8, |_| ());
            IS_OVER.store(true, Ordering::Relaxed);
            may_end.wait();
        });
    }

    static IS_OVER: AtomicBool = AtomicBool::new(false);
}
