// Level 0 is the depth image, and the stored levels are where the reduction wrote them.

@group(0) @binding(3) var<storage, read> chunk_0: array<u32>;
@group(0) @binding(4) var<storage, read> chunk_1: array<u32>;
@group(0) @binding(5) var<storage, read> chunk_2: array<u32>;

// Where level 0 begins in its texture, and its last pixel; only `source_part.wgsl` asks.
fn part_origin() -> vec2<u32> {
    return vec2<u32>(view.source_origin & COORDINATE_MASK, view.source_origin >> COORDINATE_BITS);
}

fn part_edge() -> vec2<u32> {
    return vec2<u32>(view.size) - vec2<u32>(1u);
}

fn stored_bits(index: u32) -> u32 {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}

// How many words so many texels of a row take.
fn words_of(texels: u32) -> u32 {
    return select(texels, 2u * texels, BOTH);
}

// The number of the reduction that filled the pyramid.
fn reduction_number() -> u32 {
    return stored_bits(0u);
}

// The texels of a stored level at columns t.x and t.z and rows t.y and t.w.
// `end` is 0 for farthest depths, and `pyramid.nearest` for nearest ones.
fn stored_corners(end: u32, level: u32, t: vec4<u32>) -> vec4<u32> {
    let l = pyramid.levels[level];
    let top = end + l.offset + t.y * l.stride;
    let bottom = end + l.offset + t.w * l.stride;
    let left = words_of(t.x);
    let right = words_of(t.z);
    return vec4<u32>(
        stored_bits(top + left), stored_bits(top + right),
        stored_bits(bottom + left), stored_bits(bottom + right));
}

// The same for any level; pixels of level 0 come as given.
// Tuning for software drivers: both are read, whatever the level, since they take both sides of a
// branch anyway.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return select(stored_corners(0u, level, t), far_corners(t), level == 0u);
}

// The same of nearest depths.
fn nearest_corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return select(stored_corners(pyramid.nearest, level, t), near_corners(t), level == 0u);
}

// A texel of a stored level; `end` as above.
fn stored_texel(end: u32, level: u32, x: u32, y: u32) -> u32 {
    let l = pyramid.levels[level];
    return stored_bits(end + l.offset + y * l.stride + words_of(x));
}

// The farthest depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    if level == 0u {
        return sanitized(far_given(x, y));
    }
    return stored_texel(0u, level, x, y);
}

// The nearest depth of one texel of a level.
fn nearest_texel(level: u32, x: u32, y: u32) -> u32 {
    if level == 0u {
        return sanitized_near(near_given(x, y));
    }
    return stored_texel(pyramid.nearest, level, x, y);
}
