// Settles the members of groups that need no test of each, where a mask may begin full
// (`begin_mask.wgsl`).
// An invocation takes RUN members of one group, as in `cull_members.wgsl`.
//
// In a mask that began empty it sets the bits of accepted groups.
// In one that began full it clears those of hidden groups, and of members of accepted groups that
// are absent or not asked for.

// A word per group: VISIBLE if its members are tested, UNOCCLUDED if they are accepted, or less.
@group(0) @binding(1) var<storage, read> group_verdicts: array<u32>;

@compute @workgroup_size(GROUP)
fn settle_groups(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    let is_full = parents.is_full != 0u;
    let groups = (piece.count + (GROUP - 1u)) / GROUP;
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot >= select(parents.accept_count, groups, is_full) {
        return;
    }
    var group = slot;
    var verdict = UNOCCLUDED;
    if is_full {
        verdict = group_verdicts[group];
    } else {
        // Accepted groups fill the list from its end.
        group = textureLoad(parent_list, survivor_position(groups - 1u - slot)).x;
    }
    let share = lane % SHARE;
    let first = group * GROUP + share;
    if verdict == UNOCCLUDED {
        report_run(group, share, flipped(first, accept_run(first)));
    } else if verdict < VISIBLE {
        report_run(group, share, there(first));
    }
}
