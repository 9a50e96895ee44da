// Both ends are taken of the same image.
// `source_pair.wgsl` has two images.

fn far_given(x: u32, y: u32) -> u32 {
    return foreground(source_given(x, y));
}

fn near_given(x: u32, y: u32) -> u32 {
    return source_given(x, y);
}

fn far_corners(t: vec4<u32>) -> vec4<u32> {
    return foreground4(source_corners(t));
}

fn near_corners(t: vec4<u32>) -> vec4<u32> {
    return source_corners(t);
}
