//! Sums and products of float64 numbers without rounding.
#![allow(dead_code, reason = "each test binary uses its own part")]

use num_bigint::BigInt;

/// An integer times 2^-2400, as every sum of products of two float64 is.
pub(crate) struct Exact(BigInt);

impl Exact {
    pub(crate) fn new(v: f64) -> Self {
        let bits = v.to_bits();
        let (exponent, fraction) = ((bits >> 52 & 0x7FF) as i64, bits & ((1 << 52) - 1));
        let mantissa = if exponent == 0 { fraction } else { fraction | 1 << 52 };
        let shift = 2400 + exponent.max(1) - 1075;
        let magnitude = BigInt::from(mantissa) << shift;
        Self(if v < 0.0 { -magnitude } else { magnitude })
    }

    pub(crate) fn plus(&self, other: &Self) -> Self {
        Self(&self.0 + &other.0)
    }

    pub(crate) fn minus(&self, other: &Self) -> Self {
        Self(&self.0 - &other.0)
    }

    pub(crate) fn times(&self, other: &Self) -> Self {
        Self((&self.0 * &other.0) >> 2400)
    }

    pub(crate) fn is_at_most(&self, other: &Self) -> bool {
        self.0 <= other.0
    }
}
