// The survivors of a tier of boxes, for the tests of what they hold: boxes of the tier below, or
// the members of groups.

// The same record as `Survivors` of `cull_box.wgsl`, read without atomics.
// Twin: `SurvivorsRecord` in `crates/hiz_core/src/output/survivors.rs`.
struct Parents {
    workgroups: u32,
    workgroups_y: u32,
    workgroups_z: u32,
    count: u32,
    tested: u32,
    accepted: u32,
    // 1 where the mask began full (`begin_mask.wgsl`), 0 elsewhere.
    is_full: u32,
    padding: u32,
    accept_workgroups: u32,
    accept_workgroups_y: u32,
    accept_workgroups_z: u32,
    accept_count: u32,
}

@group(3) @binding(0) var<storage, read> parents: Parents;
@group(3) @binding(1) var parent_list: texture_storage_2d<r32uint, read>;
