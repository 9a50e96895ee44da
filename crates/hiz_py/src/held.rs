//! What lives on a device, as Python's objects hold it: let go of before the process ends, and
//! refused in a fork of it.
//!
//! A driver may be at work on threads of its own after the last wait for it; only the destruction
//! of the device joins them.
//! The interpreter drops nothing that a module still names when it ends, so [`let_go`] empties
//! every holder at its exit.
//!
//! A lock that another thread holds at a fork is never released in the child.
//! So those here are only held with the interpreter lock, which whoever forks has; and
//! [`before_fork`] waits until no call is within the driver, whose locks a child would meet.

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::ThreadId;
use std::time::Duration;

use hiz_core::Error;
use hiz_core::headless::Engine;
use pyo3::prelude::*;

use crate::errors::{hiz_error, raised};

/// What a [`Held`] may hold.
pub(crate) trait OnDevice: Send + Sync + 'static {
    /// The engine, where it has one at hand.
    fn engine(&self) -> Option<&Engine> {
        None
    }
}

impl OnDevice for Engine {
    fn engine(&self) -> Option<&Engine> {
        Some(self)
    }
}

impl<T: Send + Sync + 'static> OnDevice for Arc<T> {}

/// Holds a `T` until the process ends or Python lets go of it.
pub(crate) struct Held<T: OnDevice>(Arc<Cell<T>>);

impl<T: OnDevice> Held<T> {
    pub(crate) fn new(py: Python<'_>, value: T) -> Self {
        let cell = Arc::new(Cell {
            process: std::process::id(),
            contents: Mutex::new(Some(Arc::new(value))),
        });
        let as_any: Arc<dyn Empty> = cell.clone();
        house(py).admit(Arc::downgrade(&as_any));
        Self(cell)
    }

    /// For calls that ask the device or take a lock.
    pub(crate) fn get(&self, py: Python<'_>) -> PyResult<Arc<T>> {
        // Before any lock is taken: one that another thread held at the fork is never released
        // here.
        let (made_by, here) = (self.0.process, std::process::id());
        if made_by != here {
            return Err(hiz_error(
                py,
                format!(
                    "the device of this object was made by process {made_by}, and process {here} is a fork of it: no device works \
                     after a fork. Make a Device in this process and upload again, or start workers with multiprocessing's \
                     \"spawn\""
                ),
            ));
        }
        self.look(py)
    }

    /// For what the host knows and no lock guards: works in forks, too.
    pub(crate) fn look(&self, py: Python<'_>) -> PyResult<Arc<T>> {
        // The lock is let go of before the exception is made: that may hand the interpreter lock
        // on, to a thread that wants this one.
        let value = self.0.lock().clone();
        value.ok_or_else(|| closed(py))
    }

    /// [`detached`] with what is held.
    pub(crate) fn run<R: Send>(
        &self,
        py: Python<'_>,
        work: impl Send + FnOnce(&T) -> Result<R, Error>,
    ) -> PyResult<R> {
        let value = self.get(py)?;
        detached(py, || work(&value))
    }
}

/// What a [`Held`] holds.
/// The lock is held for moments, with the interpreter lock.
struct Cell<T> {
    process: u32,
    contents: Mutex<Option<Arc<T>>>,
}

impl<T> Cell<T> {
    fn lock(&self) -> MutexGuard<'_, Option<Arc<T>>> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T> Drop for Cell<T> {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            // In a fork the device's threads are gone, and its locks may be held for ever: nothing
            // of it may be touched.
            std::mem::forget(
                self.contents.get_mut().unwrap_or_else(PoisonError::into_inner).take(),
            );
        }
    }
}

/// A holder of anything.
trait Empty: Send + Sync {
    fn engine(&self) -> Option<Engine>;

    /// What it held, for the caller to drop.
    fn empty(&self) -> Option<Box<dyn Any + Send>>;
}

impl<T: OnDevice> Empty for Cell<T> {
    fn engine(&self) -> Option<Engine> {
        self.lock().as_ref().and_then(|value| value.engine().cloned())
    }

    fn empty(&self) -> Option<Box<dyn Any + Send>> {
        self.lock().take().map(|value| Box::new(value) as _)
    }
}

