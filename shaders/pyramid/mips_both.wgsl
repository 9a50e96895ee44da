// The list of a mip texture of both ends, and rows of it; `gpu/ends_both.wgsl` says what a texel
// is.
// `mips_one.wgsl` has the same functions for one end.

// Two texels per vector: the farthest depth and the nearest, one after the other.
@group(0) @binding(3) var<storage, read_write> list: array<vec4<u32>>;

fn load(index: u32) -> Ends {
    let pair = list[index >> 1u];
    let texel = select(pair.xy, pair.zw, (index & 1u) == 1u);
    return Ends(texel.x, texel.y);
}

fn store(index: u32, texel: Ends) {
    let first = 2u * (index & 1u);
    list[index >> 1u][first] = texel.far;
    list[index >> 1u][first + 1u] = texel.near;
}

// `index` is a multiple of two.
fn store_pair(index: u32, texels: Ends2) {
    let a = vec2<u32>(texels.far.x, texels.near.x);
    list[index >> 1u] = vec4<u32>(a, texels.far.y, texels.near.y);
}

// `index` is a multiple of four.
fn store_four(index: u32, texels: Ends4) {
    store_pair(index, Ends2(texels.far.xy, texels.near.xy));
    store_pair(index + 2u, Ends2(texels.far.zw, texels.near.zw));
}

// Four pixels of a row as they were given.
fn pixels_in_row(bits: vec4<u32>) -> Ends4 {
    return Ends4(sanitized4(bits), sanitized_near4(bits));
}

// The first, the second and the third texel that each of four halved ones takes of eight or nine.
fn firsts(left: Ends4, right: Ends4) -> Ends4 {
    return Ends4(vec4<u32>(left.far.xz, right.far.xz), vec4<u32>(left.near.xz, right.near.xz));
}

fn seconds(left: Ends4, right: Ends4) -> Ends4 {
    return Ends4(vec4<u32>(left.far.yw, right.far.yw), vec4<u32>(left.near.yw, right.near.yw));
}

fn thirds(left: Ends4, right: Ends4, ninth: Ends) -> Ends4 {
    return Ends4(
        vec4<u32>(left.far.z, right.far.x, right.far.z, ninth.far),
        vec4<u32>(left.near.z, right.near.x, right.near.z, ninth.near));
}

fn joined_rows(a: Ends4, b: Ends4) -> Ends4 {
    return Ends4(farthest_each(a.far, b.far), nearest_each(a.near, b.near));
}

// `joined` where a texel takes its third one, otherwise `pairs`.
fn chosen(pairs: Ends4, joined: Ends4, takes: vec4<bool>) -> Ends4 {
    return Ends4(select(pairs.far, joined.far, takes), select(pairs.near, joined.near, takes));
}
