//! The answer of an approximate cull.

use hiz_core::headless;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::held::{Held, OnDevice};

/// A submitted approximate cull.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct ApproximateCulling(pub(crate) Held<headless::ApproximateCulling>);

impl OnDevice for headless::ApproximateCulling {}

#[pymethods]
impl ApproximateCulling {
    fn num_instances(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.culling().instances().len())
    }

    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, |seen| seen.culling().mask()).map(|mask| PyArray1::from_vec(py, mask))
    }

    fn indices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        self.0.run(py, |seen| seen.culling().indices()).map(|list| PyArray1::from_vec(py, list))
    }

    /// The counts of pixels one after the other, five u32 each.
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let counts = self.0.run(py, headless::ApproximateCulling::pixels)?;
        Ok(PyArray1::from_slice(py, bytemuck::cast_slice(&counts)))
    }

    fn negligible<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let negligible = self.0.run(py, headless::ApproximateCulling::negligible)?;
        Ok(PyArray1::from_vec(py, negligible))
    }
}
