// The cull of the members of surviving groups: an invocation tests RUN members of one group.
// Those of an accepted group are kept without a test.

// The same record as in `cull_box.wgsl`, read without atomics.
struct Survivors {
    workgroups: u32,
    workgroups_y: u32,
    workgroups_z: u32,
    count: u32,
    tested: u32,
    accepted: u32,
    padding: vec2<u32>,
}

@group(3) @binding(0) var<storage, read> survivors: Survivors;
@group(3) @binding(1) var survivor_list: texture_storage_2d<r32uint, read>;

@compute @workgroup_size(GROUP)
fn cull_members(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot < survivors.count {
        let entry = textureLoad(survivor_list, survivor_position(slot)).x;
        cull_run(entry & ~ACCEPTED, lane % SHARE, (entry & ACCEPTED) != 0u);
    }
}
