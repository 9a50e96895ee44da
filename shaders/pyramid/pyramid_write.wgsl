// One step of a reduction: what it reads, and how it writes to the pyramid's chunks.
// Twin: `crates/hiz_core/src/pyramid/reduce.rs`, `StepUniform`.

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(3) var<storage, read_write> chunk_0: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> chunk_1: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> chunk_2: array<vec4<u32>>;
@group(1) @binding(0) var<uniform> step: Step;

struct Step {
    // The level that is read, and the last level that is written.
    source: u32,
    last: u32,
    // This reduction's number, for the header; 0 if this step writes no header.
    reduction: u32,
    padding: u32,
    // The number of blocks of 8x8 texels, as columns and rows.
    // Columns are a multiple of 4, so that rows are whole vectors on the third level, too.
    blocks: vec2<u32>,
    padding_1: vec2<u32>,
}

// True: neighbouring invocations read below each other.
override TALL: bool;

// The block of an invocation of a workgroup of 64: one of 64 in a row, or with TALL one of 8x8.
//
// A software driver reads for eight invocations at once.
// Eight below each other walk along their rows in small steps, which the processor foresees.
// Eight in a row take large steps (docs/performance.md).
fn place_of(workgroup: vec2<u32>, lane: u32) -> vec2<u32> {
    if TALL {
        return 8u * workgroup + place_in_square(lane);
    }
    return vec2<u32>(64u * workgroup.x + lane, workgroup.y);
}

// The place of an invocation in a workgroup that is a square of 8x8.
fn place_in_square(lane: u32) -> vec2<u32> {
    let down = vec2<u32>(lane >> 3u, lane & 7u);
    return select(down.yx, down, TALL);
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
