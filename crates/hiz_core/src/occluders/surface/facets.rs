//! Triangles whose corners are rounded to 1/256 pixel, with a plane behind which they never are.
//!
//! **Corners.**
//! The exact image point of a vertex lies less than one unit of 1/256 pixel from its rounded one:
//! half a unit of rounding, and a quarter of a unit at most of what float64 is not sure of.
//! A vertex that is less certain takes its triangles out.
//!
//! **Planes.**
//! Let z be the depths of the corners, errors included, with more for farther.
//! A facet stores any affine function f of the rounded image with z <= f + dev at its corners.
//! A point of the exact triangle is `sum l_i v_i`, and its depth is at most `sum l_i z_i`.
//! The point `sum l_i s_i` of the rounded triangle is less than a unit away from it.
//! There f + dev is at least `sum l_i z_i`.
//! So over a pixel the exact triangle is nowhere farther than the greatest f + dev over the pixel
//! grown by a unit.
//! How well f fits is a matter of quality alone.

use crate::host::linear::Vec3;
use crate::host::rounding::{ROUNDING, round_up};
use crate::input::mesh::FaceCull;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::projector::{Clip, Projector, is_before};
use crate::occluders::surface::square::{Point, UP};

/// Units of the rounded image per pixel.
pub(super) const UNITS: i32 = 256;
/// How far an exact point may be from its rounded one, in units.
pub(super) const REACH: i32 = 1;
/// The largest error in pixels of a point that is rounded: a quarter of a unit.
const LARGEST_ERROR: f64 = 0.25 / UNITS as f64;
/// Edges are cut this many pixels from the image, where a vertex is farther away than `OUTERMOST`.
const GUARD: f64 = (1 << 20) as f64;
/// In pixels: products of two differences of coordinates then fit 62 bits.
const OUTERMOST: f64 = (1 << 21) as f64;
/// Adding this to a float64 leaves its nearest integer in the low 32 bits (ties to even).
const TO_INTEGER: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// How far squares are grown where edges are tested, in units.
pub(super) fn reach(fault: Planted) -> i32 {
    if is_planted!(fault, NoEdgeMargin) { 0 } else { REACH }
}

/// A point of the rounded image.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Corner {
    /// In units from the left and upper border of the image.
    pub(super) x: i32,
    pub(super) y: i32,
    /// Depth with more for farther, errors included.
    pub(super) far: f64,
}

/// What became of a vertex.
#[derive(Debug, Clone, Copy, Default)]
pub(super) enum Vertex {
    /// Its triangles are left out.
    #[default]
    Uncertain,
    /// Its edges are cut: it is in front of the near plane, or far outside of the image.
    Outside,
    Inside(Corner),
}

/// What is left of an edge.
#[derive(Debug, Clone, Copy)]
pub(super) enum Segment {
    Uncertain,
    /// All of it is outside.
    Nothing,
    Between(Corner, Corner),
}

/// A camera that rounds what it sees.
#[derive(Debug)]
pub(super) struct Rounder {
    pub(super) projector: Projector,
}

impl Rounder {
    pub(super) fn new(projector: Projector) -> Self {
        Self { projector }
    }

    #[inline(always)]
    fn corner(&self, point: &Point) -> Option<Corner> {
        let is_certain =
            point.margin <= LARGEST_ERROR && point.x.abs() < OUTERMOST && point.y.abs() < OUTERMOST;
        let integer = |v: f64| (v * f64::from(UNITS) + TO_INTEGER).to_bits() as i32;
        let far = (point.far + point.far_error) + 2.0 * ROUNDING * point.far.abs();
        is_certain.then(|| Corner { x: integer(point.x), y: integer(point.y), far })
    }

    /// The vertex at a world position, and where it is before it is rounded.
    #[inline(always)]
    pub(super) fn vertex(&self, p: Vec3) -> (Vertex, Point) {
        let clip = self.projector.clip(p);
        let nowhere = Point { x: 0.0, y: 0.0, far: 0.0, margin: f64::INFINITY, far_error: 0.0 };
        if self.projector.depth_in(&clip) <= 0.0 {
            return (Vertex::Outside, nowhere);
        }
        let Some(point) = self.projector.point(&clip) else { return (Vertex::Uncertain, nowhere) };
        match self.corner(&point) {
            Some(corner) => (Vertex::Inside(corner), point),
            None if point.margin <= LARGEST_ERROR => (Vertex::Outside, nowhere),
            None => (Vertex::Uncertain, nowhere),
        }
    }

