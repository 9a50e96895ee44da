//! The two passes of a frame.

use hiz_core::headless::{self, EarlyMask};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::device::{Engine, Instances, Pyramid};
use crate::held::{Held, OnDevice};
use crate::options::cull_options;

/// The two passes of a view.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct TwoPasses(Held<headless::TwoPasses>);

impl OnDevice for headless::TwoPasses {}

#[pymethods]
impl TwoPasses {
    #[new]
    fn new(
        py: Python<'_>,
        engine: &Engine,
        instances: &Instances,
        early_capacity: Option<u32>,
    ) -> PyResult<Self> {
        let instances = instances.0.get(py)?;
        engine
            .0
            .run(py, |engine| engine.two_passes(&instances, early_capacity))
            .map(|passes| Self(Held::new(py, passes)))
    }

    /// What was visible; or by size or by a mask, if one of them is given.
    fn early(
        &self,
        py: Python<'_>,
        camera: &Camera,
        pixels: Option<u32>,
        mask: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<PassAnswer> {
        let set = match (pixels, &mask) {
            (Some(pixels), _) => EarlyMask::Largest { pixels },
            (None, Some(mask)) => EarlyMask::Given(mask.as_slice()?),
            (None, None) => EarlyMask::LastVisible,
        };
        self.0
            .run(py, |passes| passes.early(&camera.0, set))
            .map(|answer| PassAnswer(Held::new(py, answer)))
    }

    fn late(
        &self,
        py: Python<'_>,
        camera: &Camera,
        pyramid: &Pyramid,
        options: &Bound<'_, PyAny>,
    ) -> PyResult<PassAnswer> {
        let (options, pyramid) = (cull_options(options)?, pyramid.0.get(py)?);
        self.0
            .run(py, |passes| passes.late(&camera.0, &pyramid.1, &options))
            .map(|answer| PassAnswer(Held::new(py, answer)))
    }

    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, |passes| {
            passes.reset();
            Ok(())
        })
    }

    fn device_bytes(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.0.get(py)?.device_bytes())
    }
}

/// What one pass draws.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct PassAnswer(Held<headless::PassAnswer>);

impl OnDevice for headless::PassAnswer {}

#[pymethods]
impl PassAnswer {
    fn num_instances(&self, py: Python<'_>) -> PyResult<u32> {
        Ok(self.0.look(py)?.instances().len())
    }

    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, headless::PassAnswer::mask).map(|mask| PyArray1::from_vec(py, mask))
    }
}
