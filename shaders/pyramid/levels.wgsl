// Which level is read.
// Level 0, the depth image, is always there; of the others those from first_stored to last_stored
// (of the pyramid, in registers).

var<private> first_stored: u32;
var<private> last_stored: u32;

// Which bit is the highest one that is set, for 0 < v < 2^24: the exponent of a float that holds v
// exactly.
fn leading_bit(v: u32) -> u32 {
    return (bitcast<u32>(f32(v)) >> 23u) - 127u;
}

// The finest level at which the pixels first..last span no more texels than the footprint.
// Integer bits, no log2: that rounds.
fn finest_level(first: vec2<u32>, last: vec2<u32>) -> u32 {
    let pixels = last - first;
    let level = max(leading_bit(pixels.x | pixels.y | 1u), FOOTPRINT_LOG2 - 1u) - (FOOTPRINT_LOG2 - 1u);
    let texels = (last >> vec2<u32>(level)) - (first >> vec2<u32>(level));
    return level + select(0u, 1u, (texels.x | texels.y) >= (1u << FOOTPRINT_LOG2));
}

// The finest level there is that is as coarse as `level`, or the coarsest one.
fn stored_level(level: u32) -> u32 {
    return select(clamp(level, first_stored, last_stored), 0u, level == 0u);
}

// How many levels lie between one and the next finer that is there; 0 has none.
fn levels_down(level: u32) -> u32 {
    return select(1u, level, level <= first_stored);
}

// The same to the next coarser.
fn levels_up(level: u32) -> u32 {
    return select(1u, first_stored, level == 0u);
}
