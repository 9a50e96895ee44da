// The list of a mip texture of one end, and rows of it; `gpu/ends_one.wgsl` says what a texel is.
// `mips_both.wgsl` has the same functions for both ends.

// Four texels per vector.
@group(0) @binding(3) var<storage, read_write> list: array<vec4<u32>>;

fn load(index: u32) -> Ends {
    return list[index >> VECTOR_LOG2][index & VECTOR_MASK];
}

fn store(index: u32, texel: Ends) {
    list[index >> VECTOR_LOG2][index & VECTOR_MASK] = texel;
}

fn store_pair(index: u32, texels: Ends2) {
    store(index, texels.x);
    store(index + 1u, texels.y);
}

// `index` is a multiple of four.
fn store_four(index: u32, texels: Ends4) {
    list[index >> VECTOR_LOG2] = texels;
}

// Four pixels of a row as they were given.
fn pixels_in_row(bits: vec4<u32>) -> Ends4 {
    return sanitized4(bits);
}

// The first, the second and the third texel that each of four halved ones takes of eight or nine.
fn firsts(left: Ends4, right: Ends4) -> Ends4 {
    return vec4<u32>(left.xz, right.xz);
}

fn seconds(left: Ends4, right: Ends4) -> Ends4 {
    return vec4<u32>(left.yw, right.yw);
}

fn thirds(left: Ends4, right: Ends4, ninth: Ends) -> Ends4 {
    return vec4<u32>(left.z, right.x, right.z, ninth);
}

fn joined_rows(a: Ends4, b: Ends4) -> Ends4 {
    return farthest_each(a, b);
}

// `joined` where a texel takes its third one, otherwise `pairs`.
fn chosen(pairs: Ends4, joined: Ends4, takes: vec4<bool>) -> Ends4 {
    return select(pairs, joined, takes);
}
