// Reads all levels from one texture, the atlas, so that one fetch serves every level.
// Each of its texels holds four neighbouring texels of a row of a level
// (`crates/hiz_core/src/pyramid/atlas.rs`).

@group(0) @binding(3) var atlas: texture_storage_2d<rgba32uint, read>;

// The number of the reduction whose depth image and stored levels these are.
// It is 0, which no reduction has, if they belong to two reductions.
// That happens if the copies ran after the next reduction.
fn reduction_number() -> u32 {
    let column = textureDimensions(atlas).x - 2u;
    let of_image = textureLoad(atlas, vec2<u32>(column, 0u)).x;
    let of_levels = textureLoad(atlas, vec2<u32>(column + 1u, 0u)).x;
    return select(0u, of_levels, of_levels == of_image);
}

// The texels at columns t.x and t.z and rows t.y and t.w of a level; those of level 0 are not
// sanitized.
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
