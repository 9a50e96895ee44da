// How a reduction reads blocks of a packed image (`source_bits.wgsl`).

// The ends of each of four quads of 2x2 pixels, columns 4x to 4x + 3 of row y of quads.
// Pixels past the edge are replaced by pixels at the edge.
fn source_quad_row(x: u32, y: u32) -> Ends4 {
    let edge = textureDimensions(source) - vec2<u32>(1u);
    let first = min(vec2<u32>(2u * x, 2u * y), edge);
    let last = min(vec2<u32>(2u * x + 1u, 2u * y + 1u), edge);
    let top_left = textureLoad(source, first);
    let bottom_left = textureLoad(source, vec2<u32>(first.x, last.y));
    let top_right = textureLoad(source, vec2<u32>(last.x, first.y));
    let bottom_right = textureLoad(source, last);
    return in_row(
        ends_of_pixels(vec4<u32>(top_left.xy, bottom_left.xy)),
        ends_of_pixels(vec4<u32>(top_left.zw, bottom_left.zw)),
        ends_of_pixels(vec4<u32>(top_right.xy, bottom_right.xy)),
        ends_of_pixels(vec4<u32>(top_right.zw, bottom_right.zw)));
}

// The four rows of quads of a block.
fn source_quads(block: vec2<u32>) -> array<Ends4, BLOCK_QUADS> {
    let y = BLOCK_QUADS * block.y;
    return array<Ends4, BLOCK_QUADS>(
        source_quad_row(block.x, y), source_quad_row(block.x, y + 1u),
        source_quad_row(block.x, y + 2u), source_quad_row(block.x, y + 3u));
}
