//! Containment: whether occluder proxies lie inside their mesh, and whether bounds contain theirs.
//!
//! A cull takes both for granted; here they are decided exactly.
//! `proxy` and `bounds` answer the two questions.
//! `winding` says how often a mesh winds about a point, and `ratio` has the exact fractions.

mod bounds;
mod proxy;
mod ratio;
mod winding;

pub use bounds::{check_bounds, contains};
pub use proxy::{Protrusion, check_proxy};

/// A power of two that brings the largest of the numbers near 1.
///
/// Distances are computed in plain float64.
/// Squares and products of large or small coordinates would leave its range, and scaling by a power
/// of two loses nothing.
fn unit_scale(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let largest = numbers.into_iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if largest > 0.0 && largest.is_finite() {
        (-largest.log2().floor()).clamp(-1000.0, 1000.0).exp2()
    } else {
        1.0
    }
}

/// A triangle mesh, borrowed from the caller.
#[derive(Clone, Copy, Debug)]
pub struct TriangleMesh<'a> {
    /// Positions.
    pub vertices: &'a [[f64; 3]],
    /// Three indices into `vertices` per triangle.
    pub triangles: &'a [[u32; 3]],
}

/// A mesh that has no inside, or that is malformed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// A position is NaN or infinite; the number of its vertex.
    #[error("expected finite vertices, got NaN or infinity at vertex {0}")]
    NonFinite(usize),
    /// An index does not name a vertex.
    #[error("expected indices below the {vertices} vertices, got {index}")]
    Index {
        /// Number of vertices.
        vertices: usize,
        /// The index.
        index: u32,
    },
    /// The mesh is not closed: some edges do not cancel.
    #[error(
        "expected a closed mesh whose triangles run consistently around, got {edges} edges that \
         run more often in one direction than in the other (the first in triangle {triangle}); \
         equal positions count as one vertex"
    )]
    Open {
        /// How many such edges there are.
        edges: usize,
        /// A triangle with such an edge.
        triangle: usize,
    },
}

impl TriangleMesh<'_> {
    fn check(&self) -> Result<(), MeshError> {
        if let Some(vertex) = self.vertices.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
            return Err(MeshError::NonFinite(vertex));
        }
        let vertices = self.vertices.len();
        match self.triangles.iter().flatten().find(|index| **index as usize >= vertices) {
            Some(index) => Err(MeshError::Index { vertices, index: *index }),
            None => Ok(()),
        }
    }

    fn corners(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Refuses meshes that have no inside: every edge must run as often in one direction as in the
    /// other.
    fn check_closed(&self) -> Result<(), MeshError> {
        // Keys compare as bits; adding 0 makes -0 equal to 0.
        let key = |v: u32| self.vertices[v as usize].map(|x| (x + 0.0).to_bits());
        let mut edges: Vec<(_, _, bool, usize)> = Vec::with_capacity(3 * self.triangles.len());
        for (number, t) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (key(t[k]), key(t[(k + 1) % 3]));
                if a != b {
                    edges.push((a.min(b), a.max(b), a < b, number));
                }
            }
        }
        edges.sort_unstable();
        let mut open = edges
            .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
            .filter(|run| 2 * run.iter().filter(|edge| edge.2).count() != run.len());
        match open.next() {
            None => Ok(()),
            Some(first) => Err(MeshError::Open { triangle: first[0].3, edges: 1 + open.count() }),
        }
    }
}