    /// What is left of the edge from a to b, for ends of which at least one is not inside.
    ///
    /// An end is what [`Rounder::vertex`] makes of it, and its world position.
    ///
    /// All triangles of the edge get the same two points.
    pub(super) fn segment(&self, a: (Vertex, Vec3), b: (Vertex, Vec3)) -> Segment {
        if is_before(b.1, a.1) {
            return match self.segment_in_order(b, a) {
                Segment::Between(p, q) => Segment::Between(q, p),
                other => other,
            };
        }
        self.segment_in_order(a, b)
    }

    /// Cuts at the near plane and at the guard band (Liang and Barsky 1984).
    fn segment_in_order(&self, a: (Vertex, Vec3), b: (Vertex, Vec3)) -> Segment {
        let clips = [self.projector.clip(a.1), self.projector.clip(b.1)];
        let [half_width, half_height] = self.projector.half;
        let guard = [GUARD / half_width, GUARD / half_height];
        let inside = |c: &Clip| {
            let [x, y, _, w] = c.at;
            [
                self.projector.depth_in(c),
                guard[0] * w - x,
                guard[0] * w + x,
                guard[1] * w - y,
                guard[1] * w + y,
            ]
        };
        let ends = [a.0, b.0];
        let is_inside = ends.map(|end| matches!(end, Vertex::Inside(_)));
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for (at_a, at_b) in inside(&clips[0]).into_iter().zip(inside(&clips[1])) {
            let t = at_a / (at_a - at_b);
            match (is_inside[0] || at_a > 0.0, is_inside[1] || at_b > 0.0) {
                (true, true) => {}
                (false, true) => first = first.max(t),
                (true, false) => last = last.min(t),
                (false, false) => return Segment::Nothing,
            }
        }
        if first >= last {
            return Segment::Nothing;
        }
        let cut = |t: f64, end: Vertex| match end {
            Vertex::Inside(corner) => Some(corner),
            Vertex::Uncertain => None,
            Vertex::Outside => {
                let between = self.projector.between(&clips[0], &clips[1], t);
                self.projector.point(&between).and_then(|point| self.corner(&point))
            }
        };
        match (cut(first, ends[0]), cut(last, ends[1])) {
            (Some(p), Some(q)) => Segment::Between(p, q),
            _ => Segment::Uncertain,
        }
    }
}

/// A triangle in the rounded image, or what is left of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    /// The plane at the point `at`, and its slopes per unit.
    far: f64,
    slope: [f64; 2],
    /// `dev`, and all roundings.
    slack: f64,
    /// The depths of the farthest and of the nearest corner.
    pub(super) farthest: f64,
    pub(super) nearest: f64,
    /// In units, within the image.
    at: [i32; 2],
    /// The sense of rotation in the rounded image, +1 or -1; 0 for a triangle that is left out.
    pub(super) sign: i8,
    /// Its corners are in a list of polygons, since it was cut.
    pub(super) is_cut: bool,
}

impl Facet {
    /// A triangle that is left out.
    pub(super) const NOTHING: Self = Self {
        far: 0.0,
        slope: [0.0; 2],
        slack: 0.0,
        farthest: 0.0,
        nearest: f64::INFINITY,
        at: [0; 2],
        sign: 0,
        is_cut: false,
    };

