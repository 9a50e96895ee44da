// A cull by a mip texture, as shaders without certificates have it: one level, one gather.
// It needs `mip_lookup.wgsl` in the same shader.
//
// The texture holds the farthest depths, all levels beside each other, for the lookup by edge
// texels.
// The answer is no proof: a rounding error of the caller's rectangle or depth can hide what shows.
// `docs/rust.md` has the counts beside those of the certified cull.

// The farthest depth of the pixels from `first` to `last`, or of some more.
// `nearest_texel` is a sampler with nearest filtering.
fn mip_farthest(
    mips: texture_2d<f32>, nearest_texel: sampler,
    first: vec2<u32>, last: vec2<u32>, size: vec2<u32>, reversed: bool,
) -> f32 {
    let level = mip_level_of(first, last, size);
    let low = mip_edge_texel(first, level, size);
    let high = mip_edge_texel(last, level, size);
    let corner = vec2<f32>(mip_origin(level, size) + low + vec2<u32>(1u));
    let place = corner / vec2<f32>(textureDimensions(mips));
    let gathered = textureGather(0, mips, nearest_texel, place);
    // From the order of a gather to rows.
    let quad = gathered.wzxy;
    // Where both are the same column or row, the gather has also read a neighbour.
    let columns = select(quad.xxzz, quad, low.x < high.x);
    let texels = select(columns.xyxy, columns, low.y < high.y);
    let least = min(min(texels.x, texels.y), min(texels.z, texels.w));
    let most = max(max(texels.x, texels.y), max(texels.z, texels.w));
    return select(most, least, reversed);
}

// Whether all pixels from `first` to `last` hold a depth nearer than `depth`, the nearest of what
// is tested.
fn mip_hides(
    mips: texture_2d<f32>, nearest_texel: sampler,
    first: vec2<u32>, last: vec2<u32>, size: vec2<u32>, depth: f32, reversed: bool,
) -> bool {
    let farthest_depth = mip_farthest(mips, nearest_texel, first, last, size, reversed);
    if reversed {
        return farthest_depth > depth;
    }
    return farthest_depth < depth;
}
