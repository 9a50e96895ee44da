// Where a record lies: in a texture, whose texels a software driver fetches whole, where it picks a
// buffer's words one by one (docs/performance.md).
// Twin: `crates/hiz_core/src/instances/records.rs`.

// Records in a row of the texture, as a power of two.
const RECORDS_PER_ROW_LOG2: u32 = 10u;

// Texel k of record i, of `texels` each.
fn record_position(i: u32, k: u32, texels: u32) -> vec2<u32> {
    let column = i % (1u << RECORDS_PER_ROW_LOG2);
    return vec2<u32>(column * texels + k, i >> RECORDS_PER_ROW_LOG2);
}
