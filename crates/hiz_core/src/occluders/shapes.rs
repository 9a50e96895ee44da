//! The meshes of occluders on the host, each in its own space, and the places where they stand.
//!
//! What depends on a mesh alone is made once, at the upload: checked arrays and meshlets.
//! What depends on a place is a matrix, so a mesh moves by its matrices alone.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::host::linear::Vec3;
use crate::host::memory;
use crate::input::mesh::MeshData;
use crate::occluders::meshlets::{self, Blocks, Meshlet};

/// Positions below this size have finite halves in float32.
pub(super) const COORDINATE_LIMIT: f64 = 1e30;

/// All meshes, one after the other in each array.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    /// Vertices in mesh coordinates, as they were given.
    pub(crate) positions: Vec<Vec3>,
    /// Triangles as indices into `positions`, sorted by meshlet.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The meshlets of all meshes.
    pub(crate) meshlets: Vec<Meshlet>,
    /// What a rasteriser reads of the meshlets.
    pub(crate) blocks: Blocks,
    /// The meshes, in the caller's order.
    pub(crate) meshes: Vec<Mesh>,
}

/// One mesh: its part of each array, and the box around its triangles.
#[derive(Debug, Clone)]
pub(crate) struct Mesh {
    pub(crate) vertices: Range<u32>,
    pub(crate) triangles: Range<u32>,
    pub(crate) meshlets: Range<u32>,
    /// In mesh coordinates; infinite and inverted for a mesh without triangles.
    pub(crate) min: Vec3,
    pub(crate) max: Vec3,
}

impl Shapes {
    /// Checks `meshes`, and cuts them into meshlets.
    ///
    /// # Errors
    /// - [`Error::Invalid`] for arrays of the wrong length, indices out of range and unusable
    ///   positions.
    /// - [`Error::Limit`] for more than 2^31 - 1 vertices or indices.
    pub(crate) fn new(meshes: &[MeshData<'_>]) -> Result<Self> {
        let mut shapes = Self::default();
        for mesh in meshes {
            shapes.add(mesh)?;
        }
        Ok(shapes)
    }

    fn add(&mut self, mesh: &MeshData<'_>) -> Result<()> {
        let num_vertices = check_arrays(mesh)?;
        let first_vertex = below_limit(self.positions.len() + num_vertices, num_vertices)?;
        let num_triangles = mesh.triangles.len() / 3;
        let corners = 3 * (self.triangles.len() + num_triangles);
        let first_triangle = (below_limit(corners, 3 * num_triangles)?) / 3;
        memory::reserve(&mut self.positions, num_vertices, "vertices")?;
        for v in 0..num_vertices {
            let p: Vec3 = mesh.vertices.array(v);
            if !p.iter().all(|x| x.abs() < COORDINATE_LIMIT) {
                return Err(Error::invalid(
                    "vertices",
                    format!("expected finite positions below 1e30, got {p:?} at vertex {v}"),
                ));
            }
            self.positions.push(p);
        }
        memory::reserve(&mut self.triangles, num_triangles, "triangles")?;
        self.triangles.extend(mesh.triangles.as_chunks().0);
        let own = &mut self.triangles[first_triangle as usize..];
        let first_meshlet = self.meshlets.len() as u32;
        let positions = &self.positions[first_vertex as usize..];
        meshlets::cluster(positions, own, first_triangle, &mut self.meshlets, &mut self.blocks)?;
        for v in own.iter_mut().flatten() {
            *v += first_vertex;
        }
        let meshlets = &self.meshlets[first_meshlet as usize..];
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for meshlet in meshlets {
            min = std::array::from_fn(|k| min[k].min(meshlet.min[k]));
            max = std::array::from_fn(|k| max[k].max(meshlet.max[k]));
        }
        self.meshes.push(Mesh {
            vertices: first_vertex..self.positions.len() as u32,
            triangles: first_triangle..self.triangles.len() as u32,
            meshlets: first_meshlet..self.meshlets.len() as u32,
            min,
            max,
        });
        Ok(())
    }

    /// Bytes on the host.
    pub(crate) fn bytes(&self) -> u64 {
        self.blocks.bytes()
            + (size_of_val(&self.positions[..])
                + size_of_val(&self.triangles[..])
                + size_of_val(&self.meshlets[..])) as u64
    }
}

/// Checks the lengths and the indices; returns the number of vertices.
fn check_arrays(mesh: &MeshData<'_>) -> Result<usize> {
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
    let found = mesh.triangles.iter().enumerate().find(|(_, v)| **v as usize >= num_vertices);
    if let Some((i, index)) = found {
        return Err(Error::invalid(
            "triangles",
            format!(
                "expected indices below the {num_vertices} vertices, got {index} in triangle {}",
                i / 3
            ),
        ));
    }
    Ok(num_vertices)
}

/// `total - more`, where `total` may be 2^31 - 1 at most: a draw counts vertices in an `i32`.
fn below_limit(total: usize, more: usize) -> Result<u32> {
    match i32::try_from(total) {
        Ok(_) => Ok((total - more) as u32),
        Err(_) => Err(Error::limit(
            "occluder vertices or indices",
            total as u64,
            i32::MAX.unsigned_abs().into(),
        )),
    }
}
