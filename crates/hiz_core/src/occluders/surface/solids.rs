//! Parts of meshes that are closed and convex, such as boxes: found once, for all cameras.
//!
//! From outside such a part is one surface, whose border is its outline (see `hulls`).
//! Nothing rests on what is found here except that the rims are the borders of the faces.
//! Whether a part is convex, and which way its faces look, is a matter of quality alone.

use std::ops::Range;

use crate::error::Result;
use crate::host::forest::Forest;
use crate::host::linear::{Vec3, cross, dot, sub};
use crate::host::memory;
use crate::occluders::shapes::Shapes;
use crate::occluders::surface::topology::{NO_EDGE, Topology};

/// The most triangles of a solid.
const MAX_TRIANGLES: usize = 32;
/// The most vertices of a solid: those of a closed surface without holes.
pub(super) const MAX_VERTICES: usize = MAX_TRIANGLES / 2 + 2;
/// How many neighbouring solids have a box together.
const GROUP: usize = 16;
/// Vertices this near to a plane are on it, as a part of the solid's size.
const FLAT: f64 = 1e-5;
/// In [`Solids::of_triangle`]: a triangle of no solid.
const NO_SOLID: u32 = u32::MAX;

/// A closed and convex part of a mesh.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    vertices: Range<u32>,
    faces: Range<u32>,
    rims: Range<u32>,
    meshlets: Range<u32>,
    /// Whether triangles of no solid meet at one of its edges, too.
    pub(super) is_shared: bool,
}

/// Triangles of a solid in about one plane.
#[derive(Debug, Clone)]
pub(super) struct Face {
    corners: Range<u32>,
    /// The largest of its triangles, counter-clockwise as seen from outside.
    pub(super) triangle: [u8; 3],
}

/// An edge between two faces.
///
/// It runs from its first end to its other one around the first face, and back around the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rim {
    pub(super) ends: [u8; 2],
    pub(super) faces: [u8; 2],
}

/// Neighbouring solids of a mesh, with a box around them.
#[derive(Debug, Clone)]
pub(super) struct Group {
    pub(super) min: Vec3,
    pub(super) max: Vec3,
    pub(super) solids: Range<u32>,
}

/// An edge at which several solids meet: each of them, with the set of its faces there.
#[derive(Debug, Clone)]
pub(super) struct Seam(Range<u32>);

/// The solids of all meshes.
#[derive(Debug, Default)]
pub(super) struct Solids {
    all: Vec<Solid>,
    groups: Vec<Group>,
    /// By mesh.
    of_mesh: Vec<Own>,
    /// By triangle of [`Shapes::triangles`]: its solid, or [`NO_SOLID`].
    of_triangle: Vec<u32>,
    /// By meshlet: whether all of its triangles are in solids.
    is_solid: Vec<bool>,
    /// Indices into [`Shapes::positions`].
    vertices: Vec<u32>,
    faces: Vec<Face>,
    /// Of faces, as vertices of their solid.
    corners: Vec<u8>,
    rims: Vec<Rim>,
    /// Where the triangles of solids are.
    meshlets: Vec<u32>,
    seams: Vec<Seam>,
    /// Of seams.
    members: Vec<(u32, u32)>,
}

/// The parts of the lists that belong to a mesh.
#[derive(Debug, Default)]
struct Own {
    groups: Range<u32>,
    solids: Range<u32>,
    seams: Range<u32>,
}

