// What a cull knows about its camera.
// Twin: `ViewUniform` in `crates/hiz_core/src/cull/view_uniform.rs`.

struct View {
    // The rows: linear functions m . (d, 1) of the position d relative to the reference point.
    // x: w times the pixel column, counted from the image's middle to the right.
    // y: w times the pixel row, counted from the image's middle downwards.
    // z: w times (depth - z_slope).
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    // Of each row: the greatest magnitude of its linear coefficients, and that of its constant.
    // Times EPS they also bound the errors of the coefficients themselves.
    magnitudes: vec4<f32>,
    constant_magnitudes: vec4<f32>,
    // The reference point is exactly eye_hi + eye_lo.
    // It is the eye, or a point nearer to what is seen (`Reference` in
    // `crates/hiz_core/src/input/view.rs`).
    eye_hi: vec3<f32>,
    z_slope: f32,
    eye_lo: vec3<f32>,
    // Upper bound, summed over the axes, of |eye_lo| + 2 * 2^-24 * |eye_hi|.
    // It stands for the low half of a position near the eye, and for the remainder that two float32
    // cannot represent.
    // Elsewhere these are greater by up to an EPS of |d_hi|.
    halves_size: f32,
    // Half of the image's size, in pixels.
    half_size: vec2<f32>,
    // How far a projection must stay away from a pixel square that it does not touch, in pixels.
    // It is the guard, less half a pixel in sample coverage.
    reach: f32,
    // Stored depths are multiplied by this before anything is called farther.
    // It is 1 + slack, or 1 - slack with reversed Z.
    depth_factor: f32,
    // The image's size in pixels: width, height.
    size: vec2<i32>,
    // 0, which no compiler knows: see `bar`.
    runtime_zero: u32,
    // The number of the reduction that the pyramid has to hold.
    reduction: u32,
    // How many texels a descent may read.
    descent_budget: u32,
    // Added to the product with depth_factor: the absolute slack, negative with reversed Z.
    depth_offset: f32,
    // From this size on a product could overflow, so such an instance is invalid.
    coordinate_limit: f32,
    // One more than the coarsest LOD that the rule can choose.
    lod_end: u32,
    // What w has to exceed, of LODs 0 to 7 in turn.
    // By error: .x of the first is a factor of the error, for all LODs.
    // By size: a factor of the radius.
    lod_needs: array<vec4<f32>, 2>,
    // Where level 0 begins in its texture, if it is a part of it: the column, and COORDINATE_BITS
    // higher the row.
    source_origin: u32,
    // What depth_factor and depth_offset are for the nearest end: they move a stored depth nearer.
    near_factor: f32,
    near_offset: f32,
    padding: u32,
    // What follows is for shadow casters (`shadow.wgsl`), and 0 in other culls.
    // How much each row changes along half of the light's unit direction.
    half_sweeps: vec4<f32>,
    // The most that each row changes per unit of length, with room for the growth's roundings.
    steepness: vec4<f32>,
    // Where light leaves the receivers' box: a coordinate per axis, about the reference point.
    exits: vec3<f32>,
    // At least the radius of the shadow map's filter.
    filter_radius: f32,
    // The way of light per unit along each axis, at least, with the sign of its direction.
    // 0 on an axis along which it may never leave the box.
    exit_rates: vec3<f32>,
    // At least the tangent of the light's angular radius.
    light_slope: f32,
    // The magnitudes of the exits and of the filter's radius.
    exit_size: f32,
    // The coordinates of the light's direction, added.
    light_size: f32,
    padding_1: vec2<u32>,
}

// Bits of a column in `source_origin`.
// Twin: `COORDINATE_BITS` in `crates/hiz_core/src/cull/view_uniform.rs`.
const COORDINATE_BITS: u32 = 16u;
const COORDINATE_MASK: u32 = (1u << COORDINATE_BITS) - 1u;

var<private> view: View;

// Keeps a compiler from folding the expression around x into the cancelling sum that made x.
// WGSL permits such folding.
fn bar(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ view.runtime_zero);
}

fn bar2(x: vec2<f32>) -> vec2<f32> {
    return bitcast<vec2<f32>>(bitcast<vec2<u32>>(x) ^ vec2<u32>(view.runtime_zero));
}

fn bar3(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) ^ vec3<u32>(view.runtime_zero));
}
