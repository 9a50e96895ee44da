// How the pyramid is laid out.
// It is one list of words, cut into chunks that each fit one storage binding.
// First comes a header, whose first word is the number of the reduction that filled the pyramid.
// Then come the texels of the stored levels, with padded rows.
// Twin: `crates/hiz_core/src/pyramid/mod.rs`, `PyramidUniform`.

struct Level {
    offset: u32,
    stride: u32,
    width: u32,
    height: u32,
}

struct Pyramid {
    levels: array<Level, 16>,
    // .xy: where each level lies in an atlas.
    origins: array<vec4<u32>, 16>,
    // A chunk holds 1 << chunk_shift texels.
    chunk_shift: u32,
    // Which levels are stored.
    // Level 0, the depth image, is always there.
    first_stored: u32,
    last_stored: u32,
    padding: u32,
}

// The number of chunks.
// With 1, everything lies in chunk_0, and the compiler drops the others.
override CHUNKS: u32;
