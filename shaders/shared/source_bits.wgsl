// Level 0 is a texture of float32 bits (r32uint): uploads travel so, for a driver may alter NaN and subnormals of a float texture.

@group(0) @binding(0) var source: texture_2d<u32>;
@group(0) @binding(1) var source_sampler: sampler;

fn source_bits(x: u32, y: u32) -> u32 {
    return sanitized(textureLoad(source, vec2<u32>(x, y), 0).x);
}

// The pixels (2x, 2y) to (2x + 1, 2y + 1), those past the edge replaced by the edge's: gathered about their common corner,
// half a pixel from where another footprint would begin.
fn source_quad(x: u32, y: u32) -> vec4<u32> {
    let corner = vec2<f32>(f32(2u * x + 1u), f32(2u * y + 1u)) / vec2<f32>(textureDimensions(source));
    return sanitized4(textureGather(0, source, source_sampler, corner));
}
