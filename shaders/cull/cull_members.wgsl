// The cull of the members of the groups that `cull_groups.wgsl` left.
// An invocation tests RUN members of one group (`../instances/groups.wgsl`).

struct Survivors {
    workgroups: u32,
    workgroups_y: u32,
    workgroups_z: u32,
    count: u32,
}

@group(3) @binding(0) var<storage, read> survivors: Survivors;
@group(3) @binding(1) var survivor_list: texture_storage_2d<r32uint, read>;

@compute @workgroup_size(GROUP)
fn cull_members(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    begin();
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot < survivors.count {
        cull_run(textureLoad(survivor_list, survivor_position(slot)).x, lane % SHARE);
    }
}
