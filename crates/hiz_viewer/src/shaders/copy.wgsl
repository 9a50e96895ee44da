// Copies a texture to a part of the target, larger by a whole or broken factor, without filtering.

// Twin: `overlay.rs`, `Placement`.
struct Placement {
    origin: vec2<f32>,
    texels_per_pixel: vec2<f32>,
}

@group(0) @binding(0) var<uniform> placement: Placement;
@group(0) @binding(1) var source: texture_2d<f32>;

@fragment
fn copy_fragment(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
    let texel = vec2<i32>(floor((p.xy - placement.origin) * placement.texels_per_pixel));
    if any(texel < vec2<i32>(0)) | any(texel >= vec2<i32>(textureDimensions(source))) {
        discard;
    }
    return textureLoad(source, texel, 0);
}
