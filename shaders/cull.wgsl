// The cull: one invocation an instance; two bit planes of verdicts, counters, and (order "any") the append of what is kept
// into the list that an indirect draw consumes.

const WORKGROUP: u32 = 128u;
const WORDS: u32 = 4u; // WORKGROUP / 32

// Append here, in whatever order invocations arrive; otherwise `compact.wgsl` makes an ascending list of the bit plane.
override APPEND: bool;
// Count the tests of each level.
override STATISTICS: bool;

struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: atomic<u32>,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

struct Counters {
    outside: atomic<u32>,
    occluded: atomic<u32>,
    visible: atomic<u32>,
    invalid: atomic<u32>,
    // How many instances were compared with the depths of each level.
    levels: array<atomic<u32>, 16>,
    // Texels read, a 64-bit number in two halves.
    texels_low: atomic<u32>,
    texels_high: atomic<u32>,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// First the plane of the kept (bit 1 of the verdicts), then that of bit 0; piece.words words each.
@group(2) @binding(0) var<storage, read_write> planes: array<u32>;
@group(2) @binding(1) var<storage, read_write> list: array<u32>;
@group(2) @binding(2) var<storage, read_write> draws: array<DrawIndexedIndirect>;
@group(2) @binding(3) var<storage, read_write> counters: Counters;
// .x: how many indices may be written in all pieces together.
@group(2) @binding(4) var<uniform> capacity: vec4<u32>;

var<workgroup> verdicts: array<u32, WORKGROUP>;

// What earlier pieces left of the capacity.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, atomicLoad(&draws[p].instance_count));
    }
    return left;
}

// The count is the draw's own: it never ends above the room, for who finds none takes its one back, and nobody can have
// taken a slot below the room before.
fn append(i: u32) {
    let slot = atomicAdd(&draws[piece.index].instance_count, 1u);
    if slot < room() {
        list[slot] = piece.base + i;
    } else {
        atomicSub(&draws[piece.index].instance_count, 1u);
    }
}

@compute @workgroup_size(128)
fn cull(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = id.x;
    var verdict = OUTSIDE;
    if i < piece.count {
        let outcome = classify(i);
        verdict = outcome.verdict;
        if STATISTICS {
            if outcome.stage >= AT_DEPTH {
                atomicAdd(&counters.levels[outcome.level], 1u);
                let before = atomicAdd(&counters.texels_low, outcome.texels_read);
                if before + outcome.texels_read < before { atomicAdd(&counters.texels_high, 1u); }
            }
        }
        if APPEND {
            if verdict >= VISIBLE {
                append(i);
            }
        }
    }
    verdicts[lane] = verdict;
    workgroupBarrier();

    // Four lanes gather 32 verdicts each into a word of both planes.
    let word = group.x * WORDS + lane;
    if lane < WORDS && word < piece.words {
        var kept = 0u;
        var low = 0u;
        for (var bit = 0u; bit < 32u; bit += 1u) {
            let v = verdicts[32u * lane + bit];
            kept |= (v >> 1u) << bit;
            low |= (v & 1u) << bit;
        }
        planes[word] = kept;
        planes[piece.words + word] = low;
        let instances = min(piece.count - 32u * word, 32u);
        let invalid = countOneBits(kept & low);
        let visible = countOneBits(kept) - invalid;
        let occluded = countOneBits(low) - invalid;
        let outside = instances - visible - invalid - occluded;
        if outside > 0u { atomicAdd(&counters.outside, outside); }
        if occluded > 0u { atomicAdd(&counters.occluded, occluded); }
        if visible > 0u { atomicAdd(&counters.visible, visible); }
        if invalid > 0u { atomicAdd(&counters.invalid, invalid); }
    }
}
