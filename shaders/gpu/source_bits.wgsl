// Level 0 is a texture of float32 bits, with VECTOR pixels of a row per texel (rgba32uint).
// Uploads travel in this form for two reasons:
//
// - A driver may alter NaN and subnormals of a float texture.
// - A software driver reads four pixels at once in less time than one (docs/performance.md).
//
// The last texel of a row may reach past the image.
// What its spare pixels hold then counts as depth of the row's last pixels.

@group(0) @binding(0) var source: texture_storage_2d<rgba32uint, read>;

// A pixel as it was given.
fn source_given(x: u32, y: u32) -> u32 {
    return textureLoad(source, vec2<u32>(x >> VECTOR_LOG2, y))[x & VECTOR_MASK];
}

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

// The pixels at columns t.x and t.z and rows t.y and t.w, as given.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let texel = t >> vec4<u32>(VECTOR_LOG2, 0u, VECTOR_LOG2, 0u);
    let left = t.x & VECTOR_MASK;
    let right = t.z & VECTOR_MASK;
    return vec4<u32>(
        textureLoad(source, texel.xy)[left], textureLoad(source, texel.zy)[right],
        textureLoad(source, texel.xw)[left], textureLoad(source, texel.zw)[right]);
}
