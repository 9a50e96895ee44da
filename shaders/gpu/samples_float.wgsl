// A multisampled color texture of one float channel (r32float, r16float).

@group(0) @binding(0) var source: texture_multisampled_2d<f32>;

fn sample_bits(at: vec2<u32>, k: i32) -> u32 {
    return bitcast<u32>(textureLoad(source, at, k).x);
}
