//! The numbers of a depth image as its maker stored them, borrowed from the caller.

use crate::input::bounds::Floats;

/// The numbers of a depth image, one per pixel, rows from top to bottom.
///
/// # Examples
/// ```
/// use hiz_core::{DepthNumbers, Floats};
///
/// let millimetres = DepthNumbers::U16(&[1500, 0]);
/// assert_eq!((millimetres.len(), millimetres.get(0)), (2, 1500.0));
/// let halves = DepthNumbers::F16(&[0x3c00, 0x7c00]); // the bits of 1 and of infinity
/// assert_eq!(halves.get(0), 1.0);
/// assert_eq!(DepthNumbers::from(Floats::F32(&[0.5])).get(0), 0.5);
/// ```
#[derive(Debug, Clone, Copy)]
pub enum DepthNumbers<'a> {
    /// float32.
    F32(&'a [f32]),
    /// float64.
    F64(&'a [f64]),
    /// float16 (IEEE 754 binary16), as bits.
    F16(&'a [u16]),
    /// Whole numbers of 16 bits.
    U16(&'a [u16]),
}

impl<'a> From<Floats<'a>> for DepthNumbers<'a> {
    fn from(floats: Floats<'a>) -> Self {
        match floats {
            Floats::F32(numbers) => Self::F32(numbers),
            Floats::F64(numbers) => Self::F64(numbers),
        }
    }
}

impl DepthNumbers<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(numbers) => numbers.len(),
            Self::F64(numbers) => numbers.len(),
            Self::F16(numbers) | Self::U16(numbers) => numbers.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number `i` as float64, which holds all types exactly.
    ///
    /// # Panics
    /// If `i` is not below [`DepthNumbers::len`].
    #[inline]
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::F32(numbers) => numbers[i].into(),
            Self::F64(numbers) => numbers[i],
            Self::F16(numbers) => of_half(numbers[i]).into(),
            Self::U16(numbers) => numbers[i].into(),
        }
    }

    /// The caller's invalid values as this type holds them.
    ///
    /// For float32 they are rounded to it.
    /// What no number of 16 bits can equal is left out.
    #[expect(clippy::cast_possible_truncation, reason = "rounded as the image's own numbers were")]
    pub(super) fn as_stored(&self, invalid: &[f64]) -> Vec<f64> {
        let narrow = |v: &f64| f64::from(*v as f32);
        match self {
            Self::F32(_) => invalid.iter().map(narrow).collect(),
            Self::F64(_) => invalid.to_vec(),
            Self::F16(_) | Self::U16(_) => {
                invalid.iter().copied().filter(|v| narrow(v) == *v).collect()
            }
        }
    }
}

/// The float16 of these bits, exactly, with its infinities and NaN.
///
/// Moved by 13 bits, its exponent and fraction are those of a float32 that is 2^-112 times as
/// large, subnormals included.
/// On the way there, only what is infinity or NaN overflows.
#[inline(always)]
pub(super) fn of_half(bits: u16) -> f32 {
    const UP: f32 = f32::from_bits((127 + 112) << 23);
    const DOWN: f32 = f32::from_bits((127 - 112) << 23);
    // The sign stays on top, and its copies below it are cut off.
    let moved = i32::from(bits.cast_signed()).cast_unsigned() << 13 & 0x8fff_e000;
    let number = f32::from_bits(moved) * UP * UP * DOWN;
    // All ones above an exponent of ones with a fraction, which makes NaN of infinity.
    let nan = (0x7c00 - i32::from(bits & 0x7fff)) >> 31;
    f32::from_bits(number.to_bits() | nan.cast_unsigned() & f32::NAN.to_bits())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every float16, by its definition in IEEE 754.
    #[test]
    fn halves_are_exact() {
        for bits in 0..=u16::MAX {
            let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
            let size = match exponent {
                0 => fraction / 1024.0 * 2.0_f64.powi(-14),
                31 if fraction == 0.0 => f64::INFINITY,
                31 => f64::NAN,
                _ => (1.0 + fraction / 1024.0) * 2.0_f64.powi(exponent - 15),
            };
            let expected = if bits >> 15 == 1 { -size } else { size };
            let got = f64::from(of_half(bits));
            let is_right = if size.is_nan() { got.is_nan() } else { got == expected };
            assert!(is_right, "{bits:#06x}: {got}");
        }
    }

    #[test]
    fn invalid_values_are_those_that_can_be_stored() {
        let values = [0.1, 5_000.0, 5_000.000_000_1];
        let tenth = f64::from(0.1_f32);
        assert_eq!(DepthNumbers::F32(&[]).as_stored(&values), [tenth, 5000.0, 5000.0]);
        assert_eq!(DepthNumbers::F64(&[]).as_stored(&values), values);
        assert_eq!(DepthNumbers::U16(&[]).as_stored(&values), [5000.0]);
    }
}
