// The cull of whole groups: one invocation tests the box around 64 instances, by the same
// certificates.
// What hides the box hides all of them.
// The other groups survive: they are listed, and `cull_members.wgsl` tests their members.
// (Moller, Haines and others, "Real-Time Rendering", section "Hierarchical Z-Buffering".)

const WORKGROUP: u32 = 128u;

struct Survivors {
    // Arguments of the indirect dispatch: one workgroup per RUN groups.
    workgroups: atomic<u32>,
    workgroups_y: u32,
    workgroups_z: u32,
    count: atomic<u32>,
}

// The groups' boxes, as if they were the instances of a piece.
@group(1) @binding(0) var<uniform> groups: Piece;
@group(2) @binding(0) var<storage, read_write> survivors: Survivors;
// One verdict per group; VISIBLE or INVALID means that its members get verdicts of their own.
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;
@group(2) @binding(2) var survivor_list: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(WORKGROUP)
fn cull_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    let group = id.x;
    if group >= groups.count {
        return;
    }
    let outcome = classify(group);
    let verdict = outcome.verdict;
    if STATISTICS {
        count_texels(outcome.level, outcome.texels_read);
    }
    group_verdicts[group] = verdict;
    if verdict >= VISIBLE {
        let slot = atomicAdd(&survivors.count, 1u);
        textureStore(survivor_list, survivor_position(slot), vec4<u32>(group));
        if slot % RUN == 0u {
            atomicAdd(&survivors.workgroups, 1u);
        }
    }
}
