// Where a record lies in the texture of records.
// It is a texture because a software driver fetches a texel whole, and a buffer word by word
// (docs/performance.md).
// Twin: `crates/hiz_core/src/instances/records.rs`.

// Records in a row of the texture, as a power of two.
const RECORDS_PER_ROW_LOG2: u32 = 10u;

// Where texel k of record i lies, if each record has `texels` texels.
fn record_position(i: u32, k: u32, texels: u32) -> vec2<u32> {
    let column = i % (1u << RECORDS_PER_ROW_LOG2);
    return vec2<u32>(column * texels + k, i >> RECORDS_PER_ROW_LOG2);
}
