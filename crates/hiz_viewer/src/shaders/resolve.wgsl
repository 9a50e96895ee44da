// The farthest sample of each pixel, as depth.

@group(0) @binding(0) var depth: texture_depth_multisampled_2d;

@fragment
fn resolve(@builtin(position) p: vec4<f32>) -> @builtin(frag_depth) f32 {
    var farthest = 1.0;
    for (var s = 0; s < i32(textureNumSamples(depth)); s++) {
        farthest = min(farthest, textureLoad(depth, vec2<i32>(p.xy), s));
    }
    return farthest;
}