    /// The facet of a polygon, or `None` if that is empty.
    pub(super) fn new(corners: &[Corner], size: [i32; 2]) -> Self {
        let first = corners[0];
        // The largest triangle of the fan has the best plane.
        let fan = |i: usize| {
            let (a, b) = (corners[i], corners[i + 1]);
            let u = [i64::from(a.x - first.x), i64::from(a.y - first.y)];
            let v = [i64::from(b.x - first.x), i64::from(b.y - first.y)];
            (u, v, u[0] * v[1] - u[1] * v[0], [a.far - first.far, b.far - first.far])
        };
        let (mut best, mut sum) = (fan(1), 0_i128);
        for i in 1..corners.len() - 1 {
            let next = fan(i);
            sum += i128::from(next.2);
            if next.2.abs() > best.2.abs() {
                best = next;
            }
        }
        let (mut farthest, mut nearest) = (f64::NEG_INFINITY, f64::INFINITY);
        for corner in corners {
            farthest = farthest.max(corner.far);
            nearest = nearest.min(corner.far);
        }
        let at = [first.x.clamp(0, size[0] * UNITS), first.y.clamp(0, size[1] * UNITS)];
        let sign = if sum < 0 { -1 } else { 1 };
        let flat = Self {
            far: farthest,
            slope: [0.0; 2],
            slack: 16.0 * ROUNDING * farthest.abs(),
            farthest,
            nearest,
            at,
            sign,
            is_cut: false,
        };
        let (u, v, area, [fu, fv]) = best;
        if area == 0 {
            return flat;
        }
        let per_area = 1.0 / area as f64;
        let slope = [
            (fu * v[1] as f64 - fv * u[1] as f64) * per_area,
            (fv * u[0] as f64 - fu * v[0] as f64) * per_area,
        ];
        // Differences of coordinates are exact.
        let from_at = |c: &Corner| [f64::from(c.x - at[0]), f64::from(c.y - at[1])];
        let [dx, dy] = from_at(&first);
        let far = first.far - slope[0] * dx - slope[1] * dy;
        let (mut dev, mut extent) = (0.0_f64, [0.0_f64; 2]);
        for corner in corners {
            let [dx, dy] = from_at(corner);
            dev = dev.max(corner.far - (far + slope[0] * dx + slope[1] * dy));
            extent = [extent[0].max(dx.abs()), extent[1].max(dy.abs())];
        }
        // `far + slope . d` has 4 roundings of its terms, here and at each square.
        // The centre of a square that the facet meets is at most 2 pixels beyond its corners.
        let room = f64::from(2 * UNITS);
        let terms =
            far.abs() + slope[0].abs() * (extent[0] + room) + slope[1].abs() * (extent[1] + room);
        let slack = (dev + 32.0 * ROUNDING * terms) * UP;
        // False for NaN, too.
        if slack < f64::INFINITY { Self { far, slope, slack, ..flat } } else { flat }
    }

    /// Depths over a square: none of the exact triangle's is beyond the first.
    ///
    /// The square has its centre at (x, y); `half` is half its side and [`REACH`], all in units.
    /// The second depth is about the nearest one, for choices alone.
    #[inline(always)]
    pub(super) fn range(&self, x: i32, y: i32, half: f64) -> (f64, f64) {
        let far = self.plane(x, y);
        let reach = half * (self.slope[0].abs() + self.slope[1].abs()) * UP + self.slack;
        let (most, least) = (far + reach, far - reach);
        (
            if most < self.farthest { most } else { self.farthest },
            if least > self.nearest { least } else { self.nearest },
        )
    }

    /// A depth of [`Facet::range`] as a float32, rounded towards far.
    #[inline(always)]
    pub(super) fn rounded(far: f64, fault: Planted) -> f32 {
        if is_planted!(fault, RoundedToNearest) {
            #[expect(clippy::cast_possible_truncation, reason = "the fault that is planted")]
            return far as f32;
        }
        round_up(far)
    }

    #[inline(always)]
    fn plane(&self, x: i32, y: i32) -> f64 {
        let [dx, dy] = [f64::from(x - self.at[0]), f64::from(y - self.at[1])];
        self.far + self.slope[0] * dx + self.slope[1] * dy
    }

    /// About the depth at a point, for choices alone.
    pub(super) fn at_point(&self, x: i32, y: i32) -> f64 {
        self.plane(x, y).min(self.farthest).max(self.nearest)
    }

    /// The same facet with its plane in float32: a fault for tests.
    #[expect(clippy::cast_possible_truncation, reason = "the fault that is planted")]
    pub(super) fn in_float32(&self) -> Self {
        let low = |v: f64| f64::from(v as f32);
        Self {
            far: low(self.far),
            slope: self.slope.map(low),
            slack: low(self.slack),
            farthest: low(self.farthest),
            ..*self
        }
    }

    /// Whether it is a triangle at all.
    #[inline]
    pub(super) fn is_there(&self) -> bool {
        self.sign != 0
    }
}

/// Whether a triangle certainly faces a way that occludes, by its points before rounding.
///
/// Exact corners are within the margins of the points.
#[inline]
pub(super) fn occludes(points: [&Point; 3], culled: FaceCull, fault: Planted) -> bool {
    let [a, b, c] = points;
    let (ux, uy, vx, vy) = (b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y);
    let area = ux * vy - uy * vx;
    let margin = a.margin.max(b.margin).max(c.margin);
    let area_error = 8.0 * ROUNDING * ((ux * vy).abs() + (uy * vx).abs())
        + (2.0 * margin * (ux.abs() + uy.abs() + vx.abs() + vy.abs()) + 8.0 * margin * margin) * UP;
    let area_error = if is_planted!(fault, FacingUnproved) { 0.0 } else { area_error };
    // Rows run downwards, so what is counter-clockwise with y up has a negative area here.
    match culled {
        FaceCull::None => true,
        FaceCull::Back => area < -area_error,
        FaceCull::Front => area > area_error,
    }
}
