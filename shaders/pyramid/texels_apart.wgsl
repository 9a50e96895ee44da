// Reads level 0 from the depth image, and the other levels from where the reduction left them.

@group(0) @binding(3) var<storage, read> chunk_0: array<u32>;
@group(0) @binding(4) var<storage, read> chunk_1: array<u32>;
@group(0) @binding(5) var<storage, read> chunk_2: array<u32>;

fn stored_bits(index: u32) -> u32 {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}

// The number of the reduction that filled the pyramid.
fn reduction_number() -> u32 {
    return stored_bits(0u);
}

// The stored texels at columns t.x and t.z and rows t.y and t.w of a level.
fn stored_corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    let l = pyramid.levels[level];
    let top = l.offset + t.y * l.stride;
    let bottom = l.offset + t.w * l.stride;
    return vec4<u32>(
        stored_bits(top + t.x), stored_bits(top + t.z), stored_bits(bottom + t.x), stored_bits(bottom + t.z));
}

// The same for any level; those of level 0 are not sanitized.
// Both are read, whatever the level, since a software driver takes both ways of a branch.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return select(stored_corners(level, t), source_corners(t), level == 0u);
}

// The depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    if level == 0u {
        return source_bits(x, y);
    }
    let l = pyramid.levels[level];
    return stored_bits(l.offset + y * l.stride + x);
}