impl Solids {
    /// Those of the meshes of `shapes`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory).
    pub(super) fn new(shapes: &Shapes, topology: &Topology) -> Result<Self> {
        let mut solids = Self {
            of_triangle: memory::filled(shapes.triangles.len(), NO_SOLID, "triangles")?,
            is_solid: memory::filled(shapes.meshlets.len(), false, "meshlets")?,
            ..Self::default()
        };
        for mesh in 0..shapes.meshes.len() {
            let count = |solids: &Self| {
                [solids.groups.len(), solids.all.len(), solids.seams.len()].map(|len| len as u32)
            };
            let first = count(&solids);
            solids.add(shapes, topology, mesh)?;
            let end = count(&solids);
            let [groups, own, seams] = std::array::from_fn(|k| first[k]..end[k]);
            solids.of_mesh.push(Own { groups, solids: own, seams });
        }
        if solids.all.is_empty() {
            // The usual case for large meshes.
            return Ok(Self { of_mesh: solids.of_mesh, ..Self::default() });
        }
        for (is_solid, meshlet) in solids.is_solid.iter_mut().zip(&shapes.meshlets) {
            let triangles = meshlet.triangles.start as usize..meshlet.triangles.end as usize;
            *is_solid = solids.of_triangle[triangles].iter().all(|solid| *solid != NO_SOLID);
        }
        Ok(solids)
    }

    fn add(&mut self, shapes: &Shapes, topology: &Topology, mesh: usize) -> Result<()> {
        let first = self.all.len();
        let parts = Parts::new(shapes, topology, mesh)?;
        let count = shapes.meshes[mesh].triangles.len();
        let mut meshlet_of = memory::list(count, "triangles")?;
        for m in shapes.meshes[mesh].meshlets.clone() {
            meshlet_of.resize(meshlet_of.len() + shapes.meshlets[m as usize].triangles.len(), m);
        }
        let begin = shapes.meshes[mesh].triangles.start;
        let mut part = Part::default();
        for triangles in parts.closed() {
            // Corners by the first vertex at their place.
            let corners: Vec<[u32; 3]> = triangles
                .iter()
                .map(|t| {
                    let meshlet = meshlet_of[(t - begin) as usize];
                    let vertices = topology.vertices(meshlet);
                    topology.corners(&(*t..t + 1))[0].map(|v| vertices[usize::from(v)])
                })
                .collect();
            if !part.is_convex(&shapes.positions, &corners) {
                continue;
            }
            let solid = self.push(&part);
            let meshlets = self.meshlets.len() as u32;
            for t in &triangles {
                self.of_triangle[*t as usize] = solid;
                let meshlet = meshlet_of[(t - begin) as usize];
                if !self.meshlets[meshlets as usize..].contains(&meshlet) {
                    self.meshlets.push(meshlet);
                }
            }
            self.all[solid as usize].meshlets = meshlets..self.meshlets.len() as u32;
        }
        self.add_seams(shapes, topology, mesh);
        for begin in (first..self.all.len()).step_by(GROUP) {
            let solids = begin as u32..self.all.len().min(begin + GROUP) as u32;
            let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
            for solid in solids.clone() {
                let (low, high) = self.box_of(solid, &shapes.positions);
                min = std::array::from_fn(|k| min[k].min(low[k]));
                max = std::array::from_fn(|k| max[k].max(high[k]));
            }
            self.groups.push(Group { min, max, solids });
        }
        Ok(())
    }

    /// Finds the edges at which more than two triangles meet.
    fn add_seams(&mut self, shapes: &Shapes, topology: &Topology, mesh: usize) {
        for m in shapes.meshes[mesh].meshlets.clone() {
            for edge in topology.edges(m) {
                let neighbours = topology.neighbours(edge);
                // Several meshlets may have it in their lists.
                if neighbours.len() < 2 || neighbours.iter().any(|n| n.meshlet < m) {
                    continue;
                }
                let number =
                    |m: u32, t: u8| shapes.meshlets[m as usize].triangles.start + u32::from(t);
                let others = neighbours.iter().map(|n| number(n.meshlet, n.triangle));
                let own = others.chain([number(m, edge.triangle)]).map(|t| self.of_triangle(t));
                let solids: Vec<Option<u32>> = own.collect();
                let is_shared = solids.contains(&None);
                let ends = edge.ends.map(|v| topology.vertices(m)[usize::from(v)]);
                let first = self.members.len();
                for solid in solids.into_iter().flatten() {
                    self.all[solid as usize].is_shared |= is_shared;
                    if self.members[first..].iter().all(|(other, _)| *other != solid) {
                        self.members.push((solid, self.faces_at(solid, ends)));
                    }
                }
                self.seams.push(Seam(first as u32..self.members.len() as u32));
            }
        }
    }

