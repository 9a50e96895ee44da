// How a cull emits nothing but its mask, of which `compact.wgsl` may make a list later.

fn emit(place: u32, index: u32) {}
