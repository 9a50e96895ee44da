// The cull of one instance. A verdict that hides it rests on certificates alone; the rectangle, the level, divisions and
// conversions only choose what is tested, and where they go wrong a certificate fails and the instance is kept.

// A lane's verdict: bit 1 says kept, bit 0 tells the two kinds apart.
const OUTSIDE: u32 = 0u;
const OCCLUDED: u32 = 1u;
const VISIBLE: u32 = 2u;
const INVALID: u32 = 3u;

// Where the algorithm stopped, for `explain`.
const AT_VALIDITY: u32 = 0u;
const AT_FRUSTUM: u32 = 1u;
const AT_EYE_PLANE: u32 = 2u;
const AT_RECTANGLE: u32 = 3u;
const AT_DEPTH: u32 = 4u;
const AT_BLOCK: u32 = 5u;
const AT_DESCENT: u32 = 6u;

// Pixel centres alone count; otherwise whole pixel squares.
override SAMPLE_COVERAGE: bool;
// The footprint is at most 2^n x 2^n texels.
override FOOTPRINT_LOG2: u32;
// Descend to finer levels where the footprint cannot decide.
override DESCENT: bool;
// Compare each texel with the volume's own outline and front there, not with its rectangle at one nearest depth.
override FIT_VOLUME: bool;

const LEAST_NORMAL: f32 = 0x1p-126;

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(3) var<storage, read> chunk_0: array<u32>;
@group(0) @binding(4) var<storage, read> chunk_1: array<u32>;
@group(0) @binding(5) var<storage, read> chunk_2: array<u32>;
@group(0) @binding(6) var<uniform> view: View;

struct Outcome {
    verdict: u32,
    stage: u32,
    // Valid from AT_DEPTH on: pixel rectangle (inclusive), level, texel rectangle, the farthest depth in it.
    pixels: vec4<i32>,
    level: u32,
    texels: vec4<u32>,
    farthest_bits: u32,
    texels_read: u32,
}

fn texel_bits(index: u32) -> u32 {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}

// The depth of one texel of a level.
fn texel(level: u32, x: u32, y: u32) -> u32 {
    if level == 0u {
        return source_bits(x, y);
    }
    let l = pyramid.levels[level];
    return texel_bits(l.offset + y * l.stride + x);
}

// The depths of the texels at columns t.x and t.z and rows t.y and t.w of a level.
fn corners(level: u32, t: vec4<u32>) -> vec4<u32> {
    if level == 0u {
        return vec4<u32>(source_bits(t.x, t.y), source_bits(t.z, t.y), source_bits(t.x, t.w), source_bits(t.z, t.w));
    }
    let l = pyramid.levels[level];
    let top = l.offset + t.y * l.stride;
    let bottom = l.offset + t.w * l.stride;
    return vec4<u32>(
        texel_bits(top + t.x), texel_bits(top + t.z), texel_bits(bottom + t.x), texel_bits(bottom + t.z));
}

// The farthest depth of the texels from columns t.x to t.z and rows t.y to t.w of a level.
fn footprint(level: u32, t: vec4<u32>) -> u32 {
    if FOOTPRINT_LOG2 == 1u {
        return farthest4(corners(level, t));
    }
    var bits = select(0u, ONE_BITS, REVERSED);
    for (var y = t.y; y <= t.w; y += 1u) {
        for (var x = t.x; x <= t.z; x += 1u) {
            bits = farthest(bits, texel(level, x, y));
        }
    }
    return bits;
}

// The first and last pixel of [lo, hi] (relative to the image's middle), widened by `margin`; first > last: none.
fn pixel_interval(interval: vec2<f32>, margin: f32, half_size: f32, size: i32) -> vec2<i32> {
    let edge = f32(size + 1);
    let first = i32(floor(clamp(interval.x - margin + half_size, -2.0, edge)));
    let last = i32(floor(clamp(interval.y + margin + half_size, -2.0, edge)));
    return vec2<i32>(clamp(first, 0, size), clamp(last, -1, size - 1));
}

// How much wider than its estimate a projected interval may be, and a little more; and what adding half an image rounds away
// (without it a volume that ends exactly on a pixel border would be tested without the pixel beyond, and kept for that).
fn widening(r: Value, w: Value, interval: vec2<f32>, w_min: f32, half_size: f32) -> f32 {
    return 1.25 * error_bound(r, max(abs(interval.x), abs(interval.y)), w) / w_min + 4.0 * EPS * half_size + view.reach;
}

// Sample coverage: the volume lies between the centres of pixels first - 1 and first.
fn between_samples(r: Value, w: Value, first: i32, half_size: f32) -> bool {
    let left = f32(first) - half_size;
    return surely_above(r, left + view.reach, w) && surely_below(r, left - view.reach, w);
}

// The block of texels lo..hi of a level spans every pixel that the volume can touch, inside the image.
fn inside_block(r: Value, w: Value, lo: u32, hi: u32, level: u32, half_size: f32, size: i32) -> bool {
    let begin = i32(lo << level);
    let end = i32((hi + 1u) << level);
    return (lo == 0u || surely_above(r, f32(begin) + view.reach - half_size, w))
        && (end >= size || surely_below(r, f32(end) - view.reach - half_size, w));
}

// The depth that a stored one stands for: with the slack, away from subnormals.
fn occluding_depth(bits: u32) -> f32 {
    let stored = select(max(bitcast<f32>(bits), LEAST_NORMAL), min(bitcast<f32>(bits), 1.0), REVERSED);
    return bar(stored * view.depth_factor + view.depth_offset);
}

// The far plane hides nothing.
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

