//! Bounds of instances, borrowed from the caller as flat arrays of float32 or float64.
//!
//! How they are validated and rounded is up to the room `instances`.

use crate::error::{Error, Result};
use crate::host::rounding::split;

/// A flat array of float32 or float64 in C order.
#[derive(Debug, Clone, Copy)]
pub enum Floats<'a> {
    /// float32.
    F32(&'a [f32]),
    /// float64.
    F64(&'a [f64]),
}

impl Floats<'_> {
    /// The number of scalars.
    #[inline]
    pub fn len(&self) -> usize {
        match self {
            Self::F32(v) => v.len(),
            Self::F64(v) => v.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Scalar `i` as float64, which holds both types exactly.
    ///
    /// # Panics
    /// If `i` is not below [`Floats::len`].
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::F32(v) => f64::from(v[i]),
            Self::F64(v) => v[i],
        }
    }

    /// The scalars of `range`.
    pub(crate) fn part(&self, range: std::ops::Range<usize>) -> Self {
        match self {
            Self::F32(v) => Self::F32(&v[range]),
            Self::F64(v) => Self::F64(&v[range]),
        }
    }

    #[inline]
    pub(crate) fn array<const N: usize>(&self, i: usize) -> [f64; N] {
        // Matched once per element, not per scalar: this is the inner loop of every upload.
        match self {
            Self::F32(v) => {
                let v = &v[N * i..N * (i + 1)];
                std::array::from_fn(|k| f64::from(v[k]))
            }
            Self::F64(v) => {
                let v = &v[N * i..N * (i + 1)];
                std::array::from_fn(|k| v[k])
            }
        }
    }
}

/// Whether one float32 does not hold a coordinate, and two are needed.
///
/// Not so for what is no valid coordinate, and for less than the least normal float32: the margin
/// of a cull covers that much (`docs/accuracy.md`).
pub(crate) fn needs_two_halves(v: f64) -> bool {
    split(v).1 != 0.0
}

/// The bounds of N instances in world coordinates, borrowed from the caller.
///
/// # Examples
/// ```
/// use hiz_core::{Bounds, BoundsKind, Floats, InstanceOptions, headless::Engine};
///
/// // Two spheres, an axis-aligned box, and a box that is turned by 45 degrees about y.
/// let spheres = Bounds::Spheres {
///     centers: Floats::F32(&[0.0, 0.0, -5.0, 1.0, 0.0, -20.0]),
///     radii: Floats::F32(&[0.5, 2.0]),
/// };
/// let (min, max) = (Floats::F64(&[-1.0, 0.0, -9.0]), Floats::F64(&[1.0, 3.0, -8.0]));
/// let boxes = Bounds::Boxes { min, max };
/// let h = std::f64::consts::FRAC_1_SQRT_2;
/// let turned = Bounds::OrientedBoxes {
///     centers: Floats::F64(&[0.0, 1.0, -7.0]),
///     half_sizes: Floats::F64(&[1.0, 1.0, 0.1]),
///     rotations: Floats::F64(&[h, 0.0, h, 0.0, 1.0, 0.0, -h, 0.0, h]),
/// };
///
/// # let engine = Engine::new(None)?;
/// let options = InstanceOptions::default();
/// assert_eq!(engine.instances(&spheres, &options)?.len(), 2);
/// assert_eq!(engine.instances(&boxes, &options)?.kind(), BoundsKind::Box);
/// assert_eq!(engine.instances(&turned, &options)?.kind(), BoundsKind::OrientedBox);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub enum Bounds<'a> {
    /// Spheres.
    Spheres {
        /// N centres, 3 scalars each.
        centers: Floats<'a>,
        /// N radii, >= 0.
        radii: Floats<'a>,
    },
    /// Axis-aligned boxes.
    Boxes {
        /// N least corners, 3 scalars each: x, y, z.
        min: Floats<'a>,
        /// N greatest corners, 3 scalars each, not below the least ones.
        max: Floats<'a>,
    },
    /// Oriented boxes: `center + A (h * u)` for u in `[-1, 1]^3`.
    ///
    /// `A` may be any finite 3x3 matrix, also a singular one.
    OrientedBoxes {
        /// N centres, 3 scalars each.
        centers: Floats<'a>,
        /// N half sizes h along the axes of the box, 3 scalars each, >= 0.
        half_sizes: Floats<'a>,
        /// N row-major matrices A, 9 scalars each.
        /// Column k is the world direction of axis k.
        rotations: Floats<'a>,
    },
    /// Points.
    ///
    /// A cull of points has a guard of half a pixel by default
    /// ([`CullOptions::guard_px`](crate::CullOptions::guard_px)).
    Points {
        /// N positions, 3 scalars each.
        positions: Floats<'a>,
    },
}

