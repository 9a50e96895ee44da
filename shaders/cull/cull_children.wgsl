// The cull of the boxes that the survivors of the tier above hold: one invocation tests one box.

// The record of the tier above, as `Survivors` of `cull_box.wgsl`, read without atomics.
// Twin: `SurvivorsRecord` in `crates/hiz_core/src/output/survivors.rs`.
struct Parents {
    workgroups: u32,
    workgroups_y: u32,
    workgroups_z: u32,
    count: u32,
    tested: u32,
    accepted: u32,
    padding: vec2<u32>,
    accept_workgroups: u32,
    accept_workgroups_y: u32,
    accept_workgroups_z: u32,
    accept_count: u32,
}

@group(3) @binding(0) var<storage, read> parents: Parents;
@group(3) @binding(1) var parent_list: texture_storage_2d<r32uint, read>;

@compute @workgroup_size(WORKGROUP)
fn cull_children(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    let slot = workgroup.x * PARENTS + lane / GROUP;
    if slot < parents.count {
        let parent = textureLoad(parent_list, survivor_position(slot)).x;
        let box = (parent & ~ACCEPTED) * GROUP + lane % GROUP;
        if box < tier.count {
            cull_box(box, (parent & ACCEPTED) != 0u);
        }
    }
}
