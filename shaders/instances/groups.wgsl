// Groups of instances.

// Instances of a group, stored one after the other.
const GROUP: u32 = 64u;
// How many members of a group one invocation tests, one after the other, and how many groups so one
// workgroup: a software driver fetches uniforms for every eight invocations anew and never skips a
// branch, and does so once a run (docs/performance.md).
const RUN: u32 = 8u;
// Invocations that share a group.
const SHARE: u32 = GROUP / RUN;

// Survivors in a row of their list, a texture (as `record_layout.wgsl` says, and why), as a power
// of two (twin: `crates/hiz_core/src/output/survivors.rs`).
const SURVIVORS_PER_ROW_LOG2: u32 = 12u;

fn survivor_position(slot: u32) -> vec2<u32> {
    return vec2<u32>(slot % (1u << SURVIVORS_PER_ROW_LOG2), slot >> SURVIVORS_PER_ROW_LOG2);
}
