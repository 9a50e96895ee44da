//! `bounds_*.wgsl`: records, and what of them differs from kind to kind.

use hiz_core::BoundsKind;

use super::{Arithmetic, Value, View, two_to};

/// A volume about the reference point.
#[derive(Debug)]
pub(super) struct Volume {
    pub(super) center: [f32; 3],
    pub(super) reach: [f32; 3],
    /// Spheres: the radius on each axis.
    half_axes: [[f32; 3]; 3],
    kind: BoundsKind,
}

impl Volume {
    /// `load_volume`; nothing where it is not valid.
    pub(super) fn load(kind: BoundsKind, record: &[u32], view: &View, f: &mut Arithmetic) -> Option<Self> {
        let three = |i: usize| [0, 1, 2].map(|k| f32::from_bits(record[i + k]));
        let one = |i: usize| f32::from_bits(record[i]);
        let diagonal = |h: [f32; 3]| [[h[0], 0.0, 0.0], [0.0, h[1], 0.0], [0.0, 0.0, h[2]]];
        let (hi, lo) = (three(0), three(4));
        let half_axes = match kind {
            BoundsKind::Sphere => diagonal([one(3); 3]),
            BoundsKind::Box => diagonal(three(8)),
            BoundsKind::OrientedBox => [three(8), three(12), [one(3), one(7), one(11)]],
        };
        let numbers = [hi, lo].into_iter().chain(half_axes).flatten();
        let sizes_valid = kind == BoundsKind::OrientedBox || (0..3).all(|k| half_axes[k][k] >= 0.0);
        if !sizes_valid || numbers.into_iter().any(|v| v.is_nan() || v.abs() >= two_to(60)) {
            return None;
        }
        let mut d_hi = [0.0; 3];
        let mut d_lo = [0.0; 3];
        let mut center = [0.0; 3];
        let mut reach = [0.0; 3];
        for k in 0..3 {
            f.part();
            d_hi[k] = f.sub(hi[k], view.eye_hi[k]);
            d_lo[k] = f.sub(lo[k], view.eye_lo[k]);
            center[k] = f.add(d_hi[k], d_lo[k]);
            let half = match kind {
                BoundsKind::OrientedBox => f.sum([0, 1, 2].map(|e| half_axes[e][k].abs())),
                BoundsKind::Sphere | BoundsKind::Box => half_axes[k][k],
            };
            f.part();
            let sum = f.sum([d_hi[k].abs(), d_lo[k].abs(), half]);
            reach[k] = f.mul_add(two_to(-24), hi[k].abs(), sum);
        }
        reach.iter().all(|r| *r < view.coordinate_limit).then_some(Self { center, reach, half_axes, kind })
    }

    /// `on_half_axes`.
    pub(super) fn on_half_axes(&self, m: [f32; 3], f: &mut Arithmetic) -> [f32; 3] {
        [0, 1, 2].map(|k| match self.kind {
            BoundsKind::OrientedBox => f.sum_of_products(m, self.half_axes[k], None),
            BoundsKind::Sphere | BoundsKind::Box => f.mul(m[k], self.half_axes[k][k]),
        })
    }
}

/// `ratio_interval`: an estimate, so float64 is as good as anything.
pub(super) fn ratio_interval(kind: BoundsKind, r: &Value, w: &Value) -> [f32; 2] {
    let wide = |v: &Value| (f64::from(v.center), v.half.map(f64::from));
    let ((r, r_half), (w, w_half)) = (wide(r), wide(w));
    let [from, to] = if kind == BoundsKind::Sphere {
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let n = w_half.map(|v| v / w);
        let t = r / w;
        let g = [0, 1, 2].map(|k| (r_half[k] - t * w_half[k]) / w);
        let q = (1.0 - dot(n, n)).max(1e-30);
        let p = dot(g, n);
        let m = (p.abs() + (p * p + q * dot(g, g)).sqrt()).max(1e-30);
        let (small, large) = (dot(g, g) / m, m / q);
        if p > 0.0 { [t - large, t + small] } else { [t - small, t + large] }
    } else {
        let mut interval = [f64::INFINITY, f64::NEG_INFINITY];
        for corner in 0..8 {
            let signs = [1, 2, 4].map(|bit| if corner & bit == 0 { -1.0 } else { 1.0 });
            let at = |middle: f64, half: [f64; 3]| middle + (0..3).map(|k| signs[k] * half[k]).sum::<f64>();
            let ratio = at(r, r_half) / at(w, w_half);
            interval = [interval[0].min(ratio), interval[1].max(ratio)];
        }
        interval
    };
    [from as f32, to as f32]
}
