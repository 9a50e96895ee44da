//! The Morton curve, along which neighbours in space are neighbours in memory.
//!
//! Source: Morton, "A computer oriented geodetic data base and a new technique in file sequencing",
//! IBM, 1966.

/// Spreads the 21 lowest bits: each is followed by two zeros.
#[inline(always)]
pub(crate) fn spread(v: u64) -> u64 {
    let v = (v | v << 32) & 0x001F_0000_0000_FFFF;
    let v = (v | v << 16) & 0x001F_0000_FF00_00FF;
    let v = (v | v << 8) & 0x100F_00F0_0F00_F00F;
    let v = (v | v << 4) & 0x10C3_0C30_C30C_30C3;
    (v | v << 2) & 0x1249_2492_4924_9249
}
