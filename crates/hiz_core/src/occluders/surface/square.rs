//! The two questions about a square of the image on which everything else rests.
//!
//! - Does an edge certainly miss the square?
//! - How far does a triangle reach within the square?
//!
//! Both answers allow for the errors of the points and for every rounding here.

use crate::host::rounding::ROUNDING;
use crate::occluders::surface::planted_fault::{Planted, is_planted};

/// A factor that covers the few relative roundings in the bounds themselves.
pub(super) const UP: f64 = 1.0 + 64.0 * ROUNDING;

/// A vertex in the image.
///
/// The exact one is within `margin` of `(x, y)` in both coordinates, and `far_error` of `far`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    /// Pixels from the left border.
    pub(super) x: f64,
    /// Pixels from the top border.
    pub(super) y: f64,
    /// Depth with more for farther: NDC depth, or its negative in reversed Z.
    pub(super) far: f64,
    /// Error bound of `x` and of `y`, in pixels.
    pub(super) margin: f64,
    /// Error bound of `far`.
    pub(super) far_error: f64,
}

/// The closed square with half side `half` about `(x, y)`, in pixels; all three are exact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Square {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) half: f64,
}

impl Square {
    /// The four squares of half the side that cover this one.
    pub(super) fn quarters(self) -> [Square; 4] {
        let half = self.half / 2.0;
        let at = |sx: f64, sy: f64| Square { x: self.x + sx * half, y: self.y + sy * half, half };
        [at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0)]
    }
}

/// Where an edge from a to b lies relative to a square.
#[derive(Debug, Clone, Copy)]
pub(super) struct Side {
    /// Whether the exact edge may meet the square; false is certain.
    pub(super) meets: bool,
    /// Whether the edge crosses the ray from the square's centre to the right.
    ///
    /// +1 if it crosses downwards, -1 if it crosses upwards, 0 if it does not cross.
    /// This is certain where `meets` is false.
    /// The edge from b to a has exactly the opposite value.
    pub(super) crossing: i32,
}

/// Tests an edge against a square with three separating axes: x, y and the edge's normal.
///
/// For the normal this is the test of Akenine-Moller and Aila, "Conservative and tiled
/// rasterization using a modified triangle set-up", 2005.
/// The exact edge lies within the larger margin of its ends from the computed one.
/// The square is therefore grown by that margin.
pub(super) fn side(a: &Point, b: &Point, square: &Square) -> Side {
    let half = (square.half + a.margin.max(b.margin)) * UP;
    // Each difference has one relative rounding, since the square's centre is exact.
    let (ax, ay, bx, by) = (a.x - square.x, a.y - square.y, b.x - square.x, b.y - square.y);
    let (down, up) = (ax * by, ay * bx);
    let cross = down - up;
    // Two differences and one product each, then the difference: 4 roundings of either product.
    let error = 8.0 * ROUNDING * (down.abs() + up.abs());
    let beside = |u: f64, v: f64| u.min(v) > half || u.max(v) < -half;
    let left_or_right = beside(ax, bx);
    let beyond = cross.abs() > half * ((b.x - a.x).abs() + (b.y - a.y).abs()) * UP + error;
    let meets = !(left_or_right || beside(ay, by) || beyond);
    // Where the edge passes the height of the centre, its side is the one that both ends are on.
    // If the ends disagree, the cross product decides.
    let crossing = match (ay > 0.0, by > 0.0) {
        (false, true) if (left_or_right && ax > 0.0) || (!left_or_right && cross > 0.0) => 1,
        (true, false) if (left_or_right && ax > 0.0) || (!left_or_right && cross < 0.0) => -1,
        _ => 0,
    };
    Side { meets, crossing }
}

