//! Edges that copies of meshes share with other copies.
//!
//! They are shared if the world positions of their ends are equal numbers.
//! That is found once, for the places where the copies stand then.
//! A copy that has moved since shares nothing: its edges are borders to the others.

use std::sync::Arc;

use crate::host::linear::Vec3;
use crate::occluders::placement::Placement;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::looks::{Look, Placed};
use crate::occluders::surface::projector::is_before;
use crate::occluders::surface::topology::{Edge, MAX_AT_EDGE, Topology, bits, hash};

/// A triangle at an edge that copies share.
#[derive(Debug, Clone, Copy)]
struct Member {
    copy: u32,
    edge: u32,
    meshlet: u32,
    triangle: u8,
    /// Whether it runs along the edge from the end that comes first, see [`is_before`].
    is_forward: bool,
}

/// The edges that copies share.
#[derive(Debug, Default)]
pub(super) struct Links {
    placements: Arc<Vec<Placement>>,
    /// By copy: the edges that it shares, sorted, each with its number in `first`.
    of_copy: Vec<Vec<(u32, u32)>>,
    /// By shared edge: where its triangles begin; one more entry marks the end.
    first: Vec<u32>,
    members: Vec<Member>,
}

impl Links {
    /// Finds the edges that copies share where they stand now.
    pub(super) fn new(
        shapes: &Shapes,
        topology: &Topology,
        placements: &Arc<Vec<Placement>>,
    ) -> Self {
        let mut links = Self { placements: Arc::clone(placements), ..Self::default() };
        if placements.len() < 2 {
            return links;
        }
        let found = shared_edges(shapes, topology, placements);
        links.of_copy = vec![Vec::new(); placements.len()];
        links.first.push(0);
        for same in found.chunk_by(|a, b| a.0 == b.0) {
            let is_shared = same.iter().any(|(_, member)| member.copy != same[0].1.copy);
            if !is_shared || same.len() > MAX_AT_EDGE {
                continue;
            }
            let number = links.first.len() as u32 - 1;
            for (_, member) in same {
                links.members.push(*member);
                let own = &mut links.of_copy[member.copy as usize];
                if own.last() != Some(&(member.edge, number)) {
                    own.push((member.edge, number));
                }
            }
            links.first.push(links.members.len() as u32);
        }
        for own in &mut links.of_copy {
            own.sort_unstable();
        }
        links
    }

    /// The links between copies that stand where they stood when the links were made.
    pub(super) fn standing<'a>(&'a self, placements: &[Placement]) -> Standing<'a> {
        let mut standing =
            Standing { links: self, before: vec![None; placements.len()], now: Vec::new() };
        if self.members.is_empty() {
            return standing;
        }
        standing.now = vec![None; self.placements.len()];
        // Copies are listed by mesh; those of a mesh keep their order.
        let (mut old, mut mesh, mut first) = (0, u32::MAX, 0);
        for (copy, placement) in placements.iter().enumerate() {
            if placement.mesh != mesh {
                mesh = placement.mesh;
                first = copy;
                old = self.placements.partition_point(|p| p.mesh < mesh);
            }
            let before = old + copy - first;
            let stands = self
                .placements
                .get(before)
                .is_some_and(|p| p.mesh == mesh && p.matrix == placement.matrix);
            if stands {
                standing.before[copy] = Some(before as u32);
                standing.now[before] = Some(copy as u32);
            }
        }
        standing
    }

    /// Bytes on the host.
    pub(super) fn bytes(&self) -> u64 {
        let lists: usize = self.of_copy.iter().map(|own| size_of_val(&own[..])).sum();
        (lists + size_of_val(&self.first[..]) + size_of_val(&self.members[..])) as u64
    }
}

/// The links between copies that have not moved.
#[derive(Debug)]
pub(super) struct Standing<'a> {
    links: &'a Links,
    /// By copy: its number when the links were made.
    before: Vec<Option<u32>>,
    /// The other way round.
    now: Vec<Option<u32>>,
}

