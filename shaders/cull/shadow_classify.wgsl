// The test of a shadow caster: does its shadow fall on anything that the camera sees?
// `classify`, the last function, takes the place of that of `classify.wgsl` in culls of casters.
//
// Culling rests on certificates alone (`shadow.wgsl`).
// The rectangle, the level, divisions and conversions only choose what is tested.
//
// With `SAMPLE_COVERAGE` receivers lie at pixel centres, otherwise anywhere in the pixels' squares.
// Casters always descend, and have no outline of their own: `DESCENT` and `FIT_VOLUME` of
// `decision.wgsl` change nothing here.

// An estimate of the least and greatest r / w at one end of the sweep: at the caster itself with
// side -1, at the other end with side 1.
fn end_interval(r: Swept, w: Swept, side: f32) -> vec2<f32> {
    let of_r = Value(r.middle.center + side * r.along, r.middle.error, r.middle.half);
    let of_w = Value(w.middle.center + side * w.along, w.middle.error, w.middle.half);
    let least_w = of_w.center - support(of_w.half) - of_w.error;
    let interval = ratio_interval(of_r, of_w);
    let error = error_bound(of_r, max(abs(interval.x), abs(interval.y)), of_w);
    let widened = RECTANGLE_MARGIN * error / least_w;
    return interval + vec2<f32>(-widened, widened);
}

// The first and last pixel that the swept volume may touch; if first > last there is none.
// The image of a hull is the hull of its ends' images.
fn swept_pixels(r: Swept, w: Swept, half_size: f32, size: i32) -> vec2<i32> {
    let begin = end_interval(r, w, -1.0);
    let end = end_interval(r, w, 1.0);
    let rounding = WIDENING_ULPS * EPS * half_size + view.reach;
    let low = min(begin.x, end.x) - rounding + half_size;
    let high = max(begin.y, end.y) + rounding + half_size;
    let edge = f32(size);
    return vec2<i32>(vec2<f32>(clamp(floor(low), 0.0, edge), clamp(floor(high), -1.0, edge - 1.0)));
}

// An interval without a pixel, as between two samples, becomes the pixels on both sides of it.
// These can be looked at, and the certificate of a block asks for no more.
fn not_empty(pixels: vec2<i32>, size: i32) -> vec2<i32> {
    let wider = clamp(pixels + vec2<i32>(-1, 1), vec2<i32>(0), vec2<i32>(size - 1));
    return select(pixels, wider, pixels.x > pixels.y);
}

// The block of texels lo..=hi of a level spans every pixel that the swept volume can touch inside
// the image, along one axis.
fn swept_inside_block(
    r: Swept, w: Swept, lo: u32, hi: u32, level: u32, half_size: f32, size: i32,
) -> bool {
    let begin = f32(i32(lo << level)) + view.reach - half_size;
    let end = i32((hi + 1u) << level);
    return (lo == 0u || swept_above(r, begin, w))
        && (end >= size || swept_below(r, f32(end) - view.reach - half_size, w));
}

// True implies: no receiver in the pixels first..=last lies in the swept volume.
// False: one may, or the budget has ended.
//
// The walk down the pyramid is that of `descend` in `classify.wgsl`.
// It begins at the footprint t of the level `top`, and enters only the texels that cannot decide.
// Even where the rectangle contains all pixels of a texel, finer ones may decide: some by the
// farthest receiver, others by the nearest.
fn descend_casters(
    top: u32, t: vec4<u32>, first: vec2<u32>, last: vec2<u32>, z: Swept, w: Swept,
    texels_read: ptr<function, u32>,
) -> bool {
    var left = view.descent_budget;
    var level = top;
    var at = t.xy;
    loop {
        if left == 0u {
            return false;
        }
        left -= 1u;
        *texels_read += 1u;
        let bits = texel(level, at.x, at.y);
        let clear = surely_clear_of(bits, nearest_texel(level, at.x, at.y), z, w);
        note_texel(level, at.x, at.y, bits, clear);
        if !clear {
            if level == 0u {
                return false;
            }
            let down = levels_down(level);
            level -= down;
            at = max(at << vec2<u32>(down), first >> vec2<u32>(level));
            continue;
        }
        if !next_texel(top, t, first, last, &level, &at) {
            return true;
        }
    }
    return false;
}

fn classify(i: u32) -> Outcome {
    var out = Outcome(INVALID, AT_VALIDITY, vec4<i32>(0), 0u, vec4<u32>(0u), 0u, 0u, 0u);
    let volume = load_volume(i);
    if !(volume.size < view.coordinate_limit) {
        if volume.center.x < ABSENT_BELOW {
            out.verdict = OUTSIDE;
        }
        return out;
    }

    // 1. Does the light carry its shadow to any receiver at all?
    out.stage = AT_FRUSTUM;
    out.verdict = OUTSIDE;
    let s = sweep_of(volume);
    if s < 0.0 {
        return out;
    }

    // 2. Is all of its shadow outside one plane of the frustum?
    var sized = volume;
    sized.size = volume.size + s * view.light_size;
    // Relative to the swept volume's size, so that no product overflows.
    if !(sized.size < view.coordinate_limit) {
        out.stage = AT_EYE_PLANE;
        out.verdict = VISIBLE;
        return out;
    }
    let growth = view.filter_radius + s * view.light_slope;
    let errors = errors_of(sized) + growth * view.steepness;
    let x = swept_value(view.x, errors.x, view.half_sweeps.x, s, volume);
    let y = swept_value(view.y, errors.y, view.half_sweeps.y, s, volume);
    let z = swept_value(view.z, errors.z, view.half_sweeps.z, s, volume);
    let w = swept_value(view.w, errors.w, view.half_sweeps.w, s, volume);
    let a = view.z_slope;
    let border = view.half_size + view.reach;
    if swept_beyond(x, border.x, w) | swept_beyond(y, border.y, w)
        | swept_below(z, bar(-a), w) | swept_above(z, bar(1.0 - a), w) {
        return out;
    }

    // 3. Does the shadow cross w = 0? Then it has no rectangle.
    out.stage = AT_EYE_PLANE;
    out.verdict = VISIBLE;
    let w_min = w.middle.center - support(w.middle.half) - abs(w.along) - w.middle.error;
    if !(w_min > LEAST_W) {
        return out;
    }

    // 4. Which pixels may the shadow touch? This is an estimate.
    let columns =
        not_empty(swept_pixels(x, w, view.half_size.x, view.size.x), view.size.x);
    let rows = not_empty(swept_pixels(y, w, view.half_size.y, view.size.y), view.size.y);
    out.pixels = vec4<i32>(columns.x, rows.x, columns.y, rows.y);
    let first = vec2<u32>(vec2<i32>(columns.x, rows.x));
    let last = vec2<u32>(vec2<i32>(columns.y, rows.y));
    let level = stored_level(finest_level(first, last));
    let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));
    out.level = level;
    out.texels = t;

    // 5. Is every texel there clear of it, at that level or below?
    out.stage = AT_DESCENT;
    out.farthest_bits = far_bits();
    if !is_reduced {
        return out;
    }
    var texels_read = 0u;
    let clear = descend_casters(level, t, first, last, z, w, &texels_read);
    out.texels_read = texels_read;

    // 6. Were these all pixels that matter?
    if clear
        && swept_inside_block(x, w, first.x, last.x, 0u, view.half_size.x, view.size.x)
        && swept_inside_block(y, w, first.y, last.y, 0u, view.half_size.y, view.size.y)
    {
        out.verdict = OCCLUDED;
    }
    return out;
}
