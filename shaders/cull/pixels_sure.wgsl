// What four texels of a row surely say about a volume, for counts of pixels.
//
// `pixels_planes.wgsl` has the planes that bound the volume.

fn bar4(x: vec4<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(bitcast<vec4<u32>>(x) ^ vec4<u32>(view.runtime_zero));
}

// Which bits are depths; others say nothing about their pixels.
fn are_depths(bits: vec4<u32>) -> vec4<bool> {
    return bits <= vec4<u32>(ONE_BITS) | bits == vec4<u32>(NEGATIVE_ZERO_BITS);
}

// `sanitized` of each.
fn all_sanitized(bits: vec4<u32>) -> vec4<u32> {
    let is_zero =
        bits < vec4<u32>(LEAST_NORMAL_BITS) | bits == vec4<u32>(NEGATIVE_ZERO_BITS);
    let flushed = select(bits, vec4<u32>(0u), is_zero);
    return select(vec4<u32>(far_bits()), flushed, are_depths(bits));
}

// How far stored depths are at most, and at least, as `surely_clear` compares them.
// They are measured from z_slope, and raised by the margin of the comparison.
fn hiding_bounds(bits: vec4<u32>) -> vec4<f32> {
    // Depths are at least 0, so their bits are ordered as they are.
    let stored = bitcast<vec4<f32>>(select(
        max(bits, vec4<u32>(LEAST_NORMAL_BITS)), min(bits, vec4<u32>(ONE_BITS)), REVERSED));
    let moved = bar4(stored * view.depth_factor + view.depth_offset);
    return with_margin(farther_sign() * bar4(moved - view.z_slope));
}

fn opening_bounds(bits: vec4<u32>) -> vec4<f32> {
    let stored = bitcast<vec4<f32>>(
        select(bits, max(bits, vec4<u32>(LEAST_NORMAL_BITS)), REVERSED));
    let moved = bar4(stored * view.near_factor + view.near_offset);
    return with_margin(-farther_sign() * bar4(moved - view.z_slope));
}

// The floor is added first: the product of a bound near 0 would be subnormal, which is slow.
fn with_margin(bound: vec4<f32>) -> vec4<f32> {
    return bound + TEXEL_ULPS * EPS * (abs(bound) + TEXEL_FLOOR / (TEXEL_ULPS * EPS));
}

// What is sure about four texels of a row.
struct Sure {
    untouched: vec4<bool>,
    // All of the volume is behind the texel's depth, in each of its pixels.
    hidden: vec4<bool>,
    // All of the volume is in front of the depth, in each of its pixels.
    open: vec4<bool>,
}

// Four texels of a row: where their pixels begin and end, cut at the volume's rectangle.
struct Place {
    left: vec4<f32>,
    right: vec4<f32>,
    top: f32,
    bottom: f32,
}

// The place of the pixels from `begin` to before `end`.
fn place_of(
    planes: ptr<function, PixelPlanes>, begin: vec4<u32>, end: vec4<u32>, rows: vec2<u32>,
) -> Place {
    // Exact: multiples of 2^-8 below 2^16, and then one of two numbers.
    let low = vec4<f32>(begin) - view.reach - view.half_size.x;
    let high = vec4<f32>(end) + view.reach - view.half_size.x;
    let low_y = f32(rows.x) - view.reach - view.half_size.y;
    let high_y = f32(rows.y) + view.reach - view.half_size.y;
    let left_top = (*planes).left_top;
    let right_bottom = (*planes).right_bottom;
    // Pixels beyond have nothing of the volume, whatever is said about them.
    // `max` and `min` take care of NaN, which costs lavapipe two instructions more.
    let left = vec4<f32>(left_top.x);
    let right = vec4<f32>(right_bottom.x);
    return Place(
        select(low, left, low < left), select(high, right, right < high),
        select(low_y, left_top.y, low_y < left_top.y),
        select(high_y, right_bottom.y, right_bottom.y < high_y));
}

// The greatest slope . (x, y) - offset over each texel.
fn most_over(offset: f32, slope: vec2<f32>, at: Place) -> vec4<f32> {
    let row = slope.y * select(at.top, at.bottom, slope.y > 0.0) - offset;
    return vec4<f32>(row) + slope.x * select(at.left, at.right, slope.x > 0.0);
}

// Comparisons are collected as the signs of differences, each of which is exact.
// Mesa joins comparisons with one number to a `max`, which is three instructions on lavapipe.
fn signs_of(difference: vec4<f32>) -> vec4<u32> {
    return bitcast<vec4<u32>>(difference);
}

// Whether some of the differences was less than 0.
fn has_sign(signs: vec4<u32>) -> vec4<bool> {
    return signs > vec4<u32>(MAGNITUDE_MASK);
}

// Which texels have a pixel, and which have only pixels, that a plane of the outline excludes.
struct Outline {
    some: vec4<bool>,
    all: vec4<bool>,
}

// No texel is wider or higher than `side`.
fn outline_of(planes: ptr<function, PixelPlanes>, at: Place, side: f32) -> Outline {
    var some = vec4<u32>(0u);
    var all = vec4<u32>(0u);
    for (var i = 0u; i < OUTLINE_PLANES; i += 1u) {
        let slope = (*planes).outline_slopes[i];
        let most = most_over((*planes).outlines[i], slope, at);
        some |= signs_of(most - vec4<f32>(dot(abs(slope), vec2<f32>(side))));
        all |= signs_of(most);
    }
    return Outline(has_sign(some), has_sign(all));
}

// What the depths of four texels say; `outside`: a plane of the outline excludes all their pixels.
fn sure_of(
    planes: ptr<function, PixelPlanes>, at: Place, outside: vec4<bool>, raw: vec4<u32>,
    near: vec4<u32>,
) -> Sure {
    let surface = hiding_bounds(all_sanitized(raw));
    let near_surface = opening_bounds(all_sanitized(near));
    // Whether the volume is farther at least, or nearer at most.
    var farther = signs_of(surface - vec4<f32>((*planes).front));
    var nearer = signs_of(near_surface - vec4<f32>((*planes).back));
    for (var i = 0u; i < FACE_PLANES; i += 1u) {
        let plane = (*planes).faces[i];
        let back = select(plane.xy, -plane.xy, TWO_SIDED);
        farther |= signs_of(surface + most_over(plane.z, plane.xy, at));
        nearer |= signs_of(near_surface + most_over(plane.w, back, at));
    }
    let hidden = has_sign(farther);
    // Background hides nothing, however far the volume is.
    let is_background = near == vec4<u32>(far_bits());
    let open = are_depths(near) & (is_background | has_sign(nearer));
    // Nothing of the volume is there if it would have to be behind the surface and in front of it.
    return Sure(outside | (hidden & open), hidden, open);
}
