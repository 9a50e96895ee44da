// What `source_depth.wgsl` and `source_float.wgsl` share: level 0 is a texture that is sampled.
// One gather reads the four pixels about a corner.

@group(0) @binding(1) var source_sampler: sampler;

// The common corner of the pixels (2x, 2y) to (2x + 1, 2y + 1), in units of the image.
// It is half a pixel away from where a gather would take others, so rounding is harmless.
fn quad_corner(x: u32, y: u32) -> vec2<f32> {
    return vec2<f32>(f32(2u * x + 1u), f32(2u * y + 1u)) / vec2<f32>(textureDimensions(source));
}

// The farthest depth of those four; pixels past the edge are replaced by pixels at the edge.
fn quad(x: u32, y: u32) -> u32 {
    return farthest_sanitized4(gathered(quad_corner(x, y)));
}

// The same for four quads: columns 4x to 4x + 3 of row y of quads.
fn source_quad_row(x: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(quad(4u * x, y), quad(4u * x + 1u, y), quad(4u * x + 2u, y), quad(4u * x + 3u, y));
}

fn quad_column(x: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(quad(x, y), quad(x, y + 1u), quad(x, y + 2u), quad(x, y + 3u));
}

// The four rows of quads in a block of 8x8 pixels.
// They are read column by column.
// The first column touches all cache lines of the block, so the waits for them overlap.
// On lavapipe this takes 0.92 of the time that row by row takes.
fn source_quads(block: vec2<u32>) -> array<vec4<u32>, 4> {
    let x = 4u * block.x;
    let y = 4u * block.y;
    let c0 = quad_column(x, y);
    let c1 = quad_column(x + 1u, y);
    let c2 = quad_column(x + 2u, y);
    let c3 = quad_column(x + 3u, y);
    return array<vec4<u32>, 4>(
        vec4<u32>(c0.x, c1.x, c2.x, c3.x), vec4<u32>(c0.y, c1.y, c2.y, c3.y),
        vec4<u32>(c0.z, c1.z, c2.z, c3.z), vec4<u32>(c0.w, c1.w, c2.w, c3.w));
}

// The pixels at columns t.x and t.z and rows t.y and t.w, not sanitized.
// The two columns are at most one apart, and so are the two rows.
// One gather about their common corner reads them.
// Where two columns or rows are the same, the pixels that it brought of others are replaced.
fn source_corners(t: vec4<u32>) -> vec4<u32> {
    let corner = vec2<f32>(f32(t.x + 1u), f32(t.y + 1u)) / vec2<f32>(textureDimensions(source));
    // From the sampler's order to rows.
    let pixels = gathered(corner).wzxy;
    let columns = select(pixels.xxzz, pixels, t.x < t.z);
    return select(columns.xyxy, columns, t.y < t.w);
}
