// What the invocations of a workgroup share (`emit.wgsl`).
// The file behind this one says what a `Sum` is.

// Invocations of a workgroup of the passes of bins.
// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

// Invocations of a row.
const ROW: u32 = 8u;
// Rows of a workgroup.
const ROWS: u32 = WORKGROUP / ROW;

var<workgroup> own_sums: array<Sum, WORKGROUP>;
var<workgroup> row_sums: array<Sum, ROWS>;

// The sum of `own` over all invocations up to and including this one.
// Then `sum_of_all` has the sum over the workgroup.
//
// Rows are summed first, and earlier rows are added then.
// So two barriers suffice, where a sum by doubled steps takes two for each doubling.
// A processor that runs a workgroup pays for each barrier.
// Source: Blelloch, "Prefix Sums and Their Applications", 1990, section 1.2 (sums of blocks).
fn prefix(lane: u32, own: Sum) -> Sum {
    own_sums[lane] = own;
    workgroupBarrier();
    let row = lane / ROW;
    var through = Sum();
    for (var l = row * ROW; l <= lane; l += 1u) {
        through += own_sums[l];
    }
    if lane % ROW == ROW - 1u {
        row_sums[row] = through;
    }
    workgroupBarrier();
    for (var r = 0u; r < row; r += 1u) {
        through += row_sums[r];
    }
    return through;
}

// The sum over all invocations, after `prefix`.
fn sum_of_all() -> Sum {
    var all = Sum();
    for (var r = 0u; r < ROWS; r += 1u) {
        all += row_sums[r];
    }
    return all;
}

// Meshes of an invocation of `emit_bins` and of `emit_draws`.
// Twin: `MESHES` in `crates/hiz_core/src/output/emit_passes.rs`.
const MESHES: u32 = 8u;

// The meshes of an invocation of these: the first one, and the one behind the last.
fn share_of(invocation: u32) -> vec2<u32> {
    let meshes = emit.records / emit.lods;
    return min(vec2<u32>(invocation, invocation + 1u) * MESHES, vec2<u32>(meshes));
}
