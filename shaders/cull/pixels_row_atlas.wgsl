// Four texels of a row of any level, from an atlas.

// The pixels 4 q to 4 q + 3 of row y, as given.
fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    return texel_row(0u, q, y);
}

// The farthest depths of these texels of a level.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return textureLoad(atlas, pyramid.origins[level].xy + vec2<u32>(q, y));
}

// The nearest depths of the same texels of a stored level.
fn nearest_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    return textureLoad(atlas, pyramid.origins[level].zw + vec2<u32>(q, y));
}
