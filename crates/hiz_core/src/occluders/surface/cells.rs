//! Triangles as a search sees them: those that may meet the pixels that it searches.
//!
//! They are clipped at the near plane and projected to pixels, with error bounds.
//! What is left of them are cells, which know their neighbours.

use crate::host::linear::Vec3;
use crate::host::rounding::ROUNDING;
use crate::input::image::ImageSize;
use crate::occluders::surface::facets::occludes;
use crate::occluders::surface::links::Standing;
use crate::occluders::surface::looks::{Look, Looks, Placed, Wanted};
use crate::occluders::surface::planted_fault::is_planted;
use crate::occluders::surface::projector::{Clip, Projector, is_before};
use crate::occluders::surface::square::{Point, UP};
use crate::occluders::surface::topology::NO_EDGE;

/// In `Cells::mates`: no neighbour.
pub(super) const NO_MATE: u32 = u32::MAX;
/// In `Cells::mates`: set where both cells lie on the same side of their edge.
pub(super) const FOLD: u32 = 1 << 31;

/// Triangles in the image.
///
/// Half-edge `3 c + k` runs from corner k of cell c to its next corner.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) corners: Vec<[Point; 3]>,
    /// +1 or -1 by orientation, as float64 computes it.
    pub(super) signs: Vec<i8>,
    /// By half-edge: the neighbour's half-edge along the same edge, with `FOLD`, or `NO_MATE`.
    ///
    /// The relation is mutual.
    pub(super) mates: Vec<u32>,
    /// The least `far` of the corners, for pruning; no proof rests on it.
    pub(super) nearest: Vec<f64>,
    /// Least and greatest x, least and greatest y, errors included.
    pub(super) bounds: Vec<[f64; 4]>,
}

impl Cells {
    /// The cells of the triangles of `looks` that are wanted.
    pub(super) fn new(
        placed: &Placed<'_>,
        projector: &Projector,
        looks: &Looks,
        links: &Standing<'_>,
        wanted: &Wanted<'_>,
    ) -> Self {
        let mut builder = Builder {
            placed,
            projector,
            links,
            size: wanted.open.size(),
            halves: Vec::new(),
            cells: Self::default(),
        };
        for look in &looks.all {
            if look.is_wanted(wanted, 0..look.vertices.len()) {
                builder.look(look, wanted);
            }
        }
        builder.finish()
    }

    pub(super) fn corners_of(&self, cell: u32) -> [&Point; 3] {
        self.corners[cell as usize].each_ref()
    }
}

/// A side of a cell that is a side of its triangle, or a part of one.
#[derive(Debug, Clone, Copy)]
struct Half {
    /// The same for all triangles of the edge.
    edge: (u32, u32),
    /// The half-edge of the cell.
    cell: u32,
    /// Whether it runs along the edge in the edge's own direction, if cells are turned to the same
    /// orientation.
    is_forward: bool,
}

/// A side of a triangle, before it is known what is left of it.
#[derive(Debug, Clone, Copy)]
struct Side {
    edge: (u32, u32),
    is_forward: bool,
}

struct Builder<'a> {
    placed: &'a Placed<'a>,
    projector: &'a Projector,
    links: &'a Standing<'a>,
    size: ImageSize,
    halves: Vec<Half>,
    cells: Cells,
}

/// In [`Side::edge`] and [`Half::edge`]: an edge that copies share, by its number.
const SHARED: u32 = u32::MAX;

