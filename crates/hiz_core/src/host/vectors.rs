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
//! # Eight lanes
//!
//! A comparison of eight numbers is one instruction, and eight bits of it are another.
//! No loop tells a compiler this reliably, nor which of two rows' numbers to take by such bits.
//! [`Eight`] has these operations, as loops and as vectors of that crate; [`with_eight`] chooses.
//!
//! # Results
//!
//! They have the same bits on every processor.
//! Rust rounds each operation as IEEE 754 says, whatever the vectors' width: it joins no product
//! and sum into one rounding, and adds in the order that is written.
//! Two things are left open by Rust, and no result here may depend on them: the bits of a NaN, and
//! whether the greater of 0 and -0 is negative.
//! Each user compares the bits of both ways in a test.

use bytemuck::Pod;
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::prelude::*;
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::{Avx2, Level, mask32x8};

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

/// Three functions of whole numbers, linear in column and row, for eight columns and any rows.
#[derive(Debug)]
pub(crate) struct Linear<'a> {
    /// At the first column and row.
    pub(crate) at: [i32; 3],
    /// Gained since then in each column, and from row to row.
    pub(crate) along: &'a [[i32; 8]; 3],
    pub(crate) down: &'a [i32; 3],
}

/// Some numbers of an image.
#[derive(Debug)]
pub(crate) struct Rows<'a> {
    /// From the first one on.
    pub(crate) numbers: &'a mut [f32],
    /// From row to row.
    pub(crate) stride: usize,
    /// Up to eight; those after them, up to eight, may change with them.
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Rows<'_> {
    /// The first ones of a row, in so many halves of eight.
    #[inline(always)]
    fn halves<const N: usize>(&mut self, row: usize) -> &mut [[f32; 4]; N] {
        let begin = row * self.stride;
        let (halves, _) = self.numbers[begin..begin + 4 * N].as_chunks_mut();
        let Ok(halves) = halves.try_into() else { unreachable!("a slice of this length") };
        halves
    }
}

/// What loops over eight lanes do not tell compilers well enough: comparisons that become bits,
/// choices by bits, and sums that are carried from row to row.
pub(crate) trait Eight: Copy {
    /// A bit for each lane where `a` is greater than `b`.
    fn greater(self, a: &[f32; 8], b: &[f32; 8]) -> u32;

    /// A bit for each lane where `a` is at least `b`.
    fn at_least(self, a: &[f32; 8], b: &[f32; 8]) -> u32;

    /// A bit for each lane where one of three numbers is negative with what is added to it.
    fn any_negative(self, numbers: &[[i32; 8]; 3], added: &[i32; 3]) -> u32;

    /// Eight rows of eight bits: set where a function is negative.
    fn rows_with_negative(self, linear: &Linear<'_>) -> u64;

    /// Raises numbers, none of which is negative, to the lesser one of `most` and the sum of `along`
    /// and what is `below` in their row, where no function is negative.
    fn raise(
        self,
        rows: Rows<'_>,
        linear: &Linear<'_>,
        along: &[f32; 8],
        below: impl Fn(usize) -> f32,
        most: f32,
    );

    /// Puts `new` into the lanes of `old` that have a bit.
    fn put<T: Pod>(self, bits: u32, new: &[T; 8], old: &mut [T; 8]);
}

/// [`Eight`] as loops, for every processor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plain;

impl Eight for Plain {
    #[inline(always)]
    fn greater(self, a: &[f32; 8], b: &[f32; 8]) -> u32 {
        (0..8).fold(0, |bits, l| bits | u32::from(a[l] > b[l]) << l)
    }

    #[inline(always)]
    fn at_least(self, a: &[f32; 8], b: &[f32; 8]) -> u32 {
        (0..8).fold(0, |bits, l| bits | u32::from(a[l] >= b[l]) << l)
    }

