// Four texels of a row of any level: pixels from the depth image, others from the chunks.

// The bits of the texels 4 q to 4 q + 3 of row y of a level; pixels of level 0 come as given.
// Tuning for software drivers: both are read, whatever the level, since they take both sides of a
// branch anyway.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    let l = pyramid.levels[level];
    let at = l.offset + y * l.stride + VECTOR * q;
    let stored = vec4<u32>(
        stored_bits(at), stored_bits(at + 1u), stored_bits(at + 2u), stored_bits(at + 3u));
    let is_image = level == 0u;
    return select(stored, pixel_row(select(0u, q, is_image), select(0u, y, is_image)), is_image);
}
