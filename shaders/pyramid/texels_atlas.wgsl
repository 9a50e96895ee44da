// All levels that are there, in one texture: one fetch serves every level.
// A texel of the texture holds VECTOR pixels, or texels of a level, of one row.
// Twin: `crates/hiz_core/src/pyramid/atlas.rs`.

@group(0) @binding(3) var atlas: texture_storage_2d<rgba32uint, read>;

// Columns at the right end, each with a header in its first row.
// The first one numbers the reduction of the depth image, the second that of the stored levels.
// Twin: `HEADERS` in `crates/hiz_core/src/pyramid/layout.rs`.
const HEADERS: u32 = 2u;

// The number of the reduction that the depth image and the stored levels belong to.
// It is 0, which no reduction has, if they belong to two: the copies ran after the next reduction.
fn reduction_number() -> u32 {
    let column = textureDimensions(atlas).x - HEADERS;
    let of_image = textureLoad(atlas, vec2<u32>(column, 0u)).x;
    let of_levels = textureLoad(atlas, vec2<u32>(column + 1u, 0u)).x;
    return select(0u, of_levels, of_levels == of_image);
}

// Where the depths of a texel's column lie in a row of the copy, in words.
// Of a pixel there is one, and of a texel with both ends the nearest one follows the farthest.
fn word_of(level: u32, column: u32, end: u32) -> u32 {
    return select(column, 2u * column + end, BOTH && level > 0u);
}

// The same columns t.x and t.z as words, for `copied_corners`.
fn words_of(level: u32, t: vec4<u32>, end: u32) -> vec4<u32> {
    return vec4<u32>(word_of(level, t.x, end), t.y, word_of(level, t.z, end), t.w);
}

// The words at columns t.x and t.z and rows t.y and t.w, counted from `origin`, as copied.
fn copied_corners(origin: vec2<u32>, t: vec4<u32>) -> vec4<u32> {
    let at = origin.xyxy + (t >> vec4<u32>(VECTOR_LOG2, 0u, VECTOR_LOG2, 0u));
    let left = t.x & VECTOR_MASK;
    let right = t.z & VECTOR_MASK;
    return vec4<u32>(
        textureLoad(atlas, at.xy)[left], textureLoad(atlas, at.zy)[right],
        textureLoad(atlas, at.xw)[left], textureLoad(atlas, at.zw)[right]);
}

// The texels at columns t.x and t.z and rows t.y and t.w of a level; pixels of level 0 as given.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    let bits = copied_corners(pyramid.origins[level].xy, words_of(level, t, 0u));
    if RECEIVERS {
        return select(bits, foreground4(bits), level == 0u);
    }
    return bits;
}

// The same of nearest depths.
fn nearest_corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return copied_corners(pyramid.origins[level].xy, words_of(level, t, 1u));
}

// The depth of one end of the texel at column x and row y of a level, as copied.
fn copied(level: u32, end: u32, x: u32, y: u32) -> u32 {
    let word = word_of(level, x, end);
    let at = pyramid.origins[level].xy + vec2<u32>(word >> VECTOR_LOG2, y);
    return textureLoad(atlas, at)[word & VECTOR_MASK];
}

// The farthest depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    let bits = copied(level, 0u, x, y);
    return sanitized(select(bits, foreground(bits), level == 0u));
}

// The nearest depth of one texel of a level.
fn nearest_texel(level: u32, x: u32, y: u32) -> u32 {
    return sanitized_near(copied(level, 1u, x, y));
}
