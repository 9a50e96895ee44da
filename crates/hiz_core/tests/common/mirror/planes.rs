//! `supporting_planes.wgsl`: the certified planes in any arithmetic.
//! Their slopes and offsets are guessed or wild.

use super::guesses::{self, Candidate};
use super::volume::ratio_interval;
use super::{Arithmetic, Certificates, EPS, Margins, Value, View, two_to};

/// The four clip rows on a volume.
#[derive(Debug)]
pub(super) struct Projected {
    pub(super) x: Value,
    pub(super) y: Value,
    pub(super) z: Value,
    pub(super) w: Value,
    pub(super) w_min: f32,
}

/// `SupportingPlane`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    pub(super) slope: [f32; 2],
    pub(super) facing: f32,
    pub(super) offset: f32,
}

/// `SupportingPlanes`.
#[derive(Debug)]
pub(super) struct Planes {
    left_top: [f32; 2],
    right_bottom: [f32; 2],
    pub(super) list: Vec<Plane>,
}

const BEYOND: f32 = 65536.0;
const STEEPEST: f32 = 65536.0;

/// A slope that a wild device may guess: anything finite, near the right one or not.
fn wild_slope(guessed: f32, f: &mut Arithmetic) -> f32 {
    let unit = f.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0;
    match f.below(8) {
        0 => 0.0,
        1 => f32::from_bits(f.below(1 << 23)),
        2 => unit * 10.0_f32.powi(f.below(24) as i32 - 19),
        3 | 4 => guessed * (1.0 + unit * 0.1_f32.powi(1 + f.below(6) as i32)),
        _ => guessed,
    }
}

/// The comparison of `surely_clear` at a texel's corner.
/// It is `offset - slope . corner > bound` with a margin of `ulps` eps.
pub(super) fn surely_beyond(
    plane: &Plane,
    corner: [f32; 2],
    bound: f32,
    ulps: f32,
    f: &mut Arithmetic,
) -> bool {
    f.part();
    let fall = [0, 1].map(|k| f.mul(plane.slope[k], corner[k]));
    let mut size = f.add(plane.offset.abs(), fall[0].abs());
    size = f.add(size, fall[1].abs());
    size = f.add(size, bound.abs());
    let margin = f.mul_add(ulps * EPS, size, two_to(-100));
    f.part();
    f.difference(plane.offset, [(plane.slope[0], corner[0]), (plane.slope[1], corner[1])], margin)
        > bound
}

