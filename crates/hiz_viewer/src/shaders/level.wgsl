// Shows a level of the pyramid: view depth on a logarithmic scale, bright is near.
// Level 0 comes from `level_image.wgsl` or `level_samples.wgsl`.

// Twin: `overlay.rs`, `LevelView`.
struct LevelView {
    // The level's size in texels, its first texel, and texels from row to row.
    size: vec2<u32>,
    offset: u32,
    stride: u32,
    // Pixels of the depth image in a texel, times pixels of the target in one of the image.
    pixels_per_texel: f32,
    // NDC depth is `a + b / view depth`.
    a: f32,
    b: f32,
    // View depths that are shown white and black.
    nearest: f32,
    farthest: f32,
    // 1: level 0, which is the depth image itself.
    is_image: u32,
    // Words from texel to texel.
    step: u32,
}

@group(0) @binding(0) var<uniform> level: LevelView;
@group(0) @binding(1) var<storage, read> texels: array<f32>;

@fragment
fn level_fragment(@builtin(position) p: vec4<f32>) -> @location(0) vec4<f32> {
    let texel = min(vec2<u32>(p.xy / level.pixels_per_texel), level.size - 1u);
    var depth: f32;
    if level.is_image == 1u {
        depth = farthest_of_image(vec2<i32>(texel));
    } else {
        depth = texels[level.offset + texel.y * level.stride + level.step * texel.x];
    }
    let distance = level.b / max(depth - level.a, 1e-12);
    if distance > 4.0 * level.farthest {
        return vec4<f32>(0.06, 0.09, 0.22, 1.0);
    }
    let place = log2(distance / level.nearest) / log2(level.farthest / level.nearest);
    return vec4<f32>(vec3<f32>(1.0 - 0.92 * clamp(place, 0.0, 1.0)), 1.0);
}
