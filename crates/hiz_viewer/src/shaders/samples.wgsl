// Reads all samples of a depth texture into a buffer, as bits, beside how often each was drawn.
//
// The host replaces the two types by those of one sample per pixel.

@group(0) @binding(0) var depth: texture_depth_multisampled_2d;
@group(0) @binding(1) var count: texture_multisampled_2d<f32>;
@group(0) @binding(2) var<storage, read_write> found: array<vec2<u32>>;

override SAMPLES: u32 = 4u;

@compute @workgroup_size(8, 8)
fn read_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    let size = textureDimensions(depth);
    if any(id.xy >= size) {
        return;
    }
    for (var s = 0u; s < SAMPLES; s++) {
        let p = vec2<i32>(id.xy);
        let place = (id.y * size.x + id.x) * SAMPLES + s;
        let bits = bitcast<u32>(textureLoad(depth, p, s));
        found[place] = vec2<u32>(bits, u32(textureLoad(count, p, s).x));
    }
}