/// Which kind of volume bounds the instances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum BoundsKind {
    /// Spheres.
    Sphere,
    /// Axis-aligned boxes.
    Box,
    /// Oriented boxes.
    OrientedBox,
    /// Points whose positions float32 holds exactly.
    Point,
    /// Points of which a position needs two float32.
    WidePoint,
}

impl BoundsKind {
    /// Whether these are points, of either width.
    pub fn is_point(self) -> bool {
        matches!(self, Self::Point | Self::WidePoint)
    }

    /// Whether instances of this kind can hold bounds of the kind `other`.
    pub(crate) fn holds(self, other: Self) -> bool {
        self == other || (self == Self::WidePoint && other == Self::Point)
    }
}

impl<'a> Bounds<'a> {
    /// The kind of these volumes.
    ///
    /// Of float64 points it reads all positions: are they numbers of float32?
    pub fn kind(&self) -> BoundsKind {
        match self {
            Self::Spheres { .. } => BoundsKind::Sphere,
            Self::Boxes { .. } => BoundsKind::Box,
            Self::OrientedBoxes { .. } => BoundsKind::OrientedBox,
            Self::Points { positions: Floats::F32(_) } => BoundsKind::Point,
            Self::Points { positions: Floats::F64(numbers) } => {
                let is_wide = numbers.iter().any(|v| needs_two_halves(*v));
                if is_wide { BoundsKind::WidePoint } else { BoundsKind::Point }
            }
        }
    }

    /// The number of instances.
    ///
    /// # Errors
    /// [`Error::Invalid`] if the lengths of the arrays disagree.
    pub fn len(&self) -> Result<usize> {
        let (columns, first): (_, Floats<'_>) = match *self {
            Self::Spheres { centers, radii } => {
                (vec![("centers", centers, 3), ("radii", radii, 1)], centers)
            }
            Self::Boxes { min, max } => (vec![("min", min, 3), ("max", max, 3)], min),
            Self::OrientedBoxes { centers, half_sizes, rotations } => (
                vec![
                    ("centers", centers, 3),
                    ("half_sizes", half_sizes, 3),
                    ("rotations", rotations, 9),
                ],
                centers,
            ),
            Self::Points { positions } => (vec![("positions", positions, 3)], positions),
        };
        let n = first.len() / 3;
        for (name, array, width) in columns {
            if array.len() != n * width {
                return Err(Error::invalid(
                    name,
                    format!("expected {n} x {width} = {} numbers, got {}", n * width, array.len()),
                ));
            }
        }
        Ok(n)
    }

    /// The bounds of the instances of `range`.
    pub(crate) fn part(&self, range: &std::ops::Range<usize>) -> Self {
        let of =
            |array: &Floats<'a>, width: usize| array.part(width * range.start..width * range.end);
        match self {
            Self::Spheres { centers, radii } => {
                Self::Spheres { centers: of(centers, 3), radii: of(radii, 1) }
            }
            Self::Boxes { min, max } => Self::Boxes { min: of(min, 3), max: of(max, 3) },
            Self::OrientedBoxes { centers, half_sizes, rotations } => Self::OrientedBoxes {
                centers: of(centers, 3),
                half_sizes: of(half_sizes, 3),
                rotations: of(rotations, 9),
            },
            Self::Points { positions } => Self::Points { positions: of(positions, 3) },
        }
    }

    /// The points that these are, if they are spheres and all radii are 0.
    pub(crate) fn as_points(&self) -> Option<Self> {
        let Self::Spheres { centers, radii } = *self else { return None };
        let is_point = match radii {
            Floats::F32(radii) => radii.iter().all(|r| *r == 0.0),
            Floats::F64(radii) => radii.iter().all(|r| *r == 0.0),
        };
        is_point.then_some(Self::Points { positions: centers })
    }

    /// Whether there are no instances.
    ///
    /// # Errors
    /// Those of [`Bounds::len`].
    pub fn is_empty(&self) -> Result<bool> {
        Ok(self.len()? == 0)
    }
}