    /// The faces of a solid that have both of these vertices: bit k for face k.
    fn faces_at(&self, solid: u32, ends: [u32; 2]) -> u32 {
        let vertices = self.vertices(solid);
        let has = |face: &Face, end: u32| {
            self.corners(face).iter().any(|v| vertices[usize::from(*v)] == end)
        };
        let faces = self.faces(solid).iter().enumerate();
        let at = faces.filter(|(_, face)| ends.iter().all(|end| has(face, *end)));
        at.fold(0, |set, (number, _)| set | 1 << number)
    }

    /// Adds a part that is a solid; returns its number.
    fn push(&mut self, part: &Part) -> u32 {
        let [vertices, faces, rims] =
            [self.vertices.len(), self.faces.len(), self.rims.len()].map(|len| len as u32);
        self.vertices.extend(&part.vertices);
        for (triangle, corners) in &part.faces {
            let first = self.corners.len() as u32;
            self.corners.extend(corners);
            let corners = first..self.corners.len() as u32;
            self.faces.push(Face { corners, triangle: *triangle });
        }
        self.rims.extend(&part.rims);
        self.all.push(Solid {
            vertices: vertices..self.vertices.len() as u32,
            faces: faces..self.faces.len() as u32,
            rims: rims..self.rims.len() as u32,
            meshlets: 0..0,
            is_shared: false,
        });
        self.all.len() as u32 - 1
    }

    /// The groups of a mesh.
    pub(super) fn groups(&self, mesh: u32) -> &[Group] {
        let groups = &self.of_mesh[mesh as usize].groups;
        &self.groups[groups.start as usize..groups.end as usize]
    }

    /// The solids of a mesh, by their numbers.
    pub(super) fn of_mesh(&self, mesh: u32) -> Range<u32> {
        self.of_mesh[mesh as usize].solids.clone()
    }

    /// The edges of a mesh at which solids meet: each solid, with the set of its faces there.
    pub(super) fn seams(&self, mesh: u32) -> impl Iterator<Item = &[(u32, u32)]> {
        let seams = &self.of_mesh[mesh as usize].seams;
        let seams = &self.seams[seams.start as usize..seams.end as usize];
        seams.iter().map(|Seam(own)| &self.members[own.start as usize..own.end as usize])
    }

    pub(super) fn get(&self, solid: u32) -> &Solid {
        &self.all[solid as usize]
    }

    /// Its vertices, as indices into [`Shapes::positions`].
    pub(super) fn vertices(&self, solid: u32) -> &[u32] {
        let own = &self.all[solid as usize].vertices;
        &self.vertices[own.start as usize..own.end as usize]
    }

    /// The box around a solid in mesh coordinates, as its least and its greatest corner.
    pub(super) fn box_of(&self, solid: u32, positions: &[Vec3]) -> (Vec3, Vec3) {
        let points = self.vertices(solid).iter().map(|v| positions[*v as usize]);
        points.fold(([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]), |(min, max), p| {
            let min = std::array::from_fn(|k| min[k].min(p[k]));
            (min, std::array::from_fn(|k| max[k].max(p[k])))
        })
    }

    pub(super) fn faces(&self, solid: u32) -> &[Face] {
        let own = &self.all[solid as usize].faces;
        &self.faces[own.start as usize..own.end as usize]
    }

    /// The corners of a face, as vertices of its solid.
    pub(super) fn corners(&self, face: &Face) -> &[u8] {
        &self.corners[face.corners.start as usize..face.corners.end as usize]
    }

    pub(super) fn rims(&self, solid: u32) -> &[Rim] {
        let own = &self.all[solid as usize].rims;
        &self.rims[own.start as usize..own.end as usize]
    }

    /// The meshlets that its triangles are in.
    pub(super) fn meshlets(&self, solid: u32) -> &[u32] {
        let own = &self.all[solid as usize].meshlets;
        &self.meshlets[own.start as usize..own.end as usize]
    }

