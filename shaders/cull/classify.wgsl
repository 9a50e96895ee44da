// The test of one instance: `classify`, the last function, decides in six numbered steps.
//
// A verdict that hides an instance rests on certificates alone.
// The rectangle, the level, divisions and conversions only choose what is tested.
// Where they are wrong, a certificate fails and the instance is kept.
//
// A module is a list of files: `decision_module` in `crates/hiz_core/src/cull/pipelines.rs`.
// What is used here and defined elsewhere:
//
// - `certificate.wgsl`: `Value`, `value_of`, `errors_of`, `error_bound`, `surely_above`, `_below`
//   and `_outside`
// - `view.wgsl`: `view`, `bar`
// - `decision.wgsl`: `SAMPLE_COVERAGE`, `DESCENT`, `FIT_VOLUME`, thresholds
// - `supporting_planes.wgsl`: `Projected`, `surely_clear`
// - `outcome.wgsl`, `../output/verdict.wgsl`: `Outcome`, stages, verdicts
// - `../instances/bounds_*.wgsl`: `load_volume`, `support`, `extent_of`, `surely_after`, `_before`
// - `../pyramid/texels*.wgsl`, `../pyramid/levels.wgsl`: `texel`, `footprint`, `finest_level`
// - `unoccluded.wgsl`: `surely_in_front`, `surely_inside`, `descend_in_front`
// - `unexplained.wgsl` or `explain.wgsl`: `note_texel`, `note_clear`

// The first and last pixel that an extent may touch; if first > last there is none.
// The extent is relative to the image's middle.
//
// Without the widening a volume that ends exactly on a pixel border would be tested without the
// pixel beyond.
// Its certificate would fail then, and it would be kept.
fn pixel_interval(extent: Extent, per_w: f32, half_size: f32, size: i32) -> vec2<i32> {
    let rounding = WIDENING_ULPS * EPS * half_size + view.reach;
    let low = extent.low - (extent.below * per_w + rounding) + half_size;
    let high = extent.high + (extent.above * per_w + rounding) + half_size;
    let edge = f32(size);
    // Clamped as floats, which is exact: pixels are small integers.
    return vec2<i32>(vec2<f32>(clamp(floor(low), 0.0, edge), clamp(floor(high), -1.0, edge - 1.0)));
}

// Sample coverage: the volume lies between the centres of the pixels first - 1 and first.
fn between_samples(r: Value, w: Value, first: i32, half_size: f32) -> bool {
    let left = f32(first) - half_size;
    return surely_above(r, left + view.reach, w) && surely_below(r, left - view.reach, w);
}

// The block of texels lo..=hi of a level spans every pixel that the volume can touch inside the
// image, along one axis.
fn inside_block(
    r: Value, w: Value, extent: Extent, w_min: f32,
    lo: u32, hi: u32, level: u32, half_size: f32, size: i32,
) -> bool {
    let begin = i32(lo << level);
    let end = i32((hi + 1u) << level);
    return (lo == 0u | surely_after(r, w, extent, f32(begin) + view.reach - half_size, w_min))
        & (end >= size | surely_before(r, w, extent, f32(end) - view.reach - half_size, w_min));
}

// Whether anything can be behind this depth: nothing is behind the far plane.
fn can_occlude(d: f32) -> bool {
    return select(1.0 > d, d >= LEAST_NORMAL, REVERSED);
}

// True implies: all of the volume is farther than the stored depth.
fn surely_behind(bits: u32, z: Value, w: Value) -> bool {
    let d = occluding_depth(bits);
    let t = bar(d - view.z_slope);
    if REVERSED {
        return can_occlude(d) && surely_below(z, t, w);
    }
    return can_occlude(d) && surely_above(z, t, w);
}

