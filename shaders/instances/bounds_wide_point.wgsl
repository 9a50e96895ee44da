// Points of which a position needs two float32.
// Twin: `WidePointRecord` in `crates/hiz_core/src/instances/point.rs`.

// Texels of a record; .xyz: the position's high half, its low half.
// The w of the first texel is the caller's index.
const RECORD_TEXELS: u32 = 2u;

fn caller_index(i: u32) -> u32 {
    return record_texel(i, 0u).w;
}

// What both halves cannot hold is covered by `view.halves_size`.
fn load_volume(i: u32) -> Volume {
    let hi = bitcast<vec3<f32>>(record_texel(i, 0u).xyz);
    let lo = bitcast<vec3<f32>>(record_texel(i, 1u).xyz);
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(lo - view.eye_lo);
    return Volume(d_hi + d_lo, size_of(d_hi, 0.0));
}
