// The cull of whole groups: one invocation tests the box around the members of a group.
// It uses the same certificates as a test of an instance, and what hides the box hides all members.
// The surviving groups are packed into a list, for `cull_members.wgsl`.
//
// Which groups can survive differs in the two passes of a frame: `groups_alone.wgsl`,
// `groups_early.wgsl` and `groups_late.wgsl` have functions of the same names for it.
//
// Source: Akenine-Moller, Haines and others, "Real-Time Rendering", section "Hierarchical
// Z-Buffering".

// Twin: `CULL_WORKGROUP` in `crates/hiz_core/src/instances/piece.rs`.
const WORKGROUP: u32 = 128u;

// Twin: `SurvivorsRecord` in `crates/hiz_core/src/output/survivors.rs`.
struct Survivors {
    // The arguments of the indirect dispatch, with a workgroup for every RUN groups.
    workgroups: atomic<u32>,
    workgroups_y: u32,
    workgroups_z: u32,
    count: atomic<u32>,
}

// The groups' boxes, as if they were the instances of a piece.
@group(1) @binding(0) var<uniform> groups: Piece;
@group(2) @binding(0) var<storage, read_write> survivors: Survivors;
// A word per group: its verdict, or VISIBLE where the members have verdicts of their own.
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;
@group(2) @binding(2) var survivor_list: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(WORKGROUP)
fn cull_groups(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    let group = id.x;
    if group >= groups.count || !has_candidates(group) {
        return;
    }
    if !any_among(group) {
        group_verdicts[group] = OUTSIDE;
        return;
    }
    let outcome = classify(group);
    let verdict = outcome.verdict;
    if STATISTICS {
        count_texels(outcome.level, outcome.texels_read);
    }
    group_verdicts[group] = verdict;
    if is_candidate(outcome) {
        let slot = atomicAdd(&survivors.count, 1u);
        textureStore(survivor_list, survivor_position(slot), vec4<u32>(group));
        if slot % RUN == 0u {
            atomicAdd(&survivors.workgroups, 1u);
        }
    } else {
        forget(group);
    }
}
