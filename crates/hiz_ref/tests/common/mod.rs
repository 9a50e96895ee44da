//! Random cases from a seed, shared by the tests and the throughput example.
//! None of them uses all of it.
#![allow(dead_code, unreachable_pub)]

pub mod scenes;

/// `SplitMix64` (Steele, Lea and Flood 2014): small, seeded, good enough.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A whole number of `from..=to`.
    pub fn whole(&mut self, from: i64, to: i64) -> i64 {
        let count = u64::try_from(to - from + 1).expect("from <= to");
        from + i64::try_from(self.bits() % count).expect("small")
    }
}
