// The cull of the boxes of the topmost tier: one invocation tests one box.

@compute @workgroup_size(WORKGROUP)
fn cull_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    if id.x < tier.count {
        cull_box(id.x, false);
    }
}
