// How a mip texture reads level 0 from a texture that is sampled (`source_sampled.wgsl`).

// The pixels at columns x and x + 1 of rows y and y + 1, as given.
fn two_by_two(x: u32, y: u32) -> vec4<u32> {
    let edge = part_edge().xyxy;
    return source_corners(min(vec4<u32>(x, y, x + 1u, y + 1u), edge));
}

// Four pixels from column 4x on, of row y and of the row below it, as given.
// Pixels past the edge are replaced by pixels of the edge.
fn two_rows(x: u32, y: u32) -> array<vec4<u32>, 2> {
    let left = two_by_two(VECTOR * x, y);
    let right = two_by_two(VECTOR * x + 2u, y);
    return array<vec4<u32>, 2>(vec4<u32>(left.xy, right.xy), vec4<u32>(left.zw, right.zw));
}
