// Oriented boxes.
// Twin: `crates/hiz_core/src/instances/volume_record.rs`, `OrientedBoxRecord`; here it is four
// texels.
//
// - xyz of texels 0 to 3: the centre's high half, its low half, half axes 0 and 1
// - w of texels 0 to 2: half axis 2
// - w of texel 3: the caller's index
const RECORD_TEXELS: u32 = 4u;

fn caller_index(i: u32) -> u32 {
    return record_texel(i, 3u).w;
}

fn load_volume(i: u32) -> Volume {
    let texel_0 = record_texel(i, 0u);
    let texel_1 = record_texel(i, 1u);
    let texel_2 = record_texel(i, 2u);
    let hi = bitcast<vec3<f32>>(texel_0.xyz);
    let lo = bitcast<vec3<f32>>(texel_1.xyz);
    let e0 = bitcast<vec3<f32>>(texel_2.xyz);
    let e1 = bitcast<vec3<f32>>(record_texel(i, 3u).xyz);
    let e2 = bitcast<vec3<f32>>(vec3<u32>(texel_0.w, texel_1.w, texel_2.w));
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(lo - view.eye_lo);
    return Volume(d_hi + d_lo, size_of(d_hi, sum_abs(e0) + sum_abs(e1) + sum_abs(e2)), e0, e1, e2);
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return vec3<f32>(dot(m, volume.half_axis_0), dot(m, volume.half_axis_1), dot(m, volume.half_axis_2));
}