// Whether no pixel of the rectangle first..last shows anything of the volume: a walk down the pyramid, from the footprint t of
// the level `top`, that enters only the texels that cannot tell, and of them only what the rectangle touches. (Greene, Kass and
// Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993, descend so.) False where a pixel may show some of it, or the
// budget ends.
fn descend(
    top: u32, t: vec4<u32>, first: vec2<u32>, last: vec2<u32>, p: Projected, texels_read: ptr<function, u32>,
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
        if !clear {
            // Its pixels, those past the image's edge left out.
            let begin = at << vec2<u32>(level);
            let end = min((at + vec2<u32>(1u)) << vec2<u32>(level), vec2<u32>(view.size));
            if FIT_VOLUME {
                clear = surely_clear(&planes, max(begin, first), min(end, last + vec2<u32>(1u)), bits);
            } else if all(begin >= first) && all(end <= last + vec2<u32>(1u)) {
                // One of its pixels has that depth, and the rectangle has them all: no finer level can decide otherwise.
                return false;
            }
        }
        if !clear {
            if !DESCENT || level == 0u {
                return false;
            }
            level -= 1u;
            at = max(2u * at, first >> vec2<u32>(level));
            continue;
        }
        // On to the next sibling, or that of the first parent that has one.
        loop {
            let end = last >> vec2<u32>(level);
            if level == top {
                if at.x < t.z {
                    at.x += 1u;
                    break;
                }
                if at.y < t.w {
                    at = vec2<u32>(t.x, at.y + 1u);
                    break;
                }
                return true;
            }
            if at.x % 2u == 0u && at.x < end.x {
                at.x += 1u;
                break;
            }
            if at.y % 2u == 0u && at.y < end.y {
                at = vec2<u32>(max(at.x - at.x % 2u, first.x >> level), at.y + 1u);
                break;
            }
            at /= vec2<u32>(2u);
            level += 1u;
        }
    }
    return false;
}

fn classify(i: u32) -> Outcome {
    var out = Outcome(INVALID, AT_VALIDITY, vec4<i32>(0), 0u, vec4<u32>(0u), 0u, 0u);
    let volume = load_volume(i);
    if !volume.valid {
        return out;
    }
    let x = value_of(view.x, volume);
    let y = value_of(view.y, volume);
    let z = value_of(view.z, volume);
    let w = value_of(view.w, volume);
    let a = view.z_slope;

    // 1. Outside one of the six planes of the frustum.
    out.stage = AT_FRUSTUM;
    out.verdict = OUTSIDE;
    let border = view.half_size + view.reach;
    if surely_below(x, -border.x, w) || surely_above(x, border.x, w)
        || surely_below(y, -border.y, w) || surely_above(y, border.y, w)
        || surely_below(z, bar(-a), w) || surely_above(z, bar(1.0 - a), w) {
        return out;
    }

    // 2. Crossing w = 0: no rectangle. Not a certificate, it keeps step 3 sane.
    out.stage = AT_EYE_PLANE;
    out.verdict = VISIBLE;
    let w_min = w.center - support(w.half) - error_bound(w, 0.0, w);
    if !(w_min > 0.0) {
        return out;
    }

    // 3. The pixels that the projection may touch: an estimate.
    out.stage = AT_RECTANGLE;
    let interval_x = ratio_interval(x, w);
    let interval_y = ratio_interval(y, w);
    let columns = pixel_interval(interval_x, widening(x, w, interval_x, w_min, view.half_size.x), view.half_size.x, view.size.x);
    let rows = pixel_interval(interval_y, widening(y, w, interval_y, w_min, view.half_size.y), view.half_size.y, view.size.y);
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

    // 4. The finest level at which it spans no more texels than the footprint. Integer bits, no log2: that rounds.
    let first = vec2<u32>(vec2<i32>(columns.x, rows.x));
    let last = vec2<u32>(vec2<i32>(columns.y, rows.y));
    let extent = last - first;
    var level = max(firstLeadingBit(extent.x | extent.y | 1u), FOOTPRINT_LOG2 - 1u) - (FOOTPRINT_LOG2 - 1u);
    if any((last >> vec2<u32>(level)) - (first >> vec2<u32>(level)) >= vec2<u32>(1u << FOOTPRINT_LOG2)) {
        level += 1u;
    }
    let t = vec4<u32>(first >> vec2<u32>(level), last >> vec2<u32>(level));
    out.level = level;
    out.texels = t;

    // 5. All of it is farther than the farthest depth there, if this is the pyramid that was promised and not one whose
    // reduction has yet to run.
    out.stage = AT_DEPTH;
    if chunk_0[0] != view.reduction {
        return out;
    }
    out.farthest_bits = footprint(level, t);
    // A variable of its own: the Vulkan backend of naga 30 cannot pass a pointer to a member.
    var texels_read = (t.z - t.x + 1u) * (t.w - t.y + 1u);
    out.texels_read = texels_read;
    var hidden = surely_behind(out.farthest_bits, z, w);
    var block = t;
    if hidden {
        out.stage = AT_BLOCK;
    } else if (DESCENT && level > 0u) || FIT_VOLUME {
        // Texel by texel, and into finer levels, over the pixels of the rectangle alone: its texels of level 0.
        out.stage = AT_DESCENT;
        hidden = descend(level, t, first, last, Projected(x, y, z, w, w_min), &texels_read);
        out.texels_read = texels_read;
        block = vec4<u32>(first, last);
        level = 0u;
    }

    // 6. The texels were those of all pixels that matter.
    if hidden && inside_block(x, w, block.x, block.z, level, view.half_size.x, view.size.x)
        && inside_block(y, w, block.y, block.w, level, view.half_size.y, view.size.y) {
        out.verdict = OCCLUDED;
    }
    return out;
}
