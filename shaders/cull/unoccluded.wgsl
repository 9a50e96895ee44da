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

// Moves a walk over rows on by a texel, and at a row's end to the row below.
// False: there is none, so it is over.
fn next_of_rows(
    first: vec2<u32>, last: vec2<u32>, level: u32, place: ptr<function, vec2<u32>>,
) -> bool {
    var at = *place;
    at.x += 1u;
    if at.x > last.x >> level {
        at = vec2<u32>(first.x >> level, at.y + 1u);
    }
    *place = at;
    return at.y <= last.y >> level;
}

// True implies: all of the volume is nearer than every pixel of the rectangle first..=last.
// False: it may not be, or the budget has ended.
//
// The walk mirrors `descend`, on the nearest end and with a budget of its own.
// With BY_ROWS, for the boxes of groups, it goes row by row.
// What stands on the ground has nearer ground before it, at the lower border of its rectangle.
// There all texels of a row fail alike, so the walk enters the whole row with the first that fails.
// So it accepts more of such groups with as many texels.
//
// `front` becomes the nearest depth of the texels that decided, or the one that did not.
fn descend_in_front(
    top: u32, t: vec4<u32>, first: vec2<u32>, last: vec2<u32>, z: Value, w: Value,
    front: ptr<function, u32>, texels_read: ptr<function, u32>,
) -> bool {
    var left = view.descent_budget;
    var level = top;
    var at = t.xy;
    var decided = far_bits();
    loop {
        if left == 0u {
            return false;
        }
        left -= 1u;
        *texels_read += 1u;
        let bits = nearest_texel(level, at.x, at.y);
        if surely_in_front(bits, z, w) {
            decided = nearest(decided, bits);
            var goes_on = false;
            if BY_ROWS {
                goes_on = next_of_rows(first, last, level, &at);
            } else {
                goes_on = next_texel(top, t, first, last, &level, &at);
            }
            if !goes_on {
                *front = decided;
                return true;
            }
            continue;
        }
        // One of its pixels has that depth; if the rectangle contains all of them, it decides.
        let begin = at << vec2<u32>(level);
        let end = min((at + vec2<u32>(1u)) << vec2<u32>(level), vec2<u32>(view.size));
        if level == 0u || (all(begin >= first) && all(end <= last + vec2<u32>(1u))) {
            *front = bits;
            return false;
        }
        let down = levels_down(level);
        level -= down;
        // With BY_ROWS the texels before it in its row have passed, so the walk goes on below it.
        let least = first >> vec2<u32>(level);
        at = max(at << vec2<u32>(down), least);
    }
    return false;
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
