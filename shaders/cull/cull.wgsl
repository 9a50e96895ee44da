// The flat cull, which tests each instance by itself, without a test of its group first.
// It serves few instances; many go through `cull_groups.wgsl` and `cull_members.wgsl`.
// An invocation tests RUN members of a group (`../instances/groups.wgsl`).

@compute @workgroup_size(GROUP)
fn cull(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    begin();
    cull_run(workgroup.x * RUN + lane / SHARE, lane % SHARE);
}
