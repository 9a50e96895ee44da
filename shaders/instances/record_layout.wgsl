// Where a record lies.
// Tuning for software drivers: records are in a texture, whose texels these drivers fetch whole.
// Words of a buffer they fetch one by one (docs/performance.md).
// Twin: `crates/hiz_core/src/instances/records.rs`.

// Records in a row of the texture, as a power of two.
// Twin: `RECORDS_PER_ROW` there.
const RECORDS_PER_ROW_LOG2: u32 = 10u;

// The position of texel k of record i, where each record has `texels`.
fn record_position(i: u32, k: u32, texels: u32) -> vec2<u32> {
    let column = i % (1u << RECORDS_PER_ROW_LOG2);
    return vec2<u32>(column * texels + k, i >> RECORDS_PER_ROW_LOG2);
}

// The bits of 2^62, beyond every camera's coordinate limit.
// A record of such numbers is invalid, whatever its kind.
// Twin: `BEYOND_LIMITS` in `crates/hiz_core/src/instances/volume_record.rs`.
const BEYOND_LIMITS_BITS: u32 = 0x5e800000u;
// The bits of -2^62: the centre of what is absent, on the first axis.
// It is the first word of a record, whatever its kind.
// Twin: `ABSENT_CENTER` in `crates/hiz_core/src/instances/volume_record.rs`.
const ABSENT_CENTER_BITS: u32 = 0xde800000u;
