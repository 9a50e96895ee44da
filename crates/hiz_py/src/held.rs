//! How Python's objects hold what is on a device: they release it before the process ends, and
//! refuse to use it in a fork.
//!
//! A driver may work on threads of its own after the last wait; only the destruction of the device
//! joins them.
//! The interpreter does not drop objects that a module still refers to when it ends, so [`let_go`]
//! empties every holder at exit.
//!
//! A lock that another thread holds at a fork is never released in the child.
//! So the locks here are held only together with the interpreter lock, which the forking thread
//! has.
//! [`before_fork`] waits until no call is within the driver, because a child would meet the locks
//! of the driver.

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::ThreadId;
use std::time::Duration;

use hiz_core::Error;
use hiz_core::headless::Engine;
use pyo3::prelude::*;

use crate::errors::{hiz_error, raised};

/// A type that a [`Held`] may hold.
///
/// No blanket implementation for [`Arc`] may exist: the contents of a [`Held`] are in an `Arc`, and
/// its methods would hide theirs.
pub(crate) trait OnDevice: Send + Sync + 'static {
    /// The engine, if a fork must wait for it on behalf of this value.
    /// Python's objects keep the `Device` that made them, so most leave the answer to its engine.
    fn engine(&self) -> Option<&Engine> {
        None
    }
}

impl OnDevice for Engine {
    fn engine(&self) -> Option<&Engine> {
        Some(self)
    }
}

/// Holds a `T` until the process ends or Python drops it.
pub(crate) struct Held<T: OnDevice>(Arc<Cell<T>>);

impl<T: OnDevice> Held<T> {
    pub(crate) fn new(py: Python<'_>, value: T) -> Self {
        let cell = Arc::new(Cell {
            process: std::process::id(),
            contents: Mutex::new(Some(Arc::new(value))),
        });
        let as_any: Arc<dyn Empty> = cell.clone();
        registry(py).admit(Arc::downgrade(&as_any));
        Self(cell)
    }

    /// The value, for calls that use the device or take a lock; an error in a fork.
    pub(crate) fn get(&self, py: Python<'_>) -> PyResult<Arc<T>> {
        // Before any lock is taken: a lock that another thread held at the fork is never released
        // here.
        let (made_by, here) = (self.0.process, std::process::id());
        if made_by != here {
            return Err(hiz_error(
                py,
                format!(
                    "the device of this object was made by process {made_by}, and process {here} \
                     is a fork of it: no device works after a fork. Make a Device in this process \
                     and upload again, or start workers with multiprocessing's \"spawn\""
                ),
            ));
        }
        self.look(py)
    }

    /// The value, for what the host knows and no lock guards; this works in forks, too.
    pub(crate) fn look(&self, py: Python<'_>) -> PyResult<Arc<T>> {
        // The lock is released before the exception is made: making it may pass the interpreter
        // lock to a thread that wants this lock.
        let value = self.0.lock().clone();
        value.ok_or_else(|| closed(py))
    }

    /// Calls [`detached`] with the value.
    pub(crate) fn run<R: Send>(
        &self,
        py: Python<'_>,
        work: impl Send + FnOnce(&T) -> Result<R, Error>,
    ) -> PyResult<R> {
        let value = self.get(py)?;
        detached(py, || work(&value))
    }
}

/// The contents of a [`Held`].
/// The lock is held for moments only, together with the interpreter lock.
struct Cell<T> {
    process: u32,
    contents: Mutex<Option<Arc<T>>>,
}

/// What a lock guards, also after a panic: it is always replaced as a whole.
fn unpoisoned<T>(locked: Result<T, PoisonError<T>>) -> T {
    locked.unwrap_or_else(PoisonError::into_inner)
}

impl<T> Cell<T> {
    fn lock(&self) -> MutexGuard<'_, Option<Arc<T>>> {
        unpoisoned(self.contents.lock())
    }
}

impl<T> Drop for Cell<T> {
    fn drop(&mut self) {
        if self.process != std::process::id() {
            // In a fork the threads of the device do not exist, and its locks may be held for ever.
            // So the value is leaked.
            std::mem::forget(unpoisoned(self.contents.get_mut()).take());
        }
    }
}

/// A holder of anything.
trait Empty: Send + Sync {
    fn engine(&self) -> Option<Engine>;

    /// Takes its value out, for the caller to drop.
    fn empty(&self) -> Option<Box<dyn Any + Send>>;
}

impl<T: OnDevice> Empty for Cell<T> {
    fn engine(&self) -> Option<Engine> {
        self.lock().as_ref().and_then(|value| T::engine(value).cloned())
    }

    fn empty(&self) -> Option<Box<dyn Any + Send>> {
        self.lock().take().map(|value| Box::new(value) as _)
    }
}

