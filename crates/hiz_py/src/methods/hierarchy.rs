//! Hierarchical visibility: conversions only.

use std::sync::Arc;

use hiz_core::methods::hierarchy::{self, HierarchyOptions};
use hiz_core::{FaceCull, MeshData, OccluderOptions};
use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, LevelArray, in_c_order};
use crate::camera::Camera;
use crate::held::detached;

/// Least and greatest corners (3 N each), parents (-1 for the root), levels, meshlets, triangles.
type Nodes<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<i64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u64>>,
);

/// The fields of `HierarchyCounts` in their order.
type Counts = (u64, u64, u64, u64, u64, u64, u64);

/// Depth, levels 1 and above, states, visible leaves, counts, centres, milliseconds.
type Frame<'py> = (
    Bound<'py, PyArray1<f32>>,
    Vec<LevelArray<'py>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<u32>>,
    Counts,
    Option<(u64, u64)>,
    f64,
);

/// Meshes under an octree.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct HierarchicalVisibility(Arc<hierarchy::HierarchicalVisibility>);

#[pymethods]
impl HierarchicalVisibility {
    #[new]
    fn new(
        py: Python<'_>,
        meshes: Vec<(FloatArray<'_>, PyReadonlyArrayDyn<'_, u32>, Option<FloatArray<'_>>)>,
        cull: &str,
        threshold: u32,
        deepest: u32,
    ) -> PyResult<Self> {
        let cull_mode = match cull {
            "none" => FaceCull::None,
            "back" => FaceCull::Back,
            "front" => FaceCull::Front,
            _ => return Err(PyValueError::new_err(format!("cull: no mode {cull:?}"))),
        };
        let mut data = Vec::with_capacity(meshes.len());
        for (vertices, triangles, transforms) in &meshes {
            in_c_order(triangles.is_c_contiguous())?;
            data.push(MeshData {
                vertices: vertices.floats()?,
                triangles: triangles.as_slice()?,
                transforms: transforms.as_ref().map(FloatArray::floats).transpose()?,
            });
        }
        let (drawing, options) =
            (OccluderOptions { cull_mode }, HierarchyOptions { threshold, deepest });
        detached(py, || hierarchy::HierarchicalVisibility::new(&data, &drawing, &options))
            .map(|made| Self(Arc::new(made)))
    }

    fn nodes<'py>(&self, py: Python<'py>) -> Nodes<'py> {
        let nodes: Vec<_> = self.0.nodes().collect();
        let corners = |of: fn(&hierarchy::HierarchyNode) -> [f64; 3]| {
            PyArray1::from_vec(py, nodes.iter().flat_map(of).collect())
        };
        let parent = |node: &hierarchy::HierarchyNode| node.parent.map_or(-1, i64::from);
        (
            corners(|node| node.min),
            corners(|node| node.max),
            PyArray1::from_vec(py, nodes.iter().map(parent).collect()),
            PyArray1::from_vec(py, nodes.iter().map(|node| node.level).collect()),
            PyArray1::from_vec(py, nodes.iter().map(|node| node.meshlets).collect()),
            PyArray1::from_vec(py, nodes.iter().map(|node| node.triangles).collect()),
        )
    }

    fn num_triangles(&self) -> u64 {
        self.0.num_triangles()
    }

    fn num_meshlets(&self) -> usize {
        self.0.num_meshlets()
    }

    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
        previous: PyReadonlyArray1<'_, u32>,
        count: bool,
    ) -> PyResult<Frame<'py>> {
        let previous = previous.as_slice()?;
        let frame = detached(py, || self.0.render(&camera.0, previous, count))?;
        let levels = frame
            .levels
            .into_iter()
            .map(|(size, texels)| ((size.height, size.width), PyArray1::from_vec(py, texels)));
        let c = frame.counts;
        Ok((
            PyArray1::from_vec(py, frame.depth),
            levels.collect(),
            PyArray1::from_vec(py, frame.states.into_iter().map(|state| state as u8).collect()),
            PyArray1::from_vec(py, frame.visible_leaves),
            (
                c.comparisons,
                c.settled_by_one,
                c.triangles_outside,
                c.triangles_in_hidden_nodes,
                c.triangles_in_hidden_meshlets,
                c.triangles_drawn,
                c.meshlets_drawn,
            ),
            frame.centres.map(|centres| (centres.in_view, centres.drawn)),
            frame.milliseconds,
        ))
    }

    /// Depth, meshlets drawn, their triangles, milliseconds.
    fn render_flat<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
    ) -> PyResult<(Bound<'py, PyArray1<f32>>, u64, u64, f64)> {
        let flat = detached(py, || self.0.render_flat(&camera.0))?;
        let depth = PyArray1::from_vec(py, flat.depth);
        Ok((depth, flat.meshlets_drawn, flat.triangles_drawn, flat.milliseconds))
    }
}
