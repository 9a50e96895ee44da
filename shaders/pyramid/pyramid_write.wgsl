// The pyramid as the reduction writes it, and one step of the reduction.

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(3) var<storage, read_write> chunk_0: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> chunk_1: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> chunk_2: array<vec4<u32>>;
@group(1) @binding(0) var<uniform> step: Step;

// Twin: `StepUniform` in `crates/hiz_core/src/pyramid/steps.rs`.
struct Step {
    // The level that is read, and the last of the levels above it that are written.
    source: u32,
    last: u32,
    // The columns and rows of blocks that are read: from `begin` to before `end`.
    // All of a level ends at a multiple of VECTOR columns, so rows are whole vectors on the third
    // level, too.
    end: vec2<u32>,
    begin: vec2<u32>,
    // Where level 0 begins in its texture, if it is a part of it.
    origin: vec2<u32>,
    // The number of this reduction, for the header; 0: this step writes no header.
    reduction: u32,
    // The number of the reduction of which this one renews a part; 0: it renews everything.
    base: u32,
    padding: vec2<u32>,
}

// The first block that is read.
// Tuning for software drivers: asking the uniform for it costs 5 % of the reduction of an upload.
fn first_block() -> vec2<u32> {
    if REGION {
        return step.begin;
    }
    return vec2<u32>(0u);
}

// Numbers a pyramid of which a part is renewed; one invocation of the first step calls this.
// A reduction of everything copies its number into the header instead (`steps.rs`).
// A software driver, which skips no branch, would run this for all invocations.
//
// A part alone is not enough where the rest does not come from the reduction that was expected.
// The number is 0 then, which no cull expects, until everything is renewed.
fn write_header() {
    let follows = step.base == 0u || chunk_0[0].x == step.base;
    chunk_0[0] = vec4<u32>(select(0u, step.reduction, follows), 0u, 0u, 0u);
}

// Where level 0 begins in its texture, and its last pixel; only `source_part.wgsl` asks.
fn part_origin() -> vec2<u32> {
    return step.origin;
}

fn part_edge() -> vec2<u32> {
    return vec2<u32>(pyramid.levels[0].width, pyramid.levels[0].height) - vec2<u32>(1u);
}

// True: neighbouring invocations read blocks below each other.
override TALL: bool;
// True: some blocks are read; otherwise all are, from the first one on.
override REGION: bool;

// Invocations of a workgroup of the reduction.
// Twin: `REDUCE_WORKGROUP` in `crates/hiz_core/src/pyramid/reduce.rs`.
const WORKGROUP: u32 = 64u;
// The side of the square that they form where they do not form a row.
// Twin: `TALL_SIDE` in `crates/hiz_core/src/pyramid/reduce.rs`.
const SIDE_LOG2: u32 = 3u;
const SIDE: u32 = 1u << SIDE_LOG2;
const SIDE_MASK: u32 = SIDE - 1u;

// Which block an invocation reads: one of a row of blocks or, with TALL, of a square.
//
// Tuning for software drivers, which read for eight invocations at once.
// Eight blocks below each other are read along their rows in small steps, which the processor
// foresees.
// Eight blocks in a row are read in large steps (docs/performance.md).
fn place_of(workgroup: vec2<u32>, lane: u32) -> vec2<u32> {
    if TALL {
        return SIDE * workgroup + place_in_square(lane);
    }
    return vec2<u32>(WORKGROUP * workgroup.x + lane, workgroup.y);
}

// The place of an invocation in its workgroup's square.
fn place_in_square(lane: u32) -> vec2<u32> {
    let down = vec2<u32>(lane >> SIDE_LOG2, lane & SIDE_MASK);
    return select(down.yx, down, TALL);
}

// `index` is a multiple of VECTOR, and so is the size of a chunk.
fn load4(index: u32) -> vec4<u32> {
    if CHUNKS == 1u {
        return chunk_0[index >> VECTOR_LOG2];
    }
    let i = (index & ((1u << pyramid.chunk_shift) - 1u)) >> VECTOR_LOG2;
    switch index >> pyramid.chunk_shift {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}

fn store4(index: u32, bits: vec4<u32>) {
    if CHUNKS == 1u {
        chunk_0[index >> VECTOR_LOG2] = bits;
        return;
    }
    let i = (index & ((1u << pyramid.chunk_shift) - 1u)) >> VECTOR_LOG2;
    switch index >> pyramid.chunk_shift {
        case 0u: { chunk_0[i] = bits; }
        case 1u: { chunk_1[i] = bits; }
        default: { chunk_2[i] = bits; }
    }
}

fn store(index: u32, bits: u32) {
    if CHUNKS == 1u {
        chunk_0[index >> VECTOR_LOG2][index & VECTOR_MASK] = bits;
        return;
    }
    let i = index & ((1u << pyramid.chunk_shift) - 1u);
    switch index >> pyramid.chunk_shift {
        case 0u: { chunk_0[i >> VECTOR_LOG2][i & VECTOR_MASK] = bits; }
        case 1u: { chunk_1[i >> VECTOR_LOG2][i & VECTOR_MASK] = bits; }
        default: { chunk_2[i >> VECTOR_LOG2][i & VECTOR_MASK] = bits; }
    }
}
