// Certificates: proofs in float32 that the whole volume lies strictly on one side of a plane.
// Their margin covers every rounding of this file and of the bounds; docs/accuracy.md counts them.
// Nothing else may cull an instance.
//
// A plane is `r - t w = 0`, where r is one of the view's rows, w is its row w, and t is a number.

// float32's spacing at 1.
// WGSL may round a sum or product up or down, so each loses up to this much, relative to itself.
const EPS: f32 = 0x1p-23;
// The margin in eps: more than any computation below can lose.
const ERROR_ULPS: f32 = 24.0;
// Covers what flushed subnormals lose.
const ERROR_FLOOR: f32 = 0x1p-70;

// A row on a volume: its value at the centre, the most by which that can be off, and its change
// along each half axis (for a sphere: each world axis, times the radius).
struct Value {
    center: f32,
    error: f32,
    half: vec3<f32>,
}

fn value_of(row: vec4<f32>, error: f32, volume: Volume) -> Value {
    return Value(dot(row.xyz, volume.center) + row.w, error, on_half_axes(row.xyz, volume));
}

// The margins of the four rows on a volume.
fn errors_of(volume: Volume) -> vec4<f32> {
    return ERROR_ULPS * EPS * (volume.size * view.magnitudes + view.constant_magnitudes) + vec4<f32>(ERROR_FLOOR);
}

// The most that `r - t w` can be off by.
fn error_bound(r: Value, t: f32, w: Value) -> f32 {
    return r.error + abs(t) * w.error;
}

// True implies: r - t w > 0 on all of the volume.
fn surely_above(r: Value, t: f32, w: Value) -> bool {
    return exceeds_support((r.center - t * w.center) - error_bound(r, t, w), r.half - t * w.half);
}

// True implies: r - t w < 0 on all of the volume.
fn surely_below(r: Value, t: f32, w: Value) -> bool {
    return exceeds_support(-(r.center - t * w.center) - error_bound(r, t, w), r.half - t * w.half);
}

// True implies: r - t w > 0 on all of the volume, or -r - t w > 0 on all of it.
// Only the side on which the centre lies is tested.
// The other side could only succeed for what lies behind the eye, and the near plane finds that.
fn surely_beyond(r: Value, t: f32, w: Value) -> bool {
    let side = select(1.0, -1.0, r.center < 0.0);
    return surely_above(Value(side * r.center, r.error, side * r.half), t, w);
}
