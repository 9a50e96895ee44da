//! Visibility tests as published texts print them.

use hiz_core::methods::{self, Text, TextCamera};
use hiz_core::{ImageSize, headless};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::in_c_order;
use crate::device::Engine;
use crate::held::{Held, OnDevice, detached};

/// Rows of four numbers that describe a camera: three matrices, six planes, eye and up.
const CAMERA_ROWS: usize = 20;

/// A published test of some instances in one view.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct TextCull(Held<methods::TextCull>);

impl OnDevice for methods::TextCull {}

#[pymethods]
impl TextCull {
    /// `camera` has 20 rows, `sizes` are heights and widths of the levels, the image first.
    #[new]
    #[expect(clippy::needless_pass_by_value, reason = "the arrays are held during the call")]
    fn new(
        py: Python<'_>,
        engine: &Engine,
        text: &str,
        bounds: PyReadonlyArrayDyn<'_, f32>,
        camera: (PyReadonlyArrayDyn<'_, f32>, f32),
        sizes: Vec<(u32, u32)>,
        texels: PyReadonlyArrayDyn<'_, f32>,
    ) -> PyResult<Self> {
        let text = match text {
            "rakos" => Text::Rakos,
            "arm" => Text::Arm,
            "darnell" => Text::Darnell,
            "one_lookup" => Text::OneLookup,
            other => return Err(PyValueError::new_err(format!("text: no text {other:?}"))),
        };
        let (camera, near) = camera;
        in_c_order(
            bounds.is_c_contiguous() && camera.is_c_contiguous() && texels.is_c_contiguous(),
        )?;
        let (bounds, rest) = bounds.as_slice()?.as_chunks::<4>();
        let (camera, rest_of_camera) = camera.as_slice()?.as_chunks::<4>();
        if !rest.is_empty() || !rest_of_camera.is_empty() || camera.len() != CAMERA_ROWS {
            return Err(PyValueError::new_err(format!(
                "camera: expected {CAMERA_ROWS} rows and bounds of four numbers each"
            )));
        }
        let row = |k: usize| camera[k];
        let camera = TextCamera {
            clip_from_world: std::array::from_fn(row),
            view_from_world: std::array::from_fn(|k| row(4 + k)),
            clip_from_view: std::array::from_fn(|k| row(8 + k)),
            planes: std::array::from_fn(|k| row(12 + k)),
            eye: row(18),
            up: row(19),
            near,
        };
        let sizes: Vec<_> = sizes.into_iter().map(|(h, w)| ImageSize::new(w, h)).collect();
        let texels = texels.as_slice()?;
        let engine = headless::Engine::clone(&*engine.0.get(py)?);
        let made = detached(py, || {
            methods::TextCull::new(&engine, text, bounds, &camera, (&sizes, texels))
        })?;
        Ok(Self(Held::new(py, made)))
    }

    /// Runs the test and waits for it.
    fn run(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, methods::TextCull::run)
    }

    /// What the last run kept.
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        self.0.run(py, methods::TextCull::mask).map(|mask| PyArray1::from_vec(py, mask))
    }
}
