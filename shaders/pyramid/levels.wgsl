// Which level a test reads.
// Level 0, the depth image, is always there.
// Of the others, the levels first_stored..=last_stored are stored.

// Copies of the pyramid's numbers, in registers.
var<private> first_stored: u32;
var<private> last_stored: u32;

// The layout of float32.
const MANTISSA_BITS: u32 = 23u;
const EXPONENT_BIAS: u32 = 127u;

// The number of the highest set bit of v, for 0 < v < 2^24.
// A float32 holds such a v exactly, and its exponent is that number.
fn leading_bit(v: u32) -> u32 {
    return (bitcast<u32>(f32(v)) >> MANTISSA_BITS) - EXPONENT_BIAS;
}

// The finest level at which the pixels first..=last span no more texels than the footprint.
// It is found with integers alone, because log2 may round.
fn finest_level(first: vec2<u32>, last: vec2<u32>) -> u32 {
    if FOOTPRINT_LOG2 == 0u {
        // One texel encloses pixels whose numbers differ in their last bits alone.
        let apart = (first.x ^ last.x) | (first.y ^ last.y);
        return select(leading_bit(apart | 1u) + 1u, 0u, apart == 0u);
    }
    let pixels = last - first;
    let side = max(FOOTPRINT_LOG2, 1u) - 1u;
    let level = max(leading_bit(pixels.x | pixels.y | 1u), side) - side;
    let texels = (last >> vec2<u32>(level)) - (first >> vec2<u32>(level));
    return level + select(0u, 1u, (texels.x | texels.y) >= (1u << FOOTPRINT_LOG2));
}

// The finest stored level that is as coarse as `level`, or the coarsest stored one.
fn stored_level(level: u32) -> u32 {
    return select(clamp(level, first_stored, last_stored), 0u, level == 0u);
}

// How many levels it is from a level above 0 down to the next finer one that is there.
fn levels_down(level: u32) -> u32 {
    return select(1u, level, level <= first_stored);
}

// The bits at which a column, or row, has a next sibling that is not beyond `end`.
// Bit k stands for the one k levels up.
fn siblings(at: u32, end: u32) -> u32 {
    // Up to their highest different bit `at` is less than `end`, above it they are equal.
    let apart = at ^ end;
    return select((2u << leading_bit(apart | 1u)) - 1u, 0u, apart == 0u) & ~at;
}

// Moves a walk on to the next sibling, or to that of the first parent that has one.
// The walk is over the rectangle first..=last, and began at the texels t of the level `top`.
// False: there is none, so it is over.
//
// The parent is found without a loop, because the loops of an invocation are limited
// (`crates/hiz_core/src/cull/descent.rs`).
fn next_texel(
    top: u32, t: vec4<u32>, first: vec2<u32>, last: vec2<u32>,
    level: ptr<function, u32>, place: ptr<function, vec2<u32>>,
) -> bool {
    var at = *place;
    var here = *level;
    if here == 0u && top > 0u {
        // The parents of pixels are on the first stored level, whatever that is.
        // The number of the last column, and row, among a parent's children.
        let last_child = (1u << first_stored) - 1u;
        if (at.x & last_child) < last_child && at.x < last.x {
            (*place).x = at.x + 1u;
            return true;
        }
        if (at.y & last_child) < last_child && at.y < last.y {
            *place = vec2<u32>(max(at.x & ~last_child, first.x), at.y + 1u);
            return true;
        }
        at >>= vec2<u32>(first_stored);
        here = first_stored;
    }
    // From here on parents are one level apart.
    let end = last >> vec2<u32>(here);
    let right = siblings(at.x, end.x);
    let below = siblings(at.y, end.y);
    let left = top - here;
    let up = min(countTrailingZeros((right | below) | (1u << left)), left);
    at >>= vec2<u32>(up);
    *level = here + up;
    if up == left {
        if at.x < t.z {
            *place = vec2<u32>(at.x + 1u, at.y);
            return true;
        }
        *place = vec2<u32>(t.x, at.y + 1u);
        return at.y < t.w;
    }
    if ((right >> up) & 1u) != 0u {
        *place = vec2<u32>(at.x + 1u, at.y);
    } else {
        *place = vec2<u32>(max(at.x & ~1u, first.x >> *level), at.y + 1u);
    }
    return true;
}
