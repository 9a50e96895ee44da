//! The reduction on the host, of rows that are in its caches.
//!
//! What comes out has the bits that `shaders/pyramid/reduce.wgsl` makes.
//! Where a level's width is no multiple of four texels, the last ones repeat the edge, as there.

use crate::host::vectors::widest;
use crate::input::image::DepthConvention;
use crate::pyramid::layout::{BLOCK_ALIGNMENT, BLOCK_LOG2};

/// Rows of pixels that make a row of texels of level [`BLOCK_LOG2`].
pub(crate) const BLOCK_ROWS: usize = 1 << BLOCK_LOG2;

/// The bits of 1, of the least normal number, and of -0, as in `shaders/gpu/depth_bits.wgsl`.
const ONE: u32 = 1.0_f32.to_bits();
const LEAST_NORMAL: u32 = f32::MIN_POSITIVE.to_bits();
const NEGATIVE_ZERO: u32 = (-0.0_f32).to_bits();

/// What the bits of a depth are compared by: the farthest depth has the greatest key.
trait Far {
    fn key(bits: u32) -> u32;
    /// The bits of the depth with this key, sanitised.
    fn bits(key: u32) -> u32;
}

/// Near is 1.
///
/// What is no depth is far, which is 0: it has a key above those of all depths, and so have
/// subnormals (`least_sanitized4` in the shader).
struct Reversed;

impl Far for Reversed {
    #[inline(always)]
    fn key(bits: u32) -> u32 {
        ONE.wrapping_sub(bits)
    }

    #[inline(always)]
    fn bits(key: u32) -> u32 {
        if key > ONE - LEAST_NORMAL { 0 } else { ONE - key }
    }
}

/// Near is 0.
struct Standard;

impl Far for Standard {
    #[inline(always)]
    fn key(bits: u32) -> u32 {
        let of_depth = if bits < LEAST_NORMAL { 0 } else { bits.min(ONE) };
        if bits == NEGATIVE_ZERO { 0 } else { of_depth }
    }

    #[inline(always)]
    fn bits(key: u32) -> u32 {
        key
    }
}

/// Texels of a row that is `width` wide, with what repeats the edge.
pub(crate) fn padded(width: u32) -> usize {
    width.next_multiple_of(BLOCK_ALIGNMENT) as usize
}

/// Halves two rows of depths of `width`, which are padded, to one, which is padded, too.
pub(crate) fn halve_rows(
    convention: DepthConvention,
    width: u32,
    [top, bottom]: [&[u32]; 2],
    out: &mut [u32],
) {
    let half = padded(width.div_ceil(2));
    let (top, bottom, out) = (&top[..padded(width)], &bottom[..padded(width)], &mut out[..half]);
    match convention {
        DepthConvention::Reversed => halve::<Reversed>(top, bottom, out),
        DepthConvention::Standard => halve::<Standard>(top, bottom, out),
    }
    let made = top.len() / 2;
    let edge = out[made - 1];
    out[made..].fill(edge);
}

fn halve<F: Far>(top: &[u32], bottom: &[u32], out: &mut [u32]) {
    widest(
        #[inline(always)]
        || {
            let pairs = top.as_chunks::<2>().0.iter().zip(bottom.as_chunks::<2>().0);
            for (out, (top, bottom)) in out.iter_mut().zip(pairs) {
                let key = |pair: &[u32; 2]| F::key(pair[0]).max(F::key(pair[1]));
                *out = F::bits(key(top).max(key(bottom)));
            }
        },
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::depth::sanitized;

    /// Bits of every kind, most of them of depths.
    fn bits(count: usize, mut state: u64) -> Vec<u32> {
        let special = [0.0, -0.0, 1.0, f32::NAN, -1.0, 1.5, f32::INFINITY, 1e-40, -1e-40, 1e-38];
        (0..count)
            .map(|_| {
                // Knuth's linear congruence.
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let (of_float, kind) = ((state >> 32) as u32, (state >> 20) % 64);
                match kind {
                    0..10 => special[kind as usize].to_bits(),
                    10..14 => of_float,
                    _ => (of_float as f32 / u32::MAX as f32).to_bits(),
                }
            })
            .collect()
    }

    #[test]
    fn a_texel_is_the_farthest_of_its_four_sanitised_depths() {
        for convention in [DepthConvention::Reversed, DepthConvention::Standard] {
            let farther =
                |a: f32, b: f32| if convention.is_reversed() { a.min(b) } else { a.max(b) };
            for width in (1..70).chain([1919, 1920]) {
                let rows = [1, 2].map(|seed| {
                    let mut row = bits(width as usize, seed + u64::from(width) * 64);
                    let edge = row[row.len() - 1];
                    row.resize(padded(width), edge);
                    row
                });
                let mut out = vec![7; padded(width.div_ceil(2)) + 3];
                halve_rows(convention, width, [&rows[0], &rows[1]], &mut out);
                for (x, made) in out.iter().take(width.div_ceil(2) as usize).enumerate() {
                    let of = |row: &Vec<u32>| {
                        [2 * x, (2 * x + 1).min(width as usize - 1)]
                            .map(|x| sanitized(row[x], convention))
                    };
                    let ([a, b], [c, d]) = (of(&rows[0]), of(&rows[1]));
                    let expected = farther(farther(a, b), farther(c, d));
                    assert_eq!(*made, expected.to_bits(), "{convention:?} {width} {x}");
                }
                // What repeats the edge is no farther than it, and nothing behind it is written.
                let edge = out[width.div_ceil(2) as usize - 1];
                let of_edge = |bits: &u32| farther(f32::from_bits(*bits), f32::from_bits(edge));
                let end = out.len() - 3;
                assert!(
                    out[..end]
                        .iter()
                        .skip(width.div_ceil(2) as usize)
                        .all(|v| of_edge(v).to_bits() == edge)
                );
                assert_eq!(out[end..], [7; 3]);
            }
        }
    }
}
