// Level 0 is a rectangle of a texture: a viewport, or what dynamic resolution uses of it.
// Its neighbours may hold anything, so no pixel beside the rectangle counts.
// `part_origin` and `part_edge` come from what reads it: `../pyramid/pyramid_write.wgsl` or
// `../pyramid/texels_apart.wgsl`.

fn source_origin() -> vec2<u32> {
    return part_origin();
}

// The ends of the pixels (2x, 2y) to (2x + 1, 2y + 1).
// Pixels past the rectangle's edge are replaced by pixels at the edge.
fn quad(x: u32, y: u32) -> Ends {
    let first = vec2<u32>(2u * x, 2u * y);
    let edge = part_edge();
    return ends_of_pixels(
        source_corners(vec4<u32>(min(first, edge), min(first + vec2<u32>(1u), edge))));
}
