// Groups of instances, and how the invocations of a cull share them.
// Twin: `crates/hiz_core/src/instances/groups.rs`, `GROUP`.

// Instances of a full group, stored one after the other.
const GROUP: u32 = 64u;
// How many members of a group one invocation tests, one after the other.
// It is also how many groups one workgroup of GROUP invocations tests.
// A software driver fetches uniforms anew for every eight invocations, and never skips a branch.
// With runs it pays for both once per run instead of once per member (docs/performance.md).
// Twin: `crates/hiz_core/src/cull/groups.rs`, `GROUPS_OF_RUN`.
const RUN: u32 = 8u;
// Invocations that share a group.
const SHARE: u32 = GROUP / RUN;

// Surviving groups in a row of their list, as a power of two.
// The list is a texture, for the reason that `record_layout.wgsl` gives.
// Twin: `crates/hiz_core/src/output/survivors.rs`, `SURVIVORS_PER_ROW`.
const SURVIVORS_PER_ROW_LOG2: u32 = 12u;

fn survivor_position(slot: u32) -> vec2<u32> {
    return vec2<u32>(slot % (1u << SURVIVORS_PER_ROW_LOG2), slot >> SURVIVORS_PER_ROW_LOG2);
}
