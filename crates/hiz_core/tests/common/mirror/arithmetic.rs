//! float32 `+ - *` in every way that WGSL permits:
//!
//! - a result may be either neighbour of the exact one;
//! - a product and a sum may be fused;
//! - sums may be taken in any order;
//! - subnormals may be flushed.

use crate::common::Random;

/// Which neighbour an inexact result is rounded to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rounding {
    /// To nearest, ties to even, as hardware does.
    Nearest,
    /// The greater one.
    Up,
    /// The lesser one.
    Down,
    /// Either, drawn for each operation.
    Either,
    /// Either, drawn for each *part* of the computation.
    /// The losses of a part then add up, as the margin has to assume.
    EitherByPart,
}

/// What a compiler does to the operations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Style {
    pub(crate) name: &'static str,
    pub(crate) rounding: Rounding,
    /// Fuse products into sums: in 1 of `n` places at random, everywhere for 1, nowhere for 0.
    pub(crate) fused: u32,
    /// Take sums in any order.
    pub(crate) reassociated: bool,
    /// Flush subnormals to 0: in 1 of `n` operations at random, in all for 1, in none for 0.
    pub(crate) flushed: u32,
    /// The rectangle is arbitrary, and so are the slopes and offsets of a volume fit.
    /// They only choose what is certified, so no verdict may depend on them.
    pub(crate) wild: bool,
    /// `bar` and `bar3` stop the compiler from folding a cancelling difference into its operands.
    pub(crate) bars: bool,
    /// `bar2` stops it from folding a slope's quotient into the products with that slope.
    pub(crate) slope_bars: bool,
    /// At the frustum's planes the margin is subtracted before the second product.
    pub(crate) margin_first: bool,
}

const PLAIN: Style = Style {
    name: "nearest",
    rounding: Rounding::Nearest,
    fused: 0,
    reassociated: false,
    flushed: 0,
    wild: false,
    bars: true,
    slope_bars: true,
    margin_first: false,
};

/// The code that lavapipe's compiler makes of the plain style.
pub(crate) const MARGIN_FIRST: Style =
    Style { name: "nearest, margin first", margin_first: true, ..PLAIN };

/// What reassociation may do where no bar stops it.
/// The margin does not cover this style.
pub(crate) const WITHOUT_BARS: Style = Style { name: "no bars", bars: false, ..PLAIN };

/// The first is the plain one.
pub(crate) const STYLES: [Style; 14] = [
    PLAIN,
    Style { name: "up", rounding: Rounding::Up, ..PLAIN },
    Style { name: "down", rounding: Rounding::Down, ..PLAIN },
    Style { name: "up or down", rounding: Rounding::Either, ..PLAIN },
    Style { name: "up or down by part", rounding: Rounding::EitherByPart, ..PLAIN },
    Style { name: "fused", fused: 1, ..PLAIN },
    Style { name: "reassociated", reassociated: true, ..PLAIN },
    Style { name: "flushed", flushed: 1, ..PLAIN },
    Style { name: "fused, up", fused: 1, rounding: Rounding::Up, ..PLAIN },
    Style { name: "fused, down", fused: 1, rounding: Rounding::Down, ..PLAIN },
    Style {
        name: "all, up or down",
        rounding: Rounding::Either,
        fused: 2,
        reassociated: true,
        flushed: 1,
        ..PLAIN
    },
    Style {
        name: "all, by part",
        rounding: Rounding::EitherByPart,
        fused: 2,
        reassociated: true,
        flushed: 1,
        ..PLAIN
    },
    Style { name: "wild guesses", wild: true, ..PLAIN },
    Style { name: "wild, by part", wild: true, rounding: Rounding::EitherByPart, ..PLAIN },
];

/// The float32 arithmetic of one device.
#[derive(Debug)]
pub(crate) struct Arithmetic {
    pub(crate) style: Style,
    random: Random,
    up: bool,
}

impl Arithmetic {
    pub(crate) fn new(style: Style, seed: u64) -> Self {
        let mut random = Random(seed);
        let up = random.below(2) == 0;
        Self { style, random, up }
    }

    /// Begins another part of the computation.
    pub(crate) fn part(&mut self) {
        if self.style.rounding == Rounding::EitherByPart {
            self.up = self.random.below(2) == 0;
        }
    }

