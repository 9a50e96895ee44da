// What one cull knows of its camera (twin: `crates/hiz_core/src/cull/view_uniform.rs`,
// ViewUniform).

struct View {
    // Rows, linear functions m .
    // (d, 1) of the position d about the reference point.
    // Times w: pixel column right of the image's middle, pixel row below it, depth less z_slope
    // times w; and w itself.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    // Of these four rows: the greatest magnitude among the linear coefficients, and that of the
    // constant.
    // Times float32's eps they bound the coefficients' own errors as well.
    magnitudes: vec4<f32>,
    constant_magnitudes: vec4<f32>,
    // The reference point is exactly eye_hi + eye_lo: the eye, or a point nearer to what is seen
    // (`Reference` in view.rs).
    eye_hi: vec3<f32>,
    z_slope: f32,
    eye_lo: vec3<f32>,
    // All axes added: at least |eye_lo|, and what low halves and what both halves cannot hold come
    // to near the eye, twice 2^-24 of
    // |eye_hi|. (Elsewhere it is an eps of |d_hi| more.)
    halves_size: f32,
    half_size: vec2<f32>,
    // How far a volume's projection must stay away from a pixel square that it does not touch: the
    // guard, less half a pixel in sample coverage.
    reach: f32,
    // What a stored depth is multiplied by before anything is called farther: 1 + slack, reversed
    // 1 - slack.
    depth_factor: f32,
    size: vec2<i32>,
    // 0, but no compiler knows: see `bar`.
    runtime_zero: u32,
    // The number of the reduction that the pyramid has to hold.
    reduction: u32,
    // How many texels a descent may read.
    descent_budget: u32,
    // What is added then: the absolute slack, reversed less than 0.
    depth_offset: f32,
    // Sizes from here on could overflow a product: such an instance is invalid.
    coordinate_limit: f32,
    padding: u32,
}

var<private> view: View;

// Keeps a compiler from folding what follows into the cancelling sum x was made by, as WGSL lets
// it.
fn bar(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ view.runtime_zero);
}

fn bar2(x: vec2<f32>) -> vec2<f32> {
    return bitcast<vec2<f32>>(bitcast<vec2<u32>>(x) ^ vec2<u32>(view.runtime_zero));
}

fn bar3(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) ^ vec3<u32>(view.runtime_zero));
}
