// Four texels of a row of any level, from an atlas.

// The pixels 4 q to 4 q + 3 of row y, as given.
fn pixel_row(q: u32, y: u32) -> vec4<u32> {
    return textureLoad(atlas, pyramid.origins[0].xy + vec2<u32>(q, y));
}

// The farthest depths of these texels of a stored level.
fn texel_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    if BOTH {
        let at = pyramid.origins[level].xy + vec2<u32>(2u * q, y);
        return vec4<u32>(
            textureLoad(atlas, at).xz, textureLoad(atlas, at + vec2<u32>(1u, 0u)).xz);
    }
    return textureLoad(atlas, pyramid.origins[level].xy + vec2<u32>(q, y));
}

// The nearest depths of the same texels.
fn nearest_row(level: u32, q: u32, y: u32) -> vec4<u32> {
    let at = pyramid.origins[level].xy + vec2<u32>(2u * q, y);
    return vec4<u32>(textureLoad(atlas, at).yw, textureLoad(atlas, at + vec2<u32>(1u, 0u)).yw);
}
