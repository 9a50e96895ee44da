//! Which triangles of a mesh share which edges: integers only, made once for all cameras.
//!
//! Edges are shared if the mesh positions of their ends are equal numbers.
//! Under one matrix they then have equal world positions, too, so a mesh that moves keeps them.
//! Each meshlet lists all edges of its triangles, those to other meshlets included.
//! So whoever looks at some meshlets alone finds every edge of their triangles.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::host::linear::Vec3;
use crate::occluders::shapes::Shapes;

/// The half-edges of all cells have to fit 31 bits.
/// Clipping may make two cells of a triangle, so there may be six half-edges per triangle.
const MAX_TRIANGLES: usize = (1 << 31) / 6 - 1;
/// The most triangles at an edge that know each other.
///
/// Where more meet, each of them has the edge as a border.
/// Lists of all of them in every meshlet would grow with the square of their number.
pub(super) const MAX_AT_EDGE: usize = 32;
/// In [`Topology::sides`]: a triangle with two equal corners, which covers nothing.
pub(super) const NO_EDGE: u32 = u32::MAX;

/// A triangle at an edge, as another triangle of that edge sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbour {
    /// Its meshlet, and its number in there.
    pub(super) meshlet: u32,
    pub(super) triangle: u8,
    /// Whether it runs along the edge in the same direction.
    pub(super) is_along: bool,
}

/// An edge in the list of a meshlet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// The same number wherever the edge is listed.
    pub(super) id: u32,
    /// Where its other triangles begin in [`Topology::neighbours`], and how many they are.
    first: u32,
    count: u8,
    /// More than [`MAX_AT_EDGE`] triangles meet here, and none is told of the others.
    pub(super) is_crowded: bool,
    /// One of its triangles in this meshlet.
    pub(super) triangle: u8,
    /// The edge as that triangle runs along it, as vertices of the meshlet.
    pub(super) ends: [u8; 2],
}

/// A meshlet's parts of the arrays.
#[derive(Debug, Clone)]
struct Part {
    vertices: Range<u32>,
    edges: Range<u32>,
}

/// The edges of all meshes.
#[derive(Debug, Default)]
pub(super) struct Topology {
    /// By triangle of [`Shapes::triangles`]: its corners as vertices of its meshlet.
    corners: Vec<[u8; 3]>,
    /// By triangle of [`Shapes::triangles`]: side k runs from corner k to the next one.
    sides: Vec<[u32; 3]>,
    parts: Vec<Part>,
    /// Indices into [`Shapes::positions`]; no two vertices of a meshlet have equal positions.
    vertices: Vec<u32>,
    edges: Vec<Edge>,
    neighbours: Vec<Neighbour>,
    num_edges: u32,
}

impl Topology {
    /// # Errors
    /// [`Error::Limit`] for more than [`MAX_TRIANGLES`] triangles.
    pub(super) fn new(shapes: &Shapes) -> Result<Self> {
        let count = shapes.triangles.len();
        if count > MAX_TRIANGLES {
            return Err(Error::limit("occluder triangles", count as u64, MAX_TRIANGLES as u64));
        }
        let mut topology = Self {
            corners: Vec::with_capacity(count),
            sides: Vec::with_capacity(count),
            ..Self::default()
        };
        for mesh in 0..shapes.meshes.len() {
            topology.add(shapes, mesh);
        }
        Ok(topology)
    }