/// All holders of this process, and the calls that use what they hold.
struct House {
    process: u32,
    holders: Vec<Weak<dyn Empty>>,
    /// How many there may be before those that are gone are struck off.
    sweep_at: usize,
    calls: usize,
    /// The threads that are about to fork: others' calls wait.
    forking: Vec<ThreadId>,
    closed: bool,
}

impl House {
    const fn new(process: u32, closed: bool) -> Self {
        Self { process, holders: Vec::new(), sweep_at: 64, calls: 0, forking: Vec::new(), closed }
    }

    fn admit(&mut self, holder: Weak<dyn Empty>) {
        if self.holders.len() >= self.sweep_at {
            self.holders.retain(|holder| holder.strong_count() > 0);
            self.sweep_at = 64.max(2 * self.holders.len());
        }
        self.holders.push(holder);
    }
}

/// The one of this process.
/// Like a cell's, its lock is only held with the interpreter lock.
fn house(_with_the_interpreter_lock: Python<'_>) -> MutexGuard<'static, House> {
    static HOUSE: Mutex<House> = Mutex::new(House::new(0, false));
    let mut house = HOUSE.lock().unwrap_or_else(PoisonError::into_inner);
    let here = std::process::id();
    if house.process != here {
        // A fork: other threads, and their calls, stayed behind.
        *house = House::new(here, house.closed);
    }
    house
}

fn closed(py: Python<'_>) -> PyErr {
    hiz_error(py, "the interpreter is about to end: every device has been let go of".to_owned())
}

/// A call that runs without the interpreter lock.
struct Call<'py>(Python<'py>);

impl<'py> Call<'py> {
    fn begin(py: Python<'py>) -> PyResult<Self> {
        loop {
            let mut house = house(py);
            if house.closed {
                drop(house);
                return Err(closed(py));
            }
            if house.forking.is_empty() || house.forking.contains(&std::thread::current().id()) {
                house.calls += 1;
                return Ok(Self(py));
            }
            drop(house);
            nap(py);
        }
    }
}

impl Drop for Call<'_> {
    fn drop(&mut self) {
        let mut house = house(self.0);
        house.calls = house.calls.saturating_sub(1);
    }
}

/// Runs `work` without the interpreter lock and turns its error into an exception.
pub(crate) fn detached<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: Send + FnOnce() -> Result<T, Error>,
{
    // Ends with the interpreter lock held: a thread that still waited for the lock when the
    // interpreter ends would be struck down within this module.
    let call = Call::begin(py)?;
    let result = py.detach(work);
    drop(call);
    result.map_err(|error| raised(py, error))
}

/// Lets other threads have the interpreter for a moment.
/// (Waiting by a condition variable would hold a lock without the interpreter's.)
fn nap(py: Python<'_>) {
    py.detach(|| std::thread::sleep(Duration::from_millis(1)));
}

/// Waits until no call is within the driver and every device is idle; calls of other threads wait
/// until [`after_fork`].
#[pyfunction]
pub(crate) fn before_fork(py: Python<'_>) {
    house(py).forking.push(std::thread::current().id());
    while house(py).calls > 0 {
        nap(py);
    }
    let holders = house(py).holders.clone();
    let engines: Vec<_> =
        holders.iter().filter_map(Weak::upgrade).filter_map(|holder| holder.engine()).collect();
    py.detach(|| {
        for engine in &engines {
            // What is freed after the end of one submit is freed before that of the next.
            // A lost device is idle.
            engine.queue().submit([]);
            drop(engine.wait());
        }
    });
}

/// The parent goes on.
#[pyfunction]
pub(crate) fn after_fork(py: Python<'_>) {
    let (mut house, me) = (house(py), std::thread::current().id());
    if let Some(mine) = house.forking.iter().position(|thread| *thread == me) {
        house.forking.swap_remove(mine);
    }
}

/// The interpreter is about to end: waits for the calls of threads that it does not wait for
/// (daemons), and lets go of every device.
/// What comes later is an error.
#[pyfunction]
pub(crate) fn let_go(py: Python<'_>) {
    house(py).closed = true;
    while house(py).calls > 0 {
        nap(py);
    }
    let holders = std::mem::take(&mut house(py).holders);
    let held: Vec<_> =
        holders.iter().filter_map(Weak::upgrade).filter_map(|holder| holder.empty()).collect();
    py.detach(|| drop(held));
}
