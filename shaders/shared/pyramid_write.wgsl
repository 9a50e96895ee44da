// A pyramid and one step of its reduction: what is read, what is written.

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(3) var<storage, read_write> chunk_0: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> chunk_1: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> chunk_2: array<vec4<u32>>;
@group(1) @binding(0) var<uniform> step: Step;

struct Step {
    // The level that is read, and the last of the up to three above it that are written.
    source: u32,
    last: u32,
    // This reduction's number, for the header; 0: no header.
    reduction: u32,
    padding: u32,
    // How many 8x8 blocks: a multiple of 4 columns, so that rows are whole vectors on the third level too.
    blocks: vec2<u32>,
    padding_1: vec2<u32>,
}

// `index` is a multiple of 4, and so is the size of a chunk.
fn load4(index: u32) -> vec4<u32> {
    if CHUNKS == 1u {
        return chunk_0[index >> 2u];
    }
    let i = (index & ((1u << pyramid.chunk_shift) - 1u)) >> 2u;
    switch index >> pyramid.chunk_shift {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}

fn store4(index: u32, bits: vec4<u32>) {
    if CHUNKS == 1u {
        chunk_0[index >> 2u] = bits;
        return;
    }
    let i = (index & ((1u << pyramid.chunk_shift) - 1u)) >> 2u;
    switch index >> pyramid.chunk_shift {
        case 0u: { chunk_0[i] = bits; }
        case 1u: { chunk_1[i] = bits; }
        default: { chunk_2[i] = bits; }
    }
}

fn store(index: u32, bits: u32) {
    if CHUNKS == 1u {
        chunk_0[index >> 2u][index & 3u] = bits;
        return;
    }
    let i = index & ((1u << pyramid.chunk_shift) - 1u);
    switch index >> pyramid.chunk_shift {
        case 0u: { chunk_0[i >> 2u][i & 3u] = bits; }
        case 1u: { chunk_1[i >> 2u][i & 3u] = bits; }
        default: { chunk_2[i >> 2u][i & 3u] = bits; }
    }
}
