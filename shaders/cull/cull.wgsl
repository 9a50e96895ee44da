// The flat cull: an invocation tests RUN members of a group.

@compute @workgroup_size(GROUP)
fn cull(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    begin();
    cull_run(workgroup.x * RUN + lane / SHARE, lane % SHARE);
}
