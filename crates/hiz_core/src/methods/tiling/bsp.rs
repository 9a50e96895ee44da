//! The tree: an octree over a BSP tree in each of its cells, or one BSP tree.
//!
//! Sources: Fuchs, Kedem and Naylor, *On visible surface generation by a priori tree structures*
//! (1980); Greene (1996), section 5, for the octree of BSP trees.
//!
//! A cell of the octree is three planes through its middle, so all nodes are alike.
//! A node of a BSP tree takes its plane from one of its triangles: of a few candidates the one that
//! splits least and balances best.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::host::linear::{Vec3, cross, dot, normalized, sub};
use crate::methods::tiling::fault::{Planted, is_planted};
use crate::occluders::placement::Placement;
use crate::occluders::surface::OccluderSurface;

/// How the tree is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BspOptions {
    /// A cell of the octree with more triangles is divided; `None`: one BSP tree, without an
    /// octree.
    pub leaf: Option<u32>,
    /// One tree is given up once it has more than so many parts per triangle, and an octree with
    /// leaves of 64 is made.
    pub most_parts: f64,
}

impl Default for BspOptions {
    /// One tree, unless it doubles the number of triangles.
    fn default() -> Self {
        Self { leaf: None, most_parts: 2.0 }
    }
}

/// The leaves of the octree that takes the place of one tree.
const LEAF: u32 = 64;
/// A tree is given up beyond these, because large triangles that cross may split without end.
const MOST_PARTS: usize = 1 << 20;
const MOST_PARTS_PER_TRIANGLE: usize = 16;
/// Cells are divided at most so often.
const DEEPEST: u32 = 16;
/// Candidates for a plane, and triangles that each is tried on.
const CANDIDATES: usize = 8;
const SAMPLES: usize = 128;
/// What a split costs beside a triangle too many on one side.
const SPLIT_COST: usize = 4;
/// Points count as on a plane within this part of the scene's size.
const ON_PLANE: f64 = 1e-9;
/// No node.
pub(super) const NONE: u32 = u32::MAX;

/// A triangle of a copy.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source {
    pub(super) copy: u32,
    pub(super) meshlet: u32,
    /// Its number in the arrays of the shapes.
    pub(super) triangle: u32,
    /// Its corners in the world.
    pub(super) corners: [Vec3; 3],
}

/// A plane: points with `normal * p > offset` are before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    pub(super) offset: f64,
}

impl Plane {
    #[inline]
    pub(super) fn at(&self, p: Vec3) -> f64 {
        dot(self.normal, p) - self.offset
    }
}

/// A plane with what lies on it, before it and behind it.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) plane: Plane,
    pub(super) front: u32,
    pub(super) back: u32,
    /// The parts on the plane.
    pub(super) own: Range<u32>,
    /// Parts in it and below.
    pub(super) parts: u32,
    /// Around all of them.
    pub(super) min: Vec3,
    pub(super) max: Vec3,
}

/// A triangle, or a part of a split one.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// In the sources.
    pub(super) source: u32,
    /// Where it was cut.
    pub(super) cuts: Range<u32>,
}

/// One line along which a triangle was cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cut {
    /// The node whose plane it is.
    pub(super) node: u32,
    /// Whether the part is before the plane.
    pub(super) is_front: bool,
}

/// Triangles in the order of a BSP tree; made once for static meshes.
///
/// # Examples
/// ```
/// use hiz_core::methods::tiling::{BspOptions, BspTree};
/// use hiz_core::{Floats, MeshData, OccluderOptions, OccluderSurface};
/// # use hiz_core::{Camera, DepthConvention, ImageSize, Pose, Projection};
/// # let pose = Pose { eye: [0.0; 3], target: [0.0, 0.0, -1.0], up: [0.0, 1.0, 0.0] };
/// # let (fov_y, convention) = (std::f64::consts::FRAC_PI_2, DepthConvention::Reversed);
/// # let projection = Projection::Perspective { fov_y, near: 0.1, far: None, convention };
/// # let camera = Camera::look_at(&pose, &projection, ImageSize::new(64, 64))?;
///
/// // A wall over the whole view, and a triangle behind it.
/// let corners = [
///     -20.0, -20.0, -10.0, 20.0, -20.0, -10.0, -20.0, 20.0, -10.0, 20.0, 20.0, -10.0, //
///     0.0, 0.0, -20.0, 1.0, 0.0, -20.0, 0.0, 1.0, -20.0,
/// ];
/// let (vertices, triangles) = (Floats::F32(&corners), &[0, 1, 2, 2, 1, 3, 4, 5, 6]);
/// let mesh = MeshData { vertices, triangles, transforms: None };
/// let surface = OccluderSurface::from_meshes(&[mesh], &OccluderOptions::default())?;
/// let tree = BspTree::new(&surface, &BspOptions::default())?;
/// let seen = tree.draw(&surface, &camera)?;
/// assert!(seen.coverage().all(|covered| covered));
/// assert_eq!(seen.num_visible(), 2);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct BspTree {
    pub(super) placements: Vec<Placement>,
    pub(super) sources: Vec<Source>,
    pub(super) nodes: Vec<Node>,
    pub(super) parts: Vec<Part>,
    pub(super) cuts: Vec<Cut>,
    pub(super) fault: Planted,
    is_octree: bool,
}