    fn add(&mut self, shapes: &Shapes, mesh: usize) {
        let mesh = &shapes.meshes[mesh];
        let vertices = mesh.vertices.start as usize..mesh.vertices.end as usize;
        let welded = weld(&shapes.positions[vertices]);
        let triangles =
            &shapes.triangles[mesh.triangles.start as usize..mesh.triangles.end as usize];
        let triangles: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| t.map(|v| welded[(v - mesh.vertices.start) as usize]))
            .collect();
        let runs = Runs::new(&triangles, welded.len());
        let first_side = self.sides.len();
        self.sides.resize(first_side + triangles.len(), [NO_EDGE; 3]);
        for (edge, run) in runs.iter().enumerate() {
            for half in run {
                let (t, k) = (half / 3, half % 3);
                self.sides[first_side + t as usize][k as usize] = self.num_edges + edge as u32;
            }
        }
        // By triangle of this mesh: its meshlet and its number in there.
        let meshlets = mesh.meshlets.start as usize..mesh.meshlets.end as usize;
        let mut places = Vec::with_capacity(triangles.len());
        for m in mesh.meshlets.clone() {
            let own = shapes.meshlets[m as usize].triangles.len();
            places.extend((0..own).map(|i| (m, i as u8)));
        }
        // Stamps: by vertex its number in the meshlet that is being made, by edge that meshlet.
        let mut number = vec![(u32::MAX, 0_u8); welded.len()];
        let mut listed = vec![u32::MAX; runs.len()];
        for m in meshlets {
            let (vertices, edges) = (self.vertices.len() as u32, self.edges.len() as u32);
            let of_mesh = |t: u32| (t - mesh.triangles.start) as usize;
            let own = shapes.meshlets[m].triangles.clone();
            let mut used = 0;
            for t in own.clone().map(of_mesh) {
                let corners = triangles[t].map(|v| {
                    let seen = &mut number[v as usize];
                    if seen.0 != m as u32 {
                        *seen = (m as u32, used);
                        used = used.wrapping_add(1);
                        self.vertices.push(mesh.vertices.start + v);
                    }
                    seen.1
                });
                self.corners.push(corners);
            }
            for t in own.map(of_mesh) {
                for k in 0..3 {
                    let id = self.sides[first_side + t][k];
                    if id == NO_EDGE {
                        continue;
                    }
                    let edge = (id - self.num_edges) as usize;
                    let run = runs.of(edge);
                    let is_crowded = run.len() > MAX_AT_EDGE;
                    let run = if is_crowded { &[] } else { run };
                    if listed[edge] == m as u32 && !is_crowded {
                        continue;
                    }
                    listed[edge] = m as u32;
                    let corners = self.corners[first_side + t];
                    let (first, mine) = (self.neighbours.len(), (3 * t + k) as u32);
                    let starts = |half: u32| triangles[(half / 3) as usize][(half % 3) as usize];
                    for &half in run.iter().filter(|half| **half != mine) {
                        let (meshlet, triangle) = places[(half / 3) as usize];
                        let is_along = starts(half) == starts(mine);
                        self.neighbours.push(Neighbour { meshlet, triangle, is_along });
                    }
                    self.edges.push(Edge {
                        id,
                        first: first as u32,
                        count: (self.neighbours.len() - first) as u8,
                        is_crowded,
                        triangle: places[t].1,
                        ends: [corners[k], corners[(k + 1) % 3]],
                    });
                }
            }
            self.parts.push(Part {
                vertices: vertices..self.vertices.len() as u32,
                edges: edges..self.edges.len() as u32,
            });
        }
        self.num_edges += runs.len() as u32;
    }

    /// The vertices of a meshlet, as indices into [`Shapes::positions`].
    pub(super) fn vertices(&self, meshlet: u32) -> &[u32] {
        let range = &self.parts[meshlet as usize].vertices;
        &self.vertices[range.start as usize..range.end as usize]
    }

    /// The edges of a meshlet's triangles, each once.
    pub(super) fn edges(&self, meshlet: u32) -> &[Edge] {
        let range = &self.parts[meshlet as usize].edges;
        &self.edges[range.start as usize..range.end as usize]
    }

    /// The triangles at an edge, except the one that it is listed with.
    #[inline]
    pub(super) fn neighbours(&self, edge: &Edge) -> &[Neighbour] {
        &self.neighbours[edge.first as usize..][..usize::from(edge.count)]
    }

    /// The corners of triangles, as vertices of their meshlet.
    pub(super) fn corners(&self, triangles: &Range<u32>) -> &[[u8; 3]] {
        &self.corners[triangles.start as usize..triangles.end as usize]
    }

    /// The edges of triangles: side k runs from corner k to the next one.
    pub(super) fn sides(&self, triangles: &Range<u32>) -> &[[u32; 3]] {
        &self.sides[triangles.start as usize..triangles.end as usize]
    }

    /// Bytes on the host.
    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(&self.corners[..])
            + size_of_val(&self.sides[..])
            + size_of_val(&self.parts[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.neighbours[..])) as u64
    }
}

