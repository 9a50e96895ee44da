// The verdict on an instance.
// From VISIBLE on it is kept.
// Twin: `Verdict` in `crates/hiz_core/src/output/verdict.rs`.
const OUTSIDE: u32 = 0u;
const OCCLUDED: u32 = 1u;
const VISIBLE: u32 = 2u;
const INVALID: u32 = 3u;
const UNOCCLUDED: u32 = 4u;

// How many there are, and the bits of a word that hold one; flags may stand above them.
const VERDICT_COUNT: u32 = 5u;
const VERDICT_MASK: u32 = 7u;
