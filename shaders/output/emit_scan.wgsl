// Counts the bits before each word of the planes (`emit.wgsl`).

// Invocations of a workgroup, and words that each of them counts in `emit_block`.
const LANES: u32 = 64u;
const SHARE: u32 = (1u << BLOCK_LOG2_WORDS) / LANES;

// One list of all planes in the order of indices: an instance is kept if any plane has its bit.
// Otherwise the planes are counted one after the other.
override BY_INDEX: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<u32>;
// Bits before each word, within its block.
@group(0) @binding(2) var<storage, read_write> before: array<u32>;
// Bits before each block; one more word holds the number of all.
@group(0) @binding(3) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(4) var<storage, read_write> totals: array<Total>;
@group(0) @binding(5) var<storage, read_write> draw_counts: array<u32>;

var<workgroup> sums: array<u32, LANES>;

fn words() -> u32 {
    return select(emit.lods, 1u, BY_INDEX) * emit.words;
}

fn bits(w: u32) -> u32 {
    var word = planes[w];
    if BY_INDEX {
        for (var l = 1u; l < emit.lods; l += 1u) {
            word |= planes[l * emit.words + w];
        }
    }
    return word;
}

// The sum of `sum` over all lanes up to and including this one.
// Source: Hillis and Steele, "Data Parallel Algorithms", 1986.
fn prefix(lane: u32, sum: u32) -> u32 {
    sums[lane] = sum;
    workgroupBarrier();
    for (var step = 1u; step < LANES; step *= 2u) {
        var earlier = 0u;
        if lane >= step { earlier = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += earlier;
        workgroupBarrier();
    }
    return sums[lane];
}

@compute @workgroup_size(LANES)
fn emit_block(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    let begin = min((workgroup.x << BLOCK_LOG2_WORDS) + lane * SHARE, words());
    let end = min(begin + SHARE, words());
    var sum = 0u;
    for (var w = begin; w < end; w += 1u) {
        sum += countOneBits(bits(w));
    }
    let through = prefix(lane, sum);
    var count = through - sum;
    for (var w = begin; w < end; w += 1u) {
        before[w] = count;
        count += countOneBits(bits(w));
    }
    if lane == LANES - 1u {
        blocks[workgroup.x] = through;
    }
}

// The capacity that earlier pieces have left.
fn room() -> u32 {
    var left = emit.capacity;
    for (var p = 0u; p < emit.piece; p += 1u) {
        left -= min(left, totals[p].written);
    }
    return left;
}

@compute @workgroup_size(LANES)
fn emit_top(@builtin(local_invocation_index) lane: u32) {
    let count = blocks_of(words());
    let share = (count + LANES - 1u) / LANES;
    let begin = min(lane * share, count);
    let end = min(begin + share, count);
    var sum = 0u;
    for (var b = begin; b < end; b += 1u) {
        sum += blocks[b];
    }
    let through = prefix(lane, sum);
    var earlier = through - sum;
    for (var b = begin; b < end; b += 1u) {
        let here = blocks[b];
        blocks[b] = earlier;
        earlier += here;
    }
    if lane == LANES - 1u {
        let written = min(through, room());
        blocks[count] = through;
        totals[emit.piece] = Total(through, written);
        if BY_INDEX {
            draw_counts[emit.piece] = written;
        }
    }
}
