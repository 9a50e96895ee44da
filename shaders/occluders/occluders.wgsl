// Draws occluders, depth only.
// A vertex is two float32 halves of its world position.
// The eye is subtracted half by half before anything is rounded.
// So a wall a million metres from the origin does not tremble.

struct OccluderView {
    // Clip-space rows about the reference point, w near 1.
    clip_from_eye: array<vec4<f32>, 4>,
    // The reference point is exactly eye_hi + eye_lo.
    eye_hi: vec4<f32>,
    eye_lo: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: OccluderView;

@vertex
fn occluder_vertex(@location(0) hi: vec3<f32>, @location(1) lo: vec3<f32>) -> @invariant @builtin(position) vec4<f32> {
    let d = vec4<f32>((hi - view.eye_hi.xyz) + (lo - view.eye_lo.xyz), 1.0);
    return vec4<f32>(
        dot(view.clip_from_eye[0], d), dot(view.clip_from_eye[1], d),
        dot(view.clip_from_eye[2], d), dot(view.clip_from_eye[3], d));
}