    #[inline(always)]
    fn any_negative(self, numbers: &[[i32; 8]; 3], added: &[i32; 3]) -> u32 {
        (0..8).fold(0, |bits, l| {
            let number = |k: usize| numbers[k][l] + added[k];
            bits | ((number(0) | number(1) | number(2)) as u32 >> 31) << l
        })
    }

    #[inline(always)]
    fn rows_with_negative(self, linear: &Linear<'_>) -> u64 {
        let Linear { at, along, down } = linear;
        (0..64).fold(0, |bits, i| {
            let value = |k: usize| at[k] + along[k][i % 8] + (i / 8) as i32 * down[k];
            bits | u64::from((value(0) | value(1) | value(2)) as u32 >> 31) << i
        })
    }

    #[inline(always)]
    fn raise(
        self,
        mut rows: Rows<'_>,
        linear: &Linear<'_>,
        along: &[f32; 8],
        below: impl Fn(usize) -> f32,
        most: f32,
    ) {
        let add = |values: &mut [[i32; 8]; 3], added: &[i32; 3]| {
            for (values, added) in values.iter_mut().zip(added) {
                values.iter_mut().for_each(|value| *value += added);
            }
        };
        let mut values = *linear.along;
        add(&mut values, &linear.at);
        for row in 0..rows.rows {
            let below = below(row);
            let numbers: &mut [f32; 8] = bytemuck::cast_mut(rows.halves::<2>(row));
            for l in 0..8 {
                let inside = !((values[0][l] | values[1][l] | values[2][l]) >> 31) as u32;
                let sum = along[l] + below;
                let sum = if sum < most { sum } else { most };
                let raised = f32::from_bits(sum.to_bits() & inside);
                numbers[l] = if raised > numbers[l] { raised } else { numbers[l] };
            }
            add(&mut values, linear.down);
        }
    }

    #[inline(always)]
    fn put<T: Pod>(self, bits: u32, new: &[T; 8], old: &mut [T; 8]) {
        for (l, (old, new)) in old.iter_mut().zip(new).enumerate() {
            *old = if bits >> l & 1 == 1 { *new } else { *old };
        }
    }
}

/// [`Eight`] as one vector.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
impl Eight for Avx2 {
    #[inline(always)]
    fn greater(self, a: &[f32; 8], b: &[f32; 8]) -> u32 {
        let [a, b] = [a, b].map(|v| self.load_array_ref_f32x8(v));
        a.simd_gt(b).to_bitmask() as u32
    }

    #[inline(always)]
    fn at_least(self, a: &[f32; 8], b: &[f32; 8]) -> u32 {
        let [a, b] = [a, b].map(|v| self.load_array_ref_f32x8(v));
        a.simd_ge(b).to_bitmask() as u32
    }

    #[inline(always)]
    fn any_negative(self, numbers: &[[i32; 8]; 3], added: &[i32; 3]) -> u32 {
        let number = |k: usize| self.load_array_ref_i32x8(&numbers[k]) + self.splat_i32x8(added[k]);
        let any = number(0) | number(1) | number(2);
        any.simd_lt(self.splat_i32x8(0)).to_bitmask() as u32
    }

    #[inline(always)]
    fn rows_with_negative(self, linear: &Linear<'_>) -> u64 {
        let Linear { at, along, down } = linear;
        let first = |k: usize| self.splat_i32x8(at[k]) + self.load_array_ref_i32x8(&along[k]);
        let down = |k: usize| self.splat_i32x8(down[k]);
        let (mut a, mut b, mut c) = (first(0), first(1), first(2));
        let zero = self.splat_i32x8(0);
        let mut bits = 0;
        for row in 0..8 {
            bits |= (a | b | c).simd_lt(zero).to_bitmask() << (8 * row);
            (a, b, c) = (a + down(0), b + down(1), c + down(2));
        }
        bits
    }

    #[inline(always)]
    fn raise(
        self,
        rows: Rows<'_>,
        linear: &Linear<'_>,
        along: &[f32; 8],
        below: impl Fn(usize) -> f32,
        most: f32,
    ) {
        // A vector of eight would wait more often for numbers that were written just before, since
        // they begin anywhere.
        if rows.columns <= 4 {
            raise_halves::<1>(self, rows, linear, along, below, most);
        } else {
            raise_halves::<2>(self, rows, linear, along, below, most);
        }
    }

