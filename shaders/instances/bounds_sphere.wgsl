// Spheres.
// Twin: `SphereRecord` in `crates/hiz_core/src/instances/volume_record.rs`.

// Texels of a record; .xyz: the centre's high half, its low half.
// The w of the first texel is the radius, that of the second the caller's index.
const RECORD_TEXELS: u32 = 2u;

// A sphere's half axes are three times its radius, summed over the axes.
const AXES: f32 = 3.0;
// The squares of a sphere's support are raised by 8 EPS.
// Both squares, the product and the sum lose at most 6 EPS.
const SQUARES_FACTOR: f32 = 1.000001;
// Components below 2^-63 may lose their squares, which are less than this in all.
const SQUARES_FLOOR: f32 = 0x1p-100;
// Keeps the divisors of an estimate above 0.
const LEAST_DIVISOR: f32 = 1e-30;

struct Volume {
    // Relative to the reference point.
    center: vec3<f32>,
    // Upper bound, summed over the axes, of everything that a row is multiplied with.
    size: f32,
    radius: f32,
}

fn caller_index(i: u32) -> u32 {
    return record_texel(i, 1u).w;
}

fn load_volume(i: u32) -> Volume {
    let texel_0 = record_texel(i, 0u);
    let hi = bitcast<vec3<f32>>(texel_0.xyz);
    let lo = bitcast<vec3<f32>>(record_texel(i, 1u).xyz);
    let radius = bitcast<f32>(texel_0.w);
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(lo - view.eye_lo);
    return Volume(d_hi + d_lo, size_of(d_hi, AXES * radius), radius);
}

// How far it reaches from its centre along each axis of the world.
fn reach_of(volume: Volume) -> vec3<f32> {
    return vec3<f32>(volume.radius);
}

// No point is farther from the centre than this.
fn radius_of(volume: Volume) -> f32 {
    return volume.radius;
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return m * volume.radius;
}

// The support of a sphere is a 2-norm.
// Squares are compared, so that no square root has to be trusted.
fn exceeds_support(center: f32, half: vec3<f32>) -> bool {
    return center > 0.0
        && center * center > dot(half, half) * SQUARES_FACTOR + SQUARES_FLOOR;
}

fn support(half: vec3<f32>) -> f32 {
    return sqrt(dot(half, half));
}

// An estimate of the least and greatest r / w, for any two linear functions.
// Source: Mara and McGuire, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere",
// JCGT 2013.
//
// Let t be the ratio at the centre.
// At a point u of the unit sphere the ratio is t + g.u / (1 + n.u).
// Its extremes are t plus the roots d of q d^2 + 2 p d - g.g = 0.
// Each root is taken in the form that does not cancel.
fn ratio_interval(r: Value, w: Value) -> vec2<f32> {
    let n = w.half / w.center;
    let q = max(1.0 - dot(n, n), LEAST_DIVISOR);
    let t = r.center / w.center;
    let g = (r.half - t * w.half) / w.center;
    let gg = dot(g, g);
    let p = dot(g, n);
    let m = max(abs(p) + sqrt(p * p + q * gg), LEAST_DIVISOR);
    let small_root = gg / m;
    let large_root = m / q;
    return vec2<f32>(
        t - select(small_root, large_root, p > 0.0),
        t + select(large_root, small_root, p > 0.0));
}

// The least and greatest r / w, and how far each can be off, times w.
struct Extent {
    low: f32,
    high: f32,
    below: f32,
    above: f32,
}

fn extent_of(r: Value, w: Value, w_min: f32) -> Extent {
    let interval = ratio_interval(r, w);
    return Extent(
        interval.x, interval.y, error_bound(r, interval.x, w), error_bound(r, interval.y, w));
}

// True implies: r / w > edge on all of the volume.
fn surely_after(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return surely_above(r, edge, w);
}

// True implies: r / w < edge on all of the volume.
fn surely_before(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return surely_below(r, edge, w);
}

// 16 directions of the outline, of which four are the rectangle's.
const OUTLINE: u32 = 16u;
// Then two rings of points on the front, around the point that is nearest to the eye.
const RING: u32 = 4u;
// The angles of the rings, seen from the centre, in radians.
const RING_ANGLES: vec2<f32> = vec2<f32>(0.7, 1.2);
const CANDIDATES: u32 = OUTLINE + 2u * RING;
// Candidates that bound the outline, which come first.
const OUTLINES: u32 = OUTLINE;
// A full turn, in radians.
const TURN: f32 = 6.2831853;

// The gradient of r / w at a point, times w.
fn gradient(r: Value, w: Value, point: vec3<f32>) -> vec3<f32> {
    return r.half - (r.center + dot(r.half, point)) / (w.center + dot(w.half, point)) * w.half;
}

fn candidate(i: u32, p: Projected) -> Candidate {
    if i < OUTLINE {
        let angle = f32(i) * (TURN / f32(OUTLINE));
        return Candidate(0.0, vec2<f32>(cos(angle), sin(angle)), 0.0);
    }
    // Neither column nor row changes along the ray of a pixel.
    let center = vec3<f32>(0.0);
    let columns = gradient(p.x, p.w, center);
    let ray = normalize(cross(columns, gradient(p.y, p.w, center)));
    let facing = farther_sign();
    let toward_eye = -sign(facing * dot(gradient(p.z, p.w, center), ray)) * ray;
    let right = normalize(columns);
    let up = cross(toward_eye, right);
    let angle = select(RING_ANGLES.x, RING_ANGLES.y, i >= OUTLINE + RING);
    let turn = f32(i) * (TURN / f32(RING));
    let outward = cos(turn) * right + sin(turn) * up;
    let point = cos(angle) * toward_eye + sin(angle) * outward;
    // Two directions along the surface at that point, and how they run in the image.
    let down = cos(angle) * outward - sin(angle) * toward_eye;
    let image = mat3x3<f32>(
        gradient(p.x, p.w, point), gradient(p.y, p.w, point), gradient(p.z, p.w, point));
    let normal = cross(down * image, cross(point, down) * image);
    return Candidate(facing, facing * normal.xy / normal.z, 0.0);
}

// A plane of any slope touches a sphere.
fn on_border(own: f32, border: f32, extent: f32) -> bool {
    return true;
}
