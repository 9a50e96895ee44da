// The count of verdicts: how many instances are outside, occluded, visible, invalid and
// unoccluded.

// Invocations of a workgroup, and vectors of four verdicts that each of them reads.
// Twin: `COUNT_WORKGROUP` in `crates/hiz_core/src/cull/count.rs`, the verdicts of a workgroup.
const LANES: u32 = 64u;
const VECTORS: u32 = 4u;

// Twin: `CounterRecord` in `crates/hiz_core/src/output/counters.rs`.
struct Counters {
    outside: atomic<u32>,
    occluded: atomic<u32>,
    visible: atomic<u32>,
    invalid: atomic<u32>,
    unoccluded: atomic<u32>,
}

@group(0) @binding(0) var<uniform> piece: Piece;
// The mask, and behind it the verdicts.
@group(0) @binding(1) var<storage, read> mask: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> counters: Counters;

// A number per verdict, in the order of their codes.
alias Sums = array<u32, VERDICT_COUNT>;

var<workgroup> sums: array<Sums, LANES>;

@compute @workgroup_size(LANES)
fn count(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var sum = Sums();
    for (var v = 0u; v < VECTORS; v += 1u) {
        let vector = id.x * VECTORS + v;
        let place = VERDICT_MULTIPLE * vector;
        if place < piece.count {
            let four = mask[verdicts_begin(piece.words) / VERDICT_MULTIPLE + vector];
            let here = vec4<u32>(place) + vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(piece.count);
            for (var verdict = 0u; verdict < VERDICT_COUNT; verdict += 1u) {
                let is_it = here & (four == vec4<u32>(verdict));
                let ones = select(vec4<u32>(0u), vec4<u32>(1u), is_it);
                sum[verdict] += ones.x + ones.y + ones.z + ones.w;
            }
        }
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane == 0u {
        var total = Sums();
        for (var l = 0u; l < LANES; l += 1u) {
            for (var verdict = 0u; verdict < VERDICT_COUNT; verdict += 1u) {
                total[verdict] += sums[l][verdict];
            }
        }
        let outside = total[OUTSIDE];
        let occluded = total[OCCLUDED];
        let visible = total[VISIBLE];
        let invalid = total[INVALID];
        let unoccluded = total[UNOCCLUDED];
        if outside > 0u { atomicAdd(&counters.outside, outside); }
        if occluded > 0u { atomicAdd(&counters.occluded, occluded); }
        if visible > 0u { atomicAdd(&counters.visible, visible); }
        if invalid > 0u { atomicAdd(&counters.invalid, invalid); }
        if unoccluded > 0u { atomicAdd(&counters.unoccluded, unoccluded); }
    }
}