    /// The solid of a triangle of [`Shapes::triangles`], if it is in one.
    #[inline]
    pub(super) fn of_triangle(&self, triangle: u32) -> Option<u32> {
        self.of_triangle.get(triangle as usize).copied().filter(|solid| *solid != NO_SOLID)
    }

    /// Whether all triangles of a meshlet are in solids.
    pub(super) fn is_solid(&self, meshlet: u32) -> bool {
        self.is_solid[meshlet as usize]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Bytes on the host.
    pub(super) fn bytes(&self) -> u64 {
        (size_of_val(&self.all[..])
            + size_of_val(&self.groups[..])
            + size_of_val(&self.of_mesh[..])
            + size_of_val(&self.of_triangle[..])
            + size_of_val(&self.is_solid[..])
            + size_of_val(&self.vertices[..])
            + size_of_val(&self.faces[..])
            + size_of_val(&self.corners[..])
            + size_of_val(&self.rims[..])
            + size_of_val(&self.meshlets[..])
            + size_of_val(&self.seams[..])
            + size_of_val(&self.members[..])) as u64
    }
}

/// The triangles of a mesh in parts that hang together.
#[derive(Debug)]
struct Parts {
    /// The parts' triangles, sorted by part.
    sorted: Vec<(u32, u32)>,
    first: u32,
    /// By triangle: it has an edge without a partner.
    is_open: Vec<bool>,
}

impl Parts {
    /// Joins the triangles of a mesh across edges at which two of them meet from different sides.
    ///
    /// Where more of them meet, those belong together that have their ends by the same indices.
    fn new(shapes: &Shapes, topology: &Topology, mesh: usize) -> Result<Self> {
        let own = shapes.meshes[mesh].triangles.clone();
        let first = own.start;
        let mut joined = Forest::new(own.len() as u32, "triangles")?;
        let mut is_open = memory::filled(own.len(), false, "triangles")?;
        let mut around = Vec::new();
        for m in shapes.meshes[mesh].meshlets.clone() {
            let begin = |m: u32| shapes.meshlets[m as usize].triangles.start - first;
            for edge in topology.edges(m) {
                let one = begin(m) + u32::from(edge.triangle);
                let neighbours = topology.neighbours(edge);
                if let ([other], false) = (neighbours, edge.is_crowded) {
                    let two = begin(other.meshlet) + u32::from(other.triangle);
                    if other.is_along {
                        [one, two].iter().for_each(|t| is_open[*t as usize] = true);
                    } else {
                        joined.join(one, two);
                    }
                    continue;
                }
                // The triangles, and the indices of their ends as they run along the edge.
                around.clear();
                let others = neighbours.iter().map(|n| begin(n.meshlet) + u32::from(n.triangle));
                for t in others.chain([one]) {
                    let number = t + first;
                    let side = topology.sides(&(number..number + 1))[0]
                        .iter()
                        .position(|side| *side == edge.id);
                    let k = side.unwrap_or(0);
                    let corners = shapes.triangles[number as usize];
                    around.push((t, [corners[k], corners[(k + 1) % 3]]));
                }
                for (t, [a, b]) in &around {
                    let mut back = around.iter().filter(|(_, ends)| *ends == [*b, *a]);
                    let along = around.iter().filter(|(_, ends)| ends == &[*a, *b]).count();
                    match (back.next(), back.next(), along) {
                        (Some((other, _)), None, 1) => joined.join(*t, *other),
                        _ => is_open[*t as usize] = true,
                    }
                }
            }
        }
        for t in own.clone() {
            // A triangle with two equal corners is in no list of edges.
            if topology.sides(&(t..t + 1))[0][0] == NO_EDGE {
                is_open[(t - first) as usize] = true;
            }
        }
        let by_part = (0..own.len() as u32).map(|t| (joined.root(t), t + first));
        let mut sorted = memory::collected(by_part, "triangles")?;
        sorted.sort_unstable();
        Ok(Self { sorted, first, is_open })
    }

