// Draws bodies by the list of their numbers, which is an instance buffer.
//
// `shaded` is the picture, `darkened` shows fragments that were drawn in vain, and `counted` adds
// 1 for each fragment.

// Twin: `scene_on_device.rs`, `View`.
struct View {
    clip_from_eye: mat4x4<f32>,
    eye: vec3<f32>,
    // 1 if LODs are tinted.
    tinted: f32,
    fog: vec3<f32>,
    // One over the distance at which fog hides most.
    fog_density: f32,
}

// Twin: `scene_on_device.rs`, `BodyRecord`.
struct Body {
    position: vec3<f32>,
    scale: f32,
    sine: f32,
    cosine: f32,
    // Red, green, blue in halves of 255.
    tint: u32,
    kind: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> bodies: array<Body>;

// Twin: `mesh.rs`, `Vertex`.
struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec4<i32>,
    @location(2) colour: vec4<f32>,
}

struct Fragment {
    // All pipelines compute the same bits: one draws what another one's depth is compared with.
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) colour: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) distance: f32,
}

const SUN: vec3<f32> = vec3<f32>(-0.52, 0.68, 0.52);
const FAR_TINT: vec3<f32> = vec3<f32>(0.25, 0.45, 1.0);

// Twin: `scene/mod.rs`, `Body::placed`.
fn placed(body: Body, p: vec3<f32>) -> vec3<f32> {
    let turned = vec3<f32>(
        body.cosine * p.x + body.sine * p.z,
        p.y,
        body.cosine * p.z - body.sine * p.x,
    );
    return body.position + body.scale * turned;
}

@vertex
fn body_vertex(vertex: Vertex, @location(3) number: u32) -> Fragment {
    let body = bodies[number];
    let from_eye = placed(body, vertex.position) - view.eye;
    let n = vec3<f32>(vertex.normal.xyz);
    let tint = 2.0 * unpack4x8unorm(body.tint).xyz;
    let lod = view.tinted * f32(vertex.normal.w);
    var fragment: Fragment;
    fragment.position = view.clip_from_eye * vec4<f32>(from_eye, 1.0);
    fragment.colour = mix(vertex.colour.rgb * tint, FAR_TINT, min(0.22 * lod, 0.9));
    fragment.normal = vec3<f32>(
        body.cosine * n.x + body.sine * n.z,
        n.y,
        body.cosine * n.z - body.sine * n.x,
    );
    fragment.distance = length(from_eye);
    return fragment;
}

@fragment
fn shaded(fragment: Fragment) -> @location(0) vec4<f32> {
    let sun = dot(normalize(fragment.normal), SUN);
    let light = 0.45 + 0.55 * max(sun, 0.0) + 0.12 * min(sun, 0.0);
    let clear = exp2(-fragment.distance * view.fog_density);
    return vec4<f32>(mix(view.fog, light * fragment.colour, clear), 1.0);
}

@fragment
fn darkened() -> @location(0) vec4<f32> {
    return vec4<f32>(0.05, 0.0, 0.12, 0.35);
}

@fragment
fn counted() -> @location(0) vec4<f32> {
    return vec4<f32>(1.0);
}
