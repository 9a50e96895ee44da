// How a mip texture reads level 0 from a texture of four pixels per texel (`source_bits.wgsl`).

// Four pixels from column 4x on, of row y and of the row below it, as given.
// Pixels past the edge are replaced by pixels of the edge.
fn two_rows(x: u32, y: u32) -> array<vec4<u32>, 2> {
    let edge = part_edge();
    let column = min(x, edge.x >> VECTOR_LOG2);
    let above = textureLoad(source, vec2<u32>(column, min(y, edge.y)));
    let below = textureLoad(source, vec2<u32>(column, min(y + 1u, edge.y)));
    // The last texel of a row may hold anything past the image.
    let is_spare = vec4<u32>(VECTOR * column) + vec4<u32>(0u, 1u, 2u, 3u) > vec4<u32>(edge.x);
    let last = edge.x & VECTOR_MASK;
    return array<vec4<u32>, 2>(
        select(above, vec4<u32>(above[last]), is_spare),
        select(below, vec4<u32>(below[last]), is_spare));
}
