// The depth pyramid: a list of texels in up to three storage bindings, the chunks.
// The list begins with a header, whose first word is the number of the reduction that filled it.
// The stored levels follow, one after the other, with padded rows.
// Where both ends are stored, the nearest depth of a texel follows its farthest.

// Twin: `MAX_LEVELS` in `crates/hiz_core/src/pyramid/levels.rs`.
const MAX_LEVELS: u32 = 16u;

// Twin: `Level` in `crates/hiz_core/src/pyramid/levels.rs`.
struct Level {
    // In words of the list; both are 0 for a level that is not stored.
    offset: u32,
    stride: u32,
    width: u32,
    height: u32,
}

// Twin: `PyramidUniform` in `crates/hiz_core/src/pyramid/mod.rs`.
struct Pyramid {
    levels: array<Level, MAX_LEVELS>,
    // Column and row where each level begins in an atlas (`texels_atlas.wgsl`).
    // Then its first word, and the words from row to row, in a buffer that has all levels
    // (`texels_in_place.wgsl`).
    origins: array<vec4<u32>, MAX_LEVELS>,
    // A chunk holds 1 << chunk_shift words.
    chunk_shift: u32,
    // Which levels above 0 are stored; level 0 is the depth image.
    first_stored: u32,
    last_stored: u32,
    // How many words behind a farthest depth the nearest one lies.
    nearest: u32,
}

// The number of chunks; with 1 the compiler drops the code for the others.
override CHUNKS: u32;
