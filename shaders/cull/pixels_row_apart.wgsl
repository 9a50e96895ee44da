// Four texels of a row of any level: pixels from the depth image, others from the chunks.

// The texels 4 q to 4 q + 3 of row y of a stored level.
// `end` is 0 for farthest depths, and `pyramid.nearest` for nearest ones.
fn stored_row(end: u32, level: u32, q: u32, y: u32) -> vec4<u32> {
    let l = pyramid.levels[level];
    let at = end + l.offset + y * l.stride + VECTOR * q;
    return vec4<u32>(
        stored_bits(at), stored_bits(at + 1u), stored_bits(at + 2u), stored_bits(at + 3u));
}

// The nearest depths of these texels.
fn nearest_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return stored_row(pyramid.nearest, level, q, y);
}

// The bits of the texels 4 q to 4 q + 3 of row y of a level; pixels of level 0 come as given.
// Tuning for software drivers: both are read, whatever the level, since they take both sides of a
// branch anyway.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    let stored = stored_row(0u, level, q, y);
    let is_image = level == 0u;
    return select(stored, pixel_row(select(0u, q, is_image), select(0u, y, is_image)), is_image);
}
