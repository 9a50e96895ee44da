// Depths travel as bits.
// Non-negative floats order like unsigned integers, so farthest is an integer min or max: exact on
// every driver, whatever it does with NaN, -0 and subnormals.

// True: near 1, far 0.
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

// A depth as given: NaN and what lies outside 0..1 is far, subnormals and -0 are 0.
// (Bits above 1's are numbers above 1, infinity, NaN, or anything with a sign.)
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
// Reversed, everything but LEAST_NORMAL_BITS..ONE_BITS is 0 in the end, and 0 is farthest: of
// ONE_BITS - bits, wrapping, the greatest is that of the farthest, or more than any such number
// has.
// Standard, order and sanitizing agree but for -0, which is 0 although its bits are above 1's.
// Where the greatest is -0 there is no other number with a sign, so the greatest of them as signed
// integers, -0 the least, is that of the rest.
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
