// A multisampled depth texture.

@group(0) @binding(0) var source: texture_depth_multisampled_2d;

fn sample_bits(at: vec2<u32>, k: i32) -> u32 {
    return bitcast<u32>(textureLoad(source, at, k));
}
