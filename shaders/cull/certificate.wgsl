// Certificates: proofs in float32 that a whole volume lies strictly on one side of a plane.
// The margin covers every rounding of this file and of the bounds; docs/accuracy.md counts them,
// under "Counting the roundings".
// Nothing else may hide an instance.

// The spacing of float32 at 1.
// WGSL rounds a sum or product up or down, so each may lose this much, relative to its size.
const EPS: f32 = 0x1p-23;
// The margin in EPS, more than any path below can lose: at most 20.5 are used.
// Twin: `ERROR_ULPS` in `crates/hiz_core/src/input/view.rs`.
const ERROR_ULPS: f32 = 24.0;
// Covers what flushed subnormals lose: 2^-126 times coefficients below 2^34, with room.
const ERROR_FLOOR: f32 = 0x1p-70;

// A row, which is a linear function of the position, on a volume.
struct Value {
    // The value at the volume's centre.
    center: f32,
    // The most that it can be off by, with the roundings of a certificate.
    error: f32,
    // The change along each half axis; for a sphere, the linear coefficients times the radius.
    half: vec3<f32>,
}

fn value_of(row: vec4<f32>, error: f32, volume: Volume) -> Value {
    return Value(dot(row.xyz, volume.center) + row.w, error, on_half_axes(row.xyz, volume));
}

// The margins of the four rows on a volume.
fn errors_of(volume: Volume) -> vec4<f32> {
    return ERROR_ULPS * EPS * (volume.size * view.magnitudes + view.constant_magnitudes)
        + vec4<f32>(ERROR_FLOOR);
}

// The most that a certificate loses of `r - t w`.
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

// True implies: r - t w > 0 on all of the volume, or -r - t w > 0 is.
// It tries the side of the centre alone.
// The other side could only succeed for volumes behind the eye, which the near plane finds.
fn surely_beyond(r: Value, t: f32, w: Value) -> bool {
    let side = select(1.0, -1.0, r.center < 0.0);
    return surely_above(Value(side * r.center, r.error, side * r.half), t, w);
}

// True implies: all of the volume is outside of one of the six planes of the frustum.
fn surely_outside(x: Value, y: Value, z: Value, w: Value) -> bool {
    let border = view.half_size + view.reach;
    let a = view.z_slope;
    return surely_beyond(x, border.x, w) | surely_beyond(y, border.y, w)
        | surely_below(z, bar(-a), w) | surely_above(z, bar(1.0 - a), w);
}
