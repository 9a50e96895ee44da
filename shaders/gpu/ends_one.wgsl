// What a reduction makes of a block: one depth, the farthest.
// A pyramid of nearest depths alone is that of farthest depths in the other convention.
// `ends_both.wgsl` has the same functions for both depths.

// The ends of one texel, and of two and four texels of a row.
alias Ends = u32;
alias Ends2 = vec2<u32>;
alias Ends4 = vec4<u32>;

// The ends of no texel at all.
fn no_ends() -> Ends {
    return near_bits();
}

// The ends of four pixels as they were given.
fn ends_of_pixels(pixels: vec4<u32>) -> Ends {
    return farthest_sanitized4(pixels);
}

// The same of the farthest and the nearest samples of four pixels.
fn ends_of_pair(far: vec4<u32>, near: vec4<u32>) -> Ends {
    return farthest_sanitized4(far);
}

// Four texels in a row.
fn in_row(a: Ends, b: Ends, c: Ends, d: Ends) -> Ends4 {
    return vec4<u32>(a, b, c, d);
}

fn pairs_in_row(a: Ends2, b: Ends2) -> Ends4 {
    return vec4<u32>(a, b);
}

// Four columns of four texels as four rows.
fn rows_of_columns(a: Ends4, b: Ends4, c: Ends4, d: Ends4) -> array<Ends4, BLOCK_QUADS> {
    return array<Ends4, BLOCK_QUADS>(
        vec4<u32>(a.x, b.x, c.x, d.x), vec4<u32>(a.y, b.y, c.y, d.y),
        vec4<u32>(a.z, b.z, c.z, d.z), vec4<u32>(a.w, b.w, c.w, d.w));
}

fn joined(a: Ends, b: Ends) -> Ends {
    return farthest(a, b);
}

fn joined4(v: Ends4) -> Ends {
    return farthest4(v);
}

// Two rows of four texels, halved to two texels: the ends of each 2x2.
fn halved(a: Ends4, b: Ends4) -> Ends2 {
    return vec2<u32>(farthest4(vec4<u32>(a.xy, b.xy)), farthest4(vec4<u32>(a.zw, b.zw)));
}
