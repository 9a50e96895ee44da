// All levels, level 0 among them, in the buffer in which the host has made them.
// It has no nearest depths: culls that ask for those read elsewhere.
// `PyramidLayout::image` in `crates/hiz_core/src/pyramid/layout.rs` says where level 0 lies.

@group(0) @binding(3) var<storage, read> words: array<u32>;

// The number of the drawing that the image and its levels belong to.
fn reduction_number() -> u32 {
    return words[0];
}

// The word of a row's first texel.
fn row_of(level: u32, y: u32) -> u32 {
    let place = pyramid.origins[level].zw;
    return place.x + y * place.y;
}

// The texels at columns t.x and t.z and rows t.y and t.w of a level; pixels of level 0 as given.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    let top = row_of(level, t.y);
    let bottom = row_of(level, t.w);
    return vec4<u32>(words[top + t.x], words[top + t.z], words[bottom + t.x], words[bottom + t.z]);
}

// The farthest depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    return sanitized(words[row_of(level, y) + x]);
}

// What is known of the same texels' nearest depths: nothing is nearer than the near plane.
fn nearest_corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(near_bits());
}

fn nearest_texel(level: u32, x: u32, y: u32) -> u32 {
    return near_bits();
}
