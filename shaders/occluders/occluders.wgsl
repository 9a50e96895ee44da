// The occluder pass, which draws depth only.
// A vertex is two float32 halves of its position in the space of its mesh.
// The eye is subtracted half by half before anything is rounded.
// So a wall a million metres from the origin does not tremble.

struct Vertex {
    @location(0) hi: vec3<f32>,
    @location(1) lo: vec3<f32>,
}

// One copy of a mesh: the rows of clip space about the eye, in the mesh's space, with w near 1.
// Twin: `CopyRecord` in `crates/hiz_core/src/occluders/device_meshes.rs`.
struct Copy {
    @location(2) clip_x: vec4<f32>,
    @location(3) clip_y: vec4<f32>,
    @location(4) clip_z: vec4<f32>,
    @location(5) clip_w: vec4<f32>,
    // The eye is exactly eye_hi + eye_lo.
    @location(6) eye_hi: vec3<f32>,
    @location(7) eye_lo: vec3<f32>,
}

@vertex
fn occluder_vertex(vertex: Vertex, copy: Copy) -> @invariant @builtin(position) vec4<f32> {
    let d = vec4<f32>((vertex.hi - copy.eye_hi) + (vertex.lo - copy.eye_lo), 1.0);
    return vec4<f32>(
        dot(copy.clip_x, d), dot(copy.clip_y, d), dot(copy.clip_z, d), dot(copy.clip_w, d));
}
