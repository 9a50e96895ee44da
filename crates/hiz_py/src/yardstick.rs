//! What `hizvk bench --speed` times: submits of work whose buffers were made beforehand, and the same work in other shapes.

use std::sync::Arc;

use hiz_core::yardstick::{self, PerLevelReduction, ReductionShape};
use hiz_core::{CullOptions, Error, Instances, Pyramid, PyramidOptions, StoredLevels, Visible, headless};
use numpy::{PyArray1, PyReadonlyArrayDyn, PyReadwriteArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::in_c_order;
use crate::camera::Camera;
use crate::culling::CullArguments;
use crate::device::{DepthImage, Engine};
use crate::errors::detached;

/// Milliseconds on the wall of single submits on one device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Yardstick(headless::Engine);

#[pymethods]
impl Yardstick {
    #[new]
    fn new(engine: &Engine) -> Self {
        Self(engine.0.clone())
    }

    /// How this module was compiled: what runs on the host is slower in a `dev` build.
    #[staticmethod]
    fn profile() -> &'static str {
        if cfg!(debug_assertions) { "dev" } else { "release" }
    }

    fn empty_submit_ms(&self, py: Python<'_>) -> PyResult<f64> {
        detached(py, || yardstick::empty_submit_ms(&self.0))
    }

    /// Of a copy on one thread of the host.
    #[staticmethod]
    #[expect(clippy::needless_pass_by_value, reason = "the arrays are held during the call")]
    fn memcpy_ms(
        py: Python<'_>,
        source: PyReadonlyArrayDyn<'_, f32>,
        mut target: PyReadwriteArrayDyn<'_, f32>,
    ) -> PyResult<f64> {
        in_c_order(source.is_c_contiguous() && target.is_c_contiguous())?;
        let (from, to) = (source.as_slice()?, target.as_slice_mut()?);
        if from.len() != to.len() {
            return Err(PyValueError::new_err(format!("target: expected {} numbers, got {}", from.len(), to.len())));
        }
        Ok(py.detach(|| yardstick::memcpy_ms(from, to)))
    }

    /// The reduction of `depth`: the library's own with these levels, or one dispatch a level, which makes all of them.
    fn reduction(
        &self,
        py: Python<'_>,
        depth: &DepthImage,
        shape: &str,
        levels: (u32, u32),
    ) -> PyResult<YardstickReduction> {
        let (engine, depth) = (self.0.clone(), depth.0.clone());
        let per_level = |shape| detached(py, || PerLevelReduction::new(&engine, &depth, shape)).map(Reducer::PerLevel);
        let reducer = match shape {
            "own" => {
                let levels = StoredLevels { first: levels.0, last: levels.1 };
                let options = PyramidOptions { levels, ..PyramidOptions::default() };
                Reducer::Own(detached(py, || engine.pyramid_with(&depth, &options))?)
            }
            "buffer" => per_level(ReductionShape::Buffer)?,
            "textures" => per_level(ReductionShape::Textures)?,
            other => return Err(PyValueError::new_err(format!("shape: no shape {other:?}"))),
        };
        Ok(YardstickReduction { engine, depth, reducer })
    }

    /// The cull of `instances`, into buffers of its own; with `depth` its reduction into `pyramid` goes before it.
    #[expect(clippy::too_many_arguments, reason = "the signature of Python's method")]
    fn cull(
        &self,
        py: Python<'_>,
        instances: &crate::device::Instances,
        camera: &Camera,
        pyramid: &crate::device::Pyramid,
        certified: bool,
        hierarchy: Option<bool>,
        order: &str,
        outputs: (bool, bool, bool, bool),
        depth: Option<&DepthImage>,
    ) -> PyResult<YardstickCull> {
        let defaults = CullOptions::default();
        let arguments = CullArguments {
            order,
            coverage: "area",
            guard_px: None,
            depth_slack: defaults.depth_slack,
            depth_slack_abs: defaults.depth_slack_abs,
            transform_slack: defaults.transform_slack,
            footprint: 2,
            descent: defaults.descent,
            fit: "rectangle",
            hierarchy,
            outputs,
            capacity: None,
            draw: (0, 0, 0, 0),
            statistics: false,
        };
        let (options, output) = (arguments.options()?, arguments.output());
        let visible = detached(py, || self.0.context().create_visible(&instances.0, &output))?;
        Ok(YardstickCull {
            engine: self.0.clone(),
            instances: Arc::clone(&instances.0),
            camera: camera.0.clone(),
            pyramid: Arc::clone(&pyramid.pyramid),
            depth: depth.map(|depth| depth.0.clone()),
            visible,
            options,
            certified,
        })
    }
}

enum Reducer {
    Own(Arc<Pyramid>),
    PerLevel(PerLevelReduction),
}

/// A reduction that can be submitted again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickReduction {
    engine: headless::Engine,
    depth: headless::DepthImage,
    reducer: Reducer,
}

#[pymethods]
impl YardstickReduction {
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        detached(py, || {
            yardstick::submitted_ms(&self.engine, |encoder| match &self.reducer {
                Reducer::Own(pyramid) => yardstick::reduce(&self.engine, encoder, &self.depth, pyramid),
                Reducer::PerLevel(reduction) => {
                    reduction.record(encoder);
                    Ok(())
                }
            })
        })
    }
}

/// A cull that can be submitted again and again.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct YardstickCull {
    engine: headless::Engine,
    instances: Arc<Instances>,
    camera: hiz_core::Camera,
    pyramid: Arc<Pyramid>,
    depth: Option<headless::DepthImage>,
    visible: Visible,
    options: CullOptions,
    certified: bool,
}

#[pymethods]
impl YardstickCull {
    fn ms(&self, py: Python<'_>) -> PyResult<f64> {
        detached(py, || yardstick::submitted_ms(&self.engine, |encoder| self.record(encoder)))
    }

    /// What the last submit kept.
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        detached(py, || yardstick::read_mask(&self.engine, &self.visible)).map(|mask| PyArray1::from_vec(py, mask))
    }

    /// Of the buffers that take what is found.
    fn device_bytes(&self) -> u64 {
        self.visible.device_bytes()
    }
}

impl YardstickCull {
    fn record(&self, encoder: &mut hiz_core::wgpu::CommandEncoder) -> Result<(), Error> {
        let Self { engine, instances, camera, pyramid, visible, options, .. } = self;
        if let Some(depth) = &self.depth {
            yardstick::reduce(engine, encoder, depth, pyramid)?;
        }
        if self.certified {
            engine.context().record_cull(encoder, instances, camera, pyramid, visible, options)
        } else {
            yardstick::record_uncertified_cull(engine, encoder, instances, camera, pyramid, visible, options)
        }
    }
}
