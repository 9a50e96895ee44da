// Axis-aligned boxes.
// Twin: `crates/hiz_core/src/instances/volume_record.rs`, `BoxRecord`; here it is three texels.
//
// - texel 0: the centre's high half
// - texel 1: the centre's low half, and the caller's index
// - texel 2: the half sizes
const RECORD_TEXELS: u32 = 3u;

fn caller_index(i: u32) -> u32 {
    return record_texel(i, 1u).w;
}

fn load_volume(i: u32) -> Volume {
    let hi = bitcast<vec3<f32>>(record_texel(i, 0u).xyz);
    let lo = bitcast<vec3<f32>>(record_texel(i, 1u).xyz);
    let half = bitcast<vec3<f32>>(record_texel(i, 2u).xyz);
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(lo - view.eye_lo);
    return Volume(
        d_hi + d_lo,
        size_of(d_hi, half.x + half.y + half.z),
        vec3<f32>(half.x, 0.0, 0.0), vec3<f32>(0.0, half.y, 0.0), vec3<f32>(0.0, 0.0, half.z));
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return m * vec3<f32>(volume.half_axis_0.x, volume.half_axis_1.y, volume.half_axis_2.z);
}
