// Compaction: from the mask to the ascending list of the caller's indices, and to the draw's
// `instance_count`.
// `scan`, one workgroup, counts the bits before each word of the mask.
// `scatter`, one invocation per word, writes the indices.

const LANES: u32 = 256u;

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
// .x: how many indices may be written in all pieces together.
@group(0) @binding(5) var<uniform> capacity: vec4<u32>;

var<workgroup> sums: array<u32, LANES>;

// How much of the capacity earlier pieces left.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, draws[p].instance_count);
    }
    return left;
}

@compute @workgroup_size(256)
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
    // Inclusive prefix sums by doubling (Hillis and Steele, "Data Parallel Algorithms", 1986).
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

@compute @workgroup_size(64)
fn scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = id.x;
    if word >= piece.words {
        return;
    }
    let written = draws[piece.index].instance_count;
    var slot = before[word];
    var bits = mask[word];
    while bits != 0u && slot < written {
        list[slot] = piece.base + 32u * word + countTrailingZeros(bits);
        bits &= bits - 1u;
        slot += 1u;
    }
}
