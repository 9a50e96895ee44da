// A Hi-Z cull as many renderers write it: float32 all the way, and no margin for its roundings.
// Depth is reversed, so the least depth is the farthest.

@group(0) @binding(0) var depth: texture_depth_2d;
@group(0) @binding(1) var above: texture_2d<f32>;
@group(0) @binding(2) var below: texture_storage_2d<r32float, write>;

// Level 0 has half the size of the depth buffer.
@compute @workgroup_size(8, 8) fn reduce_depth(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = 2u * id.xy;
    let one = min(textureLoad(depth, at, 0), textureLoad(depth, at + vec2(1u, 0u), 0));
    let two = min(textureLoad(depth, at + vec2(0u, 1u), 0), textureLoad(depth, at + vec2(1u), 0));
    if all(id.xy < textureDimensions(below)) { textureStore(below, id.xy, vec4(min(one, two))); }
}

@compute @workgroup_size(8, 8) fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let at = 2u * id.xy;
    let one = min(textureLoad(above, at, 0).x, textureLoad(above, at + vec2(1u, 0u), 0).x);
    let two = min(textureLoad(above, at + vec2(0u, 1u), 0).x, textureLoad(above, at + 1u, 0).x);
    if all(id.xy < textureDimensions(below)) { textureStore(below, id.xy, vec4(min(one, two))); }
}

struct Draw { index_count: u32, instance_count: atomic<u32>, rest: vec3<u32> }
@group(0) @binding(3) var<uniform> rows: mat4x4<f32>; // of the matrix from world to clip space
@group(0) @binding(4) var<storage> boxes: array<array<vec4<f32>, 2>>;
@group(0) @binding(5) var levels: texture_2d<f32>;
@group(0) @binding(6) var<storage, read_write> draw: Draw;
@group(0) @binding(7) var<storage, read_write> list: array<u32>;

fn is_hidden(low: vec3<f32>, high: vec3<f32>) -> bool {
    let size = 2u * textureDimensions(levels, 0);
    let ends = vec4(low.x, -high.y, high.x, -low.y) * 0.5 + 0.5;
    let pixels = clamp(ends, vec4(0.0), vec4(1.0)) * vec4<f32>(size.xyxy);
    let extent = pixels.zw - pixels.xy;
    // Of four texels that cover the rectangle.
    let level = u32(max(ceil(log2(max(extent.x, extent.y))), 1.0)) - 1u;
    let last = max(size >> vec2(level + 1u), vec2(1u)) - 1u;
    let t = min(vec4<u32>(pixels) >> vec4(level + 1u), last.xyxy);
    let one = min(textureLoad(levels, t.xy, level).x, textureLoad(levels, t.zy, level).x);
    let two = min(textureLoad(levels, t.xw, level).x, textureLoad(levels, t.zw, level).x);
    return high.z < min(one, two);
}

@compute @workgroup_size(64) fn cull(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&list) { return; }
    var low = vec3(1e30);
    var high = vec3(-1e30);
    var crosses_eye = false;
    for (var k = 0u; k < 8u; k += 1u) {
        let is_high = ((vec4(k) >> vec4(0u, 1u, 2u, 0u)) & vec4(1u)) != vec4(0u);
        let clip = select(boxes[id.x][0], boxes[id.x][1], is_high) * rows;
        crosses_eye |= clip.w <= 0.0;
        low = min(low, clip.xyz / clip.w);
        high = max(high, clip.xyz / clip.w);
    }
    let is_outside = any(low.xy > vec2(1.0)) || any(high.xy < vec2(-1.0));
    if crosses_eye || !(is_outside || is_hidden(low, high)) {
        list[atomicAdd(&draw.instance_count, 1u)] = id.x;
    }
}
