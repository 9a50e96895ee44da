// The cull of the boxes that the survivors of the tier above hold: one invocation tests one box.

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
