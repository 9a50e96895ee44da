// The edges of the bodies' bounds: white if the body is drawn, red if it is culled.

// Twin: `overlay.rs`, `BoxView`.
struct BoxView {
    clip_from_eye: mat4x4<f32>,
    eye: vec3<f32>,
    padding: f32,
}

@group(0) @binding(0) var<uniform> view: BoxView;
// Least and greatest corner of each body, in turns.
@group(0) @binding(1) var<storage, read> corners: array<vec4<f32>>;
// One bit per body.
@group(0) @binding(2) var<storage, read> drawn: array<u32>;
@group(0) @binding(3) var<storage, read> drawn_too: array<u32>;

struct Edge {
    @builtin(position) position: vec4<f32>,
    @location(0) colour: vec4<f32>,
}

// Three edges leave each of four corners that share no edge; bit k is the side along axis k.
const ENDS = array<u32, 24>(
    0u, 1u, 0u, 2u, 0u, 4u,
    3u, 1u, 3u, 2u, 3u, 7u,
    5u, 1u, 5u, 4u, 5u, 7u,
    6u, 2u, 6u, 4u, 6u, 7u,
);

@vertex
fn box_vertex(@builtin(vertex_index) v: u32, @builtin(instance_index) number: u32) -> Edge {
    var ends = ENDS;
    let sides = (vec3<u32>(ends[v]) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
    let p = select(corners[2u * number].xyz, corners[2u * number + 1u].xyz, sides == vec3<u32>(1u));
    let word = drawn[number / 32u] | drawn_too[number / 32u];
    let is_drawn = ((word >> (number % 32u)) & 1u) == 1u;
    var edge: Edge;
    edge.position = view.clip_from_eye * vec4<f32>(p - view.eye, 1.0);
    edge.colour = select(vec4<f32>(1.0, 0.1, 0.08, 0.75), vec4<f32>(1.0, 1.0, 1.0, 0.8), is_drawn);
    return edge;
}

@fragment
fn box_fragment(edge: Edge) -> @location(0) vec4<f32> {
    return edge.colour;
}
