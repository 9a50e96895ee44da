// Spheres.
// Twin: `crates/hiz_core/src/instances/volume_record.rs`, `SphereRecord`; here it is two texels.
//
// - texel 0: the centre's high half, and the radius
// - texel 1: the centre's low half, and the caller's index
const RECORD_TEXELS: u32 = 2u;

struct Volume {
    // About the reference point.
    center: vec3<f32>,
    // Bounds everything that a row is multiplied with, all axes added.
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
    return Volume(d_hi + d_lo, size_of(d_hi, 3.0 * radius), radius);
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return m * volume.radius;
}

// The support of a sphere is a 2-norm.
// It is compared squared, so that no square root needs trust.
// 1.000001 covers the roundings of both squares, and 2^-100 covers their underflow.
fn exceeds_support(center: f32, half: vec3<f32>) -> bool {
    return center > 0.0 && center * center > dot(half, half) * 1.000001 + 0x1p-100;
}

fn support(half: vec3<f32>) -> f32 {
    return sqrt(dot(half, half));
}

// An estimate of the least and greatest r / w.
// (Mara and McGuire, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D Sphere", JCGT
// 2013, written for any two linear functions.)
// With the centre's ratio t, the ratio at a point u of the unit sphere is t + g.u / (1 + n.u).
// Its extremes are the roots of q d^2 + 2 p d - g.g = 0, each in the form that does not cancel.
fn ratio_interval(r: Value, w: Value) -> vec2<f32> {
    let n = w.half / w.center;
    let q = max(1.0 - dot(n, n), 1e-30);
    let t = r.center / w.center;
    let g = (r.half - t * w.half) / w.center;
    let gg = dot(g, g);
    let p = dot(g, n);
    let m = max(abs(p) + sqrt(p * p + q * gg), 1e-30);
    let small_root = gg / m;
    let large_root = m / q;
    return vec2<f32>(
        t - select(small_root, large_root, p > 0.0),
        t + select(large_root, small_root, p > 0.0));
}

// Estimates of the least and greatest r / w.
// `below` and `above` say by how much they can be off, times w.
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
// Then two rings of 4 points about the point that is nearest to the eye.
const CANDIDATES: u32 = 24u;
const TURN: f32 = 6.2831853;
const RING_ANGLES: vec2<f32> = vec2<f32>(0.7, 1.2);

// How r / w changes with the point of the unit sphere, at `point`; times w.
fn gradient(r: Value, w: Value, point: vec3<f32>) -> vec3<f32> {
    return r.half - (r.center + dot(r.half, point)) / (w.center + dot(w.half, point)) * w.half;
}

fn candidate(i: u32, p: Projected) -> Candidate {
    if i < 16u {
        let angle = f32(i) * (TURN / 16.0);
        return Candidate(0.0, vec2<f32>(cos(angle), sin(angle)), 0.0);
    }
    // Along a pixel's ray neither column nor row changes.
    let center = vec3<f32>(0.0);
    let columns = gradient(p.x, p.w, center);
    let ray = normalize(cross(columns, gradient(p.y, p.w, center)));
    let facing = farther_sign();
    let toward_eye = -sign(facing * dot(gradient(p.z, p.w, center), ray)) * ray;
    let right = normalize(columns);
    let up = cross(toward_eye, right);
    let angle = select(RING_ANGLES.x, RING_ANGLES.y, i >= 20u);
    let turn = f32(i) * (TURN / 4.0);
    let outward = cos(turn) * right + sin(turn) * up;
    let point = cos(angle) * toward_eye + sin(angle) * outward;
    // Two directions along the surface there, and how they run in the image.
    let down = cos(angle) * outward - sin(angle) * toward_eye;
    let image = mat3x3<f32>(gradient(p.x, p.w, point), gradient(p.y, p.w, point), gradient(p.z, p.w, point));
    let normal = cross(down * image, cross(point, down) * image);
    return Candidate(facing, facing * normal.xy / normal.z, 0.0);
}

// A plane of any slope touches a sphere.
fn on_border(own: f32, border: f32, extent: f32) -> bool {
    return true;
}
