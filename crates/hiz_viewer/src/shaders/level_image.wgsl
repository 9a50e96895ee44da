// Level 0 of a depth image with one sample per pixel.

@group(0) @binding(2) var image: texture_depth_2d;

fn farthest_of_image(pixel: vec2<i32>) -> f32 {
    return textureLoad(image, pixel, 0);
}
