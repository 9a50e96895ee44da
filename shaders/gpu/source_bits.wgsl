// Level 0 is an upload: a texture of float32 bits, four pixels of a row per texel (rgba32uint).
// A driver may alter NaN and subnormals in a float texture, but not in this one.
// A software driver also reads four pixels at once in less time than one (docs/performance.md).
// Pixels past the image's width in a row's last texel count as depth at the end of the row.

@group(0) @binding(0) var source: texture_storage_2d<rgba32uint, read>;

fn source_bits(x: u32, y: u32) -> u32 {
    return sanitized(textureLoad(source, vec2<u32>(x >> 2u, y))[x & 3u]);
}

// The farthest depth of each of four quads of 2x2 pixels: columns 4x to 4x + 3 of row y of quads.
// Pixels past the edge are replaced by pixels at the edge.
fn source_quad_row(x: u32, y: u32) -> vec4<u32> {
    let edge = textureDimensions(source) - vec2<u32>(1u);
    let first = min(vec2<u32>(2u * x, 2u * y), edge);
    let last = min(vec2<u32>(2u * x + 1u, 2u * y + 1u), edge);
    let top_left = textureLoad(source, first);
    let bottom_left = textureLoad(source, vec2<u32>(first.x, last.y));
    let top_right = textureLoad(source, vec2<u32>(last.x, first.y));
    let bottom_right = textureLoad(source, last);
    return vec4<u32>(
        farthest_sanitized4(vec4<u32>(top_left.xy, bottom_left.xy)),
        farthest_sanitized4(vec4<u32>(top_left.zw, bottom_left.zw)),
        farthest_sanitized4(vec4<u32>(top_right.xy, bottom_right.xy)),
        farthest_sanitized4(vec4<u32>(top_right.zw, bottom_right.zw)));
}

// The same for the four rows of quads in a block of 8x8 pixels.
fn source_quads(block: vec2<u32>) -> array<vec4<u32>, 4> {
    let y = 4u * block.y;
    return array<vec4<u32>, 4>(
        source_quad_row(block.x, y), source_quad_row(block.x, y + 1u),
        source_quad_row(block.x, y + 2u), source_quad_row(block.x, y + 3u));
}

// The pixels at columns t.x and t.z and rows t.y and t.w, not sanitized.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let texel = t >> vec4<u32>(2u, 0u, 2u, 0u);
    let left = t.x & 3u;
    let right = t.z & 3u;
    return vec4<u32>(
        textureLoad(source, texel.xy)[left], textureLoad(source, texel.zy)[right],
        textureLoad(source, texel.xw)[left], textureLoad(source, texel.zw)[right]);
}
