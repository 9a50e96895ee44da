// Depths travel as bits. Non-negative floats order like unsigned integers, so farthest is an integer min or max: exact on
// every driver, whatever it does with NaN, -0 and subnormals.

// True: near 1, far 0.
override REVERSED: bool;

const ONE_BITS: u32 = 0x3f800000u;
const LEAST_NORMAL_BITS: u32 = 0x00800000u;
const NEGATIVE_ZERO_BITS: u32 = 0x80000000u;

fn far_bits() -> u32 {
    return select(ONE_BITS, 0u, REVERSED);
}

// A depth as given: NaN and what lies outside 0..1 is far, subnormals and -0 are 0.
// (Bits above 1's are numbers above 1, infinity, NaN, or anything with a sign.)
fn sanitized(bits: u32) -> u32 {
    let outside = bits > ONE_BITS && bits != NEGATIVE_ZERO_BITS;
    let flushed = select(bits, 0u, bits < LEAST_NORMAL_BITS || bits == NEGATIVE_ZERO_BITS);
    return select(flushed, far_bits(), outside);
}

fn sanitized4(bits: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(sanitized(bits.x), sanitized(bits.y), sanitized(bits.z), sanitized(bits.w));
}

fn farthest(a: u32, b: u32) -> u32 {
    return select(max(a, b), min(a, b), REVERSED);
}

fn farthest4(v: vec4<u32>) -> u32 {
    return farthest(farthest(v.x, v.y), farthest(v.z, v.w));
}