// True implies: no pixel of the rectangle first..=last shows anything of the volume.
// False: a pixel may show some of it, or the budget has ended.
//
// The walk down the pyramid begins at the footprint t of the level `top`.
// It enters only the texels that cannot decide, and of them only what the rectangle touches.
// Source: Greene, Kass and Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993.
fn descend(
    top: u32, t: vec4<u32>, first: vec2<u32>, last: vec2<u32>, p: Projected,
    texels_read: ptr<function, u32>,
) -> bool {
    var planes: SupportingPlanes;
    if FIT_VOLUME {
        supporting_planes(&planes, p);
    }
    var left = view.descent_budget + *texels_read;
    var level = top;
    var at = t.xy;
    loop {
        if left == 0u {
            return false;
        }
        left -= 1u;
        *texels_read += 1u;
        let bits = texel(level, at.x, at.y);
        var clear = surely_behind(bits, p.z, p.w);
        note_texel(level, at.x, at.y, bits, clear);
        if !clear {
            // The texel's pixels, cut at the image's edge.
            let begin = at << vec2<u32>(level);
            let end = min((at + vec2<u32>(1u)) << vec2<u32>(level), vec2<u32>(view.size));
            if FIT_VOLUME {
                clear = surely_clear(
                    &planes, max(begin, first), min(end, last + vec2<u32>(1u)), bits);
                note_clear(clear);
            } else if all(begin >= first) && all(end <= last + vec2<u32>(1u)) {
                // One of its pixels has that depth, and the rectangle contains all its pixels.
                // So no finer level can decide otherwise.
                return false;
            }
        }
        if !clear {
            if !DESCENT || level == 0u {
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
    let errors = errors_of(volume);
    let x = value_of(view.x, errors.x, volume);
    let y = value_of(view.y, errors.y, volume);
    let z = value_of(view.z, errors.z, volume);
    let w = value_of(view.w, errors.w, volume);

    // 1. Is it outside one of the six planes of the frustum?
    out.stage = AT_FRUSTUM;
    out.verdict = OUTSIDE;
    if surely_outside(x, y, z, w) {
        return out;
    }

    // 2. Does it cross w = 0? Then there is no rectangle.
    //    w_min is a lower bound of w; for spheres it is an estimate, as its root is not trusted.
    out.stage = AT_EYE_PLANE;
    out.verdict = VISIBLE;
    let w_min = w.center - support(w.half) - error_bound(w, 0.0, w);
    if !(w_min > LEAST_W) {
        return out;
    }

    // 3. Which pixels may its projection touch? This is an estimate.
    out.stage = AT_RECTANGLE;
    let ends_x = extent_of(x, w, w_min);
    let ends_y = extent_of(y, w, w_min);
    let per_w = RECTANGLE_MARGIN / w_min;
    let columns = pixel_interval(ends_x, per_w, view.half_size.x, view.size.x);
    let rows = pixel_interval(ends_y, per_w, view.half_size.y, view.size.y);
    out.pixels = vec4<i32>(columns.x, rows.x, columns.y, rows.y);
    if columns.x > columns.y || rows.x > rows.y {
        if SAMPLE_COVERAGE {
            if (columns.x > columns.y && between_samples(x, w, columns.x, view.half_size.x))
                || (rows.x > rows.y && between_samples(y, w, rows.x, view.half_size.y)) {
                out.verdict = OUTSIDE;
            }
        }
        return out;
    }

    // 4. What is the finest stored level at which it spans no more texels than the footprint?
    let first = vec2<u32>(vec2<i32>(columns.x, rows.x));
    let last = vec2<u32>(vec2<i32>(columns.y, rows.y));
    let finest = finest_level(first, last);
    let fits = finest <= last_stored;
    var level = stored_level(finest);
    let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));
    out.level = level;
    out.texels = t;

    // 5. Is all of it farther than the farthest depth there?
    out.stage = AT_DEPTH;
    if !is_reduced {
        return out;
    }
    // A variable of its own: the Vulkan backend of naga 30 cannot pass a pointer to a member.
    var texels_read = 0u;
    var hidden = false;
    if fits {
        out.farthest_bits = footprint(level, t);
        texels_read = (t.z - t.x + 1u) * (t.w - t.y + 1u);
        hidden = surely_behind(out.farthest_bits, z, w);
    } else {
        // More texels than a footprint has: only the budget of a descent may allow them.
        out.stage = AT_LEVEL;
        out.farthest_bits = far_bits();
    }
    out.texels_read = texels_read;
    // With both ends: is all of it inside the frustum, and nearer than the nearest depth there?
    var is_inside = false;
    var in_front = false;
    var front = near_bits();
    // Texels of the nearest end are counted, and are no part of a descent's budget.
    var nearest_read = 0u;
    if NEAREST {
        is_inside = !hidden && surely_inside(x, y, z, w);
        if fits && is_inside {
            front = nearest_footprint(level, t);
            in_front = surely_in_front(front, z, w);
            nearest_read = texels_read;
        }
    }
    var block = t;
    if hidden {
        out.stage = AT_BLOCK;
    } else if in_front && !(SAMPLE_COVERAGE && FIT_VOLUME) {
        // What shows in some pixel is not hidden, so no descent is needed.
        // Between samples a volume shows in none, and a fit to the volume may find that out.
        out.stage = AT_FRONT;
    } else if (DESCENT && level > 0u) || FIT_VOLUME {
        // Texel by texel and into finer levels, over the pixels of the rectangle alone.
        // These are texels of level 0.
        out.stage = AT_DESCENT;
        hidden = descend(level, t, first, last, Projected(x, y, z, w, w_min), &texels_read);
        if NEAREST && DESCENT {
            // No texel is farther than the farthest.
            if !hidden && !in_front && is_inside && level > 0u
                && surely_in_front(out.farthest_bits, z, w) {
                in_front = descend_in_front(level, t, first, last, z, w, &front, &texels_read);
            }
        }
        block = vec4<u32>(first, last);
        level = 0u;
    }

    out.nearest_bits = front;
    out.texels_read = texels_read + nearest_read;

    // 6. Were the texels those of all pixels that matter?
    if (hidden | in_front)
        & inside_block(x, w, ends_x, w_min, block.x, block.z, level, view.half_size.x, view.size.x)
        & inside_block(y, w, ends_y, w_min, block.y, block.w, level, view.half_size.y, view.size.y)
    {
        out.verdict = select(OCCLUDED, UNOCCLUDED, in_front & !hidden);
    }
    return out;
}
