//! How far a descent may go.
//!
//! llvmpipe ends the loops of an invocation after [`MOST_ITERATIONS`] together (`gpu/loops.rs`).
//! Where it does, instances are not tested, and bits of what is visible stay 0.
//! So on processors a descent has a budget that ends before.
//! What an invocation can take at most:
//!
//! | part | iterations at most |
//! |---|---:|
//! | an invocation tests and reports RUN = 8 instances | 2 (RUN + 1) |
//! | two footprints of an instance, of 8x8 texels each | 2 (9 + 8 x 9) |
//! | its planes, its level of detail, its place in lists | 128 |
//! | each texel of a descent | 1, and with planes ROUNDS + 1 |
//! | each texel of a descent down the nearest end | 1 |

use crate::cull::groups::GROUPS_OF_RUN;
use crate::cull::options::Fit;
use crate::gpu::loops::MOST_ITERATIONS;

/// Planes of one round of `surely_clear`, and the most rounds; `shaders/cull/supporting_planes.wgsl`.
///
/// Spheres have the most planes: 16 of the outline, and 8 of the front.
pub(crate) const PLANES_OF_ROUND: u32 = 4;
pub(crate) const MOST_ROUNDS: u32 = 24_u32.div_ceil(PLANES_OF_ROUND);

/// Iterations for an instance beside its descents, and for an invocation beside its instances.
const BESIDE_DESCENTS: u32 = 512;
const BESIDE_INSTANCES: u32 = 1024;
const _: () =
    assert!(2 * (9 + 8 * 9) + 128 < BESIDE_DESCENTS && 2 * (GROUPS_OF_RUN + 1) < BESIDE_INSTANCES);

/// How many texels a descent may read on a processor.
pub(crate) const fn most_on_processors(fit: Fit, both_ends: bool) -> u32 {
    let of_instance = (MOST_ITERATIONS - BESIDE_INSTANCES) / GROUPS_OF_RUN - BESIDE_DESCENTS;
    let of_planes = match fit {
        Fit::Rectangle => 0,
        Fit::Volume => MOST_ROUNDS + 1,
    };
    of_instance / (1 + of_planes + both_ends as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budgets_by_hand() {
        // (65535 - 1024) / 8 - 512 = 7551
        assert_eq!(most_on_processors(Fit::Rectangle, false), 7551);
        assert_eq!(most_on_processors(Fit::Rectangle, true), 3775);
        assert_eq!(most_on_processors(Fit::Volume, false), 943);
        assert_eq!(most_on_processors(Fit::Volume, true), 839);
    }
}
