// Where the texels of a mip texture lie, for shaders that read one.
//
// `size` is the depth image's size in pixels, and `level` counts from the image, which is level 0.
// Pass both as numbers.
// `textureDimensions(texture, level)` is no substitute where neighbouring invocations may ask for
// different levels: one software driver answers all of them for the first one's level.

// The size of a level.
fn mip_size(size: vec2<u32>, level: u32) -> vec2<u32> {
    return max(size >> vec2<u32>(level), vec2<u32>(1u));
}

// The texel of a pixel, for the lookup by edge texels.
// It covers the pixel, and `mip_pixels` says which others.
fn mip_edge_texel(pixel: vec2<u32>, level: u32, size: vec2<u32>) -> vec2<u32> {
    return min(pixel >> vec2<u32>(level), mip_size(size, level) - vec2<u32>(1u));
}

// The first and the last pixel of a texel, for the lookup by edge texels.
fn mip_pixels(texel: vec2<u32>, level: u32, size: vec2<u32>) -> vec4<u32> {
    let is_last = texel + vec2<u32>(1u) >= mip_size(size, level);
    let end = select((texel + vec2<u32>(1u)) << vec2<u32>(level), size, is_last);
    return vec4<u32>(texel << vec2<u32>(level), end - vec2<u32>(1u));
}

// The texel at normalised coordinates, for the lookup by normalised coordinates.
// A sampler with nearest filtering takes the same one.
fn mip_texel_at(coordinates: vec2<f32>, level: u32, size: vec2<u32>) -> vec2<u32> {
    let texels = mip_size(size, level);
    let place = max(coordinates * vec2<f32>(texels), vec2<f32>(0.0));
    return min(vec2<u32>(place), texels - vec2<u32>(1u));
}

// The texel at a pixel's centre, in integers, for the lookup by normalised coordinates.
fn mip_centre_texel(pixel: vec2<u32>, level: u32, size: vec2<u32>) -> vec2<u32> {
    let texels = mip_size(size, level);
    return ((2u * pixel + vec2<u32>(1u)) * texels) / (2u * size);
}

// The finest level at which the pixels from `first` to `last` surely lie in 2x2 texels.
// It holds for both lookups.
fn mip_level_of(first: vec2<u32>, last: vec2<u32>, size: vec2<u32>) -> u32 {
    let span = max(last.x - first.x, last.y - first.y);
    let level = select(0u, firstLeadingBit(span - 1u) + 1u, span > 1u);
    return min(level, firstLeadingBit(max(size.x, size.y)));
}

// Where a level begins in a mip texture whose levels lie beside each other.
fn mip_origin(level: u32, size: vec2<u32>) -> vec2<u32> {
    if level == 0u {
        return vec2<u32>(0u);
    }
    return vec2<u32>(size.x, size.y - (size.y >> (level - 1u)) + level - 1u);
}
