// Which numbers a cull may compute with. Decided on bits: a compiler may assume that no float is NaN or infinite.

// 2^-24: what a position's two halves cannot hold is less than this much of its low half's bound.
const HALF_EPS: f32 = 0x1p-24;
// The bits of 2^60, from which on squares of products could overflow.
const LARGEST_BITS: u32 = 0x5d800000u;

fn all_small(bits: vec4<u32>) -> bool {
    return all((bits & vec4<u32>(0x7fffffffu)) < vec4<u32>(LARGEST_BITS));
}

fn in_reach(reach: vec3<f32>) -> bool {
    return all(reach < vec3<f32>(view.coordinate_limit));
}
