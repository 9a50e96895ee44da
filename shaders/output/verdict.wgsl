// The verdicts on an instance.
// Bit 1 says whether it is kept; bit 0 tells the two verdicts of each kind apart.
// Twin: `crates/hiz_core/src/output/verdict.rs`, `Verdict`.
const OUTSIDE: u32 = 0u;
const OCCLUDED: u32 = 1u;
const VISIBLE: u32 = 2u;
const INVALID: u32 = 3u;