    #[inline(always)]
    fn put<T: Pod>(self, bits: u32, new: &[T; 8], old: &mut [T; 8]) {
        let (new, old): (&[u32; 8], &mut [u32; 8]) =
            (bytemuck::cast_ref(new), bytemuck::cast_mut(old));
        let chosen = mask32x8::from_bitmask(self, u64::from(bits));
        let [new, before] = [new, &*old].map(|v| self.load_array_ref_u32x8(v));
        *old = *chosen.select(new, before);
    }
}

/// [`Eight::raise`] for the first one or both halves of eight lanes.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
#[inline(always)]
fn raise_halves<const N: usize>(
    simd: Avx2,
    mut rows: Rows<'_>,
    linear: &Linear<'_>,
    along: &[f32; 8],
    below: impl Fn(usize) -> f32,
    most: f32,
) {
    let Linear { at, along: gained, down } = linear;
    let [mut a, mut b, mut c] = [[simd.splat_i32x4(0); N]; 3];
    let mut sums = [simd.splat_f32x4(0.0); N];
    for h in 0..N {
        let first = |k: usize| {
            simd.splat_i32x4(at[k]) + simd.load_array_ref_i32x4(&gained[k].as_chunks().0[h])
        };
        (a[h], b[h], c[h]) = (first(0), first(1), first(2));
        sums[h] = simd.load_array_ref_f32x4(&along.as_chunks().0[h]);
    }
    let down = |k: usize| simd.splat_i32x4(down[k]);
    let (zero, nothing) = (simd.splat_i32x4(0), simd.splat_f32x4(0.0));
    let most = simd.splat_f32x4(most);
    for row in 0..rows.rows {
        let below = simd.splat_f32x4(below(row));
        let numbers = rows.halves::<N>(row);
        for h in 0..N {
            let sum = (sums[h] + below).min(most);
            let raised = (a[h] | b[h] | c[h]).simd_lt(zero).select(nothing, sum);
            numbers[h] = *raised.max(simd.load_array_ref_f32x4(&numbers[h]));
            (a[h], b[h], c[h]) = (a[h] + down(0), b[h] + down(1), c[h] + down(2));
        }
    }
}

/// Runs work that is compiled for the widest vectors, which it gets as an [`Eight`].
macro_rules! with_eight {
    ($eight:ident => $work:expr) => {{
        #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
        if let Some($eight) = fearless_simd::Level::new().as_avx2() {
            fearless_simd::Simd::vectorize(
                $eight,
                #[inline(always)]
                || $work,
            )
        } else {
            let $eight = $crate::host::vectors::Plain;
            $work
        }
        #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
        {
            let $eight = $crate::host::vectors::Plain;
            $work
        }
    }};
}
pub(crate) use with_eight;

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

    /// What [`Eight`] finds of two rows, and what it makes of the second.
    fn found(eight: impl Eight, a: &[f32; 8], b: &[f32; 8]) -> ([u32; 2], [u32; 8]) {
        let (greater, at_least) = (eight.greater(a, b), eight.at_least(a, b));
        let mut chosen = *b;
        eight.put(greater ^ (at_least << 1), a, &mut chosen);
        ([greater, at_least], chosen.map(f32::to_bits))
    }

