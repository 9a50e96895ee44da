// The faces of one body's bounds, for an occlusion query.

// Twin: `scene_on_device.rs`, `View`.
struct View {
    clip_from_eye: mat4x4<f32>,
    eye: vec3<f32>,
    tinted: f32,
    fog: vec3<f32>,
    fog_density: f32,
}

@group(0) @binding(0) var<uniform> view: View;
// Least and greatest corner of each body, in turns.
@group(0) @binding(1) var<storage, read> corners: array<vec4<f32>>;

// Two triangles of a square, as bits of its two axes.
const SQUARE = array<u32, 6>(0u, 1u, 3u, 0u, 3u, 2u);

@vertex
fn face_vertex(
    @builtin(vertex_index) v: u32,
    @builtin(instance_index) number: u32,
) -> @builtin(position) vec4<f32> {
    var square = SQUARE;
    let axis = v / 12u;
    let uv = square[v % 6u];
    var sides: vec3<u32>;
    sides[axis] = (v / 6u) % 2u;
    sides[(axis + 1u) % 3u] = uv & 1u;
    sides[(axis + 2u) % 3u] = uv >> 1u;
    let p = select(corners[2u * number].xyz, corners[2u * number + 1u].xyz, sides == vec3<u32>(1u));
    return view.clip_from_eye * vec4<f32>(p - view.eye, 1.0);
}
