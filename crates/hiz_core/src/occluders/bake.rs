//! The host's part of an upload of meshes: checked arrays, and vertices moved to world coordinates.
//!
//! Each mesh becomes one part per transform.
//! World positions are kept in float64 for the surface, and as two float32 for the device.

use crate::error::{Error, Result};
use crate::host::linear::{Vec3, cross, dot};
use crate::host::memory;
use crate::host::rounding::split3;
use crate::input::mesh::MeshData;

/// A world position as two float32, `hi + lo`.
///
/// Its twin is the vertex input of `shaders/occluders/occluders.wgsl`, locations 0 and 1.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Vertex {
    hi: [f32; 3],
    lo: [f32; 3],
}

/// The vertex attributes for the two halves of a [`Vertex`].
pub(super) const VERTEX_ATTRIBUTES: [wgpu::VertexAttribute; 2] =
    wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];

/// One copy of one mesh, with its bounds in world coordinates.
///
/// It is one draw, which is left out if the bounds do not meet the frustum.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) indices: std::ops::Range<u32>,
    pub(super) base_vertex: i32,
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

/// What is uploaded, and the same triangles in float64.
#[derive(Default)]
pub(super) struct Baked {
    pub(super) vertices: Vec<Vertex>,
    pub(super) indices: Vec<u32>,
    pub(super) parts: Vec<Part>,
    /// World positions in float64; `triangles` counts them through all parts.
    pub(super) world: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Baked {
    pub(super) fn all(meshes: &[MeshData<'_>]) -> Result<Self> {
        let mut baked = Self::default();
        for mesh in meshes {
            baked.add(mesh)?;
        }
        Ok(baked)
    }

    fn add(&mut self, mesh: &MeshData<'_>) -> Result<()> {
        let (scalars, corners) = (mesh.vertices.len(), mesh.triangles.len());
        if !scalars.is_multiple_of(3) {
            return Err(Error::invalid(
                "vertices",
                format!("expected 3 numbers a vertex, got {scalars} numbers"),
            ));
        }
        if !corners.is_multiple_of(3) {
            return Err(Error::invalid(
                "triangles",
                format!("expected 3 indices a triangle, got {corners} indices"),
            ));
        }
        let num_vertices = scalars / 3;
        if let Some((i, index)) =
            mesh.triangles.iter().enumerate().find(|(_, v)| **v as usize >= num_vertices)
        {
            return Err(Error::invalid(
                "triangles",
                format!(
                    "expected indices below the {num_vertices} vertices, got {index} in triangle \
                     {}",
                    i / 3
                ),
            ));
        }
        let places: Vec<Option<[f64; 16]>> = match mesh.transforms {
            None => vec![None],
            Some(t) if t.len().is_multiple_of(16) => {
                (0..t.len() / 16).map(|k| Some(t.array(k))).collect()
            }
            Some(t) => {
                return Err(Error::invalid(
                    "transforms",
                    format!("expected 16 numbers a matrix, got {} numbers", t.len()),
                ));
            }
        };
        for (k, place) in places.iter().enumerate() {
            self.add_part(mesh, place.as_ref(), k)?;
        }
        Ok(())
    }

    fn add_part(&mut self, mesh: &MeshData<'_>, place: Option<&[f64; 16]>, k: usize) -> Result<()> {
        let world = |p: Vec3| match place {
            None => p,
            Some(m) => std::array::from_fn(|i| {
                dot([m[4 * i], m[4 * i + 1], m[4 * i + 2]], p) + m[4 * i + 3]
            }),
        };
        let mut mirrored = false;
        if let Some(m) = place {
            if m[12..] != [0.0, 0.0, 0.0, 1.0] || !m.iter().all(|v| v.is_finite()) {
                return Err(Error::invalid(
                    "transforms",
                    format!(
                        "expected finite affine matrices with last row (0, 0, 0, 1), got {:?} in \
                         matrix {k}",
                        &m[12..]
                    ),
                ));
            }
            let column = |c: usize| [m[c], m[4 + c], m[8 + c]];
            mirrored = dot(cross(column(0), column(1)), column(2)) < 0.0;
        }
        let too_many =
            |n: usize| Error::limit("occluder vertices or indices", n as u64, i32::MAX as u64);
        let base_vertex =
            i32::try_from(self.vertices.len()).map_err(|_| too_many(self.vertices.len()))?;
        let first_index =
            u32::try_from(self.indices.len()).map_err(|_| too_many(self.indices.len()))?;
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        memory::reserve(&mut self.vertices, mesh.vertices.len() / 3, "vertices")?;
        memory::reserve(&mut self.indices, mesh.triangles.len(), "triangles")?;
        for v in 0..mesh.vertices.len() / 3 {
            let p = world(mesh.vertices.array(v));
            // float32 must hold the position, or the halves would be infinite.
            if !p.iter().all(|x| x.abs() < 1e30) {
                return Err(Error::invalid(
                    "vertices",
                    format!("expected finite positions below 1e30, got {p:?} at vertex {v}"),
                ));
            }
            for i in 0..3 {
                min[i] = min[i].min(p[i]);
                max[i] = max[i].max(p[i]);
            }
            let (hi, lo) = split3(p);
            self.vertices.push(Vertex { hi, lo });
            self.world.push(p);
        }
        for t in mesh.triangles.chunks_exact(3) {
            // A mirroring transform turns a mesh inside out; reversing the corners undoes that.
            let corners = if mirrored { [t[0], t[2], t[1]] } else { [t[0], t[1], t[2]] };
            self.indices.extend(corners);
            self.triangles.push(corners.map(|v| v + base_vertex.unsigned_abs()));
        }
        let end = u32::try_from(self.indices.len()).map_err(|_| too_many(self.indices.len()))?;
        if end > first_index {
            self.parts.push(Part { indices: first_index..end, base_vertex, min, max });
        }
        Ok(())
    }
}
