// Writes the draw records of the bins that are not empty, one after the other, and their number
// (`emit.wgsl`): an invocation per eight meshes.
// The records behind them are zeros: they draw nothing.
// Where a draw cannot take its number of records from the device, all records are drawn.

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> templates: array<Template>;
@group(0) @binding(2) var<storage, read> bins: array<BinRange>;
@group(0) @binding(3) var<storage, read_write> draws: array<u32>;
@group(0) @binding(4) var<storage, read_write> draw_counts: array<u32>;

// Non-empty bins: of earlier workgroups, and of all.
alias Sum = vec2<u32>;

// The non-empty bins of an invocation's share, and of earlier shares of its workgroup.
fn filled_through(invocation: u32) -> u32 {
    return bins[share_of(invocation).x * emit.lods].filled;
}

@compute @workgroup_size(WORKGROUP)
fn emit_draws(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let meshes = emit.records / emit.lods;
    let last = (meshes - 1u) / MESHES;
    var own = Sum();
    for (var w = lane; w * WORKGROUP <= last; w += WORKGROUP) {
        let filled = filled_through(min(w * WORKGROUP + (WORKGROUP - 1u), last));
        own += Sum(select(0u, filled, w < workgroup.x), filled);
    }
    prefix(lane, own);
    let all = sum_of_all();
    var at = all.x;
    if lane > 0u {
        at += filled_through(min(id.x - 1u, last));
    }
    let share = share_of(id.x) * emit.lods;
    for (var bin = share.x; bin < share.y; bin += 1u) {
        let range = bins[bin];
        if range.count > 0u {
            write_draw(at, templates[bin], range.count, range.begin);
            at += 1u;
        }
        if bin >= all.y {
            write_draw(bin, Template(), 0u, 0u);
        }
    }
    if id.x == 0u {
        draw_counts[emit.piece] = all.y;
    }
}
