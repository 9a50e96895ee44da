//! Errors of the engine as exceptions of Python: those of `hizvk.errors`, or a plain `ValueError`
//! for a bad argument.

use hiz_core::Error;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

/// A class of `hizvk.errors`, which is imported at its first use.
struct Exception {
    name: &'static str,
    class: PyOnceLock<Py<PyType>>,
}

impl Exception {
    const fn new(name: &'static str) -> Self {
        Self { name, class: PyOnceLock::new() }
    }

    /// The exception with these arguments, or the error of the import.
    fn raise<A>(&self, py: Python<'_>, arguments: A) -> PyErr
    where
        A: pyo3::PyErrArguments + Send + Sync + 'static,
    {
        match self.class.import(py, "hizvk.errors", self.name) {
            Ok(class) => PyErr::from_type(class.clone(), arguments),
            Err(error) => error,
        }
    }
}

static HIZ_ERROR: Exception = Exception::new("HizError");
static NO_ADAPTER: Exception = Exception::new("NoAdapterError");
static LIMIT: Exception = Exception::new("LimitError");
static DEVICE_LOST: Exception = Exception::new("DeviceLostError");
static OUT_OF_MEMORY: Exception = Exception::new("OutOfMemoryError");

/// Imports all classes, before any fork.
/// A cell that is filled at its first use has a lock, and a forked child might find it held.
pub(crate) fn prepare(py: Python<'_>) -> PyResult<()> {
    for exception in [&HIZ_ERROR, &NO_ADAPTER, &LIMIT, &DEVICE_LOST, &OUT_OF_MEMORY] {
        exception.class.import(py, "hizvk.errors", exception.name)?;
    }
    Ok(())
}

/// The Python exception for an error of the engine.
pub(crate) fn raised(py: Python<'_>, error: Error) -> PyErr {
    let text = error.to_string();
    match error {
        Error::NoAdapter { request, seen, hint } => NO_ADAPTER.raise(py, (seen, hint, request)),
        Error::Limit { name, requested, allowed } => LIMIT.raise(py, (name, requested, allowed)),
        Error::DeviceLost(_) => DEVICE_LOST.raise(py, (text,)),
        Error::OutOfMemory(_) => OUT_OF_MEMORY.raise(py, (text,)),
        Error::Invalid { .. } | Error::Mismatch { .. } => PyValueError::new_err(in_python(text)),
        _ => hiz_error(py, text),
    }
}

/// A plain `HizError`.
pub(crate) fn hiz_error(py: Python<'_>, text: String) -> PyErr {
    HIZ_ERROR.raise(py, (text,))
}

/// Names of the engine's interface that its messages hold, and what Python calls them.
/// Names that end another one come after it.
const IN_PYTHON: [(&str, &str); 20] = [
    ("MipDepths::Farthest", "depths=\"farthest\""),
    ("Depths::Farthest", "depths=\"farthest\""),
    ("Depths::Nearest", "depths=\"nearest\""),
    ("Depths::Both", "depths=\"both\""),
    ("Depths::Receivers", "depths=\"receivers\""),
    ("Emit::Binned", "emit=\"bins\""),
    ("Emit::Instances", "emit=\"instances\""),
    ("Order::Stable", "\"stable\""),
    ("Order::Any", "\"any\""),
    ("Coverage::Area", "\"area\""),
    ("Coverage::Sample", "\"sample\""),
    ("Fit::Rectangle", "\"rectangle\""),
    ("Fit::Volume", "\"volume\""),
    ("Placement::Packed", "placement=\"packed\""),
    ("Placement::Reserved", "placement=\"reserved\""),
    ("`record_cull`", "`Device.cull`"),
    ("`record_early`", "`Temporal.early`"),
    ("`record_late`", "`Temporal.late`"),
    ("expected Stable", "expected \"stable\""),
    ("got Any", "got \"any\""),
];

/// A message of the engine in the words of Python.
fn in_python(text: String) -> String {
    IN_PYTHON.iter().fold(text, |text, (name, word)| text.replace(name, word))
}
