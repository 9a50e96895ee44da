// The cull does not write down what a test reads: these functions are empty, and compilers drop
// their calls.
// `explain.wgsl` has functions of the same names that write it down.

fn note_corners(level: u32, t: vec4<u32>, bits: vec4<u32>) {}

fn note_texel(level: u32, x: u32, y: u32, bits: u32, is_behind: bool) {}

fn note_clear(is_clear: bool) {}
