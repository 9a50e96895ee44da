// The records of bounds, of whatever kind.

@group(1) @binding(1) var records: texture_storage_2d<rgba32uint, read>;

fn record_texel(i: u32, k: u32) -> vec4<u32> {
    return textureLoad(records, record_position(i, k, RECORD_TEXELS));
}

// Upper bound, summed over the axes, of everything that a row is multiplied with.
// That is d_hi, d_lo, what the two halves of a position cannot hold, and `own`, the half axes.
fn size_of(d_hi: vec3<f32>, own: f32) -> f32 {
    return sum_abs(d_hi) + (own + view.halves_size);
}

fn sum_abs(v: vec3<f32>) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}
