// Where the bits of the instances lie that a cull is restricted to: a bit per place.

// Words in a row of the texture, as a power of two.
// Twin: `WORDS_PER_ROW` in `crates/hiz_core/src/cull/among.rs`.
const AMONG_PER_ROW_LOG2: u32 = 12u;
// Places per word.
// Twin: `u32::BITS`.
const AMONG_BITS: u32 = 32u;

fn among_position(word: u32) -> vec2<u32> {
    return vec2<u32>(word % (1u << AMONG_PER_ROW_LOG2), word >> AMONG_PER_ROW_LOG2);
}
