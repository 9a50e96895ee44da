//! Which triangles share which edges: integers only, made once for all cameras.

use crate::error::{Error, Result};
use crate::host::linear::Vec3;

/// The half-edges of all cells have to fit 31 bits.
/// Clipping may make two cells of a triangle, so there may be six half-edges per triangle.
const MAX_TRIANGLES: usize = (1 << 31) / 6 - 1;

/// Triangles whose vertices are welded where their positions are equal.
///
/// Half-edge `3 t + k` runs from corner k of triangle t to its next corner.
#[derive(Debug)]
pub(super) struct Topology {
    /// World positions, no two of them equal.
    pub(super) positions: Vec<Vec3>,
    /// Three different vertices per triangle.
    pub(super) triangles: Vec<[u32; 3]>,
    /// By half-edge: the undirected edge that it runs along.
    pub(super) edges: Vec<u32>,
    /// By edge: where its half-edges begin in `incident`; one more entry marks the end.
    pub(super) first: Vec<u32>,
    /// Half-edges, sorted by edge.
    pub(super) incident: Vec<u32>,
}

impl Topology {
    /// Welds positions that are equal as numbers, across meshes too.
    ///
    /// Triangles with two equal corners are dropped, since they cover nothing.
    ///
    /// # Errors
    /// [`Error::Limit`] for more than [`MAX_TRIANGLES`] triangles.
    pub(super) fn new(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self> {
        if triangles.len() > MAX_TRIANGLES {
            return Err(Error::limit(
                "occluder triangles",
                triangles.len() as u64,
                MAX_TRIANGLES as u64,
            ));
        }
        let (positions, welded) = weld(positions);
        let triangles: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| welded[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        let mut runs: Vec<(u64, u32)> = (0..3 * triangles.len() as u32)
            .map(|half| {
                let [a, b] = ends(&triangles, half);
                (u64::from(a.min(b)) << 32 | u64::from(a.max(b)), half)
            })
            .collect();
        runs.sort_unstable();
        let mut edges = vec![0; runs.len()];
        let mut first = Vec::new();
        for (i, (key, half)) in runs.iter().enumerate() {
            if i == 0 || runs[i - 1].0 != *key {
                first.push(i as u32);
            }
            edges[*half as usize] = first.len() as u32 - 1;
        }
        first.push(runs.len() as u32);
        Ok(Self {
            positions,
            triangles,
            edges,
            first,
            incident: runs.into_iter().map(|run| run.1).collect(),
        })
    }

    pub(super) fn num_edges(&self) -> usize {
        self.first.len() - 1
    }

    /// The half-edges along an edge; at least one.
    pub(super) fn around(&self, edge: usize) -> &[u32] {
        &self.incident[self.first[edge] as usize..self.first[edge + 1] as usize]
    }

    /// The vertices that a half-edge runs from and to.
    pub(super) fn ends(&self, half: u32) -> [u32; 2] {
        ends(&self.triangles, half)
    }

    /// Bytes on the host.
    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(&self.positions[..])
            + size_of_val(&self.triangles[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.first[..])
            + size_of_val(&self.incident[..])) as u64
    }
}

fn ends(triangles: &[[u32; 3]], half: u32) -> [u32; 2] {
    let (t, k) = ((half / 3) as usize, (half % 3) as usize);
    [triangles[t][k], triangles[t][(k + 1) % 3]]
}

/// The distinct positions, and the index among them of each given one.
fn weld(positions: &[Vec3]) -> (Vec<Vec3>, Vec<u32>) {
    // -0 and 0 are the same position.
    let plain = |p: Vec3| p.map(|x| x + 0.0);
    let key = |p: Vec3| plain(p).map(f64::to_bits);
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    order.sort_unstable_by_key(|i| key(positions[*i as usize]));
    let mut different: Vec<Vec3> = Vec::new();
    let mut welded = vec![0; positions.len()];
    for i in order {
        let p = plain(positions[i as usize]);
        if different.last().is_none_or(|last| key(*last) != key(p)) {
            different.push(p);
        }
        welded[i as usize] = different.len() as u32 - 1;
    }
    (different, welded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_places_are_one_vertex_and_edges_know_their_triangles() {
        // A square of two triangles with six vertices of their own, one corner at -0.
        // A third triangle has no area.
        let positions = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let topology = Topology::new(&positions, &[[0, 1, 2], [3, 4, 5], [0, 3, 1]]).unwrap();
        assert_eq!(
            (topology.positions.len(), topology.triangles.len(), topology.num_edges()),
            (4, 2, 5)
        );
        let mut sharing: Vec<usize> = (0..5).map(|e| topology.around(e).len()).collect();
        sharing.sort_unstable();
        assert_eq!(sharing, [1, 1, 1, 1, 2]);
        for half in 0..6 {
            assert!(topology.around(topology.edges[half as usize] as usize).contains(&half));
        }
    }
}
