// What an early pass may draw, before its own test.

// Where the candidates come from.
// Twin: `Candidates` in `crates/hiz_core/src/cull/pipelines.rs`.
override EARLY_SET: u32;
// What the last late pass found visible.
const SET_BY_HISTORY: u32 = 0u;
// What is large in the image.
const SET_BY_SIZE: u32 = 1u;
// What the caller's mask names.
const SET_GIVEN: u32 = 2u;

// Whether an early pass draws, or looks into, what has this outcome of a test without depth.
// By size that is an estimate, as any set is right.
fn is_candidate(outcome: Outcome) -> bool {
    if EARLY_SET == SET_BY_SIZE {
        let sides = outcome.pixels.zw - outcome.pixels.xy + vec2<i32>(1);
        let is_large = max(sides.x, sides.y) >= frame.least_pixels;
        // What crosses the plane of the eye has no rectangle, and is near.
        return outcome.verdict == VISIBLE && (is_large || outcome.stage == AT_EYE_PLANE);
    }
    return outcome.verdict >= VISIBLE;
}
