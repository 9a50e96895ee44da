// Compaction: from the mask to the ascending list of the caller's indices, and to the instance
// count of the draw.
//
// 1. `scan`, in one workgroup, counts the kept bits before each word of the mask.
// 2. `scatter`, with an invocation per word, writes the indices.

// Invocations of `scan`.
const LANES: u32 = 256u;
// Invocations of a workgroup of `scatter`.
// Twin: `SCATTER_WORKGROUP` in `crates/hiz_core/src/output/compact.rs`.
const SCATTER_WORKGROUP: u32 = 64u;

// Twin: `DrawIndexedIndirect` in `crates/hiz_core/src/output/draw.rs`.
struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> piece: Piece;
@group(0) @binding(1) var<storage, read> mask: array<u32>;
@group(0) @binding(2) var<storage, read_write> list: array<u32>;
@group(0) @binding(3) var<storage, read_write> draws: array<DrawIndexedIndirect>;
// How many bits are set before each word of the mask.
@group(0) @binding(4) var<storage, read_write> before: array<u32>;
// .x: how many indices may be written, in all pieces together.
@group(0) @binding(5) var<uniform> capacity: vec4<u32>;

var<workgroup> sums: array<u32, LANES>;

// The capacity that earlier pieces have left.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, draws[p].instance_count);
    }
    return left;
}

@compute @workgroup_size(LANES)
fn scan(@builtin(local_invocation_index) lane: u32) {
    let share = (piece.words + LANES - 1u) / LANES;
    let begin = min(lane * share, piece.words);
    let end = min(begin + share, piece.words);
    var sum = 0u;
    for (var w = begin; w < end; w += 1u) {
        sum += countOneBits(mask[w]);
    }
    sums[lane] = sum;
    workgroupBarrier();
    // Inclusive prefix sums by doubling.
    // Source: Hillis and Steele, "Data Parallel Algorithms", 1986.
    for (var step = 1u; step < LANES; step *= 2u) {
        var earlier = 0u;
        if lane >= step { earlier = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += earlier;
        workgroupBarrier();
    }
    var count = sums[lane] - sum;
    for (var w = begin; w < end; w += 1u) {
        before[w] = count;
        count += countOneBits(mask[w]);
    }
    if lane == LANES - 1u {
        draws[piece.index].instance_count = min(sums[lane], room());
    }
}

@compute @workgroup_size(SCATTER_WORKGROUP)
fn scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = id.x;
    if word >= piece.words {
        return;
    }
    let written = draws[piece.index].instance_count;
    var slot = before[word];
    var bits = mask[word];
    while bits != 0u && slot < written {
        list[slot] = piece.base + WORD_BITS * word + countTrailingZeros(bits);
        bits &= bits - 1u;
        slot += 1u;
    }
}
