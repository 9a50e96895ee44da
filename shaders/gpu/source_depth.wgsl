// Level 0 is a depth texture.

@group(0) @binding(0) var source: texture_depth_2d;

// A pixel as it was given.
fn source_given(x: u32, y: u32) -> u32 {
    return bitcast<u32>(textureLoad(source, vec2<u32>(x, y) + source_origin(), 0));
}

// The four pixels around a point, in the order of a gather:
// bottom left, bottom right, top right, top left.
fn gathered(corner: vec2<f32>) -> vec4<u32> {
    return bitcast<vec4<u32>>(textureGather(source, source_sampler, corner));
}
