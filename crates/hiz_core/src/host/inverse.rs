//! The inverse of a 3x3 matrix with an error bound per entry, also for nearly singular matrices.
//!
//! Each entry is a pair of float64.
//! Newton's step `A += A (I - M A)` improves the pairs, with residuals in pairs too.
//! The last residual bounds the remaining error.
//! Sums of products in pairs follow Ogita, Rump and Oishi, "Accurate sum and dot product", 2005,
//! section 4.

use crate::host::linear::{Mat3, Vec3, inverse3};

/// An absolute bound, with room, of the error of products that underflow float64.
const TINY: f64 = 1e-280;

/// The unevaluated sum `hi + lo`.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pair {
    hi: f64,
    lo: f64,
}

impl Pair {
    pub(crate) fn new(hi: f64) -> Self {
        Self { hi, lo: 0.0 }
    }

    /// `a + b` without an error: the two-sum of Knuth.
    fn sum(a: f64, b: f64) -> Self {
        let hi = a + b;
        let from_b = hi - a;
        Self { hi, lo: (a - (hi - from_b)) + (b - from_b) }
    }

    /// `a * b` with an error below [`TINY`].
    fn product(a: f64, b: f64) -> Self {
        let hi = a * b;
        Self { hi, lo: a.mul_add(b, -hi) }
    }

    fn plus(self, x: f64) -> Self {
        let Self { hi, lo } = Self::sum(self.hi, x);
        Self::sum(hi, self.lo + lo)
    }
}

/// A number and a bound of its absolute error.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Bounded {
    value: Pair,
    error: f64,
}

impl Bounded {
    /// The nearest float64 and a bound of its absolute error.
    pub(crate) fn rounded(self) -> (f64, f64) {
        (self.value.hi, self.value.lo.abs() + self.error)
    }

    /// The sum of the products `a * b` over `terms`.
    ///
    /// The error bound takes each sum to be off by less than 2^-105 of the sum of all magnitudes.
    /// There are at most 17 sums: four terms and the unit.
    /// The factor 2^-98 covers them, and the roundings of the bound itself.
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

/// The entries of the inverse of the matrix with these rows.
///
/// `None` for a singular matrix, and for one that float64 cannot distinguish from a singular one.
pub(crate) fn inverse(rows: &Mat3) -> Option<[[Bounded; 3]; 3]> {
    // Powers of two bring every row near 1, so that residuals mean the same in each row.
    let scale = rows.map(|row| near_one(row.iter().fold(0.0, |m, v| m.max(v.abs()))));
    let m: Mat3 = std::array::from_fn(|i| rows[i].map(|v| v * scale[i]));
    let mut a = inverse3(&m)?.map(|row| row.map(Pair::new));
    for _ in 0..4 {
        // The first inverse is off by at most 1e-4, since determinants are above 1e-12.
        // Each step squares the error.
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
    // Row sums of |E| are below 1/2, so the series is at most twice the greatest |E| per column.
    let e = residual(&m, &a).map(|row| row.map(|x| x.value.hi.abs() + x.value.lo.abs() + x.error));
    // `f64::max` would drop a NaN; this fold keeps it.
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

/// The power of two that brings `size` into `[1, 2)`.
///
/// Where log2 is off by an ulp, the result lies marginally outside.
/// The power is infinite for 0, which makes the scaled row NaN.
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

    /// Two rows that differ by `d` in one entry.
    /// The inverse, worked out by hand, contains `1/d`, which is exact for powers of two.
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