impl Builder<'_> {
    fn look(&mut self, look: &Look, wanted: &Wanted<'_>) {
        let placed = self.placed;
        let is_mirrored = placed.placements[look.copy as usize].mirrored;
        let vertices = placed.topology.vertices(look.meshlet);
        let triangles = &placed.shapes.meshlets[look.meshlet as usize].triangles;
        let sides = placed.topology.sides(triangles);
        for (corners, sides) in placed.topology.corners(triangles).iter().zip(sides) {
            let corners = corners.map(usize::from);
            if sides[0] == NO_EDGE || !look.is_wanted(wanted, corners) {
                continue;
            }
            let world = corners.map(|v| placed.world(look.copy, vertices[v]));
            let side = |k: usize| Side {
                edge: match self.links.number(look.copy, sides[k]) {
                    Some(number) => (SHARED, number),
                    None => (look.copy, sides[k]),
                },
                is_forward: is_before(world[k], world[(k + 1) % 3]),
            };
            let sides = [side(0), side(1), side(2)];
            if is_mirrored {
                // Back along the same sides.
                let [a, b, c] = world;
                let back = |side: Side| Side { is_forward: !side.is_forward, ..side };
                self.add([a, c, b], [back(sides[2]), back(sides[1]), back(sides[0])]);
            } else {
                self.add(world, sides);
            }
        }
    }

    /// The point where a side is cut.
    ///
    /// It is computed in the edge's own direction, so that all triangles of the edge agree.
    fn cut(&self, a: &Clip, b: &Clip, is_forward: bool) -> Option<Point> {
        let (a, b) = if is_forward { (a, b) } else { (b, a) };
        let (na, nb) = (self.projector.depth_in(a), self.projector.depth_in(b));
        let t = (na / (na - nb)).clamp(0.0, 1.0);
        self.projector.point(&self.projector.between(a, b, t))
    }

    /// Clips a triangle at one plane (Sutherland and Hodgman 1974), and adds the rest as cells.
    ///
    /// The rest is one or two cells, or none.
    fn add(&mut self, world: [Vec3; 3], sides: [Side; 3]) {
        let clips = world.map(|p| self.projector.clip(p));
        let inside = clips.map(|c| self.projector.depth_in(&c) > 0.0);
        // Corners of the polygon, each with the side that runs on from it.
        let (mut polygon, mut count) = ([(None, None); 4], 0);
        let mut push = |corner: (Option<Point>, Option<Side>)| {
            polygon[count] = corner;
            count += 1;
        };
        for k in 0..3 {
            let next = (k + 1) % 3;
            if inside[k] {
                push((self.projector.point(&clips[k]), Some(sides[k])));
            }
            if inside[k] != inside[next] {
                // Leaving: the next side runs along the clipping plane and has no neighbour.
                let joined = is_planted!(self.placed.fault, CutSidesJoined);
                let point = self.cut(&clips[k], &clips[next], sides[k].is_forward);
                push((point, Some(sides[k]).filter(|_| !inside[k] || joined)));
            }
        }
        match count {
            3 => drop(self.add_cell([0, 1, 2].map(|k| polygon[k]))),
            4 => {
                let [a, b, c, d] = polygon;
                let first = self.add_cell([a, b, (c.0, None)]);
                let second = self.add_cell([(a.0, None), c, d]);
                if let (Some(first), Some(second)) = (first, second) {
                    self.marry(
                        3 * first + 2,
                        3 * second,
                        self.sign(3 * first) != self.sign(3 * second),
                    );
                }
            }
            _ => {}
        }
    }

    fn add_cell(&mut self, corners: [(Option<Point>, Option<Side>); 3]) -> Option<u32> {
        let [Some(a), Some(b), Some(c)] = corners.map(|corner| corner.0) else { return None };
        let mut bounds = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];
        for p in [&a, &b, &c] {
            let m = p.margin * UP + 2.0 * ROUNDING * (p.x.abs() + p.y.abs());
            bounds = [
                bounds[0].min(p.x - m),
                bounds[1].max(p.x + m),
                bounds[2].min(p.y - m),
                bounds[3].max(p.y + m),
            ];
        }
        let [width, height] = [self.size.width, self.size.height].map(f64::from);
        // Neither the cell nor its edges can meet a pixel.
        if bounds[1] < 0.0 || bounds[0] > width || bounds[3] < 0.0 || bounds[2] > height {
            return None;
        }
        if !occludes([&a, &b, &c], self.placed.culled, self.placed.fault) {
            return None;
        }
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        let cell = self.cells.corners.len() as u32;
        self.cells.corners.push([a, b, c]);
        let sign = if area < 0.0 { -1 } else { 1 };
        self.cells.signs.push(sign);
        self.cells.nearest.push(a.far.min(b.far).min(c.far));
        self.cells.bounds.push(bounds);
        self.cells.mates.extend([NO_MATE; 3]);
        for (k, (_, side)) in (0..).zip(corners) {
            if let Some(Side { edge, is_forward }) = side {
                // In the image all triangles are oriented the same way round.
                // Two triangles on different sides then run along it in opposite directions.
                let is_forward = is_forward == (sign > 0);
                self.halves.push(Half { edge, cell: 3 * cell + k, is_forward });
            }
        }
        Some(cell)
    }

    fn sign(&self, half: u32) -> i8 {
        self.cells.signs[(half / 3) as usize]
    }

    fn marry(&mut self, a: u32, b: u32, fold: bool) {
        let flag = if fold { FOLD } else { 0 };
        self.cells.mates[a as usize] = b | flag;
        self.cells.mates[b as usize] = a | flag;
    }

    /// Pairs the half-edges of every edge.
    ///
    /// Half-edges on different sides are paired first, then the rest by twos.
    /// Any pairing is valid; where more than two triangles meet, this one is as good as any.
    fn finish(mut self) -> Cells {
        let mut halves = std::mem::take(&mut self.halves);
        halves.sort_unstable_by_key(|half| (half.edge, half.cell));
        let (mut forward, mut backward) = (Vec::new(), Vec::new());
        for run in halves.chunk_by(|a, b| a.edge == b.edge) {
            forward.clear();
            backward.clear();
            for half in run {
                if half.is_forward {
                    forward.push(half.cell);
                } else {
                    backward.push(half.cell);
                }
            }
            while let (Some(a), Some(b)) = (forward.last(), backward.last()) {
                self.marry(*a, *b, false);
                forward.pop();
                backward.pop();
            }
            let left = if forward.is_empty() { &backward } else { &forward };
            for pair in left.chunks_exact(2) {
                self.marry(pair[0], pair[1], true);
            }
        }
        self.cells
    }
}