impl Standing<'_> {
    /// Whether a copy shares any edge.
    #[inline]
    pub(super) fn has_any(&self, copy: u32) -> bool {
        let before = self.before[copy as usize];
        let of_copy = before.and_then(|before| self.links.of_copy.get(before as usize));
        of_copy.is_some_and(|own| !own.is_empty())
    }

    /// The number of a shared edge, if this edge of a copy is shared.
    #[inline]
    pub(super) fn number(&self, copy: u32, edge: u32) -> Option<u32> {
        let own = &self.links.of_copy.get(self.before[copy as usize]? as usize)?;
        let place = own.binary_search_by_key(&edge, |(edge, _)| *edge).ok()?;
        Some(own[place].1)
    }

    /// Calls `add` with copy, meshlet, triangle and direction of the triangles of other copies.
    ///
    /// The direction is whether they run along the edge like the triangle that it is listed with.
    pub(super) fn for_each(
        &self,
        look: &Look,
        edge: &Edge,
        placed: &Placed<'_>,
        add: &mut impl FnMut(u32, u32, u8, bool),
    ) {
        let Some(number) = self.number(look.copy, edge.id) else { return };
        let vertices = placed.topology.vertices(look.meshlet);
        let [a, b] = edge.ends.map(|v| placed.world(look.copy, vertices[usize::from(v)]));
        let is_mirrored = placed.placements[look.copy as usize].mirrored;
        let is_forward = is_before(a, b) != is_mirrored;
        let [begin, end] = [number, number + 1].map(|i| self.links.first[i as usize] as usize);
        for member in &self.links.members[begin..end] {
            let Some(copy) = self.now[member.copy as usize] else { continue };
            if copy != look.copy || member.edge != edge.id {
                add(copy, member.meshlet, member.triangle, member.is_forward == is_forward);
            }
        }
    }
}

/// The triangles at edges whose ends are in two copies, sorted by edge.
///
/// An edge is told by the numbers of its ends.
fn shared_edges(
    shapes: &Shapes,
    topology: &Topology,
    placements: &[Placement],
) -> Vec<([u32; 2], Member)> {
    let world =
        |copy: u32, vertex: u32| placements[copy as usize].world(shapes.positions[vertex as usize]);
    let shared = shared_vertices(shapes, topology, placements, &world);
    let mut found = Vec::new();
    for of_copy in shared.chunk_by(|a, b| a.0 == b.0) {
        let copy = of_copy[0].0;
        let placement = &placements[copy as usize];
        let number = |vertex: u32| {
            let place = of_copy.binary_search_by_key(&vertex, |(_, vertex, _)| *vertex).ok()?;
            Some(of_copy[place].2)
        };
        for meshlet in shapes.meshes[placement.mesh as usize].meshlets.clone() {
            let vertices = topology.vertices(meshlet);
            for edge in topology.edges(meshlet) {
                let neighbours = topology.neighbours(edge);
                // The first meshlet that lists an edge names all its triangles.
                if edge.is_crowded || neighbours.iter().any(|n| n.meshlet < meshlet) {
                    continue;
                }
                let ends = edge.ends.map(|v| vertices[usize::from(v)]);
                let [Some(p), Some(q)] = ends.map(number) else { continue };
                let is_forward =
                    is_before(world(copy, ends[0]), world(copy, ends[1])) != placement.mirrored;
                let mut push = |meshlet, triangle, is_forward| {
                    let member = Member { copy, edge: edge.id, meshlet, triangle, is_forward };
                    found.push(([p.min(q), p.max(q)], member));
                };
                push(meshlet, edge.triangle, is_forward);
                for n in neighbours {
                    push(n.meshlet, n.triangle, n.is_along == is_forward);
                }
            }
        }
    }
    found.sort_by_key(|(ends, member)| (*ends, member.copy, member.edge));
    found
}

/// Vertices with the world position of a vertex of another copy: copy, vertex, and a number that is
/// the same for equal positions.
///
/// Sorted by copy and vertex.
fn shared_vertices(
    shapes: &Shapes,
    topology: &Topology,
    placements: &[Placement],
    world: &impl Fn(u32, u32) -> Vec3,
) -> Vec<(u32, u32, u32)> {
    let mut keyed: Vec<(u64, u32, u32)> = Vec::new();
    for (copy, placement) in (0..).zip(placements) {
        for meshlet in shapes.meshes[placement.mesh as usize].meshlets.clone() {
            let vertices = topology.vertices(meshlet).iter();
            keyed.extend(vertices.map(|v| (hash(world(copy, *v)), copy, *v)));
        }
    }
    keyed.sort_unstable();
    keyed.dedup();
    let (mut shared, mut count) = (Vec::new(), 0);
    for same in keyed.chunk_by_mut(|a, b| a.0 == b.0) {
        if same[0].1 == same[same.len() - 1].1 {
            continue;
        }
        // Different positions may have the same hash.
        same.sort_by_key(|(_, copy, v)| bits(world(*copy, *v)));
        let equal = |a: &(u64, u32, u32), b: &(u64, u32, u32)| {
            bits(world(a.1, a.2)) == bits(world(b.1, b.2))
        };
        for equal in same.chunk_by(equal) {
            shared.extend(equal.iter().map(|(_, copy, v)| (*copy, *v, count)));
            count += 1;
        }
    }
    shared.sort_unstable();
    shared
}