/// The half-edges along each edge of a mesh.
///
/// Half-edge `3 t + k` runs from corner k of triangle t to its next corner.
struct Runs {
    /// Half-edges, sorted by edge.
    halves: Vec<u32>,
    /// By edge: where its half-edges begin; one more entry marks the end.
    first: Vec<u32>,
}

impl Runs {
    /// Sorts half-edges by their lower end in one counting pass, then the few of each by the other.
    ///
    /// Triangles with two equal corners have none.
    fn new(triangles: &[[u32; 3]], num_vertices: usize) -> Self {
        let ends = |half: u32| {
            let (t, k) = ((half / 3) as usize, (half % 3) as usize);
            (triangles[t][k], triangles[t][(k + 1) % 3])
        };
        let has_area = |[a, b, c]: [u32; 3]| a != b && b != c && c != a;
        let halves = || {
            (0..triangles.len() as u32)
                .filter(|t| has_area(triangles[*t as usize]))
                .flat_map(|t| 3 * t..3 * t + 3)
        };
        let mut next = vec![0_u32; num_vertices + 1];
        for half in halves() {
            let (a, b) = ends(half);
            next[a.min(b) as usize + 1] += 1;
        }
        for i in 1..next.len() {
            next[i] += next[i - 1];
        }
        let begin = next.clone();
        let mut sorted = vec![(0, 0); begin[num_vertices] as usize];
        for half in halves() {
            let (a, b) = ends(half);
            let place = &mut next[a.min(b) as usize];
            sorted[*place as usize] = (a.max(b), half);
            *place += 1;
        }
        let (mut halves, mut first) = (Vec::with_capacity(sorted.len()), Vec::new());
        for bounds in begin.windows(2) {
            let run = &mut sorted[bounds[0] as usize..bounds[1] as usize];
            run.sort_unstable();
            for same in run.chunk_by(|a, b| a.0 == b.0) {
                first.push(halves.len() as u32);
                halves.extend(same.iter().map(|(_, half)| half));
            }
        }
        first.push(halves.len() as u32);
        Self { halves, first }
    }

    fn len(&self) -> usize {
        self.first.len() - 1
    }

    fn of(&self, edge: usize) -> &[u32] {
        &self.halves[self.first[edge] as usize..self.first[edge + 1] as usize]
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|edge| self.of(edge))
    }
}

/// The bits of a position, where -0 is 0.
pub(super) fn bits(p: Vec3) -> [u64; 3] {
    p.map(|x| (x + 0.0).to_bits())
}

/// A number that is the same for equal positions, and seldom the same for others.
pub(super) fn hash(p: Vec3) -> u64 {
    // The finaliser of MurmurHash3 (Appleby 2011) after each coordinate.
    bits(p).into_iter().fold(0, |hash, x| {
        let h = (hash ^ x).wrapping_mul(0xFF51_AFD7_ED55_8CCD);
        let h = (h ^ h >> 33).wrapping_mul(0xC4CE_B9FE_1A85_EC53);
        h ^ h >> 33
    })
}

