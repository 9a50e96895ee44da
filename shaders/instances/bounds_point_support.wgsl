// What points of both widths have in common: no size, so no support.
// A certificate about a point is the sign of one number.

struct Volume {
    // Relative to the reference point.
    center: vec3<f32>,
    // Upper bound, summed over the axes, of everything that a row is multiplied with.
    size: f32,
}

// How far it reaches from its centre along each axis of the world.
fn reach_of(volume: Volume) -> vec3<f32> {
    return vec3<f32>(0.0);
}

// No point is farther from the centre than this.
fn radius_of(volume: Volume) -> f32 {
    return 0.0;
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn exceeds_support(center: f32, half: vec3<f32>) -> bool {
    return center > 0.0;
}

fn support(half: vec3<f32>) -> f32 {
    return 0.0;
}

// Both ends are the ratio at the point, which no certificate trusts.
fn ratio_interval(r: Value, w: Value) -> vec2<f32> {
    return vec2<f32>(r.center / w.center);
}

// The least and greatest r / w, and how far each can be off, times w.
struct Extent {
    low: f32,
    high: f32,
    below: f32,
    above: f32,
}

fn extent_of(r: Value, w: Value, w_min: f32) -> Extent {
    let ratio = r.center / w.center;
    let error = error_bound(r, ratio, w);
    return Extent(ratio, ratio, error, error);
}

// True implies: r / w > edge at the point.
fn surely_after(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return surely_above(r, edge, w);
}

// True implies: r / w < edge at the point.
fn surely_before(r: Value, w: Value, extent: Extent, edge: f32, w_min: f32) -> bool {
    return surely_below(r, edge, w);
}

// A point's rectangle is all there is of it, so `fit="volume"` adds nothing and is left out.
// These are here because the module names them: one plane, at the point's own depth.
const CANDIDATES: u32 = 1u;
// Candidates that bound the outline: the rectangle does.
const OUTLINES: u32 = 0u;

fn candidate(i: u32, p: Projected) -> Candidate {
    return Candidate(farther_sign(), vec2<f32>(0.0), 0.0);
}

fn on_border(own: f32, border: f32, extent: f32) -> bool {
    return true;
}
