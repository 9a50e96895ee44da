// The levels of both ends in the pyramid's list: all farthest depths, and behind them all nearest.
// `store_one.wgsl` has the same functions for one end.

fn load_ends4(index: u32) -> Ends4 {
    return Ends4(load4(index), load4(pyramid.nearest + index));
}

fn store_ends4(index: u32, ends: Ends4) {
    store4(index, ends.far);
    store4(pyramid.nearest + index, ends.near);
}

fn store_ends2(index: u32, ends: Ends2) {
    store(index, ends.far.x);
    store(index + 1u, ends.far.y);
    store(pyramid.nearest + index, ends.near.x);
    store(pyramid.nearest + index + 1u, ends.near.y);
}

fn store_ends(index: u32, ends: Ends) {
    store(index, ends.far);
    store(pyramid.nearest + index, ends.near);
}
