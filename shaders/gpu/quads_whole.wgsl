// Quads of 2x2 pixels of an image that is all of a texture's level (`source_whole.wgsl`).

// The common corner of the pixels (2x, 2y) to (2x + 1, 2y + 1), in units of the image.
// It is half a pixel from where a gather would take other pixels, so its rounding is harmless.
fn quad_corner(x: u32, y: u32) -> vec2<f32> {
    return vec2<f32>(f32(2u * x + 1u), f32(2u * y + 1u)) / vec2<f32>(textureDimensions(source));
}

// The ends of these four pixels; pixels past the edge are replaced by pixels at the edge.
fn quad(x: u32, y: u32) -> Ends {
    return ends_of_pixels(gathered(quad_corner(x, y)));
}
