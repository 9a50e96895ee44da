//! `extent_of` and what it certifies (`bounds_box_support.wgsl`, `bounds_sphere.wgsl`).
//! The ends of a box's extent may be anything, because the proof holds for any ends.

use hiz_core::BoundsKind;

use super::volume::ratio_interval;
use super::{Arithmetic, Certificates, Value, dot};

/// `Extent`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) low: f32,
    pub(super) high: f32,
    pub(super) below: f32,
    pub(super) above: f32,
}

/// An end that a wild device may take for the least or greatest ratio.
/// It is near the right one or anywhere in the image.
fn wild_end(end: f32, half_size: f32, f: &mut Arithmetic) -> f32 {
    let unit = f.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0;
    let small = 0.1_f32.powi(1 + f.below(7) as i32);
    match f.below(8) {
        0 => unit * 1.2 * half_size,
        // A pixel's border, and a hair beside it.
        1 => (unit * half_size).floor() + half_size.fract() + small * unit,
        2 | 3 => end * (1.0 + unit * small),
        4 | 5 => end + unit * small,
        _ => end,
    }
}

impl Certificates<'_> {
    /// `w_min`: a lower bound of w for boxes, an estimate for spheres.
    pub(super) fn least_w(&mut self, w: &Value) -> f32 {
        self.arithmetic.part();
        let support = self.support(w.half);
        if self.arithmetic.takes_any_order() {
            return self.arithmetic.sum_in_any_order([
                (w.center, 1.0),
                (-support, 1.0),
                (-w.error, 1.0),
            ]);
        }
        let least = self.arithmetic.sub(w.center, support);
        self.arithmetic.sub(least, w.error)
    }

    /// `extent_of`, along an axis with `half_size` pixels on each side of the image's middle.
    pub(super) fn extent_of(&mut self, r: &Value, w: &Value, half_size: f32) -> Extent {
        if self.kind == BoundsKind::Sphere {
            let [low, high] = ratio_interval(self.kind, r, w);
            let (below, above) = (self.error_bound(r, low, w), self.error_bound(r, high, w));
            return Extent { low, high, below, above };
        }
        let ratio = r.center / w.center;
        let toward =
            [0, 1, 2].map(|k| if r.half[k] - ratio * w.half[k] >= 0.0 { 1.0 } else { -1.0 });
        let (r_half, w_half) = (dot(toward, r.half), dot(toward, w.half));
        let mut low = (r.center - r_half) / (w.center - w_half);
        let mut high = (r.center + r_half) / (w.center + w_half);
        if self.arithmetic.style.wild {
            low = wild_end(low, half_size, self.arithmetic);
            high = wild_end(high, half_size, self.arithmetic);
        }
        let (below, above) = (self.beyond(1.0, r, low, w), self.beyond(-1.0, r, high, w));
        Extent { low, high, below, above }
    }

    /// `below` for the end `t` and the sign 1, `above` for the sign -1.
    /// On the whole volume `sign (r - t w)` is at least the negative of it.
    fn beyond(&mut self, sign: f32, r: &Value, t: f32, w: &Value) -> f32 {
        self.arithmetic.part();
        let half = [0, 1, 2].map(|k| self.arithmetic.mul_add(-t, w.half[k], r.half[k]));
        let support = self.support(half);
        self.arithmetic.part();
        let beyond = if self.arithmetic.takes_any_order() {
            let terms = [
                (support, 1.0),
                (-sign * r.center, 1.0),
                (sign * t, w.center),
                (r.error, 1.0),
                (t.abs(), w.error),
            ];
            self.arithmetic.sum_in_any_order(terms)
        } else {
            let difference = self.arithmetic.mul_add(-t, w.center, r.center);
            self.arithmetic.part();
            let sum = self.arithmetic.add(support, -sign * difference);
            let error = self.error_bound(r, t, w);
            self.arithmetic.add(sum, error)
        };
        if self.margins.clamped { beyond.max(0.0) } else { beyond }
    }

    /// `surely_after`; `edge` is exact in any arithmetic.
    pub(super) fn surely_after(
        &mut self,
        r: &Value,
        w: &Value,
        extent: &Extent,
        edge: f32,
        w_min: f32,
    ) -> bool {
        if self.kind == BoundsKind::Sphere {
            return self.surely_above(r, edge, w);
        }
        self.arithmetic.part();
        let beyond = self.arithmetic.sub(extent.low, edge);
        self.arithmetic.mul(beyond, w_min) > extent.below
    }

    /// `surely_before`.
    pub(super) fn surely_before(
        &mut self,
        r: &Value,
        w: &Value,
        extent: &Extent,
        edge: f32,
        w_min: f32,
    ) -> bool {
        if self.kind == BoundsKind::Sphere {
            return self.surely_below(r, edge, w);
        }
        self.arithmetic.part();
        let beyond = self.arithmetic.sub(edge, extent.high);
        self.arithmetic.mul(beyond, w_min) > extent.above
    }
}
