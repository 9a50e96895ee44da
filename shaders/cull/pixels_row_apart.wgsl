// Four texels of a row of a stored level.

// The texels 4 q to 4 q + 3 of row y.
// `end` is 0 for farthest depths, and `pyramid.nearest` for nearest ones.
fn stored_row(end: u32, level: u32, q: u32, y: u32) -> vec4<u32> {
    let l = pyramid.levels[level];
    let at = end + l.offset + y * l.stride + words_of(VECTOR * q);
    return vec4<u32>(
        stored_bits(at), stored_bits(at + words_of(1u)),
        stored_bits(at + words_of(2u)), stored_bits(at + words_of(3u)));
}

// The nearest depths of these texels.
fn nearest_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return stored_row(pyramid.nearest, level, q, y);
}

// Their farthest depths.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return stored_row(0u, level, q, y);
}
