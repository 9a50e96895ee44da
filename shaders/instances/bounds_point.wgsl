// Points whose positions float32 holds.
// Twin: `PointRecord` in `crates/hiz_core/src/instances/point.rs`.

// Texels of a record: the position, and the caller's index in w.
const RECORD_TEXELS: u32 = 1u;

fn caller_index(i: u32) -> u32 {
    return record_texel(i, 0u).w;
}

fn load_volume(i: u32) -> Volume {
    let hi = bitcast<vec3<f32>>(record_texel(i, 0u).xyz);
    let d_hi = bar3(hi - view.eye_hi);
    return Volume(d_hi - view.eye_lo, size_of(d_hi, 0.0));
}
