// Four pixels of a row, from a texture that is sampled.

fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    let edge = u32(view.size.x) - 1u;
    let x = min(vec4<u32>(VECTOR * q) + vec4<u32>(0u, 1u, 2u, 3u), vec4<u32>(edge));
    let left = source_corners(vec4<u32>(x.x, y, x.y, y));
    let right = source_corners(vec4<u32>(x.z, y, x.w, y));
    return vec4<u32>(left.xy, right.xy);
}