impl Certificates<'_> {
    /// The greatest `t` near `guess` at which `sign (r - t w) > 0` is certified.
    /// For `sign` -1 it is the least.
    /// `width` is the reach of the search.
    /// An offset is trusted no more than a slope is.
    /// So a wild one lies where the certificate is tightest.
    fn wild_offset(&mut self, sign: f32, r: &Value, w: &Value, guess: f32, width: f32) -> f32 {
        let (mut proved, mut open) = (guess, guess + sign * width);
        // Some searches go on until nothing but the margin's floor is left.
        let steps = if self.arithmetic.below(4) == 0 { 40 } else { 14 };
        for _ in 0..steps {
            let middle = 0.5 * (proved + open);
            if self.surely(sign, r, middle, w) { proved = middle } else { open = middle }
        }
        proved
    }

    /// `proved_interval`.
    fn proved_interval(&mut self, r: &Value, w: &Value, w_min: f32) -> [f32; 2] {
        let guess = ratio_interval(self.kind, r, w);
        let widest = guess[0].abs().max(guess[1].abs());
        let widened = 3.0 * self.error_bound(r, widest, w) / w_min;
        let mut low = (guess[0] - widened).clamp(-BEYOND, BEYOND);
        let mut high = (guess[1] + widened).clamp(-BEYOND, BEYOND);
        if self.arithmetic.style.wild && self.arithmetic.below(2) == 0 {
            low = self.wild_offset(1.0, r, w, low, 2.0 * widened + EPS);
            high = self.wild_offset(-1.0, r, w, high, 2.0 * widened + EPS);
        }
        [
            if self.surely_above(r, low, w) { low } else { -BEYOND },
            if self.surely_below(r, high, w) { high } else { BEYOND },
        ]
    }

    /// The row `facing z + slope . (x, y)`.
    fn tilted(&mut self, p: &Projected, facing: f32, slope: [f32; 2]) -> Value {
        let factors = [facing, slope[0], slope[1]];
        // Without a bar the slope's own quotient may be folded into the products.
        // The products then use another slope, a few roundings away.
        let mut on = |factors: [f32; 3], values: [f32; 3]| {
            self.arithmetic.part();
            let factors = if self.arithmetic.style.slope_bars {
                factors
            } else {
                factors.map(|v| {
                    (0..4).fold(v, |v, _| {
                        if self.arithmetic.below(2) == 0 { v.next_up() } else { v.next_down() }
                    })
                })
            };
            self.arithmetic.sum_of_products(factors, values, None)
        };
        let center = on(factors, [p.z.center, p.x.center, p.y.center]);
        let half = [0, 1, 2].map(|k| on(factors, [p.z.half[k], p.x.half[k], p.y.half[k]]));
        self.arithmetic.part();
        let errors = [p.z.error, p.x.error, p.y.error];
        let error =
            self.arithmetic.sum_of_products(factors.map(f32::abs), errors, Some(two_to(-70)));
        Value { center, error, half }
    }

    /// `supporting_planes`.
    pub(super) fn supporting_planes(&mut self, p: &Projected, reversed: bool) -> Planes {
        let columns = self.proved_interval(&p.x, &p.w, p.w_min);
        let rows = self.proved_interval(&p.y, &p.w, p.w_min);
        let mut list = Vec::new();
        let farther = if reversed { -1.0 } else { 1.0 };
        for i in 0..guesses::count(self.kind) {
            let guess = guesses::candidate(self.kind, i, p, farther);
            list.extend(self.supporting_plane(p, guess));
        }
        Planes { left_top: [columns[0], rows[0]], right_bottom: [columns[1], rows[1]], list }
    }

    fn supporting_plane(&mut self, p: &Projected, mut guess: Candidate) -> Option<Plane> {
        let wild = self.arithmetic.style.wild;
        if wild {
            guess.slope = guess.slope.map(|s| wild_slope(s, self.arithmetic));
        }
        // NaN is steep, too.
        if !guess.slope.iter().all(|s| s.abs() <= STEEPEST) {
            return None;
        }
        let mut slope = guess.slope.map(|s| if s.abs() >= self.margins.flattest { s } else { 0.0 });
        let mut r = self.tilted(p, guess.facing, slope);
        let interval = ratio_interval(self.kind, &r, &p.w);
        let extent = interval[1] - interval[0];
        let mut least = interval[0];
        let anything = wild && self.arithmetic.below(2) == 0;
        if !anything && !guesses::on_border(self.kind, &guess, least, extent) {
            if guess.facing != 0.0 || !guesses::on_border(self.kind, &guess, interval[1], extent) {
                return None;
            }
            slope = slope.map(|s| -s);
            r = r.signed(-1.0);
            least = -interval[1];
        }
        let error = self.error_bound(&r, least, &p.w);
        let mut offset = least - 3.0 * error / p.w_min;
        if wild && offset.is_finite() && self.arithmetic.below(4) != 0 {
            offset = self.wild_offset(1.0, &r, &p.w, offset, 6.0 * error / p.w_min);
        }
        let small = offset.abs() < two_to(60) && self.error_bound(&r, offset, &p.w) < two_to(38);
        (small && self.surely_above(&r, offset, &p.w)).then_some(Plane {
            slope,
            facing: guess.facing,
            offset,
        })
    }

    /// `surely_clear`; `depth` is the stored depth with its slack.
    pub(super) fn surely_clear(
        &mut self,
        planes: &Planes,
        begin: [u32; 2],
        end: [u32; 2],
        depth: f32,
        view: &View,
    ) -> bool {
        let Margins { texel, .. } = self.margins;
        let at = |k: usize| {
            let (begin, end) = (begin[k] as f32, end[k] as f32);
            let low = (begin - view.reach - view.half_size[k]).max(planes.left_top[k]);
            [low, (end + view.reach - view.half_size[k]).min(planes.right_bottom[k])]
        };
        let sides = [at(0), at(1)];
        self.arithmetic.part();
        let depth = self.arithmetic.sub(depth, view.z_slope);
        planes.list.iter().any(|plane| {
            let corner = [0, 1].map(|k| sides[k][usize::from(plane.slope[k] > 0.0)]);
            surely_beyond(plane, corner, plane.facing * depth, texel, self.arithmetic)
        })
    }
}
