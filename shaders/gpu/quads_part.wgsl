// Quads of 2x2 pixels of an image that is a rectangle of a texture (`source_part.wgsl`).

// The ends of the pixels (2x, 2y) to (2x + 1, 2y + 1).
// Pixels past the rectangle's edge are replaced by pixels at the edge.
fn quad(x: u32, y: u32) -> Ends {
    let first = vec2<u32>(2u * x, 2u * y);
    let edge = part_edge();
    return ends_of_pixels(
        source_corners(vec4<u32>(min(first, edge), min(first + vec2<u32>(1u), edge))));
}
