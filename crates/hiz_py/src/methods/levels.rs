//! Other ways to make a depth image's levels.

use hiz_core::methods::{self, LevelWay};
use hiz_core::{StoredLevels, headless};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::in_c_order;
use crate::camera::Camera;
use crate::device::Engine;
use crate::held::{Held, OnDevice, detached};

/// Levels of some images of one size.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct MethodLevels(Held<methods::MethodLevels>);

impl OnDevice for methods::MethodLevels {}

#[pymethods]
impl MethodLevels {
    /// `way` is "fragment", "mips", "pyramid", "tree" or "atomic".
    /// `shape` is the width and height of a workgroup, and of "pyramid" the first and last level.
    #[new]
    fn new(
        py: Python<'_>,
        engine: &Engine,
        way: &str,
        shape: (u32, u32),
        camera: &Camera,
        images: Vec<PyReadonlyArrayDyn<'_, f32>>,
    ) -> PyResult<Self> {
        let way = match way {
            "fragment" => LevelWay::FragmentPasses,
            "mips" => LevelWay::Mips,
            "pyramid" => LevelWay::Pyramid(StoredLevels { first: shape.0, last: shape.1 }),
            "tree" => LevelWay::Tree,
            "atomic" => LevelWay::Atomic(shape.0, shape.1),
            other => return Err(PyValueError::new_err(format!("way: no way {other:?}"))),
        };
        in_c_order(images.iter().all(|image| image.is_c_contiguous()))?;
        let images = images.iter().map(|image| image.as_slice()).collect::<Result<Vec<_>, _>>()?;
        let engine = headless::Engine::clone(&*engine.0.get(py)?);
        let made = detached(py, || methods::MethodLevels::new(&engine, way, &camera.0, &images))?;
        Ok(Self(Held::new(py, made)))
    }

    /// Makes all levels of all images in one submission, and waits for it.
    fn run(&self, py: Python<'_>) -> PyResult<()> {
        self.0.run(py, methods::MethodLevels::run)
    }

    /// Height, width and texels of level `k` of an image.
    fn level<'py>(
        &self,
        py: Python<'py>,
        image: usize,
        k: u32,
    ) -> PyResult<(u32, u32, Bound<'py, PyArray1<f32>>)> {
        let (size, texels) = self.0.run(py, |levels| levels.read(image, k))?;
        Ok((size.height, size.width, PyArray1::from_vec(py, texels)))
    }
}
