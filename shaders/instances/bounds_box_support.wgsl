// What axis-aligned and oriented boxes share.
// The support of a box is a 1-norm over its half axes, so the eight corners are not needed.

struct Volume {
    // Relative to the reference point.
    center: vec3<f32>,
    // Upper bound, summed over the axes, of everything that a row is multiplied with.
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

// How far it reaches from its centre along each axis of the world.
fn reach_of(volume: Volume) -> vec3<f32> {
    return abs(volume.half_axis_0) + abs(volume.half_axis_1) + abs(volume.half_axis_2);
}

// The square of a radius is raised by 32 EPS, and a sum of half axes as well.
// At most 16 are lost of either.
const RADIUS_FACTOR: f32 = 1.0 + 32.0 * EPS;
// Components below 2^-63 may lose their squares, which are less than this in all.
const RADIUS_FLOOR: f32 = 0x1p-100;
// Makes a root large enough that its square passes the check.
const ROOT_FACTOR: f32 = 1.0 + 8.0 * EPS;

// No point is farther from the centre than this: half of the longest of the four diagonals.
//
// The root is a guess that its square checks.
// If it fails, all half axes added will do.
fn radius_of(volume: Volume) -> f32 {
    let sum = volume.half_axis_0 + volume.half_axis_1;
    let difference = volume.half_axis_0 - volume.half_axis_1;
    let a = sum + volume.half_axis_2;
    let b = sum - volume.half_axis_2;
    let c = difference + volume.half_axis_2;
    let d = difference - volume.half_axis_2;
    let longest = max(max(dot(a, a), dot(b, b)), max(dot(c, c), dot(d, d)));
    let square = longest * RADIUS_FACTOR + RADIUS_FLOOR;
    let root = sqrt(square) * ROOT_FACTOR;
    let added = sum_abs(volume.half_axis_0) + sum_abs(volume.half_axis_1)
        + sum_abs(volume.half_axis_2);
    return select(added * RADIUS_FACTOR, root, root * root >= square);
}

// The least and greatest r / w, and what is proved about them.
struct Extent {
    low: f32,
    high: f32,
    // On all of the volume: r - low w > -below, and r - high w < above.
    // Neither is negative.
    below: f32,
    above: f32,
}

// Take the ratio r / w at the centre.
// The corner that lies farthest along r - ratio w is taken for the one with the greatest r / w, and
// the opposite corner for the least.
// This is a step of Dinkelbach, "On Nonlinear Fractional Programming", 1967.
// Where another corner has the extreme ratio, `above` and `below` tell by how much the volume
// reaches beyond.
// docs/accuracy.md derives the claim, under "A box's extent".
fn extent_of(r: Value, w: Value, w_min: f32) -> Extent {
    let ratio = r.center / w.center;
    let toward = select(vec3<f32>(-1.0), vec3<f32>(1.0), r.half - ratio * w.half >= vec3<f32>(0.0));
    let r_half = dot(toward, r.half);
    let w_half = dot(toward, w.half);
    // Barred, so that what is proved is proved for these numbers, not for the quotients.
    let low = bar((r.center - r_half) / (w.center - w_half));
    let high = bar((r.center + r_half) / (w.center + w_half));
    return Extent(
        low, high,
        max(support(r.half - low * w.half) - (r.center - low * w.center)
            + error_bound(r, low, w), 0.0),
        max(support(r.half - high * w.half) + (r.center - high * w.center)
            + error_bound(r, high, w), 0.0));
}

// True implies: r / w > edge on all of the volume, where w >= w_min > 0.
// This follows from r - edge w = (r - low w) + (low - edge) w.
//
// The edge is barred, because it is an exact sum of larger numbers.
// If a compiler took these from `low` one by one, roundings of their size would be left behind.
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

// A plane goes through each of the twelve edges, and then through each of the six faces.
const EDGES: u32 = 12u;
const FACES: u32 = 6u;
const CANDIDATES: u32 = EDGES + FACES;
// Edges along an axis, as a power of two: the axis of edge i is i >> EDGES_OF_AXIS_LOG2.
const EDGES_OF_AXIS_LOG2: u32 = 2u;
// How near its border a plane counts as touching the box, relative to the box's extent along the
// plane's normal.
const BORDER_TOLERANCE: f32 = 1e-3;

// Pixel position and depth of a corner, which is given by signs.
fn corner(p: Projected, signs: vec3<f32>) -> vec3<f32> {
    let r = vec3<f32>(
        p.x.center + dot(p.x.half, signs),
        p.y.center + dot(p.y.half, signs),
        p.z.center + dot(p.z.half, signs));
    return r / (p.w.center + dot(p.w.half, signs));
}

fn candidate(i: u32, p: Projected) -> Candidate {
    let signs = vec2<f32>(select(-1.0, 1.0, (i & 1u) != 0u), select(-1.0, 1.0, (i & 2u) != 0u));
    if i < EDGES {
        // An edge along the axis e; the signs choose it by its place on the other two axes.
        let e = vec3<f32>(vec3<u32>(i >> EDGES_OF_AXIS_LOG2) == vec3<u32>(0u, 1u, 2u));
        let beside = signs.x * e.zxy + signs.y * e.yzx;
        let begin = corner(p, beside - e).xy;
        let along = corner(p, beside + e).xy - begin;
        let across = vec2<f32>(along.y, -along.x) / max(abs(along.x), abs(along.y));
        return Candidate(0.0, across, dot(across, begin));
    }
    // The face at one end of the axis e.
    let e = vec3<f32>(vec3<u32>((i - EDGES) >> 1u) == vec3<u32>(0u, 1u, 2u));
    let end = signs.x * e;
    let begin = corner(p, end - e.zxy - e.yzx);
    let normal = cross(
        corner(p, end + e.zxy + e.yzx) - begin,
        corner(p, end - e.zxy + e.yzx) - corner(p, end + e.zxy - e.yzx));
    let facing = farther_sign();
    let slope = facing * normal.xy / normal.z;
    return Candidate(facing, slope, facing * begin.z + dot(slope, begin.xy));
}

// A face shows, or an edge belongs to the outline, if the box lies on one side of its plane.
fn on_border(own: f32, border: f32, extent: f32) -> bool {
    return abs(own - border) <= BORDER_TOLERANCE * extent;
}
