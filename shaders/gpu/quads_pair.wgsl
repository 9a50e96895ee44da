// How a reduction reads blocks of a pair of packed images (`source_pair.wgsl`).

fn pair_ends(far: vec4<u32>, near: vec4<u32>) -> Ends {
    return ends_of_pair(far_of_pair4(far, near), near);
}

// The ends of two quads of 2x2 pixels, which lie in two texels below each other.
fn quads_of_texels(top: vec2<u32>, bottom: vec2<u32>) -> array<Ends, 2> {
    let a = textureLoad(source, top);
    let b = textureLoad(source, bottom);
    let c = textureLoad(nearest_source, top);
    let d = textureLoad(nearest_source, bottom);
    return array<Ends, 2>(
        pair_ends(vec4<u32>(a.xy, b.xy), vec4<u32>(c.xy, d.xy)),
        pair_ends(vec4<u32>(a.zw, b.zw), vec4<u32>(c.zw, d.zw)));
}

// The ends of each of four quads, columns 4x to 4x + 3 of row y of quads.
// Pixels past the edge are replaced by pixels at the edge.
fn source_quad_row(x: u32, y: u32) -> Ends4 {
    let edge = textureDimensions(source) - vec2<u32>(1u);
    let first = min(vec2<u32>(2u * x, 2u * y), edge);
    let last = min(vec2<u32>(2u * x + 1u, 2u * y + 1u), edge);
    let left = quads_of_texels(first, vec2<u32>(first.x, last.y));
    let right = quads_of_texels(vec2<u32>(last.x, first.y), last);
    return in_row(left[0], left[1], right[0], right[1]);
}

// The four rows of quads of a block.
fn source_quads(block: vec2<u32>) -> array<Ends4, BLOCK_QUADS> {
    let y = BLOCK_QUADS * block.y;
    return array<Ends4, BLOCK_QUADS>(
        source_quad_row(block.x, y), source_quad_row(block.x, y + 1u),
        source_quad_row(block.x, y + 2u), source_quad_row(block.x, y + 3u));
}