/// By position: the first one that is equal to it.
fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<(u64, u32)> =
        positions.iter().enumerate().map(|(i, p)| (hash(*p), i as u32)).collect();
    order.sort_unstable();
    let mut first = vec![0; positions.len()];
    for same in order.chunk_by_mut(|a, b| a.0 == b.0) {
        let key = |i: u32| bits(positions[i as usize]);
        // Different positions may have the same hash.
        let (_, lead) = same[0];
        if same.iter().any(|(_, i)| key(*i) != key(lead)) {
            same.sort_unstable_by_key(|(_, i)| (key(*i), *i));
        }
        for equal in same.chunk_by(|a, b| key(a.1) == key(b.1)) {
            for (_, i) in equal {
                first[*i as usize] = equal[0].1;
            }
        }
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::bounds::Floats;
    use crate::input::mesh::MeshData;

    fn topology(corners: &[f64], triangles: &[u32]) -> (Shapes, Topology) {
        let mesh = MeshData { vertices: Floats::F64(corners), triangles, transforms: None };
        let shapes = Shapes::new(&[mesh]).unwrap();
        let topology = Topology::new(&shapes).unwrap();
        (shapes, topology)
    }

    #[test]
    fn equal_places_are_one_vertex_and_edges_know_their_triangles() {
        // A square of two triangles with six vertices of their own, one corner at -0.
        // A third triangle has no area.
        let corners = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [-0.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let (_, topology) = topology(corners.as_flattened(), &[0, 1, 2, 3, 4, 5, 0, 3, 1]);
        assert_eq!((topology.vertices(0).len(), topology.edges(0).len()), (4, 5));
        let mut sharing: Vec<usize> =
            topology.edges(0).iter().map(|edge| topology.neighbours(edge).len()).collect();
        sharing.sort_unstable();
        assert_eq!(sharing, [0, 0, 0, 0, 1]);
        let shared = topology.edges(0).iter().find(|e| !topology.neighbours(e).is_empty()).unwrap();
        assert!(!topology.neighbours(shared)[0].is_along, "a mesh that is oriented");
        assert_eq!(topology.sides(&(0..3)).iter().filter(|s| s[0] == NO_EDGE).count(), 1);
    }

    #[test]
    fn every_meshlet_lists_all_edges_of_its_triangles_with_all_their_triangles() {
        // A fan of 31 triangles at one edge, then one of 40, and 300 triangles in a row.
        let (mut corners, mut triangles) = (Vec::new(), Vec::new());
        for (count, at) in [(31, 0.0), (40, 50.0)] {
            let first = corners.len() as u32;
            corners.extend([[at, 0.0, 0.0], [at, 1.0, 0.0]]);
            for k in 0..count {
                triangles.extend([first, first + 1, corners.len() as u32]);
                corners.push([at + f64::from(k), 0.5, 1.0]);
            }
        }
        let first = corners.len() as u32;
        corners.extend((0..302).map(|k| [0.5 * f64::from(k), f64::from(k % 2), 9.0]));
        triangles.extend((0..300).flat_map(|k| [first + k, first + k + 1, first + k + 2]));
        let (shapes, topology) = topology(corners.as_flattened(), &triangles);
        // By brute force: the triangles at each edge.
        let edge = |a: u32, b: u32| (a.min(b), a.max(b));
        let mut around = std::collections::BTreeMap::<_, Vec<u32>>::new();
        for (t, [a, b, c]) in (0..).zip(&shapes.triangles) {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                around.entry(edge(*a, *b)).or_default().push(t);
            }
        }
        for (m, meshlet) in (0..).zip(&shapes.meshlets) {
            let own = meshlet.triangles.clone();
            let mut expected: Vec<_> = around
                .iter()
                .filter(|(_, at)| at.len() <= MAX_AT_EDGE)
                .filter(|(_, at)| at.iter().any(|t| own.contains(t)))
                .map(|(edge, at)| (*edge, at.clone()))
                .collect();
            let vertices = topology.vertices(m);
            let mut found: Vec<_> = topology
                .edges(m)
                .iter()
                .filter(|edge| !edge.is_crowded)
                .map(|listed| {
                    let [a, b] = listed.ends.map(|v| vertices[usize::from(v)]);
                    let mut at: Vec<u32> = topology
                        .neighbours(listed)
                        .iter()
                        .map(|n| {
                            let first = shapes.meshlets[n.meshlet as usize].triangles.start;
                            first + u32::from(n.triangle)
                        })
                        .chain([own.start + u32::from(listed.triangle)])
                        .collect();
                    at.sort_unstable();
                    (edge(a, b), at)
                })
                .collect();
            expected.sort();
            found.sort();
            assert_eq!(found, expected);
            // Of a crowded edge each triangle has its own entry, alone.
            let crowded = topology.edges(m).iter().filter(|edge| edge.is_crowded);
            let of_fan: Vec<_> =
                crowded.map(|e| (e.triangle, topology.neighbours(e).len())).collect();
            let count = around.values().find(|at| at.len() > MAX_AT_EDGE).unwrap().iter();
            assert_eq!(of_fan.len(), count.filter(|t| own.contains(t)).count());
            assert!(of_fan.iter().all(|(_, neighbours)| *neighbours == 0));
        }
    }
}
