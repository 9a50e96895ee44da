// Oriented boxes (twin: `crates/hiz_core/src/bounds.rs`, OrientedBoxRecord). Read as bits: validity is decided on integers.

struct OrientedBoxRecord {
    // xyz: the centre's high half, its low half, two half axes; the four w: the third half axis and nothing.
    center_hi: vec4<u32>,
    center_lo: vec4<u32>,
    half_axis_0: vec4<u32>,
    half_axis_1: vec4<u32>,
}

@group(1) @binding(1) var<storage, read> instances: array<OrientedBoxRecord>;

fn load_volume(i: u32) -> Volume {
    let record = instances[i];
    let hi = bitcast<vec3<f32>>(record.center_hi.xyz);
    let e0 = bitcast<vec3<f32>>(record.half_axis_0.xyz);
    let e1 = bitcast<vec3<f32>>(record.half_axis_1.xyz);
    let e2 = bitcast<vec3<f32>>(vec3<u32>(record.center_hi.w, record.center_lo.w, record.half_axis_0.w));
    let d_hi = bar3(hi - view.eye_hi);
    let d_lo = bar3(bitcast<vec3<f32>>(record.center_lo.xyz) - view.eye_lo);
    let reach = abs(d_hi) + abs(d_lo) + (abs(e0) + abs(e1) + abs(e2)) + HALF_EPS * abs(hi);
    let valid = all_small(record.center_hi) && all_small(record.center_lo) && all_small(record.half_axis_0)
        && all_small(vec4<u32>(record.half_axis_1.xyz, 0u)) && in_reach(reach);
    return Volume(d_hi + d_lo, reach, e0, e1, e2, valid);
}

fn on_half_axes(m: vec3<f32>, volume: Volume) -> vec3<f32> {
    return vec3<f32>(dot(m, volume.half_axis_0), dot(m, volume.half_axis_1), dot(m, volume.half_axis_2));
}
