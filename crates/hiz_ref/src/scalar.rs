//! The arithmetic in which every decision is written: numbers with a known or an open sign.
//!
//! A decision of this crate is the sign of a polynomial in the inputs.
//! It is written once, over [`Scalar`], and runs in up to two arithmetics:
//!
//! - [`Ball`]: float64 with a bound of its own error, which nearly always suffices.
//! - [`Dyadic`](crate::dyadic::Dyadic): exact, if a ball leaves the sign open.

use std::cmp::Ordering;

/// A number with ring operations, whose sign may be unknown.
///
/// There is no division: every test is multiplied out instead.
/// So the dyadic fractions, to which every float64 belongs, are closed under all operations here.
pub(crate) trait Scalar: Clone {
    /// The number that a finite float64 denotes, exactly.
    fn exact(value: f64) -> Self;
    fn plus(&self, other: &Self) -> Self;
    fn minus(&self, other: &Self) -> Self;
    fn times(&self, other: &Self) -> Self;
    fn negated(&self) -> Self;
    /// The sign of the true value, or `None` if it is open.
    fn sign(&self) -> Option<Ordering>;

    /// The absolute value.
    /// A ball around 0 may keep its centre's sign, because it still contains the true absolute
    /// value.
    fn magnitude(&self) -> Self;

    fn is_zero(&self) -> bool {
        self.sign() == Some(Ordering::Equal)
    }
}

/// Half an ulp of a number in [1, 2): the relative error of one rounded operation.
const UNIT: f64 = f64::EPSILON / 2.0;
/// Covers the at most nine roundings in the computation of an error bound.
/// That is, `(1 - UNIT)^9 * GROW > 1`.
const GROW: f64 = 1.0 + 8.0 * f64::EPSILON;

/// A float64 and a bound of its distance from the true value.
/// The true value lies in `[mid - err, mid + err]`.
///
/// Overflow gives an infinite or NaN bound, which decides nothing.
/// A bound of 0 means that `mid` is the true value.
/// Exact zeros stay exact, because the coefficients of axis-aligned views and boxes contain many of
/// them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    pub(crate) mid: f64,
    err: f64,
}

impl Ball {
    const ZERO: Ball = Ball { mid: 0.0, err: 0.0 };

    /// The ball of the numbers within `err` of `mid`.
    pub(crate) fn around(mid: f64, err: f64) -> Ball {
        Ball { mid, err }
    }

    /// Whether its error is small relative to its centre: at most 1e-6 of it.
    pub(crate) fn is_tight(self) -> bool {
        self.err <= self.mid.abs() * 1e-6
    }

    /// A ball that contains every quotient of a number of this ball and one of `other`.
    /// It contains every number if `other` may be 0.
    pub(crate) fn divided_by(self, other: Ball) -> Ball {
        let least = other.mid.abs() - other.err;
        if least.is_nan() || least <= 0.0 {
            return Ball { mid: 0.0, err: f64::INFINITY };
        }
        let mid = self.mid / other.mid;
        // a'/b' - a/b = ((a' - a) - (a/b) (b' - b)) / b', with the division's own rounding counted
        // twice.
        let err = ((self.err + mid.abs() * (other.err + 2.0 * UNIT * other.mid.abs())) / least
            + UNIT * mid.abs()
            + f64::MIN_POSITIVE)
            * (GROW * GROW);
        Ball { mid, err }
    }

    /// The bound of the distance from `mid` to the true value.
    pub(crate) fn err(self) -> f64 {
        self.err
    }

    /// A ball that contains the square roots of this ball's numbers that are not negative.
    pub(crate) fn square_root(self) -> Ball {
        // Each end is moved outwards by more than the rounding of its sum and of its root.
        let low = ((self.mid - self.err) * (1.0 - 4.0 * UNIT)).max(0.0).sqrt() * (1.0 - 2.0 * UNIT);
        let high = ((self.mid + self.err) * (1.0 + 4.0 * UNIT)).sqrt() * (1.0 + 4.0 * UNIT);
        let mid = low.midpoint(high);
        Ball { mid, err: ((high - low) * 0.5 + UNIT * mid + f64::MIN_POSITIVE) * GROW }
    }

    fn is_exact_zero(self) -> bool {
        self.mid == 0.0 && self.err == 0.0
    }
}

impl Scalar for Ball {
    fn exact(value: f64) -> Self {
        Ball { mid: value, err: 0.0 }
    }

    fn plus(&self, other: &Self) -> Self {
        if self.is_exact_zero() {
            return *other;
        }
        if other.is_exact_zero() {
            return *self;
        }
        let mid = self.mid + other.mid;
        // Half an ulp of the sum is at most UNIT |mid|.
        // That holds among the subnormals too, where sums are exact.
        let err = (self.err + other.err + UNIT * mid.abs()) * GROW;
        Ball { mid, err }
    }

    fn minus(&self, other: &Self) -> Self {
        self.plus(&other.negated())
    }

