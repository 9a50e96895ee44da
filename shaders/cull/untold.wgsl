// Empty functions in the place of those by which `explain.wgsl` writes down what a test reads.
// `classify.wgsl` calls them for every texel, and compilers drop calls of empty functions.
// So the explanation runs the cull's own code, and the cull pays nothing for it.

fn tell_corners(level: u32, t: vec4<u32>, bits: vec4<u32>) {}

fn tell_texel(level: u32, x: u32, y: u32, bits: u32, is_behind: bool) {}

fn tell_clear(is_clear: bool) {}
