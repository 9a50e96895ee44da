// The third answer: certificates that all of a volume shows.
// docs/accuracy.md derives them, under "Surely visible".
//
// They mirror those that hide: `surely_behind`, and the frustum's planes of `classify`.
// Their roundings are those of line a in the same document, under "Counting the roundings".

// What the reach of sample coverage lacks of the guard, in pixels.
const HALF_PIXEL: f32 = 0.5;

// The nearest depth that a stored one may stand for, moved by the slack towards the eye.
//
// A pixel that is exactly far is background, which hides nothing, so no slack is taken off it.
// Reversed Z: subnormals are stored as 0, so 0 stands for all depths below the least normal number.
fn revealing_depth(bits: u32) -> f32 {
    let stored = bitcast<f32>(bits);
    let moved = select(stored, max(stored, LEAST_NORMAL), REVERSED) * view.near_factor
        + view.near_offset;
    return bar(select(moved, select(1.0, LEAST_NORMAL, REVERSED), bits == far_bits()));
}

// True implies: all of the volume is nearer than the stored depth, where its w is above 0.
// `bits` is the nearest depth of a block, sanitized as `nearest_texel` does.
fn surely_in_front(bits: u32, z: Value, w: Value) -> bool {
    let t = bar(revealing_depth(bits) - view.z_slope);
    if REVERSED {
        return surely_above(z, t, w);
    }
    return surely_below(z, t, w);
}

// True implies: all of the volume lies within the six planes of the frustum, and w > 0 on it.
// It also stays away from the image's borders by the guard.
fn surely_inside(x: Value, y: Value, z: Value, w: Value) -> bool {
    // The reach is the guard, less half a pixel in sample coverage.
    // Multiples of 2^-8 below 2^16: exact.
    let guard = view.reach + select(0.0, HALF_PIXEL, SAMPLE_COVERAGE);
    let border = view.half_size - guard;
    let a = view.z_slope;
    return surely_below(x, border.x, w) & surely_above(x, -border.x, w)
        & surely_below(y, border.y, w) & surely_above(y, -border.y, w)
        & surely_above(z, bar(-a), w) & surely_below(z, bar(1.0 - a), w);
}
