// Where the algorithm stopped, for `explain`.
const AT_VALIDITY: u32 = 0u;
const AT_FRUSTUM: u32 = 1u;
const AT_EYE_PLANE: u32 = 2u;
const AT_RECTANGLE: u32 = 3u;
const AT_DEPTH: u32 = 4u;
const AT_BLOCK: u32 = 5u;
const AT_DESCENT: u32 = 6u;
const AT_LEVEL: u32 = 7u;

struct Outcome {
    verdict: u32,
    stage: u32,
    // Valid from AT_DEPTH on: pixel rectangle (inclusive), level, texel rectangle, the farthest
    // depth in it.
    pixels: vec4<i32>,
    level: u32,
    texels: vec4<u32>,
    farthest_bits: u32,
    texels_read: u32,
}
