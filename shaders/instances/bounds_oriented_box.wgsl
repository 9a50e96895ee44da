// Oriented boxes.
// Twin: `OrientedBoxRecord` in `crates/hiz_core/src/instances/volume_record.rs`.

// Texels of a record; .xyz: the centre's high half, its low half, the first two half axes.
// The w of the first three texels hold the third half axis.
// The w of the last texel is the caller's index.
const RECORD_TEXELS: u32 = 4u;
const LAST_TEXEL: u32 = RECORD_TEXELS - 1u;

fn caller_index(i: u32) -> u32 {
    return record_texel(i, LAST_TEXEL).w;
}

fn load_volume(i: u32) -> Volume {
    let texel_0 = record_texel(i, 0u);
    let texel_1 = record_texel(i, 1u);
    let texel_2 = record_texel(i, 2u);
    let hi = bitcast<vec3<f32>>(texel_0.xyz);
    let lo = bitcast<vec3<f32>>(texel_1.xyz);
    let e0 = bitcast<vec3<f32>>(texel_2.xyz);
    let e1 = bitcast<vec3<f32>>(record_texel(i, LAST_TEXEL).xyz);
    let e2 = bitcast<vec3<f32>>(vec3<u32>(texel_0.w, texel_1.w, texel_2.w));
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(lo - view.eye_lo);
    return Volume(d_hi + d_lo, size_of(d_hi, sum_abs(e0) + sum_abs(e1) + sum_abs(e2)), e0, e1, e2);
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return vec3<f32>(
        dot(m, volume.half_axis_0), dot(m, volume.half_axis_1), dot(m, volume.half_axis_2));
}