    /// Uniform in 0..n, for random choices outside the arithmetic.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        self.random.below(n)
    }

    fn flush(&mut self, v: f32) -> f32 {
        let n = self.style.flushed;
        let flushes = n != 0 && v.is_subnormal() && (n == 1 || self.random.below(n) == 0);
        if flushes { 0.0 } else { v }
    }

    /// The float32 that the exact number `value + rest` is rounded to.
    /// `nearest` is the result of rounding to nearest.
    fn rounded(&mut self, value: f64, rest: f64, nearest: f32) -> f32 {
        // Exact: `nearest` is within half a spacing of `value`.
        // So the sign of the sum is the sign of the error.
        let error = (value - f64::from(nearest)) + rest;
        let up = match self.style.rounding {
            Rounding::Nearest => return self.flush(nearest),
            _ if error == 0.0 => return self.flush(nearest),
            Rounding::Up => true,
            Rounding::Down => false,
            Rounding::Either => self.random.below(2) == 0,
            Rounding::EitherByPart => self.up,
        };
        let result = match (up, error > 0.0) {
            (true, true) => nearest.next_up(),
            (false, false) => nearest.next_down(),
            _ => nearest,
        };
        self.flush(result)
    }

    pub(crate) fn add(&mut self, a: f32, b: f32) -> f32 {
        let (a, b) = (self.flush(a), self.flush(b));
        let (sum, rest) = two_sum(f64::from(a), f64::from(b));
        self.rounded(sum, rest, a + b)
    }

    pub(crate) fn sub(&mut self, a: f32, b: f32) -> f32 {
        self.add(a, -b)
    }

    pub(crate) fn mul(&mut self, a: f32, b: f32) -> f32 {
        let (a, b) = (self.flush(a), self.flush(b));
        self.rounded(f64::from(a) * f64::from(b), 0.0, a * b)
    }

    /// `a b + c`, fused or not.
    pub(crate) fn mul_add(&mut self, a: f32, b: f32, c: f32) -> f32 {
        if self.style.fused == 0 || self.random.below(self.style.fused) != 0 {
            let product = self.mul(a, b);
            return self.add(product, c);
        }
        let (a, b, c) = (self.flush(a), self.flush(b), self.flush(c));
        let (sum, rest) = two_sum(f64::from(a) * f64::from(b), f64::from(c));
        self.rounded(sum, rest, a.mul_add(b, c))
    }

    /// The sum of the products and of the rest, in the order written or in any other.
    pub(crate) fn sum_of_products(&mut self, a: [f32; 3], b: [f32; 3], rest: Option<f32>) -> f32 {
        let mut order = [0, 1, 2];
        if self.style.reassociated {
            order.swap(0, self.random.below(3) as usize);
            order.swap(1, 1 + self.random.below(2) as usize);
        }
        let [i, j, k] = order;
        let early = self.style.reassociated && self.random.below(2) == 0;
        let mut sum = match rest {
            Some(rest) if early => self.mul_add(a[i], b[i], rest),
            _ => self.mul(a[i], b[i]),
        };
        for n in [j, k] {
            sum = self.mul_add(a[n], b[n], sum);
        }
        match rest {
            Some(rest) if !early => self.add(sum, rest),
            _ => sum,
        }
    }

    /// `from` minus two products and `margin`, in the order written or in any other.
    pub(crate) fn difference(&mut self, from: f32, products: [(f32, f32); 2], margin: f32) -> f32 {
        let [(a, b), (c, d)] = products;
        // All terms are products; those with 1 are exact, fused or not.
        let mut terms = [(from, 1.0), (-a, b), (-c, d), (-margin, 1.0)];
        if self.style.reassociated {
            (0..3).for_each(|k| terms.swap(k, k + self.random.below(4 - k as u32) as usize));
        }
        let first = self.mul(terms[0].0, terms[0].1);
        terms[1..].iter().fold(first, |sum, (a, b)| self.mul_add(*a, *b, sum))
    }

    /// Whether the sums of one expression are taken as a single sum in any order.
    /// Half of the time where that is permitted.
    pub(crate) fn takes_any_order(&mut self) -> bool {
        self.style.reassociated && self.random.below(2) == 0
    }

    /// The sum of products, in any order.
    pub(crate) fn sum_in_any_order<const N: usize>(&mut self, mut terms: [(f32, f32); N]) -> f32 {
        (0..N - 1).for_each(|k| terms.swap(k, k + self.random.below((N - k) as u32) as usize));
        // All terms are products; those with 1 are exact, fused or not.
        let first = self.mul(terms[0].0, terms[0].1);
        terms[1..].iter().fold(first, |sum, (a, b)| self.mul_add(*a, *b, sum))
    }

    pub(crate) fn sum(&mut self, mut v: [f32; 3]) -> f32 {
        if self.style.reassociated {
            v.swap(0, self.random.below(3) as usize);
        }
        let sum = self.add(v[0], v[1]);
        self.add(sum, v[2])
    }
}

/// What a volume fit has to withstand besides [`STYLES`].
/// Subnormals are flushed in one place and not in another.
pub(crate) const WILDEST: Style = Style {
    name: "all, wild",
    rounding: Rounding::EitherByPart,
    fused: 2,
    reassociated: true,
    flushed: 2,
    wild: true,
    ..PLAIN
};

/// The same, where the slopes that are certified differ from those that are compared with.
pub(crate) const WITHOUT_SLOPE_BARS: Style =
    Style { name: "no bars at slopes", slope_bars: false, ..WILDEST };

/// Knuth's two-sum: the float64 sum and its exact error.
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let bb = sum - a;
    (sum, (a - (sum - bb)) + (b - bb))
}
