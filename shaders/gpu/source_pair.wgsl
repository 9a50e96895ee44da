// Level 0 is two images: the farthest of each pixel's samples, and the nearest.
// Each is a texture of float32 bits as in `source_bits.wgsl`.
//
// A pixel shows the background alone where its nearest sample does.
// One that shows it beside a receiver has a farthest sample that is far, and keeps it.

@group(0) @binding(0) var source: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(7) var nearest_source: texture_storage_2d<rgba32uint, read>;

fn far_of_pair(far: u32, near: u32) -> u32 {
    return select(far, near_bits(), RECEIVERS & is_background(near));
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

// The pixels at columns t.x and t.z and rows t.y and t.w, as given.
fn near_corners(t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        near_given(t.x, t.y), near_given(t.z, t.y), near_given(t.x, t.w), near_given(t.z, t.w));
}

fn far_corners(t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        far_given(t.x, t.y), far_given(t.z, t.y), far_given(t.x, t.w), far_given(t.z, t.w));
}
