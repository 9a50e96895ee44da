// Which level is read.
// Level 0, the depth image, is always there.
// Of the others, those from first_stored to last_stored are.

// Copies of the pyramid's two numbers, in registers (`begin` in `texels.wgsl`).
var<private> first_stored: u32;
var<private> last_stored: u32;

// The number of the highest bit that is set, for 0 < v < 2^24.
// It is the exponent of a float that holds v exactly.
fn leading_bit(v: u32) -> u32 {
    return (bitcast<u32>(f32(v)) >> 23u) - 127u;
}

// The finest level at which the pixels first..last span no more texels than the footprint.
// It is computed from integer bits, because log2 rounds.
fn finest_level(first: vec2<u32>, last: vec2<u32>) -> u32 {
    let pixels = last - first;
    let level = max(leading_bit(pixels.x | pixels.y | 1u), FOOTPRINT_LOG2 - 1u) - (FOOTPRINT_LOG2 - 1u);
    let texels = (last >> vec2<u32>(level)) - (first >> vec2<u32>(level));
    return level + select(0u, 1u, (texels.x | texels.y) >= (1u << FOOTPRINT_LOG2));
}

// The finest stored level that is at least as coarse as `level`; the coarsest one if none is.
fn stored_level(level: u32) -> u32 {
    return select(clamp(level, first_stored, last_stored), 0u, level == 0u);
}

// How many levels down the next finer stored level is; not for level 0.
fn levels_down(level: u32) -> u32 {
    return select(1u, level, level <= first_stored);
}

// How many levels up the next coarser stored level is.
fn levels_up(level: u32) -> u32 {
    return select(1u, first_stored, level == 0u);
}
