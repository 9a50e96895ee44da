// Texels of a mip texture that holds both ends: x is the farthest depth, y the nearest.

// The bits of a texel's two depths.
alias Ends = vec2<u32>;

// Texels of a row that are made and stored together.
alias Four = array<Ends, BLOCK_QUADS>;

// Two texels per vector.
@group(0) @binding(3) var<storage, read_write> list: array<vec4<u32>>;

fn joined(a: Ends, b: Ends) -> Ends {
    return Ends(farthest(a.x, b.x), nearer(a.y, b.y));
}

fn ends_of(bits: u32) -> Ends {
    return Ends(sanitized(bits), sanitized_to_near(bits));
}

fn load(index: u32) -> Ends {
    let pair = list[index >> 1u];
    return select(pair.xy, pair.zw, (index & 1u) == 1u);
}

fn store(index: u32, texel: Ends) {
    let first = 2u * (index & 1u);
    list[index >> 1u][first] = texel.x;
    list[index >> 1u][first + 1u] = texel.y;
}

// Stores four texels of a row; `index` is a multiple of four.
fn store_four(index: u32, texels: Four) {
    list[index >> 1u] = vec4<u32>(texels[0], texels[1]);
    list[(index >> 1u) + 1u] = vec4<u32>(texels[2], texels[3]);
}
