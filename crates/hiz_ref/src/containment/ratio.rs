//! Exact fractions with a float64 ball: the ball decides comparisons if it can, and exact numbers
//! decide the others.

use crate::dyadic::Dyadic;
use crate::scalar::{Ball, Scalar};
use std::cmp::Ordering;

/// A number `over / under` with `under > 0`, and a ball around it.
#[derive(Clone, Debug)]
pub(super) struct Ratio {
    pub(super) ball: Ball,
    pub(super) over: Dyadic,
    pub(super) under: Dyadic,
}

impl Ratio {
    pub(super) fn of(value: f64) -> Ratio {
        Ratio { ball: Ball::exact(value), over: Dyadic::exact(value), under: Dyadic::exact(1.0) }
    }

    /// Makes a fraction; `under` must be positive.
    /// If cancellation or a division made the ball too wide, a new one is computed from the exact
    /// numbers.
    fn new(ball: Ball, over: Dyadic, under: Dyadic) -> Ratio {
        let ball = match (ball.is_tight(), over.quotient(&under)) {
            (false, Some(quotient)) => Ball::around(quotient, quotient.abs() * 2.0_f64.powi(-48)),
            _ => ball,
        };
        Ratio { ball, over, under }
    }

    pub(super) fn plus(&self, other: &Ratio) -> Ratio {
        Ratio::new(
            self.ball.plus(&other.ball),
            self.over.times(&other.under).plus(&other.over.times(&self.under)),
            self.under.times(&other.under),
        )
    }

    pub(super) fn negated(&self) -> Ratio {
        Ratio { ball: self.ball.negated(), over: self.over.negated(), under: self.under.clone() }
    }

    pub(super) fn minus(&self, other: &Ratio) -> Ratio {
        self.plus(&other.negated())
    }

    pub(super) fn times(&self, other: &Ratio) -> Ratio {
        Ratio::new(
            self.ball.times(&other.ball),
            self.over.times(&other.over),
            self.under.times(&other.under),
        )
    }

    /// The quotient; `other` must not be 0.
    pub(super) fn divided_by(&self, other: &Ratio) -> Ratio {
        let (over, under) = (self.over.times(&other.under), self.under.times(&other.over));
        let negative = other.sign() == Ordering::Less;
        let (over, under) =
            if negative { (over.negated(), under.negated()) } else { (over, under) };
        Ratio::new(self.ball.divided_by(other.ball), over, under)
    }

    pub(super) fn sign(&self) -> Ordering {
        self.ball.sign().or_else(|| self.over.sign()).expect("exact numbers have a sign")
    }

    pub(super) fn compare(&self, other: &Ratio) -> Ordering {
        let exact = || self.over.times(&other.under).minus(&other.over.times(&self.under)).sign();
        self.ball.minus(&other.ball).sign().or_else(exact).expect("exact numbers have a sign")
    }

    /// A number strictly between two different ones.
    /// It is a float64 if there is one, so that its digits stay few.
    pub(super) fn between(&self, other: &Ratio) -> Ratio {
        let middle = Ratio::of(self.ball.mid / 2.0 + other.ball.mid / 2.0);
        let (low, high) =
            if self.compare(other) == Ordering::Less { (self, other) } else { (other, self) };
        if middle.ball.mid.is_finite()
            && low.compare(&middle) == Ordering::Less
            && middle.compare(high) == Ordering::Less
        {
            middle
        } else {
            self.plus(other).times(&Ratio::of(0.5))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Witnesses are reported from the balls.
    /// When balls were not renewed, some witnesses on real meshes lay far from their triangle.
    #[test]
    fn what_cancels_keeps_a_useful_ball() {
        let tiny = Ratio::of(1.0).plus(&Ratio::of(1e-17)).minus(&Ratio::of(1.0));
        assert!((tiny.ball.mid / 1e-17 - 1.0).abs() < 1e-12);
        assert!((Ratio::of(1.0).divided_by(&tiny).ball.mid / 1e17 - 1.0).abs() < 1e-12);
        assert_eq!(tiny.minus(&tiny).ball.sign(), Some(Ordering::Equal));
    }

    #[test]
    fn thirds_add_up() {
        let third = Ratio::of(1.0).divided_by(&Ratio::of(3.0));
        let sum = third.plus(&third).plus(&third);
        assert_eq!(sum.compare(&Ratio::of(1.0)), Ordering::Equal);
        let minus = Ratio::of(1.0).divided_by(&Ratio::of(-3.0));
        assert_eq!((minus.sign(), minus.plus(&third).sign()), (Ordering::Less, Ordering::Equal));
        // No float64 lies between these two.
        let above = third.plus(&Ratio::of(1e-300));
        let middle = above.between(&third);
        assert_eq!(
            (third.compare(&middle), middle.compare(&above)),
            (Ordering::Less, Ordering::Less)
        );
    }
}
