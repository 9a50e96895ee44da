// Four pixels of a row, from the images of the farthest and of the nearest samples.

fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    return textureLoad(source, vec2<u32>(q, y));
}

// The nearest samples of the same pixels.
fn near_pixel_row(q: u32, y: u32) -> vec4<u32> {
    return textureLoad(nearest_source, vec2<u32>(q, y));
}
