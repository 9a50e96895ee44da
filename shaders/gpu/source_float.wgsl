// Level 0 is a color texture of one float channel (r32float, r16float).

@group(0) @binding(0) var source: texture_2d<f32>;

// A pixel as it was given.
fn source_given(x: u32, y: u32) -> u32 {
    let at = vec2<u32>(x, y) + source_origin();
    return bitcast<u32>(textureLoad(source, at, 0).x);
}

// The four pixels around a point, in the order of a gather:
// bottom left, bottom right, top right, top left.
fn gathered(corner: vec2<f32>) -> vec4<u32> {
    return bitcast<vec4<u32>>(textureGather(0, source, source_sampler, corner));
}
