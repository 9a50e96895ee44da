// Four pixels of a row, from a texture that holds four per texel.

fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    return textureLoad(source, vec2<u32>(q, y));
}
