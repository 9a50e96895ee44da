// The result of a test.

// The stage at which a test stopped.
// Twin: `Stage` in `crates/hiz_core/src/cull/explain.rs`.
const AT_VALIDITY: u32 = 0u;
const AT_FRUSTUM: u32 = 1u;
const AT_EYE_PLANE: u32 = 2u;
const AT_RECTANGLE: u32 = 3u;
const AT_DEPTH: u32 = 4u;
const AT_BLOCK: u32 = 5u;
const AT_DESCENT: u32 = 6u;
const AT_LEVEL: u32 = 7u;
const AT_FRONT: u32 = 8u;

struct Outcome {
    verdict: u32,
    stage: u32,
    // What follows is set from AT_DEPTH on, the pixels from AT_RECTANGLE on.
    // First column, first row, last column, last row, inclusive.
    pixels: vec4<i32>,
    level: u32,
    // The texels of that level, in the same order.
    texels: vec4<u32>,
    // The farthest depth of these texels.
    farthest_bits: u32,
    texels_read: u32,
    // The nearest depth of these texels, or of those that decided a walk down the nearest end.
    // Near without both ends.
    nearest_bits: u32,
}
