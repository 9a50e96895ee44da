// The pyramid as a cull reads it, wherever its levels lie.
// `texels_apart.wgsl` and `texels_atlas.wgsl` read single texels.

// The footprint has at most 2^n x 2^n texels.
override FOOTPRINT_LOG2: u32;
// True: the pyramid has nearest depths, too, and they are asked for.
override NEAREST: bool;
// True: the pyramid has them, so a texel is two words.
override BOTH: bool;

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(6) var<uniform> view_uniform: View;

// Whether the pyramid holds the reduction that the view was made for.
// A reduction that was recorded may never have run.
var<private> is_reduced: bool;

// Every entry point calls this first.
// Tuning for software drivers: what is in registers is not fetched again for every instance.
fn begin() {
    view = view_uniform;
    is_reduced = reduction_number() == view.reduction;
    first_stored = pyramid.first_stored;
    last_stored = pyramid.last_stored;
}

// The farthest depth of the texels from columns t.x to t.z and rows t.y to t.w of a level.
fn footprint(level: u32, t: vec4<u32>) -> u32 {
    // The corners of a 2x2 footprint are all of its texels.
    if FOOTPRINT_LOG2 == 1u {
        let bits = corners(level, t);
        note_corners(level, t, bits);
        return farthest_sanitized4(bits);
    }
    var bits = near_bits();
    for (var y = t.y; y <= t.w; y += 1u) {
        for (var x = t.x; x <= t.z; x += 1u) {
            let here = texel(level, x, y);
            note_texel(level, x, y, here, false);
            bits = farthest(bits, here);
        }
    }
    return bits;
}

// The nearest depth of the same texels; only where NEAREST is set.
fn nearest_footprint(level: u32, t: vec4<u32>) -> u32 {
    if FOOTPRINT_LOG2 == 1u {
        return nearest_sanitized4(nearest_corners(level, t));
    }
    var bits = far_bits();
    for (var y = t.y; y <= t.w; y += 1u) {
        for (var x = t.x; x <= t.z; x += 1u) {
            bits = nearest(bits, nearest_texel(level, x, y));
        }
    }
    return bits;
}

const LEAST_NORMAL: f32 = 0x1p-126;

// The depth that a certificate takes for a stored one: moved by the slack, away from subnormals.
fn occluding_depth(bits: u32) -> f32 {
    let stored =
        select(max(bitcast<f32>(bits), LEAST_NORMAL), min(bitcast<f32>(bits), 1.0), REVERSED);
    return bar(stored * view.depth_factor + view.depth_offset);
}
