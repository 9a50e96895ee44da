// The verdict on an instance.
// Bit 1 says that it is kept; bit 0 tells the two verdicts of each kind apart.
// Twin: `Verdict` in `crates/hiz_core/src/output/verdict.rs`.
const OUTSIDE: u32 = 0u;
const OCCLUDED: u32 = 1u;
const VISIBLE: u32 = 2u;
const INVALID: u32 = 3u;

// How many there are, and the bits of a word that hold one; flags may stand above them.
const VERDICT_COUNT: u32 = 4u;
const VERDICT_MASK: u32 = VERDICT_COUNT - 1u;