/// All holders of this process, and the calls that use their values.
struct Registry {
    process: u32,
    holders: Vec<Weak<dyn Empty>>,
    /// The number of holders at which dead ones are removed.
    sweep_at: usize,
    calls: usize,
    /// The threads that are about to fork; the calls of others wait.
    forking: Vec<ThreadId>,
    closed: bool,
}

impl Registry {
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

/// The registry of this process.
/// Like the lock of a cell, its lock is held only together with the interpreter lock.
fn registry(_with_the_interpreter_lock: Python<'_>) -> MutexGuard<'static, Registry> {
    static REGISTRY: Mutex<Registry> = Mutex::new(Registry::new(0, false));
    let mut registry = unpoisoned(REGISTRY.lock());
    let here = std::process::id();
    if registry.process != here {
        // A fork: other threads and their calls do not exist here.
        *registry = Registry::new(here, registry.closed);
    }
    registry
}

fn closed(py: Python<'_>) -> PyErr {
    hiz_error(py, "the interpreter is about to end: every device has been let go of".to_owned())
}

/// A call that runs without the interpreter lock, counted in the registry.
struct Call<'py>(Python<'py>);

impl<'py> Call<'py> {
    fn begin(py: Python<'py>) -> PyResult<Self> {
        loop {
            let registry = registry(py);
            if registry.closed {
                drop(registry);
                return Err(closed(py));
            }
            if registry.forking.is_empty()
                || registry.forking.contains(&std::thread::current().id())
            {
                drop(registry);
                return Ok(Self::count(py));
            }
            drop(registry);
            nap(py);
        }
    }

    /// Begins a call without asking whether it may begin.
    fn count(py: Python<'py>) -> Self {
        registry(py).calls += 1;
        Self(py)
    }
}

impl Drop for Call<'_> {
    fn drop(&mut self) {
        let mut registry = registry(self.0);
        registry.calls = registry.calls.saturating_sub(1);
    }
}

/// Runs `work` without the interpreter lock and turns its error into an exception.
pub(crate) fn detached<T, F>(py: Python<'_>, work: F) -> PyResult<T>
where
    T: Send,
    F: Send + FnOnce() -> Result<T, Error>,
{
    // The call ends with the interpreter lock held: a thread that still waits for the lock when the
    // interpreter ends would be killed within this module.
    let call = Call::begin(py)?;
    let result = py.detach(work);
    drop(call);
    result.map_err(|error| raised(py, error))
}

/// Lets other threads have the interpreter for a moment.
/// Waiting for a condition variable would hold a lock without the interpreter lock.
fn nap(py: Python<'_>) {
    py.detach(|| std::thread::sleep(Duration::from_millis(1)));
}

/// Waits until no call is within the driver and every device is idle.
/// Calls of other threads wait until [`after_fork`].
///
/// A driver works on threads of its own after a submission, and holds locks there which a child
/// would need.
/// Lavapipe compiles shaders there, under locks of LLVM that are the whole process's.
#[pyfunction]
pub(crate) fn before_fork(py: Python<'_>) {
    registry(py).forking.push(std::thread::current().id());
    while registry(py).calls > 0 {
        nap(py);
    }
    let mut engines: Vec<Engine> = Vec::new();
    let holders = registry(py).holders.clone();
    for engine in holders.iter().filter_map(Weak::upgrade).filter_map(|holder| holder.engine()) {
        // Not `==`: devices of different instances of wgpu may be equal.
        if engines.iter().all(|other| !std::ptr::eq(other.device(), engine.device())) {
            engines.push(engine);
        }
    }
    // Counted as a call: [`let_go`] and the forks of other threads wait until it ends.
    let call = Call::count(py);
    py.detach(|| {
        for engine in &engines {
            // What is freed after one submission ends is freed before the next one ends.
            // The error of a lost device is dropped: such a device is idle.
            engine.queue().submit([]);
            drop(engine.wait());
        }
    });
    drop(call);
}

/// Ends [`before_fork`] in the parent.
#[pyfunction]
pub(crate) fn after_fork(py: Python<'_>) {
    let (mut registry, me) = (registry(py), std::thread::current().id());
    if let Some(mine) = registry.forking.iter().position(|thread| *thread == me) {
        registry.forking.swap_remove(mine);
    }
}

/// Drops every device, as the interpreter is about to end.
/// It first waits for the calls of daemon threads, for which the interpreter does not wait.
/// A later call is an error.
#[pyfunction]
pub(crate) fn let_go(py: Python<'_>) {
    registry(py).closed = true;
    while registry(py).calls > 0 {
        nap(py);
    }
    let holders = std::mem::take(&mut registry(py).holders);
    let held: Vec<_> =
        holders.iter().filter_map(Weak::upgrade).filter_map(|holder| holder.empty()).collect();
    py.detach(|| drop(held));
}
