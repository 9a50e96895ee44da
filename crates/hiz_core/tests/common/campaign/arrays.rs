//! Volumes as the flat arrays that the engine takes.

use hiz_core::{Bounds, BoundsKind, Floats};
use hiz_ref::Volume;

#[derive(Debug, Default)]
pub(crate) struct Arrays {
    a: Vec<f64>,
    b: Vec<f64>,
    c: Vec<f64>,
}

impl Arrays {
    pub(crate) fn new(volumes: &[Volume]) -> Self {
        let mut arrays = Self::default();
        for volume in volumes {
            match volume {
                Volume::Sphere { center, radius } => {
                    arrays.a.extend(center);
                    arrays.b.push(*radius);
                }
                Volume::Box { min, max } => {
                    arrays.a.extend(min);
                    arrays.b.extend(max);
                }
                Volume::OrientedBox { center, half_sizes, axes } => {
                    arrays.a.extend(center);
                    arrays.b.extend(half_sizes);
                    arrays.c.extend(axes.as_flattened());
                }
            }
        }
        arrays
    }

    pub(crate) fn bounds(&self, kind: BoundsKind) -> Bounds<'_> {
        let (a, b, c) = (Floats::F64(&self.a), Floats::F64(&self.b), Floats::F64(&self.c));
        match kind {
            BoundsKind::Sphere => Bounds::Spheres { centers: a, radii: b },
            BoundsKind::Point | BoundsKind::WidePoint => Bounds::Points { positions: a },
            BoundsKind::Box => Bounds::Boxes { min: a, max: b },
            BoundsKind::OrientedBox => {
                Bounds::OrientedBoxes { centers: a, half_sizes: b, rotations: c }
            }
        }
    }
}
