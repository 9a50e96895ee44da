//! The inverse of a 3x3 matrix with a bound of its error, however near to singular the matrix is.
//!
//! Entries are pairs of float64, improved by Newton's step `A += A (I - M A)` with residuals in
//! pairs.
//! The last residual bounds what is left.
//! (Ogita, Rump and Oishi, "Accurate sum and dot product", 2005, section 4: sums of products in
//! pairs.)

use crate::host::linear::{Mat3, Vec3, inverse3};

/// More than what products below float64's range lose.
const TINY: f64 = 1e-280;

/// The number `hi + lo`, never evaluated.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pair {
    hi: f64,
    lo: f64,
}

impl Pair {
    pub(crate) fn new(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }

    /// `a + b` without an error (Knuth).
    fn sum(a: f64, b: f64) -> Self {
        let hi = a + b;
        let from_b = hi - a;
        Self { hi, lo: (a - (hi - from_b)) + (b - from_b) }
    }

    /// `a * b` without an error but [`TINY`].
    fn product(a: f64, b: f64) -> Self {
        let hi = a * b;
        Self { hi, lo: a.mul_add(b, -hi) }
    }

    fn plus(self, x: f64) -> Self {
        let Self { hi, lo } = Self::sum(self.hi, x);
        Self::sum(hi, self.lo + lo)
    }
}

/// A number and how far it may be off.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounded {
    value: Pair,
    error: f64,
}

impl Bounded {
    /// The nearest float64, and how far it may be off.
    pub(crate) fn rounded(self) -> (f64, f64) {
        (self.value.hi, self.value.lo.abs() + self.error)
    }

    /// `sum a b`.
    /// At most 17 sums (four terms and the unit), each off by less than 2^-105 of all magnitudes:
    /// 2^-98 covers them, and what evaluating the bound itself loses.
    pub(crate) fn dot(terms: &[(f64, Self)]) -> Self {
        let (mut value, mut size, mut inherited) = (Pair::default(), 0.0, 0.0);
        for (a, b) in terms {
            for part in [b.value.hi, b.value.lo] {
                let Pair { hi, lo } = Pair::product(*a, part);
                value = value.plus(hi).plus(lo);
                size += hi.abs();
            }
            inherited += a.abs() * b.error;
        }
        Self { value, error: inherited * (1.0 + 1e-9) + 2.0_f64.powi(-98) * size + TINY }
    }
}

impl From<f64> for Bounded {
    fn from(exact: f64) -> Self {
        Self { value: Pair::new(exact), error: 0.0 }
    }
}

/// The entries of the inverse of the matrix with these rows; nothing for one that is singular, or
/// that float64 cannot tell from one.
pub(crate) fn inverse(rows: &Mat3) -> Option<[[Bounded; 3]; 3]> {
    // Rows near 1, by powers of two: residuals then mean the same in each.
    let scale = rows.map(|row| near_one(row.iter().fold(0.0, |m, v| m.max(v.abs()))));
    let m: Mat3 = std::array::from_fn(|i| rows[i].map(|v| v * scale[i]));
    let mut a = inverse3(&m)?.map(|row| row.map(Pair::new));
    for _ in 0..4 {
        // A first inverse is off by 1e-4 at worst (determinants above 1e-12), and each step squares
        // that.
        let e = residual(&m, &a).map(|row| row.map(|x| x.value.hi));
        let column = |j: usize| -> Vec3 { [e[0][j], e[1][j], e[2][j]] };
        a = a.map(|row| {
            std::array::from_fn(|j| {
                let step: f64 = row.iter().zip(column(j)).map(|(x, y)| x.hi * y).sum();
                row[j].plus(step)
            })
        });
    }
    // M A = I - E gives M^-1 - A = A (E + E^2 + ...).
    // No row of |E| sums to more than 1/2, so the series is at most twice the greatest |E| of each
    // column.
    let e = residual(&m, &a).map(|row| row.map(|x| x.value.hi.abs() + x.value.lo.abs() + x.error));
    // A NaN is kept: `max` would drop it.
    let row_sum = e
        .iter()
        .map(|row| row.iter().sum::<f64>())
        .fold(0.0, |m: f64, x| if x > m || x.is_nan() { x } else { m });
    if row_sum.is_nan() || row_sum >= 0.5 {
        return None;
    }
    let greatest: Vec3 = std::array::from_fn(|j| e.iter().map(|row| row[j]).fold(0.0, f64::max));
    Some(a.map(|row| {
        let size: f64 = row.iter().map(|x| x.hi.abs()).sum::<f64>() * (1.0 + 1e-9);
        std::array::from_fn(|j| Bounded {
            value: Pair { hi: row[j].hi * scale[j], lo: row[j].lo * scale[j] },
            error: 2.0 * size * greatest[j] * scale[j] + TINY,
        })
    }))
}

/// The power of two that brings `size` into `[1, 2)` (a hair beside it where log2 is off by an
/// ulp); no number for 0.
#[expect(
    clippy::cast_possible_truncation,
    reason = "an exponent; infinities saturate, and end as NaN"
)]
fn near_one(size: f64) -> f64 {
    2.0_f64.powi((size.log2().floor() as i32).saturating_neg())
}

/// `I - M A`.
fn residual(m: &Mat3, a: &[[Pair; 3]; 3]) -> [[Bounded; 3]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let unit = f64::from(u8::from(i == j));
            let product = |c: usize| (-m[i][c], Bounded { value: a[c][j], error: 0.0 });
            Bounded::dot(&[(1.0, unit.into()), product(0), product(1), product(2)])
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows that differ by `d` in one entry: the inverse by hand has `1/d` in it, exactly, for
    /// powers of two.
    #[test]
    fn nearly_singular_matrices_by_hand() {
        for power in [0, 10, 30, 38] {
            let d = 2.0_f64.powi(-power);
            let a = inverse(&[[1.0, 1.0, 0.0], [1.0, 1.0 + d, 0.0], [0.0, 0.0, 1.0]]).unwrap();
            let n = d.recip();
            let expected = [[1.0 + n, -n, 0.0], [-n, n, 0.0], [0.0, 0.0, 1.0]];
            for (row, wanted) in a.iter().flatten().zip(expected.iter().flatten()) {
                let (value, error) = row.rounded();
                assert!((value - wanted).abs() <= error, "{value} {error} for {wanted}");
                assert!(error <= 1e-15 * n, "{error} for {wanted}");
            }
        }
        assert!(inverse(&[[1.0, 1.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).is_none());
        assert!(inverse(&[[0.0; 3]; 3]).is_none());
        assert!(inverse(&[[f64::NAN; 3]; 3]).is_none());
    }

    #[test]
    fn sums_of_products_keep_what_cancels() {
        let big = 1.0e16;
        let sum = Bounded::dot(&[(big, big.into()), (1.0, 1.0.into()), (-big, big.into())]);
        let (value, error) = sum.rounded();
        assert!((value - 1.0).abs() <= error && error < 1e10, "{value} {error}");
    }
}
