// How bit planes lie in memory (`emit.wgsl`).
//
// `planes_one.wgsl` or `planes_four.wgsl` says how many planes make a set.
// The words of a set with the same number lie side by side.
// One load reads them all, and one vector counts their bits.

// Words of a set that one workgroup of `emit_block` counts, as a power of two.
const BLOCK_LOG2_WORDS: u32 = 10u;

// The number of sets.
fn sets() -> u32 {
    return (emit.lods + (PLANES - 1u)) / PLANES;
}

// The number of blocks of 1024 words of a set.
fn blocks_of_set() -> u32 {
    return (emit.words + ((1u << BLOCK_LOG2_WORDS) - 1u)) >> BLOCK_LOG2_WORDS;
}

// Where the counts of a word's block stand; word `emit.words` is not there, but its counts are.
fn block_at(s: u32, word: u32) -> u32 {
    let block = select(word >> BLOCK_LOG2_WORDS, blocks_of_set(), word >= emit.words);
    return s * (blocks_of_set() + 1u) + block;
}

// The instances of a word that any set keeps; for planes in the order of indices.
fn in_any_set(word: u32) -> u32 {
    var bits = 0u;
    for (var s = 0u; s < sets(); s += 1u) {
        bits |= in_any_plane(planes[s * emit.words + word]);
    }
    return bits;
}
