// Squares by which `sample_places.rs` finds where samples lie, and where their depth is computed.

// Places per pixel; twin: `STEPS` in `sample_places.rs`.
const STEPS: u32 = 16u;
// The target; twin: `SIZE` in `sample_places.rs`.
const SIZE: vec2<f32> = vec2<f32>(25.0, 4.0);

@vertex
fn square(@builtin(vertex_index) v: u32, @builtin(instance_index) i: u32)
    -> @builtin(position) vec4<f32> {
    let corner = vec2<f32>(f32(v & 1u), f32(v >> 1u));
    // Column `step` of row 0 is covered from a step on to the right, and of row 2 downwards.
    let step = i % (STEPS + 1u);
    let begin = f32(step) / f32(STEPS);
    var low = vec2<f32>(f32(step) + begin, 0.0);
    var size = vec2<f32>(1.0 - begin, 1.0);
    var depth = 0.5;
    if i > STEPS {
        low = vec2<f32>(f32(step), 2.0 + begin);
        size = vec2<f32>(1.0, 1.0 - begin);
    }
    // Behind them, depth grows by 1/8 per pixel to the right, and by 1/3 per pixel downwards.
    if i == 2u * (STEPS + 1u) {
        low = vec2<f32>(17.0, 0.0);
        size = vec2<f32>(8.0, 1.0);
        depth = corner.x;
    }
    if i == 2u * (STEPS + 1u) + 1u {
        low = vec2<f32>(17.0, 1.0);
        size = vec2<f32>(8.0, 3.0);
        depth = corner.y;
    }
    let ndc = (low + corner * size) / SIZE * 2.0 - 1.0;
    return vec4<f32>(ndc.x, -ndc.y, depth, 1.0);
}