    /// The triangles of the small closed parts.
    fn closed(&self) -> impl Iterator<Item = Vec<u32>> {
        let is_open =
            |part: &[(u32, u32)]| part.iter().any(|(_, t)| self.is_open[(t - self.first) as usize]);
        self.sorted
            .chunk_by(|a, b| a.0 == b.0)
            .filter(move |part| part.len() <= MAX_TRIANGLES && !is_open(part))
            .map(|part| part.iter().map(|(_, t)| *t).collect())
    }
}

/// A closed part, as a solid has it.
#[derive(Debug, Default)]
struct Part {
    vertices: Vec<u32>,
    /// The largest triangle of each face, and the face's corners.
    faces: Vec<([u8; 3], Vec<u8>)>,
    rims: Vec<Rim>,
}

impl Part {
    /// Becomes the part with these corners of triangles; returns whether it is a solid.
    fn is_convex(&mut self, positions: &[Vec3], triangles: &[[u32; 3]]) -> bool {
        let Self { vertices, faces, rims } = self;
        vertices.clear();
        faces.clear();
        rims.clear();
        for v in triangles.iter().flatten() {
            if !vertices.contains(v) {
                vertices.push(*v);
            }
        }
        if vertices.len() > MAX_VERTICES {
            return false;
        }
        let number = |v: u32| vertices.iter().position(|other| *other == v).unwrap_or(0) as u8;
        let mut triangles: Vec<[u8; 3]> = triangles.iter().map(|t| t.map(number)).collect();
        let points: Vec<Vec3> = vertices
            .iter()
            .map(|v| sub(positions[*v as usize], positions[vertices[0] as usize]))
            .collect();
        let at = |v: u8| points[usize::from(v)];
        let volume: f64 =
            triangles.iter().map(|[a, b, c]| dot(at(*a), cross(at(*b), at(*c)))).sum();
        if volume < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let size = points.iter().flatten().fold(0.0_f64, |size, x| size.max(x.abs()));
        let flat = FLAT * size;
        // Normals with the length of twice the area.
        let normals: Vec<Vec3> = triangles
            .iter()
            .map(|[a, b, c]| cross(sub(at(*b), at(*a)), sub(at(*c), at(*a))))
            .collect();
        let height = |t: usize, v: u8| {
            let normal = normals[t];
            dot(normal, sub(at(v), at(triangles[t][0]))) / dot(normal, normal).sqrt()
        };
        // False for NaN, too.
        let is_behind = |t: usize| (0..points.len() as u8).all(|v| height(t, v) <= flat);
        if !(0..triangles.len()).all(is_behind) {
            return false;
        }
        let mut face_of = vec![u8::MAX; triangles.len()];
        for t in 0..triangles.len() {
            if face_of[t] != u8::MAX {
                continue;
            }
            let (mut largest, mut corners) = (t, Vec::new());
            for other in t..triangles.len() {
                let is_in = face_of[other] == u8::MAX
                    && dot(normals[t], normals[other]) > 0.0
                    && triangles[other].iter().all(|v| height(t, *v).abs() <= flat);
                if !is_in && other != t {
                    continue;
                }
                face_of[other] = faces.len() as u8;
                let area = |t: usize| dot(normals[t], normals[t]);
                largest = if area(other) > area(largest) { other } else { largest };
                for v in triangles[other] {
                    if !corners.contains(&v) {
                        corners.push(v);
                    }
                }
            }
            faces.push((triangles[largest], corners));
        }
        // Every edge is there once in each direction.
        let halves: Vec<([u8; 2], u8)> = triangles
            .iter()
            .zip(&face_of)
            .flat_map(|([a, b, c], face)| [([*a, *b], *face), ([*b, *c], *face), ([*c, *a], *face)])
            .collect();
        for ([a, b], face) in &halves {
            let along = halves.iter().filter(|(ends, _)| ends == &[*a, *b]).count();
            let mut back = halves.iter().filter(|(ends, _)| ends == &[*b, *a]);
            let (Some((_, other)), None, 1) = (back.next(), back.next(), along) else {
                return false;
            };
            if a < b && face != other {
                rims.push(Rim { ends: [*a, *b], faces: [*face, *other] });
            }
        }
        true
    }
}
