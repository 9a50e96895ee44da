//! The volumes that are tested, taken exactly as written.

use crate::feasibility::{Form, Shape};
use crate::scalar::Scalar;

/// A closed convex volume in world units.
/// Its numbers are the exact real numbers that the float64 values denote.
///
/// Sizes of 0 are valid (a point, a segment, a rectangle).
/// So are mirrored, sheared or singular `axes`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Volume {
    /// All points within `radius` of `center`.
    Sphere {
        /// Centre.
        center: [f64; 3],
        /// Radius, at least 0.
        radius: f64,
    },
    /// A box along the world axes.
    Box {
        /// The corner with the least coordinates.
        min: [f64; 3],
        /// The corner with the greatest coordinates, none of them below that of `min`.
        max: [f64; 3],
    },
    /// A parallelepiped: `center + axes * (half_sizes * s)` for all `s` in `[-1, 1]^3`.
    OrientedBox {
        /// Centre.
        center: [f64; 3],
        /// Half the extent along each box axis, at least 0.
        half_sizes: [f64; 3],
        /// Row-major matrix whose column `k` is the world direction (and scale) of box axis `k`.
        axes: [[f64; 3]; 3],
    },
}

impl Volume {
    /// Whether the volume is valid: every number finite, no negative size, `min <= max`.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let finite = |numbers: &[f64]| numbers.iter().all(|x| x.is_finite());
        match self {
            Volume::Sphere { center, radius } => {
                finite(center) && radius.is_finite() && *radius >= 0.0
            }
            Volume::Box { min, max } => {
                finite(min) && finite(max) && min.iter().zip(max).all(|(low, high)| low <= high)
            }
            Volume::OrientedBox { center, half_sizes, axes } => {
                finite(center)
                    && finite(half_sizes)
                    && finite(axes.as_flattened())
                    && half_sizes.iter().all(|&half| half >= 0.0)
            }
        }
    }

    pub(crate) fn shape(&self) -> Shape {
        match self {
            Volume::Sphere { .. } => Shape::Ball,
            Volume::Box { .. } | Volume::OrientedBox { .. } => Shape::Cube,
        }
    }
}

/// Local coordinates of a volume.
///
/// The volume is the image of the unit ball, or of the cube `[-1, 1]^3`.
/// The map is `s -> center + sum_k axes[k] s_k`.
pub(crate) struct Frame<S> {
    /// Centre relative to the view's origin.
    center: [S; 3],
    /// `axes[k]` is half axis `k`, a world vector.
    axes: [[S; 3]; 3],
}

impl<S: Scalar> Frame<S> {
    pub(crate) fn new(volume: &Volume, origin: [f64; 3]) -> Frame<S> {
        let number = |x: f64| S::exact(x);
        let relative = |p: [f64; 3]| {
            let axis = |i: usize| number(p[i]).minus(&number(origin[i]));
            [axis(0), axis(1), axis(2)]
        };
        let diagonal = |lengths: [S; 3]| {
            let zero = || number(0.0);
            let [x, y, z] = lengths;
            [[x, zero(), zero()], [zero(), y, zero()], [zero(), zero(), z]]
        };
        match *volume {
            Volume::Sphere { center, radius } => {
                Frame { center: relative(center), axes: diagonal([radius; 3].map(number)) }
            }
            Volume::Box { min, max } => {
                // Relative to the origin first.
                // Far from it, halving would otherwise cost float64 its last digits.
                let (low, high) = (relative(min), relative(max));
                let half = number(0.5);
                let axis = |i: usize| low[i].plus(&high[i]).times(&half);
                let length = |i: usize| number(max[i]).minus(&number(min[i])).times(&half);
                Frame {
                    center: [axis(0), axis(1), axis(2)],
                    axes: diagonal([length(0), length(1), length(2)]),
                }
            }
            Volume::OrientedBox { center, half_sizes, axes } => {
                let axis = |k: usize| {
                    let half = number(half_sizes[k]);
                    axes.map(|row| number(row[k]).times(&half))
                };
                Frame { center: relative(center), axes: [axis(0), axis(1), axis(2)] }
            }
        }
    }

    /// A matrix row as a linear function of the local coordinates.
    pub(crate) fn form(&self, row: &[f64; 4]) -> Form<S> {
        let row = row.map(S::exact);
        let dot =
            |v: &[S; 3]| row[0].times(&v[0]).plus(&row[1].times(&v[1])).plus(&row[2].times(&v[2]));
        Form {
            middle: dot(&self.center).plus(&row[3]),
            along: [0, 1, 2].map(|k| dot(&self.axes[k])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ZERO: [f64; 3] = [0.0; 3];
    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn bad_numbers_are_invalid_and_degenerate_volumes_are_not() {
        let sphere = |radius| Volume::Sphere { center: ZERO, radius };
        let aabb = |min, max| Volume::Box { min, max };
        let oriented = |half_sizes, axes| Volume::OrientedBox { center: ZERO, half_sizes, axes };
        for good in [
            sphere(0.0),
            sphere(-0.0),
            aabb(ZERO, ZERO),
            aabb([-1e300; 3], [1e300; 3]),
            oriented(ZERO, AXES),
            oriented([1.0; 3], [[0.0; 3]; 3]),
            oriented([1.0; 3], AXES.map(|row| row.map(|x| -x))),
        ] {
            assert!(good.is_valid(), "{good:?}");
        }
        let nan = f64::NAN;
        for bad in [
            sphere(-1e-300),
            sphere(nan),
            sphere(f64::INFINITY),
            Volume::Sphere { center: [0.0, nan, 0.0], radius: 1.0 },
            aabb([0.0, 0.0, 1.0], [1.0, 1.0, 0.5]),
            aabb([nan, 0.0, 0.0], [1.0; 3]),
            aabb([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]),
            oriented([1.0, -1.0, 1.0], AXES),
            oriented([1.0; 3], [[nan; 3]; 3]),
        ] {
            assert!(!bad.is_valid(), "{bad:?}");
        }
    }
}