/// A part while the tree is made: its corners, and the nodes that have cut it.
#[derive(Debug, Clone)]
struct Piece {
    source: u32,
    corners: Vec<Vec3>,
    cuts: Vec<Cut>,
}

/// Where a piece lies about a plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    On,
    Front,
    Back,
    Crossing,
}

/// A cell that is still to be divided.
struct Task {
    /// The node that it hangs from, and on which side.
    parent: Option<(u32, bool)>,
    pieces: Vec<Piece>,
    /// The cell of the octree, and how many planes have divided it.
    cell: Option<([Vec3; 2], u32)>,
}

impl BspTree {
    /// The tree of these triangles where they stand now.
    ///
    /// # Errors
    /// [`Error::Limit`] where triangles cut one another into too many parts: more than 16 for each
    /// and 2^20 besides.
    pub fn new(surface: &OccluderSurface, options: &BspOptions) -> Result<Self> {
        Self::planted(surface, options, Planted::default())
    }

    /// [`BspTree::new`] with a planted fault, for tests.
    ///
    /// # Errors
    /// As [`BspTree::new`].
    #[cfg(feature = "testing")]
    pub fn with_fault(
        surface: &OccluderSurface,
        options: &BspOptions,
        fault: Option<super::fault::TilingFault>,
    ) -> Result<Self> {
        Self::planted(surface, options, Planted(fault))
    }

    fn planted(surface: &OccluderSurface, options: &BspOptions, fault: Planted) -> Result<Self> {
        let placements = surface.placements().to_vec();
        let shapes = surface.shapes();
        let mut sources = Vec::new();
        for (copy, placement) in (0..).zip(&placements) {
            for meshlet in shapes.meshes[placement.mesh as usize].meshlets.clone() {
                for triangle in shapes.meshlets[meshlet as usize].triangles.clone() {
                    let corners = shapes.triangles[triangle as usize]
                        .map(|v| placement.world(shapes.positions[v as usize]));
                    sources.push(Source { copy, meshlet, triangle, corners });
                }
            }
        }
        let mut tree = Self {
            placements,
            sources,
            nodes: Vec::new(),
            parts: Vec::new(),
            cuts: Vec::new(),
            fault,
            is_octree: false,
        };
        let triangles = tree.sources.len();
        let allowed = MOST_PARTS + MOST_PARTS_PER_TRIANGLE * triangles;
        let most = match options.leaf {
            Some(_) => allowed as f64,
            None => (options.most_parts * triangles as f64).min(allowed as f64),
        };
        let mut is_done = tree.grow(options.leaf, most);
        if !is_done && options.leaf.is_none() {
            is_done = tree.grow(Some(LEAF), allowed as f64);
        }
        if !is_done {
            // It was given up at the first part too many.
            let allowed = allowed as u64;
            return Err(Error::limit("parts of split triangles", allowed + 1, allowed));
        }
        tree.measure();
        Ok(tree)
    }

