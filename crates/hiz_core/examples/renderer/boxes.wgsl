// Boxes drawn through a list of their numbers: the packed list of a cull, or simply 0, 1, 2, ...
// Positions are eye-relative, as in hiz_core's occluder pass: two float32 halves, the eye subtracted half by half.

struct View {
    // Clip-space rows about the eye.
    clip_from_eye: array<vec4<f32>, 4>,
    eye_hi: vec4<f32>,
    eye_lo: vec4<f32>,
}

struct Block {
    min_hi: vec4<f32>,
    min_lo: vec4<f32>,
    max_hi: vec4<f32>,
    max_lo: vec4<f32>,
    colour: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<storage, read> blocks: array<Block>;

struct Corner {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) block: u32,
    @location(1) @interpolate(flat) face: u32,
    // Where on its face, -1..1.
    @location(2) on_face: vec2<f32>,
}

@vertex
fn block_vertex(@builtin(vertex_index) v: u32, @location(0) block: u32) -> Corner {
    let axis = v / 8u;
    var side: vec3<bool>;
    side[axis] = v / 4u % 2u == 1u;
    side[(axis + 1u) % 3u] = v % 2u == 1u;
    side[(axis + 2u) % 3u] = v / 2u % 2u == 1u;

    let b = blocks[block];
    let hi = select(b.min_hi.xyz, b.max_hi.xyz, side);
    let lo = select(b.min_lo.xyz, b.max_lo.xyz, side);
    let d = vec4<f32>((hi - view.eye_hi.xyz) + (lo - view.eye_lo.xyz), 1.0);
    let m = view.clip_from_eye;
    let position = vec4<f32>(dot(m[0], d), dot(m[1], d), dot(m[2], d), dot(m[3], d));
    let on_face = vec2<f32>(vec2<u32>(v % 2u, v / 2u % 2u)) * 2.0 - 1.0;
    return Corner(position, block, axis, on_face);
}

struct Pixel {
    @location(0) colour: vec4<f32>,
    // The box's number + 1; 0 is the sky.
    @location(1) id: u32,
}

@fragment
fn block_fragment(in: Corner) -> Pixel {
    const LIGHT = array<f32, 3>(0.7, 1.0, 0.85);
    let edge = max(abs(in.on_face.x), abs(in.on_face.y));
    let shade = LIGHT[in.face] * (1.0 - 0.35 * smoothstep(0.85, 1.0, edge));
    return Pixel(vec4<f32>(blocks[in.block].colour.rgb * shade, 1.0), in.block + 1u);
}
