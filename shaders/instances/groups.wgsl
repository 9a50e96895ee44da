// Groups of instances, and how the invocations of a cull share them.
// Twin: `crates/hiz_core/src/instances/groups.rs`, `GROUP`.

// Instances of a group, which are stored one after the other.
// Twin: `GROUP` in `crates/hiz_core/src/instances/groups.rs`.
const GROUP: u32 = 64u;
const GROUP_LOG2: u32 = 6u;
// How many members of a group one invocation tests, one after the other.
// So this is also the number of groups that one workgroup takes.
// Tuning for software drivers, which fetch uniforms anew for every eight invocations and never skip
// a branch.
// With a run they do so once per run (docs/performance.md).
// Twin: `GROUPS_OF_RUN` in `crates/hiz_core/src/cull/groups.rs`.
const RUN: u32 = 8u;
// Invocations that share a group.
const SHARE: u32 = GROUP / RUN;

// A flag beside the number of a box in the list of an upper tier's survivors: all that it holds is
// kept without a test.
const ACCEPTED: u32 = 0x80000000u;

// Survivors in a row of their list, as a power of two.
// The list is a texture for the reason that `record_layout.wgsl` gives.
// Twin: `SURVIVORS_PER_ROW` in `crates/hiz_core/src/output/survivors.rs`.
const SURVIVORS_PER_ROW_LOG2: u32 = 12u;

fn survivor_position(slot: u32) -> vec2<u32> {
    return vec2<u32>(slot % (1u << SURVIVORS_PER_ROW_LOG2), slot >> SURVIVORS_PER_ROW_LOG2);
}
