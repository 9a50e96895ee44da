// Level 0 of a multisampled depth image: the farthest sample, with reversed Z.

@group(0) @binding(2) var image: texture_depth_multisampled_2d;

fn farthest_of_image(pixel: vec2<i32>) -> f32 {
    var farthest = 1.0;
    for (var s = 0; s < i32(textureNumSamples(image)); s++) {
        farthest = min(farthest, textureLoad(image, pixel, s));
    }
    return farthest;
}
