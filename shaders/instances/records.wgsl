// The records of the volumes, of whatever kind.
// The file `bounds_*.wgsl` of the kind says what a record holds.

@group(1) @binding(1) var records: texture_storage_2d<rgba32uint, read>;

fn record_texel(i: u32, k: u32) -> vec4<u32> {
    return textureLoad(records, record_position(i, k, RECORD_TEXELS));
}

// A bound of everything that a row is multiplied with, summed over the axes.
// That is d_hi and d_lo, what a position's halves cannot hold, and `own`: the volume's half axes.
fn size_of(d_hi: vec3<f32>, own: f32) -> f32 {
    return sum_abs(d_hi) + (own + view.halves_size);
}

fn sum_abs(v: vec3<f32>) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}
