//! Loops over numbers, compiled once more for wider vectors.
//!
//! A program for x86-64 may use vectors of 16 bytes, which every such processor has.
//! Nearly all of them also have vectors of 32 bytes (AVX2, the level x86-64-v3).
//! [`widest`] asks the processor, and runs a closure that is compiled for either.
//! A compiler makes the vectors out of plain loops, so there are no intrinsics here.
//! On other architectures, such as aarch64, all processors have the same vectors, and the closure
//! runs as it is.
//!
//! The crate `fearless_simd` has the one function that takes `unsafe`: it calls a closure in a
//! function that may use these instructions, and only a processor that has them gives the token
//! for it.
//!
//! # What is compiled for them
//!
//! Only what is inlined into the closure.
//! So `#[inline(always)]` stands in front of the closure, and of each function that it calls.
//!
//! # Results
//!
//! They have the same bits on every processor.
//! Rust rounds each operation as IEEE 754 says, whatever the vectors' width: it joins no product
//! and sum into one rounding, and adds in the order that is written.
//! Two things are left open by Rust, and no result here may depend on them: the bits of a NaN, and
//! whether the greater of 0 and -0 is negative.
//! Each user compares the bits of both ways in a test.

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Level, Simd};

/// Runs `work` with the widest vectors that this processor has.
///
/// It costs some nanoseconds, so call it for hundreds of numbers.
///
/// ```ignore
/// widest(
///     #[inline(always)]
///     || numbers.iter_mut().for_each(|n| *n = n.sqrt()),
/// );
/// ```
#[inline]
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = Level::new().as_avx2() {
        return avx2.vectorize(work);
    }
    work()
}

/// `all` without an early end, which would keep a compiler from making vectors.
#[inline(always)]
pub(crate) fn are_all(each: impl Iterator<Item = bool>) -> bool {
    each.fold(0_u32, |wrong, is_so| wrong | u32::from(!is_so)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every size, with subnormals, infinities and zeros of both signs.
    fn numbers() -> Vec<f64> {
        let mut state = 1_u64;
        (0..10_007)
            .map(|i| {
                // Knuth's linear congruence.
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                match i % 100 {
                    0 => [0.0, -0.0, f64::INFINITY, 5e-324, 1e-40, f64::MAX][i / 100 % 6],
                    1..50 => (state >> 11) as f64 / 2.0_f64.powi(53) + 1.0,
                    _ => f64::from_bits(state & !(1 << 62)),
                }
            })
            .collect()
    }

    /// All operations that the users of this module have, and a sum in order.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "this rounding is tested, too")]
    fn operations(numbers: &[f64], out: &mut [f64], fused: bool) -> f64 {
        let mut sum = 0.0;
        for (out, v) in out.iter_mut().zip(numbers) {
            let moved = if fused { v.mul_add(*v, -1.1) } else { v * v - 1.1 };
            let quotient = moved.abs().sqrt() / (v - 0.7);
            *out = quotient * f64::from((*v as f32).abs().sqrt() * 0.9);
            sum += if quotient.abs() < 4.0 { quotient } else { 0.0 };
        }
        sum
    }

    #[inline(never)]
    fn as_compiled(numbers: &[f64], out: &mut [f64]) -> f64 {
        operations(numbers, out, false)
    }

    /// Where two results differ; any NaN equals any other.
    fn differences(a: &[f64], b: &[f64]) -> usize {
        let is_same = |a: f64, b: f64| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        a.iter().zip(b).filter(|(a, b)| !is_same(**a, **b)).count()
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        let numbers = numbers();
        let mut out = [(); 2].map(|()| vec![0.0; numbers.len()]);
        let [plain, wide] = &mut out;
        let sum = as_compiled(&numbers, plain);
        let wide_sum = widest(
            #[inline(always)]
            || operations(&numbers, wide, false),
        );
        assert!(sum.is_finite() && sum.to_bits() == wide_sum.to_bits(), "{sum} {wide_sum}");
        assert_eq!(differences(plain, wide), 0);
        // A fault: one rounding of product and sum in place of two shows.
        widest(
            #[inline(always)]
            || operations(&numbers, wide, true),
        );
        assert!(differences(plain, wide) > 100);
    }

    #[test]
    fn work_is_done_once_and_its_result_comes_back() {
        let mut calls = 0;
        let result = widest(|| {
            calls += 1;
            "done".to_owned()
        });
        assert_eq!((calls, result.as_str()), (1, "done"));
    }
}
