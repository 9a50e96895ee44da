// The levels of a mip texture: floor-halved, as the mip levels of a texture are.
//
// At an odd size a texel of the next level takes three texels along that axis, not two.
// Otherwise the last row and column would be lost.
// Which texels do so depends on how shaders look texels up:
//
// - By normalised coordinates: all of them.
//   The texel at floor(u n) then covers every pixel that its part of the image touches.
// - By the pixel's number, shifted: the last one alone.
//   Texel min(p >> k, n - 1) of level k then covers pixel p, and no more than that.
//
// A list of texels takes the levels, and is copied into the texture afterwards.
// On software drivers this takes about half of the time of stores into a texture.
//
// An invocation reads 8x8 texels, or 9x9 at odd sizes, and makes up to three levels of them.
// The shape is that of `reduce.wgsl`.
// The second and the third level are made where the level before them has even sizes.

// True: level 0, the depth image, is read; otherwise a level of the list.
override FROM_SOURCE: bool;
// How many levels a step makes, 1 to 3.
override LEVELS: u32;
// Whether the level that is read has an odd size above 1 along an axis.
override ODD_X: bool;
override ODD_Y: bool;
// True: texels are looked up by shifted pixel numbers; otherwise by normalised coordinates.
override EDGE_TEXEL: bool;

// Invocations of a workgroup, in a row.
// Twin: `WORKGROUP` in `crates/hiz_core/src/pyramid/mips_passes.rs`.
const WORKGROUP: u32 = 64u;

// Twin: `MipsUniform` in `crates/hiz_core/src/pyramid/mips_bindings.rs`.
struct Mips {
    // Level 0 is in the list while it is copied, and lies where the other levels lie later.
    levels: array<Level, MAX_LEVELS>,
    // Where level 0 begins in its texture.
    origin: vec2<u32>,
    padding: vec2<u32>,
}

// Twin: `MipStepUniform` in `crates/hiz_core/src/pyramid/mips_bindings.rs`.
struct MipStep {
    // The level that is read, and the last one that is made.
    source: u32,
    last: u32,
    // Rows of level 0 that the list takes at a time.
    first: u32,
    rows: u32,
}

@group(0) @binding(2) var<uniform> mips: Mips;
@group(1) @binding(0) var<uniform> step: MipStep;

// Where level 0 begins in its texture, and its last pixel.
fn part_origin() -> vec2<u32> {
    return mips.origin;
}

fn part_edge() -> vec2<u32> {
    return vec2<u32>(mips.levels[0].width, mips.levels[0].height) - vec2<u32>(1u);
}

fn nearer(a: u32, b: u32) -> u32 {
    return select(min(a, b), max(a, b), REVERSED);
}

// As `sanitized`, but what is no depth counts as near.
fn sanitized_to_near(bits: u32) -> u32 {
    let outside = bits > ONE_BITS && bits != NEGATIVE_ZERO_BITS;
    return select(sanitized(bits), near_bits(), outside);
}

fn four_ends(bits: vec4<u32>) -> Four {
    return Four(ends_of(bits.x), ends_of(bits.y), ends_of(bits.z), ends_of(bits.w));
}

fn joined_four(a: Four, b: Four) -> Four {
    return Four(
        joined(a[0], b[0]), joined(a[1], b[1]), joined(a[2], b[2]), joined(a[3], b[3]));
}

// A level's texel; past the edge that of the edge.
fn stored(level: Level, x: u32, y: u32) -> Ends {
    let column = min(x, level.width - 1u);
    let row = min(y, level.height - 1u);
    return load(level.offset + row * level.stride + column);
}

// Whether texel i of a level of n texels takes a third one along an axis of odd size.
fn takes_third(i: u32, n: u32) -> bool {
    return !EDGE_TEXEL || i + 1u == n;
}

// `pair`, joined with a third texel where texel i of n takes one.
fn with_third(pair: Ends, third: Ends, i: u32, n: u32) -> Ends {
    return select(pair, joined(pair, third), takes_third(i, n));
}

// Nine texels of a row become four, which are texels i to i + 3 of n.
fn halved(
    left: Four, right: Four, ninth: Ends, i: u32, n: u32,
) -> Four {
    let pairs = Four(
        joined(left[0], left[1]), joined(left[2], left[3]),
        joined(right[0], right[1]), joined(right[2], right[3]));
    if !ODD_X {
        return pairs;
    }
    return Four(
        with_third(pairs[0], left[2], i, n),
        with_third(pairs[1], right[0], i + 1u, n),
        with_third(pairs[2], right[2], i + 2u, n),
        with_third(pairs[3], ninth, i + 3u, n));
}

// Rows 2y and 2y + 1 of the level that is read, halved along x, for block column x.
fn halved_rows(level: Level, x: u32, y: u32, n: u32) -> array<Four, 2> {
    let i = BLOCK_QUADS * x;
    if FROM_SOURCE {
        let left = two_rows(2u * x, 2u * y);
        let right = two_rows(2u * x + 1u, 2u * y);
        var ninth = vec2<u32>(0u);
        if ODD_X {
            let more = two_rows(2u * x + 2u, 2u * y);
            ninth = vec2<u32>(more[0].x, more[1].x);
        }
        return array<Four, 2>(
            halved(four_ends(left[0]), four_ends(right[0]), ends_of(ninth.x), i, n),
            halved(four_ends(left[1]), four_ends(right[1]), ends_of(ninth.y), i, n));
    }
    return array<Four, 2>(
        halved_stored_row(level, x, 2u * y, i, n), halved_stored_row(level, x, 2u * y + 1u, i, n));
}

