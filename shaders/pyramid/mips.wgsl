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
// Nearest depths alone are the farthest in the other convention, invalid pixels included.
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

// Nine texels of a row become four, which are texels i to i + 3 of n.
fn halved_row(left: Ends4, right: Ends4, ninth: Ends, i: u32, n: u32) -> Ends4 {
    let pairs = joined_rows(firsts(left, right), seconds(left, right));
    if !ODD_X {
        return pairs;
    }
    let takes = vec4<bool>(
        takes_third(i, n), takes_third(i + 1u, n), takes_third(i + 2u, n), takes_third(i + 3u, n));
    return chosen(pairs, joined_rows(pairs, thirds(left, right, ninth)), takes);
}

// Rows 2y and 2y + 1 of the level that is read, halved along x, for block column x.
fn halved_rows(level: Level, x: u32, y: u32, n: u32) -> array<Ends4, 2> {
    let i = BLOCK_QUADS * x;
    if FROM_SOURCE {
        let left = two_rows(2u * x, 2u * y);
        let right = two_rows(2u * x + 1u, 2u * y);
        var more = array<vec4<u32>, 2>();
        if ODD_X {
            more = two_rows(2u * x + 2u, 2u * y);
        }
        let above = ends_of_pixels(more[0].xxxx);
        let below = ends_of_pixels(more[1].xxxx);
        return array<Ends4, 2>(
            halved_row(pixels_in_row(left[0]), pixels_in_row(right[0]), above, i, n),
            halved_row(pixels_in_row(left[1]), pixels_in_row(right[1]), below, i, n));
    }
    return array<Ends4, 2>(
        halved_stored_row(level, x, 2u * y, n), halved_stored_row(level, x, 2u * y + 1u, n));
}

fn halved_stored_row(level: Level, x: u32, y: u32, n: u32) -> Ends4 {
    let first = BLOCK * x;
    let left = four_stored(level, first, y);
    let right = four_stored(level, first + VECTOR, y);
    return halved_row(left, right, stored(level, first + BLOCK, y), BLOCK_QUADS * x, n);
}

fn four_stored(level: Level, x: u32, y: u32) -> Ends4 {
    return in_row(
        stored(level, x, y), stored(level, x + 1u, y),
        stored(level, x + 2u, y), stored(level, x + 3u, y));
}

// Row i of n of the first level that is made: two or three rows, halved along x.
fn first_row(pair: array<Ends4, 2>, third: Ends4, i: u32, n: u32) -> Ends4 {
    let of_pair = joined_rows(pair[0], pair[1]);
    if !ODD_Y || !takes_third(i, n) {
        return of_pair;
    }
    return joined_rows(of_pair, third);
}

// Stores four texels of a level, or two; rows past its end are left out.
// Columns past its end lie in the padding of the list.
fn store_row(level: Level, x: u32, y: u32, row: Ends4) {
    if y < level.height {
        store_four(level.offset + y * level.stride + x, row);
    }
}

fn store_half_row(level: Level, x: u32, y: u32, row: Ends2) {
    if y < level.height {
        store_pair(level.offset + y * level.stride + x, row);
    }
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
    let top = halved(a, b);
    let bottom = halved(c, d);
    store_half_row(quarter, 2u * id.x, 2u * id.y, top);
    store_half_row(quarter, 2u * id.x, 2u * id.y + 1u, bottom);
    if LEVELS == 2u {
        return;
    }
    let eighth = mips.levels[step.source + BLOCK_LOG2];
    let all = joined4(pairs_in_row(top, bottom));
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
    store_four(index, pixels_in_row(rows[0]));
    if row + 1u < step.rows {
        store_four(index + level.stride, pixels_in_row(rows[1]));
    }
}
