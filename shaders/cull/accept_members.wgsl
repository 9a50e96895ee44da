// Keeps the members of accepted groups (`accept_run.wgsl`).
// An invocation takes RUN members of one group, as in `cull_members.wgsl`.
// Where a mask may begin full, `settle_groups.wgsl` takes the place of this.
//
// Tuning for software drivers, which skip no branch: it is a pass of its own.

@compute @workgroup_size(GROUP)
fn accept_members(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot < parents.accept_count {
        // Accepted groups fill the list from its end.
        let groups = (piece.count + (GROUP - 1u)) / GROUP;
        let group = textureLoad(parent_list, survivor_position(groups - 1u - slot)).x;
        report_run(group, lane % SHARE, accept_run(group * GROUP + lane % SHARE));
    }
}