    /// Makes all nodes; false if there are more than `most` parts.
    fn grow(&mut self, leaf: Option<u32>, most: f64) -> bool {
        self.nodes.clear();
        self.parts.clear();
        self.cuts.clear();
        self.is_octree = leaf.is_some();
        let piece = |(source, one): (u32, &Source)| Piece {
            source,
            corners: one.corners.to_vec(),
            cuts: Vec::new(),
        };
        let pieces: Vec<Piece> = (0..).zip(&self.sources).map(piece).collect();
        let cell = bounds(&pieces);
        let size = (0..3).map(|k| cell[1][k] - cell[0][k]).fold(0.0, f64::max);
        let reach = (0..3).map(|k| cell[0][k].abs().max(cell[1][k].abs())).fold(size, f64::max);
        let on_plane = reach * ON_PLANE;
        let mut left = pieces.len();
        let first = Task { parent: None, pieces, cell: leaf.map(|_| (cell, 0)) };
        let mut tasks = vec![first];
        while let Some(Task { parent, pieces, cell }) = tasks.pop() {
            left -= pieces.len();
            let number = self.nodes.len() as u32;
            let divided = cell.filter(|(_, times)| {
                pieces.len() > leaf.unwrap_or(u32::MAX) as usize && *times < 3 * DEEPEST
            });
            let plane = match divided {
                Some((cell, times)) => middle_plane(&cell, times),
                None => self.best_plane(&pieces, on_plane),
            };
            let [mut front, mut back] = [Vec::new(), Vec::new()];
            let first = self.parts.len() as u32;
            for piece in pieces {
                match placed(&plane, &piece, on_plane) {
                    // A plane of the octree has no parts of its own.
                    Place::On if divided.is_none() => self.keep(piece),
                    Place::On | Place::Front => front.push(piece),
                    Place::Crossing if is_planted!(self.fault, NeverSplit) => front.push(piece),
                    Place::Back => back.push(piece),
                    Place::Crossing => {
                        let [before, behind] = split(&plane, piece, number, on_plane);
                        front.push(before);
                        back.push(behind);
                    }
                }
            }
            let own = first..self.parts.len() as u32;
            self.nodes.push(Node {
                plane,
                front: NONE,
                back: NONE,
                own,
                parts: 0,
                min: [f64::INFINITY; 3],
                max: [f64::NEG_INFINITY; 3],
            });
            if let Some((parent, is_front)) = parent {
                let parent = &mut self.nodes[parent as usize];
                *(if is_front { &mut parent.front } else { &mut parent.back }) = number;
            }
            for (is_front, pieces) in [(true, front), (false, back)] {
                if pieces.is_empty() {
                    continue;
                }
                let cell = divided.map(|(cell, times)| (half(&cell, times, is_front), times + 1));
                left += pieces.len();
                tasks.push(Task { parent: Some((number, is_front)), pieces, cell });
            }
            if (self.parts.len() + left) as f64 > most {
                return false;
            }
        }
        true
    }

    fn keep(&mut self, piece: Piece) {
        let first = self.cuts.len() as u32;
        self.cuts.extend(piece.cuts);
        self.parts.push(Part { source: piece.source, cuts: first..self.cuts.len() as u32 });
    }

    /// The plane of the triangle that splits least and balances best, of a few candidates.
    fn best_plane(&self, pieces: &[Piece], on_plane: f64) -> Plane {
        let step = |count: usize| pieces.len().div_ceil(count).max(1);
        let planes = pieces
            .iter()
            .step_by(step(CANDIDATES))
            .filter_map(|piece| plane_of(&self.sources[piece.source as usize].corners));
        let cost = |plane: &Plane| {
            let (mut front, mut back, mut crossing) = (0_usize, 0_usize, 0_usize);
            for piece in pieces.iter().step_by(step(SAMPLES)) {
                match placed(plane, piece, on_plane) {
                    Place::On => {}
                    Place::Front => front += 1,
                    Place::Back => back += 1,
                    Place::Crossing => crossing += 1,
                }
            }
            SPLIT_COST * crossing + front.abs_diff(back)
        };
        let best = planes.min_by_key(cost);
        // Triangles without an area lie on any plane through them; one far away has all before it,
        // so the first triangle with a plane of any kind counts, and the rest are kept together.
        best.or_else(|| {
            pieces.iter().find_map(|p| plane_of(&self.sources[p.source as usize].corners))
        })
        .unwrap_or(Plane { normal: [0.0; 3], offset: 0.0 })
    }

