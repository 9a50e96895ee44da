// Level 0 is two images: the farthest of each pixel's samples, and the nearest.
// Each is a texture of float32 bits as in `source_bits.wgsl`.
//
// A pixel shows the background alone where its nearest sample does.
// One that shows it beside a receiver has a farthest sample that is far, and keeps it.

@group(0) @binding(0) var source: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(7) var nearest_source: texture_storage_2d<rgba32uint, read>;

fn far_of_pair(far: u32, near: u32) -> u32 {
    return select(far, near_bits(), RECEIVERS && is_background(near));
}

fn far_of_pair4(far: vec4<u32>, near: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        far_of_pair(far.x, near.x), far_of_pair(far.y, near.y),
        far_of_pair(far.z, near.z), far_of_pair(far.w, near.w));
}

fn near_given(x: u32, y: u32) -> u32 {
    return textureLoad(nearest_source, vec2<u32>(x >> VECTOR_LOG2, y))[x & VECTOR_MASK];
}

fn far_given(x: u32, y: u32) -> u32 {
    let far = textureLoad(source, vec2<u32>(x >> VECTOR_LOG2, y))[x & VECTOR_MASK];
    return far_of_pair(far, near_given(x, y));
}

fn pair_ends(far: vec4<u32>, near: vec4<u32>) -> Ends {
    return ends_of_pair(far_of_pair4(far, near), near);
}

// The ends of two quads of 2x2 pixels, which lie in two texels below each other.
fn quads_of_texels(top: vec2<u32>, bottom: vec2<u32>) -> array<Ends, 2> {
    let a = textureLoad(source, top);
    let b = textureLoad(source, bottom);
    let c = textureLoad(nearest_source, top);
    let d = textureLoad(nearest_source, bottom);
    return array<Ends, 2>(
        pair_ends(vec4<u32>(a.xy, b.xy), vec4<u32>(c.xy, d.xy)),
        pair_ends(vec4<u32>(a.zw, b.zw), vec4<u32>(c.zw, d.zw)));
}

// The ends of each of four quads, columns 4x to 4x + 3 of row y of quads.
// Pixels past the edge are replaced by pixels at the edge.
fn source_quad_row(x: u32, y: u32) -> Ends4 {
    let edge = textureDimensions(source) - vec2<u32>(1u);
    let first = min(vec2<u32>(2u * x, 2u * y), edge);
    let last = min(vec2<u32>(2u * x + 1u, 2u * y + 1u), edge);
    let left = quads_of_texels(first, vec2<u32>(first.x, last.y));
    let right = quads_of_texels(vec2<u32>(last.x, first.y), last);
    return in_row(left[0], left[1], right[0], right[1]);
}

// The four rows of quads of a block.
fn source_quads(block: vec2<u32>) -> array<Ends4, BLOCK_QUADS> {
    let y = BLOCK_QUADS * block.y;
    return array<Ends4, BLOCK_QUADS>(
        source_quad_row(block.x, y), source_quad_row(block.x, y + 1u),
        source_quad_row(block.x, y + 2u), source_quad_row(block.x, y + 3u));
}

// The pixels at columns t.x and t.z and rows t.y and t.w, as given.
fn near_corners(t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        near_given(t.x, t.y), near_given(t.z, t.y), near_given(t.x, t.w), near_given(t.z, t.w));
}

fn far_corners(t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        far_given(t.x, t.y), far_given(t.z, t.y), far_given(t.x, t.w), far_given(t.z, t.w));
}
