// The levels of both ends in the pyramid's list: the nearest depth of a texel follows its farthest.
// `store_one.wgsl` has the same functions for one end.
//
// So two texels are a vector, which costs a software driver half as much to store as four words.

// Words of a texel.
const ENDS: u32 = 2u;

fn load_ends4(index: u32) -> Ends4 {
    let left = load4(index);
    let right = load4(index + VECTOR);
    return Ends4(vec4<u32>(left.xz, right.xz), vec4<u32>(left.yw, right.yw));
}

fn store_ends4(index: u32, ends: Ends4) {
    store_ends2(index, Ends2(ends.far.xy, ends.near.xy));
    store_ends2(index + VECTOR, Ends2(ends.far.zw, ends.near.zw));
}

// `index` is that of a texel of an even column.
fn store_ends2(index: u32, ends: Ends2) {
    store4(index, vec4<u32>(ends.far.x, ends.near.x, ends.far.y, ends.near.y));
}

fn store_ends(index: u32, ends: Ends) {
    store(index, ends.far);
    store(index + 1u, ends.near);
}
