// The outcome of one test: the verdict, and for `explain.wgsl` how it was found.

// The stage at which `classify` stopped.
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
    // Valid from AT_DEPTH on: the pixel rectangle (inclusive), the level, its texel rectangle
    // (inclusive), and the farthest depth in that.
    // A rectangle is first column, first row, last column, last row.
    pixels: vec4<i32>,
    level: u32,
    texels: vec4<u32>,
    farthest_bits: u32,
    texels_read: u32,
}
