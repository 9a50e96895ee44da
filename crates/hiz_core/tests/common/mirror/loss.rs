//! How many eps the arithmetic really loses.
//! The claims of certificates and of a texel's comparison are compared with the same in float64.

use hiz_core::BoundsKind;
use hiz_ref::Volume as Exact;

use super::extent::Extent;
use super::planes::{Plane, Projected, surely_beyond};
use super::volume::Volume;
use super::{Arithmetic, Certificates, EPS, LEAST_W, Margins, Mirror, two_to};
use crate::campaign::Round;

/// The greatest loss, and the number of claims that it is taken over.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Loss {
    pub(crate) eps: f64,
    pub(crate) claims: usize,
}

impl Loss {
    pub(crate) fn add(&mut self, other: Self) {
        self.eps = self.eps.max(other.eps);
        self.claims += other.claims;
    }
}

/// The losses by kind of claim.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Losses {
    /// Of supporting planes.
    pub(crate) planes: Loss,
    /// Of a box's extent: `below` and `above`.
    pub(crate) extents: Loss,
    /// Of a box's least w.
    pub(crate) least_w: Loss,
}

impl Losses {
    pub(crate) fn add(&mut self, other: Self) {
        self.planes.add(other.planes);
        self.extents.add(other.extents);
        self.least_w.add(other.least_w);
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Mirror {
    /// The losses of certificates on the round's one volume.
    /// A loss is the margin minus what is left of it in float64.
    /// The arithmetic has to be a wild one.
    /// Only there are the supporting planes' offsets moved to where they just hold.
    pub(crate) fn losses(&self, round: &Round, arithmetic: &mut Arithmetic) -> Losses {
        let mut losses = Losses::default();
        let (kind, words) = &self.words[0];
        let view = &self.view;
        let Some(volume) = Volume::load(*kind, words, view, &Margins::FULL, arithmetic) else {
            return losses;
        };
        let mut c = Certificates { kind: *kind, margins: Margins::FULL, arithmetic };
        let [x, y, z, w] = [&view.x, &view.y, &view.z, &view.w].map(|row| c.value_of(row, &volume));
        let w_min = c.least_w(&w);
        if w_min.is_nan() || w_min <= LEAST_W {
            return losses;
        }
        let extents = [(x, 0), (y, 1)].map(|(r, k)| c.extent_of(&r, &w, view.half_size[k]));
        let planes = c.supporting_planes(&Projected { x, y, z, w, w_min }, self.reversed);
        let ulps = f64::from(Margins::FULL.certificate);
        let add = |loss: &mut Loss, plane: &Plane, spare: f32| {
            let [sx, sy] = plane.slope.map(f32::abs);
            let error = plane.facing.abs() * z.error
                + sx * x.error
                + sy * y.error
                + plane.offset.abs() * w.error;
            let unit = f64::from(error) / ulps;
            if let Some(left) =
                self.left(round, plane, 0.02 * unit).filter(|_| unit > f64::from(two_to(-50)))
            {
                loss.add(Loss { eps: ulps - (left + f64::from(spare)) / unit, claims: 1 });
            }
        };
        for plane in &planes.list {
            add(&mut losses.planes, plane, 0.0);
        }
        if *kind != BoundsKind::Sphere {
            for (k, Extent { low, high, below, above }) in extents.into_iter().enumerate() {
                for (sign, end, beyond) in [(1.0, low, below), (-1.0, high, above)] {
                    let mut slope = [0.0; 2];
                    slope[k] = sign;
                    // A bound that was clamped to 0 claims less than it has proved.
                    if beyond > 0.0 && end.is_finite() {
                        add(
                            &mut losses.extents,
                            &Plane { slope, facing: 0.0, offset: sign * end },
                            beyond,
                        );
                    }
                }
            }
            add(&mut losses.least_w, &Plane { slope: [0.0; 2], facing: 0.0, offset: -1.0 }, -w_min);
        }
        losses
    }

    /// The least of `facing Z' + slope . (X', Y') - offset W'` on the volume, in float64.
    /// `None` where that is off by more than `tolerance`.
    fn left(&self, round: &Round, plane: &Plane, tolerance: f64) -> Option<f64> {
        let (rows, origin) = (&round.view.rows, round.view.origin);
        // The rows that the shader reads are these times a power of two.
        let k =
            (0..4).max_by(|a, b| rows[3][*a].abs().total_cmp(&rows[3][*b].abs())).expect("four");
        let perspective = rows[3][..3].iter().any(|v| *v != 0.0);
        let k = if perspective && k == 3 {
            (0..3).max_by(|a, b| rows[3][*a].abs().total_cmp(&rows[3][*b].abs())).expect("three")
        } else {
            k
        };
        let scale = (f64::from(self.view.w.m[k]) / rows[3][k]).log2().round().exp2();
        let (facing, offset) = (f64::from(plane.facing), f64::from(plane.offset));
        let [sx, sy] = plane.slope.map(f64::from);
        let [half_width, half_height] = self.view.half_size.map(f64::from);
        let slope = f64::from(self.view.z_slope);
        let factors = [sx * half_width, -sy * half_height, facing, -(facing * slope + offset)]
            .map(|v| v * scale);
        let row: [f64; 4] = std::array::from_fn(|k| (0..4).map(|r| factors[r] * rows[r][k]).sum());
        let sizes: [f64; 4] =
            std::array::from_fn(|k| (0..4).map(|r| (factors[r] * rows[r][k]).abs()).sum());
        let linear = [row[0], row[1], row[2]];
        let about = |p: [f64; 3]| dot(linear, [0, 1, 2].map(|k| p[k] - origin[k])) + row[3];
        let far = |p: [f64; 3], h: f64| {
            (0..3).map(|k| sizes[k] * (p[k].abs() + origin[k].abs() + h)).sum::<f64>() + sizes[3]
        };
        let (least, magnitude) = match &round.volumes[0].1[0] {
            Exact::Sphere { center, radius } => {
                (about(*center) - radius * dot(linear, linear).sqrt(), far(*center, *radius))
            }
            Exact::Box { min, max } => {
                let center = [0, 1, 2].map(|k| 0.5 * (min[k] + max[k]));
                let half = [0, 1, 2].map(|k| 0.5 * (max[k] - min[k]));
                (
                    about(center) - dot(linear.map(f64::abs), half),
                    far(center, half[0] + half[1] + half[2]),
                )
            }
            Exact::OrientedBox { center, half_sizes, axes } => {
                let support =
                    |k: usize| (half_sizes[k] * dot(linear, axes.map(|row| row[k]))).abs();
                (
                    about(*center) - (0..3).map(support).sum::<f64>(),
                    far(*center, half_sizes.iter().sum()),
                )
            }
        };
        (16.0 * f64::EPSILON * magnitude < tolerance).then_some(least)
    }
}

/// The loss of a texel's comparison with a plane.
/// The terms are random and nearly cancel.
/// Offsets are moved to where the comparison just holds with 8 eps.
pub(crate) fn texel_loss(cases: usize, arithmetic: &mut Arithmetic) -> Loss {
    let mut loss = Loss::default();
    for _ in 0..cases {
        let mut any = |most: i32| {
            let unit = arithmetic.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0;
            unit * two_to(-(arithmetic.below(12) as i32)) * two_to(most)
        };
        let slope = [any(6), any(6)];
        let corner = [any(8), any(8)].map(|v| (v * 256.0).round() / 256.0);
        // `bound` is a depth minus z_slope, both float32.
        let (depth, z_slope) = (any(0).abs(), any(0));
        let exact = f64::from(depth) - f64::from(z_slope);
        let bound = arithmetic.sub(depth, z_slope);
        let falls = [0, 1].map(|k| f64::from(slope[k]) * f64::from(corner[k]));
        let near = falls[0] + falls[1] + exact;
        let size = near.abs() + falls[0].abs() + falls[1].abs() + exact.abs();
        let at = |s: f64| Plane {
            slope,
            facing: 1.0,
            offset: (near + s * f64::from(EPS) * size) as f32,
        };
        let (mut open, mut proved) = (0.0, 20.0);
        for _ in 0..10 {
            let middle = 0.5 * (open + proved);
            if surely_beyond(&at(middle), corner, bound, Margins::FULL.texel, arithmetic) {
                proved = middle;
            } else {
                open = middle;
            }
        }
        let plane = at(proved);
        if surely_beyond(&plane, corner, bound, Margins::FULL.texel, arithmetic) {
            let unit = f64::from(EPS)
                * (f64::from(plane.offset.abs()) + falls[0].abs() + falls[1].abs() + exact.abs());
            let left = f64::from(plane.offset) - near;
            loss.add(Loss { eps: f64::from(Margins::FULL.texel) - left / unit, claims: 1 });
        }
    }
    loss
}
