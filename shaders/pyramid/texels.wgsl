// The pyramid as a cull reads it, wherever its levels lie.
// `texels_apart.wgsl`, `texels_atlas.wgsl` or `texels_nowhere.wgsl` comes before this file.

// The footprint is at most 2^n x 2^n texels.
override FOOTPRINT_LOG2: u32;

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(6) var<uniform> view_uniform: View;

// Whether the reduction that this cull was recorded for has filled the pyramid.
// If not, the cull keeps everything.
var<private> is_reduced: bool;

// Every entry point calls this first.
// It copies uniforms to registers; a software driver would fetch them anew for every instance.
fn begin() {
    view = view_uniform;
    is_reduced = reduction_number() == view.reduction;
    first_stored = pyramid.first_stored;
    last_stored = pyramid.last_stored;
}

// The farthest depth of the texels from columns t.x to t.z and rows t.y to t.w of a level.
fn footprint(level: u32, t: vec4<u32>) -> u32 {
    if FOOTPRINT_LOG2 == 1u {
        let bits = corners(level, t);
        tell_corners(level, t, bits);
        return farthest_sanitized4(bits);
    }
    var bits = near_bits();
    for (var y = t.y; y <= t.w; y += 1u) {
        for (var x = t.x; x <= t.z; x += 1u) {
            let here = texel(level, x, y);
            tell_texel(level, x, y, here, false);
            bits = farthest(bits, here);
        }
    }
    return bits;
}

const LEAST_NORMAL: f32 = 0x1p-126;

// The depth that a stored one may stand for: the farthest that the slack allows.
// It is kept away from subnormals, which a driver may flush.
fn occluding_depth(bits: u32) -> f32 {
    let stored = select(max(bitcast<f32>(bits), LEAST_NORMAL), min(bitcast<f32>(bits), 1.0), REVERSED);
    return bar(stored * view.depth_factor + view.depth_offset);
}
