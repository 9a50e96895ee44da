// Axis-aligned boxes (twin: `crates/hiz_core/src/bounds.rs`, BoxRecord). Read as bits: validity is decided on integers.

struct BoxRecord {
    // xyz: the centre's high half.
    center_hi: vec4<u32>,
    // xyz: its low half.
    center_lo: vec4<u32>,
    // xyz: the half sizes.
    half_size: vec4<u32>,
}

@group(1) @binding(1) var<storage, read> instances: array<BoxRecord>;

fn load_volume(i: u32) -> Volume {
    let record = instances[i];
    let hi = bitcast<vec3<f32>>(record.center_hi.xyz);
    let half = bitcast<vec3<f32>>(record.half_size.xyz);
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(bitcast<vec3<f32>>(record.center_lo.xyz) - view.eye_lo);
    let reach = abs(d_hi) + abs(d_lo) + half + HALF_EPS * abs(hi);
    let valid = all_small(vec4<u32>(record.center_hi.xyz, 0u)) && all_small(vec4<u32>(record.center_lo.xyz, 0u))
        && all_small(vec4<u32>(record.half_size.xyz, 0u)) && all(half >= vec3<f32>(0.0)) && in_reach(reach);
    return Volume(
        d_hi + d_lo, reach,
        vec3<f32>(half.x, 0.0, 0.0), vec3<f32>(0.0, half.y, 0.0), vec3<f32>(0.0, 0.0, half.z),
        valid);
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return m * vec3<f32>(volume.half_axis_0.x, volume.half_axis_1.y, volume.half_axis_2.z);
}
