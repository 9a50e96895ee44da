// A header, whose first word numbers the reduction that filled the pyramid, and the stored levels:
// one list of texels, rows padded, cut into chunks that each fit one storage binding.

struct Level {
    offset: u32,
    stride: u32,
    width: u32,
    height: u32,
}

struct Pyramid {
    levels: array<Level, 16>,
    // .xy: where they lie in an atlas.
    origins: array<vec4<u32>, 16>,
    // A chunk holds 1 << chunk_shift texels.
    chunk_shift: u32,
    // Which levels are stored.
    // Level 0, the depth image, is always there.
    first_stored: u32,
    last_stored: u32,
    padding: u32,
}

// 1: everything lies in chunk_0, and the compiler drops the others.
override CHUNKS: u32;
