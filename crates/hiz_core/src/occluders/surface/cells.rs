//! The surface as a camera sees it.
//!
//! Triangles are clipped at the near plane and projected to pixels, with error bounds.
//! What is left of them are cells, which know their neighbours.

use crate::host::linear::{Vec3, sub};
use crate::host::rounding::ROUNDING;
use crate::input::camera::Camera;
use crate::input::mesh::FaceCull;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::square::{Point, UP};
use crate::occluders::surface::topology::Topology;

/// Triangles are clipped this part of the depth range behind the near plane.
/// Rounding needs that room.
const NEAR_ROOM: f64 = 1.0 / (1 << 20) as f64;
/// The largest margin in pixels with which a point is still of use.
const LARGEST_MARGIN: f64 = 0.25;
/// In `Cells::mates`: no neighbour.
pub(super) const NO_MATE: u32 = u32::MAX;
/// In `Cells::mates`: set where both cells lie on the same side of their edge.
pub(super) const FOLD: u32 = 1 << 31;

/// Triangles in the image.
///
/// Half-edge `3 c + k` runs from corner k of cell c to its next corner.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) points: Vec<Point>,
    pub(super) corners: Vec<[u32; 3]>,
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

/// Clip coordinates x, y, far and w, with a bound of the error of each.
///
/// `far` is clip z, or its negative in reversed Z.
#[derive(Debug, Clone, Copy)]
struct Clip {
    at: [f64; 4],
    error: [f64; 4],
}

/// The camera's part of the projection.
struct Projector {
    rows: [[f64; 4]; 4],
    origin: Vec3,
    half: [f64; 2],
    /// Values of `far`: at the near plane, and where triangles are clipped.
    near: f64,
    clipped: f64,
    fault: Planted,
}

impl Projector {
    fn new(camera: &Camera, fault: Planted) -> Self {
        let mut rows = camera.rows_near_one();
        let reversed = camera.convention().is_reversed();
        if reversed {
            rows[2] = rows[2].map(|v| -v);
        }
        let near = if reversed { -1.0 } else { 0.0 };
        let near = if is_planted!(fault, BeforeNear) { near - 0.1 } else { near };
        let size = camera.size();
        Self {
            rows,
            origin: camera.origin(),
            half: [f64::from(size.width) / 2.0, f64::from(size.height) / 2.0],
            near,
            clipped: near + NEAR_ROOM,
            fault,
        }
    }

    /// The clip coordinates of a world position.
    ///
    /// `d` has one rounding, each product two, and the sums add three: 6 roundings of every term.
    /// The bound takes 8.
    fn clip(&self, p: Vec3) -> Clip {
        let d = sub(p, self.origin);
        let mut clip = Clip { at: [0.0; 4], error: [0.0; 4] };
        for (i, row) in self.rows.iter().enumerate() {
            let terms = [row[0] * d[0], row[1] * d[1], row[2] * d[2]];
            clip.at[i] = terms[0] + terms[1] + terms[2] + row[3];
            clip.error[i] =
                8.0 * ROUNDING * (terms[0].abs() + terms[1].abs() + terms[2].abs() + row[3].abs());
        }
        clip
    }

    /// How far a point is behind the clipping plane, times w.
    fn depth_in(&self, c: &Clip) -> f64 {
        c.at[2] - self.clipped * c.at[3]
    }

    /// The point in the image; `None` if it is too uncertain or may be in front of the near plane.
    fn point(&self, c: &Clip) -> Option<Point> {
        let ([x, y, far, w], [ex, ey, ef, ew]) = (c.at, c.error);
        let least_w = w - ew;
        // The condition is negated so that NaN fails it, too.
        if !(least_w > w / 2.0 && w > 0.0) {
            return None;
        }
        let divided = |v: f64, e: f64| {
            let q = v / w;
            // v'/w' - q = ((v' - v) - q (w' - w)) / w', plus the rounding of the division.
            (q, (e + q.abs() * ew) / least_w + 2.0 * ROUNDING * q.abs())
        };
        let ((sx, ex), (sy, ey), (far, ef)) = (divided(x, ex), divided(y, ey), divided(far, ef));
        // One more sum and one more product.
        let pixels = |half: f64, s: f64, e: f64| half * (e + 4.0 * ROUNDING * (s.abs() + 1.0));
        let margin = pixels(self.half[0], sx, ex).max(pixels(self.half[1], sy, ey)) * UP;
        let far_error = ef * UP;
        let unproved = if is_planted!(self.fault, NearPointsUnproved) { 0.0 } else { far_error };
        if !(margin <= LARGEST_MARGIN && far - unproved >= self.near && far.is_finite()) {
            return None;
        }
        let is_exact = is_planted!(self.fault, NoWidening);
        let margin = if is_exact { 0.0 } else { margin };
        let far_error =
            if is_exact || is_planted!(self.fault, DepthsExact) { 0.0 } else { far_error };
        Some(Point {
            x: (sx + 1.0) * self.half[0],
            y: (1.0 - sy) * self.half[1],
            far,
            margin,
            far_error,
        })
    }
}

