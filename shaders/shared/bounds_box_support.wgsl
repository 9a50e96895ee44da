// What axis-aligned and oriented boxes share: the support is a 1-norm over the half axes, no eight corners needed.

struct Volume {
    // About the reference point.
    center: vec3<f32>,
    // Bounds the size of everything that a row is multiplied with.
    reach: vec3<f32>,
    half_axis_0: vec3<f32>,
    half_axis_1: vec3<f32>,
    half_axis_2: vec3<f32>,
    valid: bool,
}

fn support(half: vec3<f32>) -> f32 {
    return abs(half.x) + abs(half.y) + abs(half.z);
}

fn exceeds_support(center: f32, half: vec3<f32>) -> bool {
    return center > support(half);
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
