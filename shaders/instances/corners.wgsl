// Boxes that are formed on the device: least and greatest corners as integer keys, and the record
// of the box between them.
//
// Whatever can be done on bits is: validation, and the least and greatest corner.
// So no flushed subnormal and no assumption about NaN takes part in it.
// docs/accuracy.md counts the roundings of what is left, under "Bounds from a buffer".
//
// `source.runtime_zero` is defined elsewhere: 0, which no compiler knows.

// Texels of a box's record.
const BOX_TEXELS: u32 = 3u;

const HALF: f32 = 0.5;
const SIGN_BIT: u32 = 0x80000000u;
const MAGNITUDE_BITS: u32 = 0x7fffffffu;
// The bits of 2^60 (`volume_record.rs`, `LARGEST`), beyond which bounds are invalid.
const LARGEST_BITS: u32 = 0x5d800000u;
// The bits of 2^61: a valid box has no corner beyond, and sums of such corners do not overflow.
const LARGEST_CORNER_BITS: u32 = 0x5e000000u;
// The bits of 2^-100 and of 2^-99: what is below the first is taken as the second.
// There a flushed subnormal may be more than the next float32 makes up for.
const SMALL_BITS: u32 = 0x0d800000u;
const BEYOND_SMALL_BITS: u32 = 0x0e000000u;

// A float's bits as an integer that ascends as the float does.
// The next integer is the next float.
fn key_of(bits: u32) -> u32 {
    return select(bits | SIGN_BIT, ~bits, bits >= SIGN_BIT);
}

fn bits_of(key: u32) -> u32 {
    return select(~key, key & MAGNITUDE_BITS, key >= SIGN_BIT);
}

// The key of a float that is not below the exact sum or difference that was rounded to x.
fn key_above(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    let is_small = (bits & MAGNITUDE_BITS) < SMALL_BITS;
    return select(key_of(bits) + 1u, key_of(BEYOND_SMALL_BITS), is_small);
}

// The key of a float that is not above it.
fn key_below(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    let is_small = (bits & MAGNITUDE_BITS) < SMALL_BITS;
    return select(key_of(bits) - 1u, key_of(BEYOND_SMALL_BITS | SIGN_BIT), is_small);
}

// Keeps a compiler from folding a centre into the differences that are taken from it.
fn bar(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ source.runtime_zero);
}

// The least and greatest corner of what an instance's bounds contain, as keys.
struct Corners {
    low: vec3<u32>,
    high: vec3<u32>,
}

// The corners of invalid bounds: they reach beyond every float.
const INVALID_LOW: u32 = 0u;
const INVALID_HIGH: u32 = 0xffffffffu;

fn invalid_corners() -> Corners {
    return Corners(vec3<u32>(INVALID_LOW), vec3<u32>(INVALID_HIGH));
}

// A centre and a half size along one axis, as bits.
fn middle(low_key: u32, high_key: u32) -> vec2<u32> {
    if low_key == high_key {
        return vec2<u32>(bits_of(low_key), 0u);
    }
    let low = bitcast<f32>(bits_of(low_key));
    let high = bitcast<f32>(bits_of(high_key));
    let center = bar(HALF * low + HALF * high);
    let half = bits_of(max(key_above(high - center), key_above(center - low)));
    return vec2<u32>(bitcast<u32>(center), half);
}

// The first and the last texel of a box's record; the one between holds the index.
struct BoxTexels {
    center: vec3<u32>,
    half: vec3<u32>,
}

fn box_texels(corners: Corners) -> BoxTexels {
    let x = middle(corners.low.x, corners.high.x);
    let y = middle(corners.low.y, corners.high.y);
    let z = middle(corners.low.z, corners.high.z);
    let box = BoxTexels(vec3<u32>(x.x, y.x, z.x), vec3<u32>(x.y, y.y, z.y));
    let is_small = all((box.center & vec3<u32>(MAGNITUDE_BITS)) < vec3<u32>(LARGEST_BITS))
        && all(box.half < vec3<u32>(LARGEST_BITS));
    if is_small {
        return box;
    }
    return BoxTexels(vec3<u32>(0u), vec3<u32>(BEYOND_LIMITS_BITS));
}