/// The exact point `a + t (b - a)` for the float64 number t.
///
/// Both triangles of an edge use the same t, so they share the point.
/// It need not lie on the clipping plane, since any part of a triangle is an occluder.
fn between(a: &Clip, b: &Clip, t: f64) -> Clip {
    Clip {
        at: std::array::from_fn(|i| a.at[i] + t * (b.at[i] - a.at[i])),
        error: std::array::from_fn(|i| {
            a.error[i].max(b.error[i]) + 8.0 * ROUNDING * (a.at[i].abs() + b.at[i].abs())
        }),
    }
}

impl Cells {
    /// The cells of all triangles that may meet the image.
    ///
    /// `culled` are the faces that do not occlude, as seen by this camera.
    pub(super) fn new(
        topology: &Topology,
        camera: &Camera,
        culled: FaceCull,
        fault: Planted,
    ) -> Self {
        let mut builder = Builder::new(topology, Projector::new(camera, fault));
        let size = camera.size();
        let image = [f64::from(size.width), f64::from(size.height)];
        for t in 0..topology.triangles.len() as u32 {
            builder.add(t, image, culled);
        }
        builder.finish()
    }

    pub(super) fn corners_of(&self, cell: u32) -> [&Point; 3] {
        self.corners[cell as usize].map(|i| &self.points[i as usize])
    }
}

struct Builder<'a> {
    topology: &'a Topology,
    projector: Projector,
    clips: Vec<Clip>,
    inside: Vec<bool>,
    /// Points of vertices, then those of cut edges.
    points: Vec<Option<Point>>,
    /// By edge: the index of its point on the clipping plane, or `NO_MATE` if there is none yet.
    cuts: Vec<u32>,
    /// By half-edge of the topology: the half-edge of the cell, or `NO_MATE`.
    placed: Vec<u32>,
    cells: Cells,
}

impl<'a> Builder<'a> {
    fn new(topology: &'a Topology, projector: Projector) -> Self {
        let clips: Vec<Clip> = topology.positions.iter().map(|p| projector.clip(*p)).collect();
        let inside: Vec<bool> = clips.iter().map(|c| projector.depth_in(c) > 0.0).collect();
        let points = clips
            .iter()
            .zip(&inside)
            .map(|(c, inside)| projector.point(c).filter(|_| *inside))
            .collect();
        Self {
            projector,
            clips,
            inside,
            points,
            cuts: vec![NO_MATE; topology.num_edges()],
            placed: vec![NO_MATE; topology.edges.len()],
            cells: Cells::default(),
            topology,
        }
    }

    /// The index of the point where an edge is cut.
    ///
    /// It is computed in the edge's own direction, so that both triangles of the edge agree.
    fn cut(&mut self, half: u32) -> u32 {
        let edge = self.topology.edges[half as usize] as usize;
        if self.cuts[edge] == NO_MATE {
            let [a, b] = self.topology.ends(self.topology.around(edge)[0]);
            let (a, b) = (&self.clips[a.min(b) as usize], &self.clips[a.max(b) as usize]);
            let (na, nb) = (self.projector.depth_in(a), self.projector.depth_in(b));
            let t = (na / (na - nb)).clamp(0.0, 1.0);
            let mut cut = between(a, b, t);
            if is_planted!(self.projector.fault, CutPointsExact) {
                cut.error = [0.0; 4];
            }
            let point = self.projector.point(&cut);
            self.cuts[edge] = self.points.len() as u32;
            self.points.push(point);
        }
        self.cuts[edge]
    }

