// The cull of the members of surviving groups: an invocation tests RUN members of one group.

@compute @workgroup_size(GROUP)
fn cull_members(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot < parents.count {
        cull_run(textureLoad(parent_list, survivor_position(slot)).x, lane % SHARE);
    }
}