    #[test]
    fn eight_lanes_say_the_same_plain_and_as_vectors() {
        let numbers: Vec<f32> = numbers().iter().map(|v| *v as f32).collect();
        let (rows, _) = numbers.as_chunks::<8>();
        let special = [0.0, -0.0, f32::NAN, f32::INFINITY, -1.0, 1.0, -f32::INFINITY, 1e-40];
        let mut bits = [0; 2];
        for pair in rows.windows(2).map(|pair| [pair[0], pair[1]]).chain([[special; 2]]) {
            for shift in 0..8 {
                let (mut a, b) = (pair[0], pair[1]);
                a.rotate_left(shift);
                let plain = found(Plain, &a, &b);
                for (l, (a, b)) in a.iter().zip(&b).enumerate() {
                    let expected = [a > b, a >= b];
                    for (count, (bits, is_so)) in bits.iter_mut().zip(plain.0.iter().zip(expected))
                    {
                        assert_eq!(bits >> l & 1 == 1, is_so, "{a} {b}");
                        *count += u32::from(is_so);
                    }
                }
                assert_eq!(with_eight!(eight => found(eight, &a, &b)), plain, "{a:?} {b:?}");
            }
        }
        assert!(bits.iter().all(|count| *count > 0), "{bits:?}");
    }

    /// Checks what becomes of some numbers in eight rows, given where a function is negative.
    fn are_raised(linear: &Linear<'_>, columns: usize, negative: u64) {
        const STRIDE: usize = 11;
        let along = std::array::from_fn(|l| 0.1 * l as f32);
        let below = |row: usize| 0.3 - 0.2 * row as f32;
        let before: Vec<f32> = (0..8 * STRIDE).map(|i| 0.01 * (i % 7) as f32).collect();
        let [mut plain, mut vectors] = [before.clone(), before.clone()];
        let rows = |numbers| Rows { numbers, stride: STRIDE, columns, rows: 8 };
        Plain.raise(rows(&mut plain), linear, &along, below, 0.5);
        with_eight!(eight => eight.raise(rows(&mut vectors), linear, &along, below, 0.5));
        for (i, before) in before.into_iter().enumerate() {
            let (row, l) = (i / STRIDE, i % STRIDE);
            let is_raised = l < 8 && negative >> (8 * row + l) & 1 == 0;
            let expected =
                if is_raised { before.max((along[l] + below(row)).min(0.5)) } else { before };
            assert_eq!([plain[i], vectors[i]], [expected; 2], "{linear:?} {columns} {i}");
        }
    }

    #[test]
    fn rows_of_three_functions_have_bits_where_one_is_negative() {
        let numbers: Vec<i32> = numbers().iter().map(|v| v.to_bits() as i32 >> 4).collect();
        let mut counts = [0; 2];
        for numbers in numbers.as_chunks::<40>().0 {
            // Mostly of the size of what they gain, so that signs change.
            let at = [0, 1, 2].map(|k| numbers[k] + (1 << 27));
            let along = [0, 1, 2].map(|k| std::array::from_fn(|l| numbers[8 * k + 8 + l]));
            let down = [0, 1, 2].map(|k| numbers[k + 3] / 4);
            let linear = Linear { at, along: &along, down: &down };
            let plain = Plain.rows_with_negative(&linear);
            for bit in 0..64 {
                let (row, l) = (bit / 8, bit % 8);
                let value = |k: usize| at[k] + along[k][l] + row as i32 * down[k];
                let expected = (0..3).any(|k| value(k) < 0);
                assert_eq!(plain >> bit & 1 == 1, expected, "{numbers:?}");
                counts[usize::from(expected)] += 1;
            }
            let vectors = with_eight!(eight => eight.rows_with_negative(&linear));
            assert_eq!(vectors, plain, "{numbers:?}");
            let first = [
                Plain.any_negative(&along, &at),
                with_eight!(eight => eight.any_negative(&along, &at)),
            ];
            assert_eq!(first, [plain as u32 & 0xFF; 2], "{numbers:?}");
            are_raised(&linear, 8, plain);
            for columns in 1..8 {
                let mut narrow = along;
                narrow[1][columns..].fill(-(1 << 30));
                let outside =
                    (0..8).fold(plain, |bits, row| bits | (0xFF << columns & 0xFF) << (8 * row));
                are_raised(&Linear { along: &narrow, ..linear }, columns, outside);
            }
        }
        assert!(counts.iter().all(|count| *count > 1000), "{counts:?}");
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
