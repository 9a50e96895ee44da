// Level 0 is a texture of float32 bits (r32uint): uploads travel so, for a driver may alter NaN and subnormals of a float texture. It is
// read as a storage texture, texel by texel: faster than a gather on a software driver (docs/performance.md).

@group(0) @binding(0) var source: texture_storage_2d<r32uint, read>;

fn raw_bits(x: u32, y: u32) -> u32 {
    return textureLoad(source, vec2<u32>(x, y)).x;
}

fn source_bits(x: u32, y: u32) -> u32 {
    return sanitized(raw_bits(x, y));
}

// The farthest depth of the pixels (2x, 2y) to (2x + 1, 2y + 1), those past the edge replaced by the edge's.
fn source_quad(x: u32, y: u32) -> u32 {
    let edge = textureDimensions(source) - vec2<u32>(1u);
    let first = min(vec2<u32>(2u * x, 2u * y), edge);
    let last = min(vec2<u32>(2u * x + 1u, 2u * y + 1u), edge);
    return farthest_sanitized4(source_corners(vec4<u32>(first, last)));
}

// The same of four below each other, y to y + 3.
fn source_column(x: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(source_quad(x, y), source_quad(x, y + 1u), source_quad(x, y + 2u), source_quad(x, y + 3u));
}

// The pixels at columns t.x and t.z and rows t.y and t.w, as given.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(raw_bits(t.x, t.y), raw_bits(t.z, t.y), raw_bits(t.x, t.w), raw_bits(t.z, t.w));
}
