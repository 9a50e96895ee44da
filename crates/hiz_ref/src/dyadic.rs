//! Exact dyadic fractions: `mantissa * 2^exponent` with an integer mantissa of any length.

use crate::scalar::Scalar;
use num_bigint::{BigInt, Sign};
use std::cmp::Ordering;

/// An exact number.
///
/// Every finite float64 is one, and sums, differences and products of them stay dyadic.
/// So there is never a common denominator to reduce, which makes them several times faster here
/// than fractions in lowest terms.
#[derive(Clone, Debug)]
pub(crate) struct Dyadic {
    mantissa: BigInt,
    exponent: i32,
}

impl Dyadic {
    /// The mantissa at a smaller (or the same) exponent.
    fn mantissa_at(&self, exponent: i32) -> BigInt {
        let shift = usize::try_from(self.exponent - exponent).expect("exponents only go down");
        &self.mantissa << shift
    }

    /// The number as `mantissa * 2^exponent` with a float64 mantissa; 0 for 0.
    ///
    /// It keeps the leading 62 bits and rounds them once, so its relative error is below 2^-52.
    fn leading(&self) -> (f64, i64) {
        let bits = self.mantissa.bits();
        let cut = bits.saturating_sub(62);
        let digits = (self.mantissa.magnitude() >> cut).iter_u64_digits().next().unwrap_or(0);
        let sign = if self.mantissa.sign() == Sign::Minus { -1.0 } else { 1.0 };
        (sign * digits as f64, i64::from(self.exponent) + i64::try_from(cut).expect("fits memory"))
    }

    /// `self / other` with a relative error below 2^-48.
    /// `None` if float64 cannot hold the quotient, and if `other` is 0.
    pub(crate) fn quotient(&self, other: &Self) -> Option<f64> {
        let ((a, i), (b, j)) = (self.leading(), other.leading());
        let power = i32::try_from(i - j).ok().filter(|power| power.abs() < 2000)?;
        // In two steps, because one power of two may exceed float64 while the quotient does not.
        let quotient = a / b * 2.0_f64.powi(power / 2) * 2.0_f64.powi(power - power / 2);
        (b != 0.0 && (a == 0.0 || quotient.is_normal())).then_some(quotient)
    }

    fn combine(&self, other: &Self, op: impl Fn(BigInt, BigInt) -> BigInt) -> Self {
        let exponent = self.exponent.min(other.exponent);
        Dyadic { mantissa: op(self.mantissa_at(exponent), other.mantissa_at(exponent)), exponent }
    }
}

impl Scalar for Dyadic {
    fn exact(value: f64) -> Self {
        assert!(value.is_finite(), "inputs are checked before they get here");
        let bits = value.to_bits();
        let field = i32::try_from((bits >> 52) & 0x7ff).expect("eleven bits");
        let fraction = bits & ((1 << 52) - 1);
        // IEEE 754: exponent field 0 means a subnormal.
        // It has no hidden bit, and the exponent of field 1.
        let (integer, exponent) =
            if field == 0 { (fraction, -1074) } else { (fraction | (1 << 52), field - 1075) };
        if integer == 0 {
            return Dyadic { mantissa: BigInt::ZERO, exponent: 0 };
        }
        // Odd mantissas keep the integers short, because most inputs are round numbers.
        let zeros = integer.trailing_zeros();
        let magnitude = BigInt::from(integer >> zeros);
        Dyadic {
            mantissa: if value < 0.0 { -magnitude } else { magnitude },
            exponent: exponent + i32::try_from(zeros).expect("at most 52"),
        }
    }

    fn plus(&self, other: &Self) -> Self {
        if self.is_zero() {
            return other.clone();
        }
        if other.is_zero() {
            return self.clone();
        }
        self.combine(other, |a, b| a + b)
    }

    fn minus(&self, other: &Self) -> Self {
        if other.is_zero() {
            return self.clone();
        }
        if self.is_zero() {
            return other.negated();
        }
        self.combine(other, |a, b| a - b)
    }

