// Reads no depth: for `refine.wgsl` and `refine_groups.wgsl`, which only ask what is outside.
// All is far, and no reduction has run.

// No reduction has this number, so a test ends before it reads.
fn reduction_number() -> u32 {
    return 0u;
}

fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(far_bits());
}

fn texel(level: u32, x: u32, y: u32) -> u32 {
    return far_bits();
}
