// A level of a depth image out of the finer one, by a fragment shader.
//
// Source: Mike Turitzin, "Hierarchical Depth Buffers", 2020, "Generating the mip chain".
// Sizes are halved and rounded down.
// A texel covers two texels of the finer level along each axis, or three where its side is odd.
// Its depths are in reversed Z, so the farthest is the least.

@group(0) @binding(0) var finer: texture_2d<f32>;

// One triangle that covers the image.
@vertex
fn whole_image(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32((i & 1u) << 2u), f32((i >> 1u) << 2u));
    return vec4<f32>(corner - 1.0, 0.0, 1.0);
}

@fragment
fn farther_level(@builtin(position) at: vec4<f32>) -> @location(0) f32 {
    let size = textureDimensions(finer);
    let first = 2u * vec2<u32>(at.xy);
    let last = min(first + 1u + (size & vec2<u32>(1u)), size - 1u);
    var farthest = textureLoad(finer, first, 0).x;
    for (var y = first.y; y <= last.y; y += 1u) {
        for (var x = first.x; x <= last.x; x += 1u) {
            farthest = min(farthest, textureLoad(finer, vec2<u32>(x, y), 0).x);
        }
    }
    return farthest;
}
