// All levels that are there in one texture, four pixels or texels of a row a texel of it
// (`crates/hiz_core/src/pyramid/atlas.rs`): one fetch serves every level.

@group(0) @binding(3) var atlas: texture_storage_2d<rgba32uint, read>;

// The number of the reduction whose depth image and stored levels these are; 0, which none has,
// where they are of two reductions: the copies ran after the next one.
fn reduction_number() -> u32 {
    let column = textureDimensions(atlas).x - 2u;
    let of_image = textureLoad(atlas, vec2<u32>(column, 0u)).x;
    let of_levels = textureLoad(atlas, vec2<u32>(column + 1u, 0u)).x;
    return select(0u, of_levels, of_levels == of_image);
}

// The texels at columns t.x and t.z and rows t.y and t.w of a level; level 0's as given.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    let at = pyramid.origins[level].xyxy + (t >> vec4<u32>(2u, 0u, 2u, 0u));
    let left = t.x & 3u;
    let right = t.z & 3u;
    return vec4<u32>(
        textureLoad(atlas, at.xy)[left], textureLoad(atlas, at.zy)[right],
        textureLoad(atlas, at.xw)[left], textureLoad(atlas, at.zw)[right]);
}

// The depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    return sanitized(textureLoad(atlas, pyramid.origins[level].xy + vec2<u32>(x >> 2u, y))[x & 3u]);
}
