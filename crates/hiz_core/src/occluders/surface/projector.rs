//! World positions to image points in float64, with a bound of the error of each.

use crate::host::linear::{Vec3, sub};
use crate::host::rounding::ROUNDING;
use crate::input::camera::Camera;
use crate::occluders::surface::planted_fault::{Planted, is_planted};
use crate::occluders::surface::square::{Point, UP};

/// Triangles are clipped this part of the depth range behind the near plane.
/// Rounding needs that room.
const NEAR_ROOM: f64 = 1.0 / (1 << 20) as f64;
/// The largest margin in pixels with which a point is still of use.
const LARGEST_MARGIN: f64 = 0.25;

/// Clip coordinates x, y, far and w, with a bound of the error of each.
///
/// `far` is clip z, or its negative in reversed Z.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clip {
    pub(super) at: [f64; 4],
    pub(super) error: [f64; 4],
}

/// The camera's part of the projection.
#[derive(Debug)]
pub(super) struct Projector {
    rows: [[f64; 4]; 4],
    origin: Vec3,
    /// Half the image's width and height in pixels.
    pub(super) half: [f64; 2],
    /// Values of `far`: at the near plane, and where triangles are clipped.
    near: f64,
    clipped: f64,
    fault: Planted,
}

impl Projector {
    pub(super) fn new(camera: &Camera, fault: Planted) -> Self {
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

    /// Clip-space rows x, y, far and w about `origin`.
    pub(super) fn rows(&self) -> &[[f64; 4]; 4] {
        &self.rows
    }

    pub(super) fn origin(&self) -> Vec3 {
        self.origin
    }

    /// The value of `far` where triangles are clipped.
    pub(super) fn clipped(&self) -> f64 {
        self.clipped
    }

    /// The clip coordinates of a world position.
    ///
    /// `d` has one rounding, each product two, and the sums add three: 6 roundings of every term.
    /// The bound takes 8.
    #[inline(always)]
    pub(super) fn clip(&self, p: Vec3) -> Clip {
        let d = sub(p, self.origin);
        #[expect(clippy::cast_possible_truncation, reason = "the fault that is planted")]
        let d = if is_planted!(self.fault, VerticesInFloat32) {
            std::array::from_fn(|k| f64::from(p[k] as f32 - self.origin[k] as f32))
        } else {
            d
        };
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
    #[inline(always)]
    pub(super) fn depth_in(&self, c: &Clip) -> f64 {
        c.at[2] - self.clipped * c.at[3]
    }

    /// The point in the image; `None` if it is too uncertain or may be in front of the near plane.
    ///
    /// With `v` for x, y or far, the exact quotient differs from `v / w` by `((v' - v) - (v / w)
    /// (w' - w)) / w'`.
    /// The reciprocal of w and the product with it add two roundings; the bound takes four.
    #[inline(always)]
    pub(super) fn point(&self, c: &Clip) -> Option<Point> {
        let ([x, y, far, w], [ex, ey, ef, ew]) = (c.at, c.error);
        let least_w = w - ew;
        // The condition is negated so that NaN fails it, too.
        if !(least_w > w / 2.0 && w > 0.0) {
            return None;
        }
        let (per_w, per_least_w) = (1.0 / w, 1.0 / least_w);
        let divided = |v: f64, e: f64| {
            let q = v * per_w;
            (q, (e + q.abs() * ew) * per_least_w + 4.0 * ROUNDING * q.abs())
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

    /// The exact point `a + t (b - a)` for the float64 number t.
    ///
    /// Both triangles of an edge use the same t, so they share the point.
    /// It need not lie on a clipping plane, since any part of a triangle is an occluder.
    pub(super) fn between(&self, a: &Clip, b: &Clip, t: f64) -> Clip {
        let exact = is_planted!(self.fault, CutPointsExact);
        Clip {
            at: std::array::from_fn(|i| a.at[i] + t * (b.at[i] - a.at[i])),
            error: std::array::from_fn(|i| {
                if exact {
                    return 0.0;
                }
                a.error[i].max(b.error[i]) + 8.0 * ROUNDING * (a.at[i].abs() + b.at[i].abs())
            }),
        }
    }
}

/// Whether a world position comes before another one, by x, then y, then z.
///
/// The ends of an edge are taken in this order wherever a number depends on their order.
/// So all triangles of an edge agree on it, in whichever mesh they are.
#[inline]
pub(super) fn is_before(a: Vec3, b: Vec3) -> bool {
    a < b
}