    fn times(&self, other: &Self) -> Self {
        Dyadic {
            mantissa: &self.mantissa * &other.mantissa,
            exponent: self.exponent + other.exponent,
        }
    }

    fn negated(&self) -> Self {
        Dyadic { mantissa: -&self.mantissa, exponent: self.exponent }
    }

    fn sign(&self) -> Option<Ordering> {
        Some(match self.mantissa.sign() {
            Sign::Minus => Ordering::Less,
            Sign::NoSign => Ordering::Equal,
            Sign::Plus => Ordering::Greater,
        })
    }

    fn magnitude(&self) -> Self {
        Dyadic { mantissa: self.mantissa.magnitude().clone().into(), exponent: self.exponent }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_rational::BigRational;
    use num_traits::Signed;
    use proptest::prelude::*;

    fn finite() -> impl Strategy<Value = f64> {
        prop_oneof![
            any::<f64>().prop_filter("finite", |x| x.is_finite()),
            (0u64..1 << 53).prop_map(f64::from_bits),
            -16.0f64..16.0,
        ]
    }

    fn fraction(x: f64) -> BigRational {
        BigRational::from_float(x).expect("finite")
    }

    /// The sign according to num-rational.
    fn sign(x: &BigRational) -> Option<Ordering> {
        Some(if x.is_positive() {
            Ordering::Greater
        } else if x.is_negative() {
            Ordering::Less
        } else {
            Ordering::Equal
        })
    }

    proptest! {
        #[test]
        fn arithmetic_agrees_with_fractions(a in finite(), b in finite(), c in finite(), d in finite()) {
            let [x, y, z, t] = [a, b, c, d].map(Dyadic::exact);
            let [p, q, r, s] = [a, b, c, d].map(fraction);
            prop_assert_eq!(x.plus(&y).times(&z).minus(&t).sign(), sign(&((&p + &q) * &r - &s)));
            prop_assert_eq!(x.times(&y).minus(&z.times(&t)).sign(), sign(&(&p * &q - &r * &s)));
            prop_assert_eq!(x.magnitude().minus(&y.magnitude()).sign(), sign(&(p.abs() - q.abs())));
            prop_assert_eq!(x.minus(&y).sign(), a.partial_cmp(&b));
        }
    }

    #[test]
    fn quotients_are_near() {
        let third = Dyadic::exact(-1.0).quotient(&Dyadic::exact(3.0)).unwrap();
        assert!((third + 1.0 / 3.0).abs() < 1e-15);
        let long = Dyadic::exact(1.0 / 3.0).times(&Dyadic::exact(1e-9)).plus(&Dyadic::exact(1e9));
        assert!((long.quotient(&long.times(&Dyadic::exact(1e9))).unwrap() - 1e-9).abs() < 1e-23);
        assert_eq!(Dyadic::exact(0.0).quotient(&long), Some(0.0));
        assert_eq!(long.quotient(&Dyadic::exact(0.0)), None);
        for size in [1e300, 1e-300, f64::MAX, f64::MIN_POSITIVE] {
            let x = Dyadic::exact(size);
            assert_eq!(x.quotient(&Dyadic::exact(1.0)), Some(size));
            assert_eq!(x.times(&x).quotient(&Dyadic::exact(1.0)), None, "beyond float64");
        }
    }

    #[test]
    fn one_tenth_three_times_is_not_three_tenths() {
        // The float64 nearest to 0.1 lies above it, and the one nearest to 0.3 below.
        // So 3 * 0.1 > 0.3, although the two are within an ulp.
        let difference = Dyadic::exact(0.1).times(&Dyadic::exact(3.0)).minus(&Dyadic::exact(0.3));
        assert_eq!(difference.sign(), Some(Ordering::Greater));
        let least = Dyadic::exact(f64::from_bits(1));
        assert_eq!(least.times(&least).sign(), Some(Ordering::Greater), "no underflow");
    }
}