    /// Boxes and counts, from the leaves up: children come after their parents.
    fn measure(&mut self) {
        for number in (0..self.nodes.len()).rev() {
            let node = &self.nodes[number];
            let (mut min, mut max) = (node.min, node.max);
            let mut parts = node.own.len() as u32;
            let mut add = |low: Vec3, high: Vec3| {
                min = std::array::from_fn(|k| min[k].min(low[k]));
                max = std::array::from_fn(|k| max[k].max(high[k]));
            };
            // A part lies within its triangle and its cell; the triangle's box is enough.
            for part in &self.parts[node.own.start as usize..node.own.end as usize] {
                self.sources[part.source as usize].corners.iter().for_each(|p| add(*p, *p));
            }
            for number in [node.front, node.back].into_iter().filter(|number| *number != NONE) {
                let child = &self.nodes[number as usize];
                parts += child.parts;
                if !(number == node.back && is_planted!(self.fault, BoxOfOneSide)) {
                    add(child.min, child.max);
                }
            }
            let node = &mut self.nodes[number];
            (node.min, node.max, node.parts) = (min, max, parts);
        }
    }

    /// Triangles, counted once per transform of their mesh.
    pub fn num_triangles(&self) -> usize {
        self.sources.len()
    }

    /// Triangles and parts of split ones.
    pub fn num_parts(&self) -> usize {
        self.parts.len()
    }

    /// Planes of the tree.
    pub fn num_nodes(&self) -> usize {
        self.nodes.len()
    }

    /// Whether it is an octree of BSP trees.
    pub fn is_octree(&self) -> bool {
        self.is_octree
    }

    /// Bytes on the host, beside those of the surface.
    pub fn host_bytes(&self) -> u64 {
        (size_of_val(&self.sources[..])
            + size_of_val(&self.nodes[..])
            + size_of_val(&self.parts[..])
            + size_of_val(&self.cuts[..])) as u64
    }
}

fn bounds(pieces: &[Piece]) -> [Vec3; 2] {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in pieces.iter().flat_map(|piece| &piece.corners) {
        min = std::array::from_fn(|k| min[k].min(p[k]));
        max = std::array::from_fn(|k| max[k].max(p[k]));
    }
    [min, max]
}

/// The plane through the middle of a cell, across each axis in turn.
fn middle_plane(cell: &[Vec3; 2], times: u32) -> Plane {
    let axis = times as usize % 3;
    let normal = std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
    Plane { normal, offset: 0.5 * (cell[0][axis] + cell[1][axis]) }
}

/// The part of a cell before or behind that plane.
fn half(cell: &[Vec3; 2], times: u32, is_front: bool) -> [Vec3; 2] {
    let axis = times as usize % 3;
    let mut half = *cell;
    half[usize::from(!is_front)][axis] = 0.5 * (cell[0][axis] + cell[1][axis]);
    half
}

/// The plane of a triangle; `None` without an area.
fn plane_of(corners: &[Vec3; 3]) -> Option<Plane> {
    let normal = normalized(cross(sub(corners[1], corners[0]), sub(corners[2], corners[0])))?;
    Some(Plane { normal, offset: dot(normal, corners[0]) })
}

fn placed(plane: &Plane, piece: &Piece, on_plane: f64) -> Place {
    let (mut front, mut back) = (false, false);
    for p in &piece.corners {
        let at = plane.at(*p);
        front |= at > on_plane;
        back |= at < -on_plane;
    }
    match (front, back) {
        (false, false) => Place::On,
        (true, false) => Place::Front,
        (false, true) => Place::Back,
        (true, true) => Place::Crossing,
    }
}

/// Both parts of a piece that crosses the plane of `node`.
fn split(plane: &Plane, piece: Piece, node: u32, on_plane: f64) -> [Piece; 2] {
    let side = |is_front: bool| {
        let sign = if is_front { 1.0 } else { -1.0 };
        let mut corners = Vec::with_capacity(piece.corners.len() + 1);
        for (i, p) in piece.corners.iter().enumerate() {
            let q = &piece.corners[(i + 1) % piece.corners.len()];
            let (a, b) = (sign * plane.at(*p), sign * plane.at(*q));
            if a >= -on_plane {
                corners.push(*p);
            }
            if (a > on_plane && b < -on_plane) || (a < -on_plane && b > on_plane) {
                let t = a / (a - b);
                corners.push(std::array::from_fn(|k| p[k] + t * (q[k] - p[k])));
            }
        }
        let mut cuts = piece.cuts.clone();
        cuts.push(Cut { node, is_front });
        Piece { source: piece.source, corners, cuts }
    };
    [side(true), side(false)]
}
