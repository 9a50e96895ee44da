//! `bounds_*.wgsl`: the records, and what differs between kinds of bounds.

use hiz_core::BoundsKind;

use super::{Arithmetic, Margins, Value, View};

/// A volume relative to the reference point.
#[derive(Debug)]
pub(super) struct Volume {
    pub(super) center: [f32; 3],
    pub(super) size: f32,
    /// For spheres: the radius on each axis.
    pub(super) half_axes: [[f32; 3]; 3],
    pub(super) kind: BoundsKind,
}

impl Volume {
    /// `load_volume`; `None` where the bounds are invalid.
    pub(super) fn load(
        kind: BoundsKind,
        record: &[u32],
        view: &View,
        margins: &Margins,
        f: &mut Arithmetic,
    ) -> Option<Self> {
        let three = |i: usize| [0, 1, 2].map(|k| f32::from_bits(record[i + k]));
        let one = |i: usize| f32::from_bits(record[i]);
        let diagonal = |h: [f32; 3]| [[h[0], 0.0, 0.0], [0.0, h[1], 0.0], [0.0, 0.0, h[2]]];
        // A point whose position is one float32 has no second half.
        let lo = if kind == BoundsKind::Point { [0.0; 3] } else { three(4) };
        let hi = three(0);
        let half_axes = match kind {
            BoundsKind::Sphere => diagonal([one(3); 3]),
            BoundsKind::Box => diagonal(three(8)),
            BoundsKind::OrientedBox => [three(8), three(12), [one(3), one(7), one(11)]],
            BoundsKind::Point | BoundsKind::WidePoint => [[0.0; 3]; 3],
        };
        let mut d_hi = [0.0; 3];
        let mut center = [0.0; 3];
        for k in 0..3 {
            f.part();
            d_hi[k] = f.sub(hi[k], view.eye_hi[k]);
            let d_lo = f.sub(lo[k], view.eye_lo[k]);
            center[k] = if f.style.bars {
                f.add(d_hi[k], d_lo)
            } else {
                let (p, eye) = (f.add(hi[k], lo[k]), f.add(view.eye_hi[k], view.eye_lo[k]));
                f.sub(p, eye)
            };
        }
        f.part();
        let own = match kind {
            BoundsKind::Sphere => f.mul(3.0, one(3)),
            BoundsKind::Box => f.sum(three(8)),
            BoundsKind::OrientedBox => {
                let sums = half_axes.map(|e| f.sum(e.map(f32::abs)));
                f.sum(sums)
            }
            BoundsKind::Point | BoundsKind::WidePoint => 0.0,
        };
        f.part();
        let distance = f.sum(d_hi.map(f32::abs));
        let rest = f.add(margins.own * own, view.halves_size);
        let size = f.add(distance, rest);
        (size < view.coordinate_limit).then_some(Self { center, size, half_axes, kind })
    }

    /// `on_half_axes`.
    pub(super) fn on_half_axes(&self, m: [f32; 3], f: &mut Arithmetic) -> [f32; 3] {
        [0, 1, 2].map(|k| match self.kind {
            BoundsKind::OrientedBox => f.sum_of_products(m, self.half_axes[k], None),
            _ => f.mul(m[k], self.half_axes[k][k]),
        })
    }
}

/// `ratio_interval`: an estimate that no proof relies on.
/// So plain float32 will do in every style.
pub(super) fn ratio_interval(kind: BoundsKind, r: &Value, w: &Value) -> [f32; 2] {
    if kind == BoundsKind::Sphere {
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let n = w.half.map(|v| v / w.center);
        let q = (1.0 - dot(n, n)).max(1e-30);
        let t = r.center / w.center;
        let g = [0, 1, 2].map(|k| (r.half[k] - t * w.half[k]) / w.center);
        let gg = dot(g, g);
        let p = dot(g, n);
        let m = (p.abs() + (p * p + q * gg).sqrt()).max(1e-30);
        let (small, large) = (gg / m, m / q);
        return if p > 0.0 { [t - large, t + small] } else { [t - small, t + large] };
    }
    let mut interval = [f32::INFINITY, f32::NEG_INFINITY];
    for (y, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let face = |v: &Value| v.center + y * v.half[1] + z * v.half[2];
        for x in [1.0, -1.0] {
            let ratio = (face(r) + x * r.half[0]) / (face(w) + x * w.half[0]);
            interval = [interval[0].min(ratio), interval[1].max(ratio)];
        }
    }
    interval
}
