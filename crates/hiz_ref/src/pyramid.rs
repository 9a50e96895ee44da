//! The depth that a pixel stands for, and the reference of the depth pyramid.

/// The bits of 1.0f32: the greatest pattern that denotes a depth.
pub(crate) const ONE: u32 = 0x3f80_0000;
/// The bits of the least normal float32, 2^-126.
pub(crate) const LEAST_NORMAL: u32 = 0x0080_0000;
/// The bits of -0.0f32.
const MINUS_ZERO: u32 = 0x8000_0000;

/// The depth that a pixel of a depth image stands for, decided on its bits.
///
/// - NaN, infinities and everything outside 0..=1 are "far": 1, or 0 if `reversed`.
///   That includes negative subnormals.
/// - Positive subnormals and -0 are +0.
/// - Everything else is itself.
#[must_use]
pub fn sanitized_depth(depth: f32, reversed: bool) -> f32 {
    let bits = depth.to_bits();
    if bits == MINUS_ZERO || bits < LEAST_NORMAL {
        0.0
    } else if bits <= ONE {
        depth
    } else if reversed {
        0.0
    } else {
        1.0
    }
}

/// One level of a depth pyramid.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    /// Width in texels.
    pub width: u32,
    /// Height in texels.
    pub height: u32,
    /// NDC depths in row order, row 0 on top.
    pub texels: Vec<f32>,
}

/// The farthest-depth pyramid of an NDC depth image, from level 0 down to 1x1.
///
/// `depth` has `width * height` values in row order, row 0 on top.
/// Level `k` has `ceil(width / 2^k)` by `ceil(height / 2^k)` texels.
/// Texel (x, y) covers the pixel block `[x << k, (x + 1) << k) x [y << k, (y + 1) << k)`.
/// It is the farthest [sanitized](sanitized_depth) depth in that block: the greatest, or the least
/// if `reversed`.
///
/// Each texel is computed from all of its pixels, never from the level before.
/// So a mistake of a reduction cannot repeat itself here.
///
/// # Panics
///
/// If a side is 0 or `depth` does not hold `width * height` values.
#[must_use]
pub fn pyramid(depth: &[f32], width: u32, height: u32, reversed: bool) -> Vec<Level> {
    assert!(width > 0 && height > 0, "image size: expected at least 1x1, got {width}x{height}");
    assert_eq!(
        depth.len(),
        width as usize * height as usize,
        "depth: expected {width}x{height} values"
    );
    let farther = |a: f32, b: f32| if reversed { a.min(b) } else { a.max(b) };
    let mut levels = Vec::new();
    for k in 0.. {
        let side = 1usize << k;
        let size = [width, height].map(|n| n.div_ceil(1 << k));
        let block = |texel: u32, n: u32| {
            texel as usize * side..((texel as usize + 1) * side).min(n as usize)
        };
        let mut texels = Vec::with_capacity(size[0] as usize * size[1] as usize);
        for y in 0..size[1] {
            for x in 0..size[0] {
                let rows = block(y, height).map(|row| &depth[row * width as usize..]);
                let pixels = rows.flat_map(|row| &row[block(x, width)]);
                let texel = pixels.map(|&pixel| sanitized_depth(pixel, reversed)).reduce(farther);
                texels.push(texel.expect("a block of the image is not empty"));
            }
        }
        levels.push(Level { width: size[0], height: size[1], texels });
        if size == [1, 1] {
            break;
        }
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depths_are_decided_on_their_bits() {
        let least_subnormal = f32::from_bits(1);
        let greatest_subnormal = f32::from_bits(LEAST_NORMAL - 1);
        let past_one = f32::from_bits(ONE + 1);
        for (input, standard, reversed) in [
            (0.25, 0.25, 0.25),
            (1.0, 1.0, 1.0),
            (0.0, 0.0, 0.0),
            (-0.0, 0.0, 0.0),
            (least_subnormal, 0.0, 0.0),
            (greatest_subnormal, 0.0, 0.0),
            (f32::MIN_POSITIVE, f32::MIN_POSITIVE, f32::MIN_POSITIVE),
            (-least_subnormal, 1.0, 0.0),
            (-0.5, 1.0, 0.0),
            (past_one, 1.0, 0.0),
            (f32::INFINITY, 1.0, 0.0),
            (f32::NEG_INFINITY, 1.0, 0.0),
            (f32::NAN, 1.0, 0.0),
            (-f32::NAN, 1.0, 0.0),
            (f32::from_bits(0x7f80_0001), 1.0, 0.0), // a signalling NaN
        ] {
            let bits = |reversed| sanitized_depth(input, reversed).to_bits();
            assert_eq!(bits(false), f32::to_bits(standard), "{input:?}");
            assert_eq!(bits(true), f32::to_bits(reversed), "{input:?} reversed");
        }
    }

    #[test]
    fn a_five_by_three_image_by_hand() {
        // Both sides are odd: the last column and row form blocks of their own down to the last
        // level.
        #[rustfmt::skip]
        let depth = [
            0.1, 0.2, 0.3, 0.4, 0.5,
            0.2, 0.1, 0.9, 0.3, 0.6,
            0.3, 0.7, 0.1, 0.2, f32::NAN,
        ];
        let far = pyramid(&depth, 5, 3, false);
        let sizes: Vec<_> = far.iter().map(|level| (level.width, level.height)).collect();
        assert_eq!(sizes, [(5, 3), (3, 2), (2, 1), (1, 1)]);
        assert_eq!(far[0].texels[..14], depth[..14]);
        assert_eq!(far[1].texels, [0.2, 0.9, 0.6, 0.7, 0.2, 1.0]);
        assert_eq!(far[2].texels, [0.9, 1.0]);
        assert_eq!(far[3].texels, [1.0]);

        let reversed = pyramid(&depth, 5, 3, true);
        assert_eq!(reversed[1].texels, [0.1, 0.3, 0.5, 0.3, 0.1, 0.0]);
        assert_eq!(reversed[2].texels, [0.1, 0.0]);
        assert_eq!(reversed[3].texels, [0.0]);
    }

    #[test]
    fn one_pixel_and_one_line() {
        assert_eq!(pyramid(&[0.5], 1, 1, false).len(), 1);
        let line: Vec<f32> = (0..9u8).map(|i| f32::from(i) / 16.0).collect();
        for (width, height) in [(9, 1), (1, 9)] {
            let levels = pyramid(&line, width, height, false);
            let texels: Vec<_> = levels.iter().map(|level| level.texels.len()).collect();
            assert_eq!(texels, [9, 5, 3, 2, 1]);
            // Blocks of four: pixels 0..4, 4..8 and 8 alone.
            assert_eq!(levels[2].texels, [3.0 / 16.0, 7.0 / 16.0, 8.0 / 16.0]);
        }
    }

    #[test]
    #[should_panic(expected = "depth: expected 2x2 values")]
    fn a_wrong_length_is_refused() {
        let _ = pyramid(&[0.0; 3], 2, 2, false);
    }
}
