// Depths as bits.
// Non-negative floats order like unsigned integers, so the farthest depth is an integer min or max,
// and so is the nearest.
// That is exact on every driver, whatever it does with NaN, -0 and subnormals.
//
// The nearest depth in one convention is the farthest in the other, invalid pixels included.

// True: near is 1 and far is 0.
override REVERSED: bool;
// True: pixels of level 0 that show the background leave the farthest depth alone.
override RECEIVERS: bool = false;

// The bits of 1, of the least normal number, and of -0.
const ONE_BITS: u32 = 0x3f800000u;
const LEAST_NORMAL_BITS: u32 = 0x00800000u;
const NEGATIVE_ZERO_BITS: u32 = 0x80000000u;

// Depths that one load or store takes: a vec4 of a buffer, or a texel of an rgba32uint texture.
// They follow each other in a row.
// Twins: `PIXELS` and `BLOCK_ALIGNMENT` in `crates/hiz_core/src/pyramid/layout.rs`.
const VECTOR_LOG2: u32 = 2u;
const VECTOR: u32 = 1u << VECTOR_LOG2;
const VECTOR_MASK: u32 = VECTOR - 1u;

// Texels along a side of the block that one invocation of the reduction reads.
// The logarithm is also the number of levels that it makes of the block.
// Twin: `BLOCK_LOG2` in `crates/hiz_core/src/pyramid/layout.rs`.
const BLOCK_LOG2: u32 = 3u;
const BLOCK: u32 = 1u << BLOCK_LOG2;
// Quads of 2x2 texels along a side of a block.
const BLOCK_QUADS: u32 = BLOCK / 2u;

fn far_bits() -> u32 {
    return select(ONE_BITS, 0u, REVERSED);
}

fn near_bits() -> u32 {
    return select(0u, ONE_BITS, REVERSED);
}

// A depth as it was given becomes one that can be compared.
// NaN and numbers outside of 0..1 are far; subnormals and -0 are 0.
// Bits above those of 1 belong to numbers above 1, infinity, NaN, or anything with a sign.
fn sanitized(bits: u32) -> u32 {
    let outside = bits > ONE_BITS && bits != NEGATIVE_ZERO_BITS;
    let flushed = select(bits, 0u, bits < LEAST_NORMAL_BITS || bits == NEGATIVE_ZERO_BITS);
    return select(flushed, far_bits(), outside);
}

fn sanitized4(v: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(sanitized(v.x), sanitized(v.y), sanitized(v.z), sanitized(v.w));
}

// The same for the nearest depth: what is no depth is near.
fn sanitized_near(bits: u32) -> u32 {
    let outside = bits > ONE_BITS && bits != NEGATIVE_ZERO_BITS;
    return select(sanitized(bits), near_bits(), outside);
}

fn sanitized_near4(v: vec4<u32>) -> vec4<u32> {
    return vec4<u32>(
        sanitized_near(v.x), sanitized_near(v.y), sanitized_near(v.z), sanitized_near(v.w));
}

fn farthest(a: u32, b: u32) -> u32 {
    return select(max(a, b), min(a, b), REVERSED);
}

// The same of four pairs.
fn farthest_each(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    if REVERSED {
        return min(a, b);
    }
    return max(a, b);
}

fn farthest4(v: vec4<u32>) -> u32 {
    return farthest(farthest(v.x, v.y), farthest(v.z, v.w));
}

fn nearest(a: u32, b: u32) -> u32 {
    return select(min(a, b), max(a, b), REVERSED);
}

fn nearest_each(a: vec4<u32>, b: vec4<u32>) -> vec4<u32> {
    if REVERSED {
        return max(a, b);
    }
    return min(a, b);
}

fn nearest4(v: vec4<u32>) -> u32 {
    return nearest(nearest(v.x, v.y), nearest(v.z, v.w));
}

// The least of four depths, where what is no depth is 0, with less work than sanitizing each.
//
// All bits outside of LEAST_NORMAL_BITS..ONE_BITS are sanitized to 0.
// The greatest of ONE_BITS - bits, wrapping, belongs to the least depth.
// If it is greater than that of any number in the range, some depth is sanitized to 0.
fn least_sanitized4(v: vec4<u32>) -> u32 {
    let below_one = vec4<u32>(ONE_BITS) - v;
    let most = max(max(below_one.x, below_one.y), max(below_one.z, below_one.w));
    return select(ONE_BITS - most, 0u, most > ONE_BITS - LEAST_NORMAL_BITS);
}

// The greatest of four depths, where what is no depth is 1, with less work than sanitizing each.
//
// Sanitizing keeps the order of bits, except for -0, which becomes 0.
// Its bits are above those of 1.
// If -0 has the greatest bits, no other number has a sign.
// As signed integers -0 is then the least, and the greatest is that of the other numbers.
fn greatest_sanitized4(v: vec4<u32>) -> u32 {
    let greatest = max(max(v.x, v.y), max(v.z, v.w));
    let s = bitcast<vec4<i32>>(v);
    let greatest_signed = max(max(s.x, s.y), max(s.z, s.w));
    let without_negative_zero =
        select(greatest, u32(max(greatest_signed, 0)), greatest == NEGATIVE_ZERO_BITS);
    let bits = min(without_negative_zero, ONE_BITS);
    return select(bits, 0u, bits < LEAST_NORMAL_BITS);
}

// The farthest of four depths as they were given, where what is no depth is far.
fn farthest_sanitized4(v: vec4<u32>) -> u32 {
    if REVERSED {
        return least_sanitized4(v);
    }
    return greatest_sanitized4(v);
}

// The nearest of four depths as they were given, where what is no depth is near.
fn nearest_sanitized4(v: vec4<u32>) -> u32 {
    if REVERSED {
        return greatest_sanitized4(v);
    }
    return least_sanitized4(v);
}

// Background is what has exactly the bits of far, where -0 is 0.
//
// Both sides are always evaluated: `||` makes a branch, and a block of 64 pixels makes 64 of them.
// SwiftShader then compiles a reduction for a minute or more, and else for 0.2 s.
fn is_background(bits: u32) -> bool {
    return (bits == far_bits()) | (REVERSED & (bits == NEGATIVE_ZERO_BITS));
}

// A pixel of level 0 as the farthest depth counts it.
// Where only receivers count, background becomes near, and so leaves the farthest depth alone.
fn foreground(bits: u32) -> u32 {
    return select(bits, near_bits(), RECEIVERS & is_background(bits));
}

fn foreground4(v: vec4<u32>) -> vec4<u32> {
    if RECEIVERS {
        return vec4<u32>(foreground(v.x), foreground(v.y), foreground(v.z), foreground(v.w));
    }
    return v;
}
