// A yardstick: the test of a box without certificates, as an author who trusts float32 writes it.
// It has the same records, tests, footprint and level, and runs in the same frame.
// It has no margins and no bars, and proves nothing.
// It hides instances that can be seen, and exists to be measured against.

struct Flat {
    center: f32,
    half: vec3<f32>,
}

fn flat_value(row: vec4<f32>, center: vec3<f32>, volume: Volume) -> Flat {
    return Flat(dot(row.xyz, center) + row.w, on_half_axes(row.xyz, volume));
}

fn flat_above(r: Flat, t: f32, w: Flat) -> bool {
    return r.center - t * w.center > support(r.half - t * w.half);
}

fn flat_beyond(r: Flat, t: f32, w: Flat) -> bool {
    return abs(r.center) - t * w.center
        > support(select(1.0, -1.0, r.center < 0.0) * r.half - t * w.half);
}

fn flat_interval(r: Flat, w: Flat) -> vec2<f32> {
    let ratio = r.center / w.center;
    let toward = select(vec3<f32>(-1.0), vec3<f32>(1.0), r.half - ratio * w.half >= vec3<f32>(0.0));
    let r_half = dot(toward, r.half);
    let w_half = dot(toward, w.half);
    return vec2<f32>(
        (r.center - r_half) / (w.center - w_half), (r.center + r_half) / (w.center + w_half));
}

fn flat_pixels(interval: vec2<f32>, half_size: f32, size: i32) -> vec2<i32> {
    let pixels = floor(interval + half_size);
    return vec2<i32>(clamp(pixels, vec2<f32>(0.0, -1.0), vec2<f32>(f32(size), f32(size) - 1.0)));
}

fn classify(i: u32) -> Outcome {
    var out = Outcome(OUTSIDE, AT_FRUSTUM, vec4<i32>(0), 0u, vec4<u32>(0u), 0u, 0u, 0u);
    let volume = load_volume(i);
    let center = volume.center;
    let x = flat_value(view.x, center, volume);
    let y = flat_value(view.y, center, volume);
    let z = flat_value(view.z, center, volume);
    let w = flat_value(view.w, center, volume);
    let behind_near = Flat(-z.center, -z.half);
    if flat_beyond(x, view.half_size.x, w) | flat_beyond(y, view.half_size.y, w)
        | flat_above(behind_near, view.z_slope, w) | flat_above(z, 1.0 - view.z_slope, w) {
        return out;
    }
    out.verdict = VISIBLE;
    if w.center <= support(w.half) {
        return out;
    }
    let columns = flat_pixels(flat_interval(x, w), view.half_size.x, view.size.x);
    let rows = flat_pixels(flat_interval(y, w), view.half_size.y, view.size.y);
    if columns.x > columns.y || rows.x > rows.y {
        return out;
    }
    let first = vec2<u32>(vec2<i32>(columns.x, rows.x));
    let last = vec2<u32>(vec2<i32>(columns.y, rows.y));
    let level = stored_level(finest_level(first, last));
    let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));
    let depth = bitcast<f32>(footprint(level, t)) - view.z_slope;
    var hidden: bool;
    if REVERSED {
        hidden = flat_above(behind_near, -depth, w);
    } else {
        hidden = flat_above(z, depth, w);
    }
    out.verdict = select(VISIBLE, OCCLUDED, hidden);
    return out;
}
