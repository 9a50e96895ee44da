// How many instances got which verdict.
// Twin: `crates/hiz_core/src/output/counters.rs`.

const LANES: u32 = 64u;
// Vectors of four places that one invocation counts.
const VECTORS: u32 = 4u;

struct Counters {
    outside: atomic<u32>,
    occluded: atomic<u32>,
    visible: atomic<u32>,
    invalid: atomic<u32>,
}

@group(0) @binding(0) var<uniform> piece: Piece;
// The mask, and behind it the verdicts.
@group(0) @binding(1) var<storage, read> mask: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read_write> counters: Counters;

var<workgroup> sums: array<vec4<u32>, LANES>;

@compute @workgroup_size(LANES)
fn count(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var sum = vec4<u32>(0u);
    for (var v = 0u; v < VECTORS; v += 1u) {
        let vector = id.x * VECTORS + v;
        let place = 4u * vector;
        if place < piece.count {
            let four = mask[verdicts_begin(piece.words) / 4u + vector];
            let here = vec4<u32>(place) + vec4<u32>(0u, 1u, 2u, 3u) < vec4<u32>(piece.count);
            for (var verdict = 0u; verdict < 4u; verdict += 1u) {
                let ones = select(vec4<u32>(0u), vec4<u32>(1u), here & (four == vec4<u32>(verdict)));
                sum[verdict] += ones.x + ones.y + ones.z + ones.w;
            }
        }
    }
    sums[lane] = sum;
    workgroupBarrier();
    if lane == 0u {
        var total = vec4<u32>(0u);
        for (var l = 0u; l < LANES; l += 1u) {
            total += sums[l];
        }
        if total.x > 0u { atomicAdd(&counters.outside, total.x); }
        if total.y > 0u { atomicAdd(&counters.occluded, total.y); }
        if total.z > 0u { atomicAdd(&counters.visible, total.z); }
        if total.w > 0u { atomicAdd(&counters.invalid, total.w); }
    }
}
