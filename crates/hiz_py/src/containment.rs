//! Checks of proxies and bounds by `hiz_ref`: conversions only.

use hiz_ref::TriangleMesh;
use numpy::{PyArray1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::{FloatArray, bounds, in_c_order};
use crate::errors::raised;
use crate::reference::volume;

/// Protruding triangles, for each a point outside the mesh, protruding vertices, and the distance.
type Protrusion = (Vec<usize>, Vec<[f64; 3]>, Vec<usize>, f64);

/// float64 positions and indices.
type MeshArrays<'py> = (PyReadonlyArrayDyn<'py, f64>, PyReadonlyArrayDyn<'py, u32>);

fn mesh<'a>((vertices, triangles): &'a MeshArrays<'_>) -> PyResult<TriangleMesh<'a>> {
    in_c_order(vertices.is_c_contiguous() && triangles.is_c_contiguous())?;
    let triples = |_| PyValueError::new_err("expected (N, 3) arrays");
    Ok(TriangleMesh {
        vertices: bytemuck::try_cast_slice(vertices.as_slice()?).map_err(triples)?,
        triangles: bytemuck::try_cast_slice(triangles.as_slice()?).map_err(triples)?,
    })
}

/// The parts of a proxy that are not inside its mesh.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "the arrays are held during the call")]
pub(crate) fn check_proxy(
    py: Python<'_>,
    proxy: MeshArrays<'_>,
    mesh: MeshArrays<'_>,
) -> PyResult<Protrusion> {
    let (proxy, mesh) = (self::mesh(&proxy)?, self::mesh(&mesh)?);
    let found = py
        .detach(|| hiz_ref::check_proxy(&proxy, &mesh))
        .map_err(|error| PyValueError::new_err(format!("mesh: {error}")))?;
    Ok((found.triangles, found.witnesses, found.vertices, found.distance))
}

/// How far each instance's vertices lie outside its bounds; -1 for bounds that contain them.
/// `instances` holds, for each, the number of its mesh and that of its matrix, if it has one.
#[pyfunction]
#[expect(clippy::needless_pass_by_value, reason = "the arrays are held during the call")]
pub(crate) fn check_bounds<'py>(
    py: Python<'py>,
    kind: &str,
    arrays: Vec<FloatArray<'py>>,
    meshes: Vec<MeshArrays<'py>>,
    transforms: PyReadonlyArrayDyn<'py, f64>,
    instances: Vec<(usize, Option<usize>)>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let volumes = bounds(kind, &arrays)?;
    let count = volumes.len().map_err(|error| raised(py, error))?;
    let meshes: Vec<TriangleMesh<'_>> = meshes.iter().map(mesh).collect::<PyResult<_>>()?;
    in_c_order(transforms.is_c_contiguous())?;
    let matrices: &[[f64; 16]] = bytemuck::try_cast_slice(transforms.as_slice()?)
        .map_err(|_| PyValueError::new_err("transforms: expected (K, 4, 4)"))?;
    let known = |(mesh, matrix): &(usize, Option<usize>)| {
        *mesh < meshes.len() && matrix.is_none_or(|matrix| matrix < matrices.len())
    };
    if instances.len() != count || !instances.iter().all(known) {
        return Err(PyValueError::new_err(format!(
            "meshes: expected one for each of {count} instances"
        )));
    }
    let outside: Vec<f64> = py.detach(|| {
        let check = |(i, (mesh, matrix)): (usize, &(usize, Option<usize>))| {
            hiz_ref::check_bounds(
                &volume(&volumes, i),
                meshes[*mesh].vertices,
                matrix.map(|k| &matrices[k]),
            )
        };
        instances.iter().enumerate().map(|one| check(one).unwrap_or(-1.0)).collect()
    });
    Ok(PyArray1::from_vec(py, outside))
}
