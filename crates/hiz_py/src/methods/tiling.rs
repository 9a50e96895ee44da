//! Tiling without depths, and the depth tiles that it is compared with.
//!
//! They lie on the host, so no device holds them.

use std::sync::{Arc, Mutex, PoisonError};

use hiz_core::methods::tiling::{self, BspOptions};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arguments::image_size;
use crate::camera::Camera;
use crate::device::Occluders;

/// Triangles in the order of a BSP tree.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct BspTree(tiling::BspTree);

/// What is seen of a tree.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct Tiled(tiling::Tiled);

/// The library's rasteriser on one thread.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct DepthTiles(Mutex<tiling::DepthTiles>);

#[pymethods]
impl BspTree {
    #[new]
    fn new(
        py: Python<'_>,
        occluders: &Occluders,
        leaf: Option<u32>,
        most_parts: f64,
    ) -> PyResult<Self> {
        let options = BspOptions { leaf, most_parts };
        let made = |occluders: &Arc<hiz_core::Occluders>| {
            tiling::BspTree::new(occluders.surface(), &options)
        };
        occluders.0.run(py, made).map(Self)
    }

    /// Triangles, parts and nodes, and bytes on the host.
    fn numbers(&self) -> (usize, usize, usize, u64) {
        let tree = &self.0;
        (tree.num_triangles(), tree.num_parts(), tree.num_nodes(), tree.host_bytes())
    }

    fn is_octree(&self) -> bool {
        self.0.is_octree()
    }

    fn draw(&self, py: Python<'_>, occluders: &Occluders, camera: &Camera) -> PyResult<Tiled> {
        let draw =
            |occluders: &Arc<hiz_core::Occluders>| self.0.draw(occluders.surface(), &camera.0);
        occluders.0.run(py, draw).map(Tiled)
    }
}

#[pymethods]
impl Tiled {
    fn coverage<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.0.coverage())
    }

    /// Visible triangles, tiled parts, nodes, hidden nodes, and bytes of the pyramid.
    fn numbers(&self) -> (usize, u64, u64, u64, u64) {
        let seen = &self.0;
        (seen.num_visible(), seen.parts, seen.nodes, seen.hidden_nodes, seen.bytes())
    }
}

#[pymethods]
impl DepthTiles {
    #[new]
    fn new(size: (u32, u32)) -> Self {
        Self(Mutex::new(tiling::DepthTiles::new(image_size(size))))
    }

    fn draw(&self, py: Python<'_>, occluders: &Occluders, camera: &Camera) -> PyResult<()> {
        occluders.0.run(py, |occluders| {
            let mut tiles = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            tiles.draw(occluders.surface(), &camera.0)
        })
    }

    fn coverage<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        let coverage = self.0.lock().unwrap_or_else(PoisonError::into_inner).coverage();
        PyArray1::from_vec(py, coverage)
    }

    fn bytes(&self) -> u64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).bytes()
    }
}
