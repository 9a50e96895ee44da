// The levels of one end in the pyramid's list.
// `store_both.wgsl` has the same functions for both ends.

// Words of a texel.
const ENDS: u32 = 1u;

fn load_ends4(index: u32) -> Ends4 {
    return load4(index);
}

fn store_ends4(index: u32, ends: Ends4) {
    store4(index, ends);
}

fn store_ends2(index: u32, ends: Ends2) {
    store(index, ends.x);
    store(index + 1u, ends.y);
}

fn store_ends(index: u32, ends: Ends) {
    store(index, ends);
}
