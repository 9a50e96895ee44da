// Depths travel as bits.
// Non-negative floats order like unsigned integers, so the farthest is an integer min or max.
// That is exact on every driver, whatever it does with NaN, -0 and subnormals.

// True: reversed Z, with depth 1 near and 0 far.
override REVERSED: bool;

const ONE_BITS: u32 = 0x3f800000u;
const LEAST_NORMAL_BITS: u32 = 0x00800000u;
const NEGATIVE_ZERO_BITS: u32 = 0x80000000u;

fn far_bits() -> u32 {
    return select(ONE_BITS, 0u, REVERSED);
}

fn near_bits() -> u32 {
    return select(0u, ONE_BITS, REVERSED);
}

// Sanitizes a depth: NaN and what lies outside 0..1 become far, subnormals and -0 become 0.
// Bits above those of 1 are numbers above 1, infinity, NaN, or anything with a sign.
fn sanitized(bits: u32) -> u32 {
    let outside = bits > ONE_BITS && bits != NEGATIVE_ZERO_BITS;
    let flushed = select(bits, 0u, bits < LEAST_NORMAL_BITS || bits == NEGATIVE_ZERO_BITS);
    return select(flushed, far_bits(), outside);
}

fn farthest(a: u32, b: u32) -> u32 {
    return select(max(a, b), min(a, b), REVERSED);
}

fn farthest4(v: vec4<u32>) -> u32 {
    return farthest(farthest(v.x, v.y), farthest(v.z, v.w));
}

// The farthest of four sanitized depths, with less work than sanitizing each.
//
// With reversed Z, all but LEAST_NORMAL_BITS..ONE_BITS becomes 0, and 0 is the farthest.
// The wrapping difference ONE_BITS - bits is greatest for the farthest depth.
// It exceeds ONE_BITS - LEAST_NORMAL_BITS if any of the four becomes 0.
//
// With standard Z, the order of bits is that of sanitized depths, except for -0.
// Its bits are above those of 1, although it becomes 0.
// If -0 has the greatest bits, no other of the four has a sign.
// As signed integers -0 is then the least, so the greatest signed integer is that of the rest.
fn farthest_sanitized4(v: vec4<u32>) -> u32 {
    if REVERSED {
        let below_one = vec4<u32>(ONE_BITS) - v;
        let most = max(max(below_one.x, below_one.y), max(below_one.z, below_one.w));
        return select(ONE_BITS - most, 0u, most > ONE_BITS - LEAST_NORMAL_BITS);
    }
    let greatest = max(max(v.x, v.y), max(v.z, v.w));
    let s = bitcast<vec4<i32>>(v);
    let greatest_signed = max(max(s.x, s.y), max(s.z, s.w));
    let bits = min(select(greatest, u32(max(greatest_signed, 0)), greatest == NEGATIVE_ZERO_BITS), ONE_BITS);
    return select(bits, 0u, bits < LEAST_NORMAL_BITS);
}
