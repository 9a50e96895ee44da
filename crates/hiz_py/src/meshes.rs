//! Tables of meshes, and how a cull emits their bins.

use hiz_core::{DrawTemplate, Emit, Lod, MeshLods, Placement};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::held::{Held, OnDevice};

/// Meshes with their levels of detail on a device.
#[pyclass(frozen, module = "hizvk._core")]
pub(crate) struct MeshTable(pub(crate) Held<hiz_core::MeshTable>);

impl OnDevice for hiz_core::MeshTable {}

/// A level of detail: `index_count`, `first_index`, `base_vertex`, `first_instance`, and its error.
pub(crate) type LodNumbers = (u32, u32, i32, u32, f64);

/// The table of these meshes.
pub(crate) fn mesh_table(
    engine: &hiz_core::headless::Engine,
    meshes: &[Vec<LodNumbers>],
) -> hiz_core::Result<hiz_core::MeshTable> {
    let lod = |(index_count, first_index, base_vertex, first_instance, error): &LodNumbers| {
        let draw = DrawTemplate {
            index_count: *index_count,
            first_index: *first_index,
            base_vertex: *base_vertex,
            first_instance: *first_instance,
        };
        Lod::new(draw, *error)
    };
    let lods: Vec<Vec<Lod>> = meshes.iter().map(|mesh| mesh.iter().map(lod).collect()).collect();
    let meshes: Vec<_> = lods.iter().map(|lods| MeshLods::new(lods)).collect();
    engine.context().create_mesh_table(&meshes)
}

/// How a cull emits: the fields `emit` and `placement` of `hizvk.Outputs`.
pub(crate) fn emit(
    given: &Bound<'_, PyAny>,
    meshes: Option<&hiz_core::MeshTable>,
) -> PyResult<Emit> {
    let Some(meshes) = meshes.cloned() else { return Ok(Emit::List) };
    let (emit, placement): (String, String) =
        (given.getattr("emit")?.extract()?, given.getattr("placement")?.extract()?);
    match (emit.as_str(), placement.as_str()) {
        ("bins", "packed") => Ok(Emit::Binned { meshes, placement: Placement::Packed }),
        ("bins", "reserved") => Ok(Emit::Binned { meshes, placement: Placement::Reserved }),
        ("instances", _) => Ok(Emit::Instances { meshes }),
        _ => Err(PyValueError::new_err(format!("emit: no way {emit:?}, {placement:?}"))),
    }
}