    fn times(&self, other: &Self) -> Self {
        if self.is_exact_zero() || other.is_exact_zero() {
            return Ball::ZERO;
        }
        let mid = self.mid * other.mid;
        // MIN_POSITIVE covers what the four products lose if they underflow (2^-1075 each).
        let err = (self.mid.abs() * other.err
            + other.mid.abs() * self.err
            + self.err * other.err
            + UNIT * mid.abs()
            + f64::MIN_POSITIVE)
            * GROW;
        Ball { mid, err }
    }

    fn negated(&self) -> Self {
        Ball { mid: -self.mid, err: self.err }
    }

    fn sign(&self) -> Option<Ordering> {
        // Every comparison with NaN is false, so an overflow ends in `None`.
        if self.mid > self.err {
            Some(Ordering::Greater)
        } else if self.mid < -self.err {
            Some(Ordering::Less)
        } else if self.is_exact_zero() {
            Some(Ordering::Equal)
        } else {
            None
        }
    }

    fn magnitude(&self) -> Self {
        Ball { mid: self.mid.abs(), err: self.err }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dyadic::Dyadic;
    use proptest::prelude::*;

    /// Whether the ball contains the exact value.
    fn contains(ball: Ball, truth: &Dyadic) -> bool {
        if !(ball.mid.is_finite() && ball.err.is_finite()) {
            return true;
        }
        let off = truth.minus(&Dyadic::exact(ball.mid)).magnitude();
        off.minus(&Dyadic::exact(ball.err)).sign() != Some(Ordering::Greater)
    }

    fn run<S: Scalar>(inputs: &[f64], program: &[(u8, usize, usize)]) -> Vec<S> {
        let mut values: Vec<S> = inputs.iter().map(|&x| S::exact(x)).collect();
        for &(op, a, b) in program {
            let (a, b) = (&values[a % values.len()], &values[b % values.len()]);
            values.push(match op % 5 {
                0 => a.plus(b),
                1 => a.minus(b),
                2 => a.times(b),
                3 => a.negated(),
                _ => a.magnitude(),
            });
        }
        values
    }

    proptest! {
        /// A quotient is checked by multiplying it back: `|mid b - a| <= err |b|` for the ends a
        /// and b of both balls.
        #[test]
        fn quotients_are_contained(a in -9.0f64..9.0, b in -9.0f64..9.0, fuzz in 0.0f64..1.0) {
            let (x, y) = (Ball { mid: a, err: fuzz * 1e-3 }, Ball { mid: b, err: fuzz * fuzz });
            let quotient = x.divided_by(y);
            prop_assume!(quotient.err.is_finite());
            for (a, b) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
                let end = |ball: Ball, sign: f64| Dyadic::exact(ball.mid).plus(&Dyadic::exact(sign * ball.err));
                let (a, b) = (end(x, a), end(y, b));
                let off = Dyadic::exact(quotient.mid).times(&b).minus(&a).magnitude();
                let room = Dyadic::exact(quotient.err).times(&b.magnitude());
                prop_assert_ne!(off.minus(&room).sign(), Some(Ordering::Greater));
            }
        }

        /// Random straight-line programs, with extreme exponents and subnormals.
        #[test]
        fn a_ball_contains_the_exact_value(
            inputs in prop::collection::vec(prop_oneof![
                any::<f64>().prop_filter("finite", |x| x.is_finite()),
                -4.0f64..4.0,
                (-8i32..8).prop_map(f64::from),
                (1u64..1 << 60).prop_map(f64::from_bits),
            ], 1..5),
            program in prop::collection::vec((any::<u8>(), any::<usize>(), any::<usize>()), 1..9),
        ) {
            let balls = run::<Ball>(&inputs, &program);
            let truths = run::<Dyadic>(&inputs, &program);
            for (ball, truth) in balls.iter().zip(&truths) {
                prop_assert!(contains(*ball, truth), "{ball:?} {truth:?}");
                if let Some(sign) = ball.sign() {
                    prop_assert_eq!(Some(sign), truth.sign());
                }
            }
        }
    }

    #[test]
    fn an_open_sign_is_reported_as_open() {
        // (1 + e)^2 and 1 + 2e differ by e^2, which float64 cannot resolve.
        let e = f64::EPSILON;
        let square = Ball::exact(1.0 + e).times(&Ball::exact(1.0 + e));
        assert_eq!(square.minus(&Ball::exact(1.0 + 2.0 * e)).sign(), None);
        assert_eq!(square.minus(&Ball::exact(1.0 + 4.0 * e)).sign(), Some(Ordering::Less));
        let huge = Ball::exact(f64::MAX).times(&Ball::exact(4.0));
        assert_eq!(huge.sign(), None, "overflow decides nothing");
        assert_eq!(huge.minus(&huge).sign(), None);
        assert_eq!(Ball::exact(1.0).divided_by(Ball::exact(0.0)).sign(), None);
        let zero = Ball::exact(-0.0).times(&huge);
        assert_eq!(zero.sign(), Some(Ordering::Equal), "0 times anything finite is 0");
    }
}