fn halved_stored_row(level: Level, x: u32, y: u32, i: u32, n: u32) -> Four {
    let first = BLOCK * x;
    let left = four_stored(level, first, y);
    let right = four_stored(level, first + VECTOR, y);
    return halved(left, right, stored(level, first + BLOCK, y), i, n);
}

fn four_stored(level: Level, x: u32, y: u32) -> Four {
    return Four(
        stored(level, x, y), stored(level, x + 1u, y),
        stored(level, x + 2u, y), stored(level, x + 3u, y));
}

// Row i of n of the first level that is made: two or three rows, halved along x.
fn first_row(
    pair: array<Four, 2>, third: Four, i: u32, n: u32,
) -> Four {
    let of_pair = joined_four(pair[0], pair[1]);
    if !ODD_Y || !takes_third(i, n) {
        return of_pair;
    }
    return joined_four(of_pair, third);
}

// Stores four texels of a level, or two; rows past its end are left out.
// Columns past its end lie in the padding of the list.
fn store_row(level: Level, x: u32, y: u32, row: Four) {
    if y < level.height {
        store_four(level.offset + y * level.stride + x, row);
    }
}

fn store_pair(level: Level, x: u32, y: u32, a: Ends, b: Ends) {
    if y < level.height {
        let index = level.offset + y * level.stride + x;
        store(index, a);
        store(index + 1u, b);
    }
}

fn quad_ends(top: Four, bottom: Four, k: u32) -> Ends {
    let both = joined_four(top, bottom);
    return select(joined(both[2], both[3]), joined(both[0], both[1]), k == 0u);
}

// A block of the level that is read becomes 4x4 texels of the next one, then 2x2, then one.
@compute @workgroup_size(WORKGROUP, 1)
fn mip_blocks(@builtin(global_invocation_id) id: vec3<u32>) {
    let read = mips.levels[step.source];
    let half = mips.levels[step.source + 1u];
    let x = BLOCK_QUADS * id.x;
    let y = BLOCK_QUADS * id.y;
    if x >= half.width || y >= half.height {
        return;
    }
    let n = half.width;
    let rows_0 = halved_rows(read, id.x, y, n);
    let rows_1 = halved_rows(read, id.x, y + 1u, n);
    let rows_2 = halved_rows(read, id.x, y + 2u, n);
    let rows_3 = halved_rows(read, id.x, y + 3u, n);
    var ninth = rows_3[1];
    if ODD_Y {
        ninth = halved_rows(read, id.x, y + BLOCK_QUADS, n)[0];
    }
    let a = first_row(rows_0, rows_1[0], y, half.height);
    let b = first_row(rows_1, rows_2[0], y + 1u, half.height);
    let c = first_row(rows_2, rows_3[0], y + 2u, half.height);
    let d = first_row(rows_3, ninth, y + 3u, half.height);
    store_row(half, x, y, a);
    store_row(half, x, y + 1u, b);
    store_row(half, x, y + 2u, c);
    store_row(half, x, y + 3u, d);
    if LEVELS == 1u {
        return;
    }
    let quarter = mips.levels[step.source + 2u];
    let top_left = quad_ends(a, b, 0u);
    let top_right = quad_ends(a, b, 1u);
    let bottom_left = quad_ends(c, d, 0u);
    let bottom_right = quad_ends(c, d, 1u);
    store_pair(quarter, 2u * id.x, 2u * id.y, top_left, top_right);
    store_pair(quarter, 2u * id.x, 2u * id.y + 1u, bottom_left, bottom_right);
    if LEVELS == 2u {
        return;
    }
    let eighth = mips.levels[step.source + BLOCK_LOG2];
    let all = joined(joined(top_left, top_right), joined(bottom_left, bottom_right));
    store(eighth.offset + id.y * eighth.stride + id.x, all);
}

// The texel at (x, y) of the level after `read`.
fn made_of(read: Level, made: Level, x: u32, y: u32) -> Ends {
    let edge = vec2<u32>(read.width, read.height) - vec2<u32>(1u);
    let is_odd = vec2<bool>((read.width & 1u) == 1u, (read.height & 1u) == 1u);
    let third = vec2<bool>(takes_third(x, made.width), takes_third(y, made.height)) & is_odd;
    let first = 2u * vec2<u32>(x, y);
    let last = min(first + select(vec2<u32>(1u), vec2<u32>(2u), third), edge);
    var texel = stored(read, first.x, first.y);
    for (var row = first.y; row <= last.y; row += 1u) {
        for (var column = first.x; column <= last.x; column += 1u) {
            texel = joined(texel, stored(read, column, row));
        }
    }
    return texel;
}

// All levels that are left, made by one workgroup: they are less work than another dispatch.
@compute @workgroup_size(WORKGROUP, 1)
fn mip_tail(@builtin(local_invocation_index) lane: u32) {
    for (var source_number = step.source; source_number < step.last; source_number += 1u) {
        let read = mips.levels[source_number];
        let made = mips.levels[source_number + 1u];
        for (var i = lane; i < made.width * made.height; i += WORKGROUP) {
            let x = i % made.width;
            let y = i / made.width;
            store(made.offset + y * made.stride + x, made_of(read, made, x, y));
        }
        storageBarrier();
    }
}

// Some rows of level 0, sanitized: an invocation takes four columns of two rows.
@compute @workgroup_size(WORKGROUP, 1)
fn mip_level_0(@builtin(global_invocation_id) id: vec3<u32>) {
    let level = mips.levels[0];
    let row = 2u * id.y;
    let y = step.first + row;
    if VECTOR * id.x >= level.width || row >= step.rows {
        return;
    }
    let rows = two_rows(id.x, y);
    let index = row * level.stride + VECTOR * id.x;
    store_four(index, four_ends(rows[0]));
    if row + 1u < step.rows {
        store_four(index + level.stride, four_ends(rows[1]));
    }
}
