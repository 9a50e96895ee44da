//! Axis-aligned boxes in float64 that contain the given volumes for the exact real numbers.
//! Every sum is rounded outwards.

use crate::input::bounds::{Bounds, Floats};

/// An axis-aligned box in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Aabb {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
}

impl Aabb {
    /// The box that contains nothing and adds nothing to a union.
    pub(crate) const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: std::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    /// The middle; each corner is halved before the sum, because the sum of both may overflow.
    pub(crate) fn center(&self) -> [f64; 3] {
        std::array::from_fn(|k| 0.5 * self.min[k] + 0.5 * self.max[k])
    }

    /// `center +- reach`, rounded outwards.
    fn about(center: [f64; 3], reach: [f64; 3]) -> Self {
        Self {
            min: std::array::from_fn(|k| {
                if reach[k] == 0.0 { center[k] } else { (center[k] - reach[k]).next_down() }
            }),
            max: std::array::from_fn(|k| {
                if reach[k] == 0.0 { center[k] } else { (center[k] + reach[k]).next_up() }
            }),
        }
    }

    /// Whether the corners are finite and ordered.
    fn is_box(&self) -> bool {
        (0..3).all(|k| {
            self.min[k].is_finite() && self.max[k].is_finite() && self.min[k] <= self.max[k]
        })
    }
}

impl Bounds<'_> {
    /// The box around volume `i`.
    /// `None` for invalid bounds: a number that is not finite, a negative size, or min > max.
    pub(crate) fn aabb(&self, i: usize) -> Option<Aabb> {
        let aabb = match *self {
            Self::Spheres { centers, radii } => sphere(centers.array(i), radii.get(i))?,
            Self::Boxes { min, max } => Aabb { min: min.array(i), max: max.array(i) },
            Self::OrientedBoxes { centers, half_sizes, rotations } => {
                oriented_box(centers, half_sizes, rotations, i)?
            }
            Self::Points { positions } => {
                let position = positions.array(i);
                Aabb { min: position, max: position }
            }
        };
        aabb.is_box().then_some(aabb)
    }
}

fn sphere(center: [f64; 3], radius: f64) -> Option<Aabb> {
    (radius >= 0.0).then(|| Aabb::about(center, [radius; 3]))
}

/// Along each world axis, the box reaches `sum over k of |A_ik| h_k` from its centre.
fn oriented_box(
    centers: Floats<'_>,
    half_sizes: Floats<'_>,
    rotations: Floats<'_>,
    i: usize,
) -> Option<Aabb> {
    let (h, a): ([f64; 3], [f64; 9]) = (half_sizes.array(i), rotations.array(i));
    if !h.iter().all(|h| *h >= 0.0) {
        return None;
    }
    let reach = std::array::from_fn(|row| {
        (0..3).fold(0.0, |sum, k| {
            let part = product_up(a[3 * row + k].abs(), h[k]);
            if part == 0.0 { sum } else { (sum + part).next_up() }
        })
    });
    Some(Aabb::about(centers.array(i), reach))
}

/// A float64 that is not below the exact product of two numbers >= 0.
/// A product that underflows to 0 is rounded up as well; only a factor of 0 gives 0.
fn product_up(a: f64, b: f64) -> f64 {
    let product = a * b;
    if a == 0.0 || b == 0.0 { product } else { product.next_up() }
}
