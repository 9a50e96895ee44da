// Four texels of a row of any level, from the buffer that has them all.

// The farthest depths of the texels 4 q to 4 q + 3 of row y.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    let at = row_of(level, y) + VECTOR * q;
    return vec4<u32>(words[at], words[at + 1u], words[at + 2u], words[at + 3u]);
}

// Nothing is known of their nearest depths.
fn nearest_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(UNKNOWN_BITS);
}

// These pixels of level 0, as given.
fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    return texel_row(0u, q, y);
}