/// A bound of the exact triangle's depth over the square: none of its points there is farther.
///
/// Points of the exact and of the computed triangle correspond by barycentric coordinates.
/// Corresponding points are at most the largest margin apart.
/// Their depths differ by at most the largest depth error.
/// It is therefore enough to bound the computed plane over the square grown by that margin.
/// A triangle that is too thin for its plane is bounded by its corners.
pub(super) fn farthest(corners: [&Point; 3], square: &Square, fault: Planted) -> f64 {
    let [a, b, c] = corners;
    let corner_error =
        |p: &Point| if is_planted!(fault, CornerDepthsExact) { 0.0 } else { p.far_error };
    let top = corners.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p.far + corner_error(p)));
    let top = top + 2.0 * ROUNDING * top.abs();
    let half = (square.half + a.margin.max(b.margin).max(c.margin)) * UP;
    let (ux, uy, vx, vy) = (b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y);
    let area = ux * vy - uy * vx;
    let area_error = 8.0 * ROUNDING * ((ux * vy).abs() + (uy * vx).abs());
    if area.abs() < 1024.0 * area_error || area == 0.0 {
        return top;
    }
    let (qx, qy) = (square.x - a.x, square.y - a.y);
    let (fb, fc) = (b.far - a.far, c.far - a.far);
    // The plane is a.far + value / area, where `value` is linear in the position.
    let value = fb * (qx * vy - qy * vx) + fc * (ux * qy - uy * qx);
    let value_error = 16.0
        * ROUNDING
        * (fb.abs() * ((qx * vy).abs() + (qy * vx).abs())
            + fc.abs() * ((ux * qy).abs() + (uy * qx).abs()));
    let spread = (fb * vy - fc * uy).abs() + (fc * ux - fb * vx).abs();
    let spread_error =
        8.0 * ROUNDING * ((fb * vy).abs() + (fc * uy).abs() + (fc * ux).abs() + (fb * vx).abs());
    let most = value * area.signum() + value_error + half * (spread + spread_error) * UP;
    // The area's relative error is below 1/1024, so it counts at most twice.
    let rise = most / area.abs();
    let rise = rise + rise.abs() * (2.0 * area_error / area.abs() + 4.0 * ROUNDING);
    let far_error = a.far_error.max(b.far_error).max(c.far_error);
    let plane = a.far + rise + far_error + 4.0 * ROUNDING * (a.far.abs() + rise.abs() + far_error);
    top.min(plane)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, far: f64) -> Point {
        Point { x, y, far, margin: 0.0, far_error: 0.0 }
    }

    #[test]
    fn touching_counts_as_meeting() {
        let square = Square { x: 0.5, y: 0.5, half: 0.5 };
        let meets = |a: (f64, f64), b: (f64, f64)| {
            side(&point(a.0, a.1, 0.0), &point(b.0, b.1, 0.0), &square).meets
        };
        assert!(meets((1.0, -3.0), (1.0, 9.0)), "along the border");
        assert!(meets((2.0, 0.0), (0.0, 2.0)), "through a corner");
        assert!(meets((0.4, 0.4), (0.6, 0.5)), "inside");
        assert!(!meets((1.0 + 1e-12, -3.0), (1.0 + 1e-12, 9.0)));
        assert!(!meets((2.0 + 1e-12, 0.0), (0.0, 2.0 + 1e-12)));
        assert!(!meets((3.0, 0.5), (2.0, 0.5)), "on the same line");
    }

    #[test]
    fn a_loop_crosses_the_ray_as_often_as_it_winds() {
        let corners = [point(-9.0, -9.0, 0.0), point(9.0, -8.0, 0.0), point(0.0, 20.0, 0.0)];
        let winding = |x: f64, y: f64, order: [usize; 3]| -> i32 {
            let square = Square { x, y, half: 1e-3 };
            (0..3)
                .map(|k| side(&corners[order[k]], &corners[order[(k + 1) % 3]], &square).crossing)
                .sum()
        };
        assert_eq!(winding(0.0, 0.0, [0, 1, 2]), -winding(0.0, 0.0, [0, 2, 1]));
        assert_eq!(winding(0.0, 0.0, [0, 1, 2]).abs(), 1);
        for outside in [(-20.0, 0.0), (20.0, 0.0), (0.0, -20.0), (0.0, 30.0), (8.0, 15.0)] {
            assert_eq!(winding(outside.0, outside.1, [0, 1, 2]), 0);
        }
    }

    #[test]
    fn planes_are_bounded_by_their_far_corner_of_the_square() {
        // far = x / 8 + y / 16 over a large triangle.
        // Over the unit square about (2.5, 1.5) that is at most 3/8 + 2/16.
        let corners = [point(0.0, 0.0, 0.0), point(16.0, 0.0, 2.0), point(0.0, 16.0, 1.0)];
        let bound = farthest(
            [&corners[0], &corners[2], &corners[1]],
            &Square { x: 2.5, y: 1.5, half: 0.5 },
            Planted::default(),
        );
        assert!((0.5..0.5 + 1e-12).contains(&bound), "{bound}");
        // Where the plane goes farther than the triangle, its corners decide.
        assert!((2.0..2.0 + 1e-12).contains(&farthest(
            [&corners[0], &corners[1], &corners[2]],
            &Square { x: 40.0, y: 1.0, half: 0.5 },
            Planted::default(),
        )));
    }
}
