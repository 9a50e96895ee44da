//! Bounds of instances, borrowed from the caller as flat arrays of float32 or float64.
//!
//! How they are validated and rounded is up to the room `instances`.

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
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::F32(v) => f64::from(v[i]),
            Self::F64(v) => v[i],
        }
    }

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

/// The bounds of N instances in world coordinates, borrowed from the caller.
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
}
