//! Hierarchical occlusion maps.
//!
//! They lie on the host, so no device holds them.

use std::sync::Arc;

use hiz_core::methods::occlusion_map::{self, MapCull, MapOptions};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::arguments::{FloatArray, bounds};
use crate::camera::Camera;
use crate::device::Occluders;
use crate::held::detached;

/// `(height, width)`, and as many numbers in C order.
type Image<'py, T> = ((u32, u32), Bound<'py, PyArray1<T>>);
/// Verdicts, holes, and how many pixels of maps were read.
type Seen<'py> = (Bound<'py, PyArray1<u8>>, Bound<'py, PyArray1<u32>>, u64);

/// Maps of what the occluders of one view cover.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct OcclusionMap(occlusion_map::OcclusionMap);

#[pymethods]
impl OcclusionMap {
    #[new]
    fn new(
        py: Python<'_>,
        occluders: &Occluders,
        camera: &Camera,
        least: u32,
        regions: u32,
        max_triangles: Option<u64>,
        max_copies: Option<u64>,
    ) -> PyResult<Self> {
        let options = MapOptions { least, regions, max_triangles, max_copies };
        let made = |occluders: &Arc<hiz_core::Occluders>| {
            occlusion_map::OcclusionMap::new(occluders.surface(), &camera.0, &options)
        };
        occluders.0.run(py, made).map(Self)
    }

    fn num_levels(&self) -> u32 {
        self.0.num_levels()
    }

    fn level<'py>(&self, py: Python<'py>, level: u32) -> Image<'py, u32> {
        let (size, counts) = self.0.level(level);
        ((size.height, size.width), PyArray1::from_slice(py, counts))
    }

    fn estimate<'py>(&self, py: Python<'py>) -> Image<'py, f64> {
        let (size, depths) = self.0.estimate();
        ((size.height, size.width), PyArray1::from_slice(py, depths))
    }

    fn least_counts(&self, negligible_px: u32) -> Vec<u32> {
        self.0.least_counts(negligible_px)
    }

    fn chosen<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_slice(py, self.0.chosen())
    }

    fn num_triangles(&self) -> u64 {
        self.0.num_triangles()
    }

    fn cull<'py>(
        &self,
        py: Python<'py>,
        kind: &str,
        arrays: Vec<FloatArray<'_>>,
        negligible_px: u32,
        never: Option<PyReadonlyArray1<'_, bool>>,
    ) -> PyResult<Seen<'py>> {
        let bounds = bounds(kind, &arrays)?;
        let never = never.as_ref().map(|never| never.as_slice()).transpose()?;
        let seen = detached(py, || self.0.cull(&bounds, &MapCull { negligible_px, never }))?;
        let verdicts = PyArray1::from_slice(py, bytemuck::cast_slice(&seen.verdicts));
        Ok((verdicts, PyArray1::from_vec(py, seen.holes), seen.lookups))
    }
}
