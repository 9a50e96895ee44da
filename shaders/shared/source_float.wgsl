// Level 0 is a color texture of one float channel (r32float).

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var source_sampler: sampler;

fn source_bits(x: u32, y: u32) -> u32 {
    return sanitized(bitcast<u32>(textureLoad(source, vec2<u32>(x, y), 0).x));
}

// The common corner of the pixels (2x, 2y) to (2x + 1, 2y + 1), in units of the image: half a pixel from where a gather would take
// others, so that rounding is harmless.
fn quad_corner(x: u32, y: u32) -> vec2<f32> {
    return vec2<f32>(f32(2u * x + 1u), f32(2u * y + 1u)) / vec2<f32>(textureDimensions(source));
}

// Their farthest depth, those past the edge replaced by the edge's.
fn source_quad(x: u32, y: u32) -> u32 {
    return farthest_sanitized4(bitcast<vec4<u32>>(textureGather(0, source, source_sampler, quad_corner(x, y))));
}

// The same of four below each other, y to y + 3.
fn source_column(x: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(source_quad(x, y), source_quad(x, y + 1u), source_quad(x, y + 2u), source_quad(x, y + 3u));
}

// The pixels at columns t.x and t.z and rows t.y and t.w, as given; at most one apart. One gather about their common corner, and
// where two are the same what it brought of others is replaced.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let corner = vec2<f32>(f32(t.x + 1u), f32(t.y + 1u)) / vec2<f32>(textureDimensions(source));
    // In the sampler's order: bottom left, bottom right, top right, top left.
    let quad = bitcast<vec4<u32>>(textureGather(0, source, source_sampler, corner)).wzxy;
    let columns = select(quad.xxzz, quad, t.x < t.z);
    return select(columns.xyxy, columns, t.y < t.w);
}
