// What the invocations of a workgroup share (`emit.wgsl`).
// The file behind this one says what a `Sum` is.

// Invocations of a workgroup of the passes of bins.
// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

var<workgroup> sums: array<Sum, WORKGROUP>;

// The sum of `own` over all invocations up to and including this one.
// Then `sums[WORKGROUP - 1u]` holds the sum of all.
// Source: Hillis and Steele, "Data Parallel Algorithms", 1986.
fn prefix(lane: u32, own: Sum) -> Sum {
    sums[lane] = own;
    workgroupBarrier();
    for (var step = 1u; step < WORKGROUP; step *= 2u) {
        var earlier = Sum();
        if lane >= step { earlier = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += earlier;
        workgroupBarrier();
    }
    return sums[lane];
}

// Meshes of an invocation of `emit_bins` and of `emit_draws`.
// Twin: `MESHES` in `crates/hiz_core/src/output/emit_passes.rs`.
const MESHES: u32 = 8u;

// The meshes of an invocation of these: the first one, and the one behind the last.
fn share_of(invocation: u32) -> vec2<u32> {
    let meshes = emit.records / emit.lods;
    return min(vec2<u32>(invocation, invocation + 1u) * MESHES, vec2<u32>(meshes));
}
