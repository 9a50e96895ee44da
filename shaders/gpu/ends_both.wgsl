// What a reduction makes of a block: both ends, the farthest and the nearest depth.
// The source is read once for both.
// `ends_one.wgsl` has the same functions for one end.

// The ends of one texel, and of two and four texels of a row.
struct Ends {
    far: u32,
    near: u32,
}

struct Ends2 {
    far: vec2<u32>,
    near: vec2<u32>,
}

struct Ends4 {
    far: vec4<u32>,
    near: vec4<u32>,
}

// The ends of no texel at all; stored, this says that a block shows no receiver.
fn no_ends() -> Ends {
    return Ends(near_bits(), far_bits());
}

// The least and the greatest of four depths as they were given.
// What is no depth is 0 for the least, and 1 for the greatest.
// Together they take less work than `least_sanitized4` and `greatest_sanitized4`.
//
// Where no bits are above those of 1, all four are depths, whose order is that of their bits.
// Otherwise one of them is no depth or -0, and the least is 0.
// Bits above those of -0 belong to negative numbers, which are no depths.
// Without these, the greatest as signed integers is that of all but -0.
fn range_of_pixels(v: vec4<u32>) -> vec2<u32> {
    let least = min(min(v.x, v.y), min(v.z, v.w));
    let greatest = max(max(v.x, v.y), max(v.z, v.w));
    let s = bitcast<vec4<i32>>(v);
    let greatest_signed = max(max(s.x, s.y), max(s.z, s.w));
    let without_negative = min(u32(max(greatest_signed, 0)), ONE_BITS);
    let high = select(without_negative, ONE_BITS, greatest > NEGATIVE_ZERO_BITS);
    return vec2<u32>(
        select(least, 0u, greatest > ONE_BITS || least < LEAST_NORMAL_BITS),
        select(high, 0u, high < LEAST_NORMAL_BITS));
}

// The ends of four pixels as they were given.
fn ends_of_pixels(pixels: vec4<u32>) -> Ends {
    if RECEIVERS {
        return Ends(farthest_sanitized4(foreground4(pixels)), nearest_sanitized4(pixels));
    }
    let range = range_of_pixels(pixels);
    if REVERSED {
        return Ends(range.x, range.y);
    }
    return Ends(range.y, range.x);
}

// The same of the farthest and the nearest samples of four pixels.
fn ends_of_pair(far: vec4<u32>, near: vec4<u32>) -> Ends {
    return Ends(farthest_sanitized4(far), nearest_sanitized4(near));
}

// Four texels in a row.
fn in_row(a: Ends, b: Ends, c: Ends, d: Ends) -> Ends4 {
    return Ends4(vec4<u32>(a.far, b.far, c.far, d.far), vec4<u32>(a.near, b.near, c.near, d.near));
}

fn pairs_in_row(a: Ends2, b: Ends2) -> Ends4 {
    return Ends4(vec4<u32>(a.far, b.far), vec4<u32>(a.near, b.near));
}

// Four columns of four texels as four rows.
fn rows_of_columns(a: Ends4, b: Ends4, c: Ends4, d: Ends4) -> array<Ends4, BLOCK_QUADS> {
    return array<Ends4, BLOCK_QUADS>(
        Ends4(
            vec4<u32>(a.far.x, b.far.x, c.far.x, d.far.x),
            vec4<u32>(a.near.x, b.near.x, c.near.x, d.near.x)),
        Ends4(
            vec4<u32>(a.far.y, b.far.y, c.far.y, d.far.y),
            vec4<u32>(a.near.y, b.near.y, c.near.y, d.near.y)),
        Ends4(
            vec4<u32>(a.far.z, b.far.z, c.far.z, d.far.z),
            vec4<u32>(a.near.z, b.near.z, c.near.z, d.near.z)),
        Ends4(
            vec4<u32>(a.far.w, b.far.w, c.far.w, d.far.w),
            vec4<u32>(a.near.w, b.near.w, c.near.w, d.near.w)));
}

fn joined(a: Ends, b: Ends) -> Ends {
    return Ends(farthest(a.far, b.far), nearest(a.near, b.near));
}

fn joined4(v: Ends4) -> Ends {
    return Ends(farthest4(v.far), nearest4(v.near));
}

// Two rows of four texels, halved to two texels: the ends of each 2x2.
fn halved(a: Ends4, b: Ends4) -> Ends2 {
    let left = joined4(Ends4(vec4<u32>(a.far.xy, b.far.xy), vec4<u32>(a.near.xy, b.near.xy)));
    let right = joined4(Ends4(vec4<u32>(a.far.zw, b.far.zw), vec4<u32>(a.near.zw, b.near.zw)));
    return Ends2(vec2<u32>(left.far, right.far), vec2<u32>(left.near, right.near));
}
