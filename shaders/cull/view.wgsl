// The view: what a cull's shaders know of the camera and of the options that are numbers.
// Twin: `crates/hiz_core/src/cull/view_uniform.rs`, `ViewUniform`.

struct View {
    // Four rows.
    // Each is a linear function `dot(m, (d, 1))` of the position d about the reference point.
    //
    // - x: pixel columns to the right of the image's middle, times w
    // - y: pixel rows below the image's middle, times w
    // - z: depth times w, less z_slope times w
    // - w itself
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    // For each row, the greatest magnitude among its linear coefficients, and the magnitude of its
    // constant.
    // Times float32's eps they bound the coefficients' own errors as well.
    magnitudes: vec4<f32>,
    constant_magnitudes: vec4<f32>,
    // The reference point is exactly eye_hi + eye_lo.
    // It is the eye, or a point nearer to what is seen: `Reference` in
    // `crates/hiz_core/src/input/view.rs`.
    eye_hi: vec3<f32>,
    z_slope: f32,
    eye_lo: vec3<f32>,
    // An upper bound, summed over the axes, of |eye_lo| + 2 * 2^-24 * |eye_hi|.
    // Near the eye it covers the low half of a position and what both halves cannot hold.
    // Elsewhere these come to an eps of |d_hi| more.
    halves_size: f32,
    half_size: vec2<f32>,
    // How far a volume's projection must stay away from a pixel square that it does not touch.
    // It is the option `guard_px`, less half a pixel in sample coverage.
    reach: f32,
    // A stored depth is multiplied by this before anything counts as farther.
    // It is 1 + slack, or with reversed Z 1 - slack.
    depth_factor: f32,
    size: vec2<i32>,
    // Always 0, which no compiler can know: see `bar`.
    runtime_zero: u32,
    // The number of the reduction that the pyramid has to hold.
    reduction: u32,
    // How many texels a descent may read.
    descent_budget: u32,
    // This is added after the multiplication by depth_factor.
    // It is the absolute slack, or with reversed Z its negative.
    depth_offset: f32,
    // A volume of this size or larger could overflow a product, so it is invalid.
    coordinate_limit: f32,
    padding: u32,
}

var<private> view: View;

// A barrier against optimisation: returns x, and no compiler can see through it.
// WGSL lets a compiler reassociate sums.
// Without the barrier it could merge later terms into the sum that made x.
// Where that sum cancels, the rounding errors would then be larger than the margin.
fn bar(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ view.runtime_zero);
}

fn bar2(x: vec2<f32>) -> vec2<f32> {
    return bitcast<vec2<f32>>(bitcast<vec2<u32>>(x) ^ vec2<u32>(view.runtime_zero));
}

fn bar3(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) ^ vec3<u32>(view.runtime_zero));
}
