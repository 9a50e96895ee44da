// Counts the bits before each word of the planes (`emit.wgsl`).

// Words that an invocation of `emit_block` counts.
const SHARE: u32 = (1u << BLOCK_LOG2_WORDS) / WORKGROUP;

// One list of all planes in the order of indices: an instance is kept if any plane has its bit.
// Then the first set counts for all.
// Otherwise the planes are counted one after the other.
override BY_INDEX: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<Numbers>;
// Bits before each word, within its block of its plane.
@group(0) @binding(2) var<storage, read_write> before: array<Packed>;
// Bits before each block, in earlier planes, too.
@group(0) @binding(3) var<storage, read_write> blocks: array<Numbers>;
@group(0) @binding(4) var<storage, read_write> totals: array<Total>;
@group(0) @binding(5) var<storage, read_write> draw_counts: array<u32>;

alias Sum = Numbers;

fn ones(s: u32, w: u32) -> Numbers {
    if !BY_INDEX {
        return countOneBits(planes[s * emit.words + w]);
    }
    return of_first(countOneBits(in_any_set(w)));
}

@compute @workgroup_size(WORKGROUP)
fn emit_block(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    let s = workgroup.y;
    let begin = min((workgroup.x << BLOCK_LOG2_WORDS) + lane * SHARE, emit.words);
    let end = min(begin + SHARE, emit.words);
    var own = Numbers();
    for (var w = begin; w < end; w += 1u) {
        own += ones(s, w);
    }
    let through = prefix(lane, own);
    var count = through - own;
    for (var w = begin; w < end; w += 1u) {
        before[s * emit.words + w] = pack(count);
        count += ones(s, w);
    }
    if lane == WORKGROUP - 1u {
        blocks[block_at(s, workgroup.x << BLOCK_LOG2_WORDS)] = through;
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

@compute @workgroup_size(WORKGROUP)
fn emit_top(@builtin(local_invocation_index) lane: u32) {
    let share = (blocks_of_set() + WORKGROUP - 1u) / WORKGROUP;
    let begin = min(lane * share, blocks_of_set());
    let end = min(begin + share, blocks_of_set());
    var kept = 0u;
    for (var s = 0u; s < select(sets(), 1u, BY_INDEX); s += 1u) {
        let first = block_at(s, 0u);
        var own = Numbers();
        for (var b = begin; b < end; b += 1u) {
            own += blocks[first + b];
        }
        let through = prefix(lane, own);
        let all = sum_of_all();
        // All bits of earlier planes come first.
        let earlier = Numbers(kept) + sum_before(all);
        var count = earlier + through - own;
        for (var b = begin; b < end; b += 1u) {
            let here = blocks[first + b];
            blocks[first + b] = count;
            count += here;
        }
        if lane == 0u {
            blocks[block_at(s, emit.words)] = earlier + all;
        }
        kept += sum(all);
    }
    if lane == 0u {
        let written = min(kept, room());
        totals[emit.piece] = Total(kept, written);
        if BY_INDEX {
            draw_counts[emit.piece] = written;
        }
    }
}
