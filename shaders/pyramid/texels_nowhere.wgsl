// No depth at all, for passes that ask only which instances are outside.
// Every texel is far and near at once, so nothing is decided, and no reduction has run.

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

fn nearest_corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(near_bits());
}

fn nearest_texel(level: u32, x: u32, y: u32) -> u32 {
    return near_bits();
}
