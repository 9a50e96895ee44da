// The survivors of a tier of boxes, for the tests of what they hold.

// The same record as in `cull_box.wgsl`, read without atomics.
// Twin: `SurvivorsRecord` in `crates/hiz_core/src/output/survivors.rs`.
struct Survivors {
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

@group(3) @binding(0) var<storage, read> survivors: Survivors;
@group(3) @binding(1) var survivor_list: texture_storage_2d<r32uint, read>;
