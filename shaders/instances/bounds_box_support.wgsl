// What axis-aligned and oriented boxes share.
// The support of a box is a 1-norm over its half axes, so no certificate needs the eight corners.

struct Volume {
    // About the reference point.
    center: vec3<f32>,
    // Bounds everything that a row is multiplied with, all axes added.
    size: f32,
    half_axis_0: vec3<f32>,
    half_axis_1: vec3<f32>,
    half_axis_2: vec3<f32>,
}

fn support(half: vec3<f32>) -> f32 {
    return abs(half.x) + abs(half.y) + abs(half.z);
}

fn exceeds_support(center: f32, half: vec3<f32>) -> bool {
    return center > support(half);
}

// The least and greatest r / w, and what is proved of them.
struct Extent {
    low: f32,
    high: f32,
    // On all of the volume r - low w > -below, and r - high w < above; both are above 0.
    below: f32,
    above: f32,
}

// An estimate of the ends, and a proved bound of what lies beyond them.
//
// Let `ratio` be that of the centre.
// The corner where `r - ratio w` is greatest is a guess for the greatest r / w, and the opposite
// corner for the least.
// This is one step of Dinkelbach, "On Nonlinear Fractional Programming", 1967.
// Where another corner would be right, `above` and `below` say how far the volume reaches beyond.
fn extent_of(r: Value, w: Value, w_min: f32) -> Extent {
    let ratio = r.center / w.center;
    let toward = select(vec3<f32>(-1.0), vec3<f32>(1.0), r.half - ratio * w.half >= vec3<f32>(0.0));
    let r_half = dot(toward, r.half);
    let w_half = dot(toward, w.half);
    // The barriers make these numbers, not their quotients, what the next lines bound.
    let low = bar((r.center - r_half) / (w.center - w_half));
    let high = bar((r.center + r_half) / (w.center + w_half));
    return Extent(
        low, high,
        max(support(r.half - low * w.half) - (r.center - low * w.center) + error_bound(r, low, w), 0.0),
        max(support(r.half - high * w.half) + (r.center - high * w.center) + error_bound(r, high, w), 0.0));
}

// True implies: r / w > edge on all of the volume, where w >= w_min > 0.
// The reason is r - edge w = (r - low w) + (low - edge) w.
// The edge is an exact sum of larger numbers.
// Without the barrier a compiler could subtract these from `low` one by one, and leave roundings of
// their size behind.
fn surely_after(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return (extent.low - bar(edge)) * w_min > extent.below;
}

// True implies: r / w < edge on all of the volume, where w >= w_min > 0.
fn surely_before(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return (bar(edge) - extent.high) * w_min > extent.above;
}

// An estimate of the least and greatest r / w: those of the eight corners.
fn ratio_interval(r: Value, w: Value) -> vec2<f32> {
    let sign_y = vec4<f32>(1.0, 1.0, -1.0, -1.0);
    let sign_z = vec4<f32>(1.0, -1.0, 1.0, -1.0);
    let r_face = r.center + sign_y * r.half.y + sign_z * r.half.z;
    let w_face = w.center + sign_y * w.half.y + sign_z * w.half.z;
    let a = (r_face + r.half.x) / (w_face + w.half.x);
    let b = (r_face - r.half.x) / (w_face - w.half.x);
    let least = min(a, b);
    let greatest = max(a, b);
    return vec2<f32>(
        min(min(least.x, least.y), min(least.z, least.w)),
        max(max(greatest.x, greatest.y), max(greatest.z, greatest.w)));
}

// The six faces and twelve edges: a plane through each.
const CANDIDATES: u32 = 18u;
// How near to the border of the box still counts as on it, relative to the box's extent along the
// plane's normal.
const BORDER_TOLERANCE: f32 = 1e-3;

// Pixel position and depth of a corner, given by signs.
fn corner(p: Projected, signs: vec3<f32>) -> vec3<f32> {
    let r = vec3<f32>(
        p.x.center + dot(p.x.half, signs), p.y.center + dot(p.y.half, signs), p.z.center + dot(p.z.half, signs));
    return r / (p.w.center + dot(p.w.half, signs));
}

fn candidate(i: u32, p: Projected) -> Candidate {
    let signs = vec2<f32>(select(-1.0, 1.0, (i & 1u) != 0u), select(-1.0, 1.0, (i & 2u) != 0u));
    if i < 12u {
        // An edge along e, beside the other two axes.
        let e = vec3<f32>(vec3<u32>(i >> 2u) == vec3<u32>(0u, 1u, 2u));
        let beside = signs.x * e.zxy + signs.y * e.yzx;
        let begin = corner(p, beside - e).xy;
        let along = corner(p, beside + e).xy - begin;
        let across = vec2<f32>(along.y, -along.x) / max(abs(along.x), abs(along.y));
        return Candidate(0.0, across, dot(across, begin));
    }
    // The face at one end of e.
    let e = vec3<f32>(vec3<u32>((i - 12u) >> 1u) == vec3<u32>(0u, 1u, 2u));
    let end = signs.x * e;
    let begin = corner(p, end - e.zxy - e.yzx);
    let normal = cross(
        corner(p, end + e.zxy + e.yzx) - begin, corner(p, end - e.zxy + e.yzx) - corner(p, end + e.zxy - e.yzx));
    let facing = farther_sign();
    let slope = facing * normal.xy / normal.z;
    return Candidate(facing, slope, facing * begin.z + dot(slope, begin.xy));
}

// A face shows, and an edge belongs to the outline, if the box lies on one side of its plane.
fn on_border(own: f32, border: f32, extent: f32) -> bool {
    return abs(own - border) <= BORDER_TOLERANCE * extent;
}
