// Draws bodies by a list of their numbers: the packed list of a cull, or 0, 1, 2, ...
//
// Positions are relative to the eye, as in hiz_core's occluder pass.
// Each position is two float32 halves, and the eye is subtracted half by half.

struct View {
    // Clip-space rows about the eye.
    clip_from_eye: array<vec4<f32>, 4>,
    eye_hi: vec3<f32>,
    vertices_per_body: u32,
    eye_lo: vec3<f32>,
    padding: u32,
}

// Every vertex is stored, and none is computed from a body's size.
// So this pass has exactly the vertices of the prepass.
struct Vertex {
    hi: vec3<f32>,
    // RGBA, 8 bits each.
    colour: u32,
    lo: vec3<f32>,
    // The body's number.
    body: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) body: u32,
    @location(1) @interpolate(flat) colour: u32,
}

// The walls are drawn as body 0, with indices that begin behind the vertices of all bodies.
@vertex
fn body_vertex(@builtin(vertex_index) v: u32, @location(0) body: u32) -> Corner {
    let vertex = vertices[body * view.vertices_per_body + v];
    let d = vec4<f32>((vertex.hi - view.eye_hi) + (vertex.lo - view.eye_lo), 1.0);
    let m = view.clip_from_eye;
    let position = vec4<f32>(dot(m[0], d), dot(m[1], d), dot(m[2], d), dot(m[3], d));
    return Corner(position, vertex.body, vertex.colour);
}

struct Pixel {
    @location(0) colour: vec4<f32>,
    // The body's number + 1, or 0 for the sky.
    @location(1) id: u32,
}

@fragment
fn body_fragment(in: Corner) -> Pixel {
    return Pixel(unpack4x8unorm(in.colour), in.body + 1u);
}
