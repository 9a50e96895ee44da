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

// The pixels at columns t.x and t.z and rows t.y and t.w, as given.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let texel = t >> vec4<u32>(VECTOR_LOG2, 0u, VECTOR_LOG2, 0u);
    let left = t.x & VECTOR_MASK;
    let right = t.z & VECTOR_MASK;
    return vec4<u32>(
        textureLoad(source, texel.xy)[left], textureLoad(source, texel.zy)[right],
        textureLoad(source, texel.xw)[left], textureLoad(source, texel.zw)[right]);
}
