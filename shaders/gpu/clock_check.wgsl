// A known amount of work, by which a device's timestamps are checked.
// Source of the steps: Marsaglia, "Xorshift RNGs", 2003.

// Twin: `WORKGROUP` in `crates/hiz_core/src/gpu/clock_check.rs`.
const WORKGROUP: u32 = 64u;
// Shifts of a step.
const LEFT: u32 = 13u;
const RIGHT: u32 = 17u;
const LEFT_AGAIN: u32 = 5u;

// How many steps an invocation takes.
override STEPS: u32;

@group(0) @binding(0) var<storage, read_write> numbers: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn spin(@builtin(global_invocation_id) id: vec3<u32>) {
    var x = id.x + 1u;
    for (var step = 0u; step < STEPS; step += 1u) {
        x ^= x << LEFT;
        x ^= x >> RIGHT;
        x ^= x << LEFT_AGAIN;
    }
    numbers[id.x] = x;
}