    /// Clips a triangle at one plane (Sutherland and Hodgman 1974), and adds the rest as cells.
    ///
    /// The rest is one or two cells, or none.
    fn add(&mut self, t: u32, image: [f64; 2], culled: FaceCull) {
        let corners = self.topology.triangles[t as usize];
        let inside = corners.map(|v| self.inside[v as usize]);
        // Corners of the polygon, each with the half-edge that its next side belongs to.
        let (mut polygon, mut count) = ([(0, NO_MATE); 4], 0);
        let mut push = |corner| {
            polygon[count] = corner;
            count += 1;
        };
        for k in 0..3 {
            let (half, next) = (3 * t + k as u32, (k + 1) % 3);
            if inside[k] {
                push((corners[k], half));
            }
            if inside[k] != inside[next] {
                // Leaving: the next side runs along the clipping plane and has no neighbour.
                let joined = is_planted!(self.projector.fault, CutSidesJoined);
                push((self.cut(half), if inside[k] && !joined { NO_MATE } else { half }));
            }
        }
        match count {
            3 => drop(self.add_cell([0, 1, 2].map(|k| polygon[k]), image, culled)),
            4 => {
                let [a, b, c, d] = polygon;
                let first = self.add_cell([a, b, (c.0, NO_MATE)], image, culled);
                let second = self.add_cell([(a.0, NO_MATE), c, d], image, culled);
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

    fn add_cell(
        &mut self,
        corners: [(u32, u32); 3],
        image: [f64; 2],
        culled: FaceCull,
    ) -> Option<u32> {
        let ids = corners.map(|corner| corner.0);
        let [Some(a), Some(b), Some(c)] = ids.map(|i| self.points[i as usize]) else { return None };
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
        // Neither the cell nor its edges can meet a pixel.
        if bounds[1] < 0.0 || bounds[0] > image[0] || bounds[3] < 0.0 || bounds[2] > image[1] {
            return None;
        }
        let (ux, uy, vx, vy) = (b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y);
        let area = ux * vy - uy * vx;
        let margin = a.margin.max(b.margin).max(c.margin);
        let area_error = 8.0 * ROUNDING * ((ux * vy).abs() + (uy * vx).abs())
            + (2.0 * margin * (ux.abs() + uy.abs() + vx.abs() + vy.abs()) + 8.0 * margin * margin)
                * UP;
        let area_error =
            if is_planted!(self.projector.fault, FacingUnproved) { 0.0 } else { area_error };
        // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
        let occludes = match culled {
            FaceCull::None => true,
            FaceCull::Back => area < -area_error,
            FaceCull::Front => area > area_error,
        };
        if !occludes {
            return None;
        }
        let cell = self.cells.corners.len() as u32;
        self.cells.corners.push(ids);
        self.cells.signs.push(if area < 0.0 { -1 } else { 1 });
        self.cells.nearest.push(a.far.min(b.far).min(c.far));
        self.cells.bounds.push(bounds);
        self.cells.mates.extend([NO_MATE; 3]);
        for (k, (_, half)) in corners.iter().enumerate() {
            if *half != NO_MATE {
                self.placed[*half as usize] = 3 * cell + k as u32;
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
        let (mut forward, mut backward) = (Vec::new(), Vec::new());
        for edge in 0..self.topology.num_edges() {
            forward.clear();
            backward.clear();
            for half in self.topology.around(edge) {
                let placed = self.placed[*half as usize];
                if placed == NO_MATE {
                    continue;
                }
                let [a, b] = self.topology.ends(*half);
                // In the image all triangles are oriented the same way round.
                // Two triangles on different sides then run along it in opposite directions.
                if (a < b) == (self.sign(placed) > 0) {
                    forward.push(placed);
                } else {
                    backward.push(placed);
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
        // Cells use valid points alone, so the others are placeholders that nothing reads.
        let nowhere = Point {
            x: f64::NAN,
            y: f64::NAN,
            far: f64::NAN,
            margin: f64::NAN,
            far_error: f64::NAN,
        };
        self.cells.points = self.points.into_iter().map(|p| p.unwrap_or(nowhere)).collect();
        self.cells
    }
}
