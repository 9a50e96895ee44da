// Level 0 is a texture that is sampled (`source_depth.wgsl`, `source_float.wgsl`).
// One gather reads the four pixels around a corner.
// `source_whole.wgsl` or `source_part.wgsl` says where the image begins in its texture.

@group(0) @binding(1) var source_sampler: sampler;

// The pixels at columns t.x and t.z and rows t.y and t.w, as given; they are at most one apart.
// One gather reads the four pixels around their common corner.
// Where two columns or rows are the same, the gather has also read a neighbour, which is replaced.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let at = t.xy + source_origin() + vec2<u32>(1u);
    let corner = vec2<f32>(at) / vec2<f32>(textureDimensions(source));
    // From the order of a gather to rows.
    let pixels = gathered(corner).wzxy;
    let columns = select(pixels.xxzz, pixels, t.x < t.z);
    return select(columns.xyxy, columns, t.y < t.w);
}
