// Texels of a mip texture that holds one end: the farthest depth of the pixels, or the nearest.

// True: the nearest depth; false: the farthest.
override NEAREST: bool;

// The bits of a texel's depth.
alias Ends = u32;

// Texels of a row that are made and stored together.
alias Four = array<Ends, BLOCK_QUADS>;

// Four texels per vector.
@group(0) @binding(3) var<storage, read_write> list: array<vec4<u32>>;

fn joined(a: Ends, b: Ends) -> Ends {
    return select(farthest(a, b), nearer(a, b), NEAREST);
}

fn ends_of(bits: u32) -> Ends {
    return select(sanitized(bits), sanitized_to_near(bits), NEAREST);
}

fn load(index: u32) -> Ends {
    return list[index >> VECTOR_LOG2][index & VECTOR_MASK];
}

fn store(index: u32, texel: Ends) {
    list[index >> VECTOR_LOG2][index & VECTOR_MASK] = texel;
}

// Stores four texels of a row; `index` is a multiple of four.
fn store_four(index: u32, texels: Four) {
    list[index >> VECTOR_LOG2] = vec4<u32>(texels[0], texels[1], texels[2], texels[3]);
}
