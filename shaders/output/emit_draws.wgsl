// Writes the draw records of the bins that are not empty, one after the other, and their number.
// The records behind them are zeros: they draw nothing.
// Where a draw cannot take its number of records from the device, all records are drawn.
// One workgroup does this, because each record's place depends on all records before it.

const LANES: u32 = 256u;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> templates: array<Template>;
@group(0) @binding(2) var<storage, read> bins: array<BinRange>;
@group(0) @binding(3) var<storage, read_write> draws: array<u32>;
@group(0) @binding(4) var<storage, read_write> draw_counts: array<u32>;

var<workgroup> sums: array<u32, LANES>;

@compute @workgroup_size(LANES)
fn emit_draws(@builtin(local_invocation_index) lane: u32) {
    let share = (emit.records + LANES - 1u) / LANES;
    let begin = min(lane * share, emit.records);
    let end = min(begin + share, emit.records);
    var sum = 0u;
    for (var bin = begin; bin < end; bin += 1u) {
        sum += select(0u, 1u, bins[bin].count > 0u);
    }
    sums[lane] = sum;
    workgroupBarrier();
    // Source: Hillis and Steele, "Data Parallel Algorithms", 1986.
    for (var step = 1u; step < LANES; step *= 2u) {
        var earlier = 0u;
        if lane >= step { earlier = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += earlier;
        workgroupBarrier();
    }
    var at = sums[lane] - sum;
    for (var bin = begin; bin < end; bin += 1u) {
        let range = bins[bin];
        if range.count > 0u {
            write_draw(at, templates[bin], range.count, range.begin);
            at += 1u;
        }
    }
    let count = sums[LANES - 1u];
    for (var empty = max(begin, count); empty < end; empty += 1u) {
        write_draw(empty, Template(), 0u, 0u);
    }
    if lane == 0u {
        draw_counts[emit.piece] = count;
    }
}
