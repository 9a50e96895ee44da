// Level 0 is one image: of several samples per pixel it has the farthest alone.

// Nothing is known of the nearest samples of four pixels of a row.
fn near_pixel_row(q: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(UNKNOWN_BITS);
}
