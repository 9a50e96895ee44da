// One coarse level, made alone and straight from the depth image in one dispatch.
// A texel of it takes 16x16 pixels or more.
//
// An invocation reads up to 32x32 pixels; larger texels are shared by a workgroup.
//
// The usual way, atomicMin on float bits, has two faults that this one avoids:
//
// - Bits are sanitized before they are compared, so -0 and NaN cannot break the integer order.
// - No value begins as a depth of 1, which would cap larger ones.

// True: a workgroup shares a texel.
override SHARED: bool;
// True: each iteration reads two rows of blocks.
//
// Lavapipe ends all loops of eight invocations once they have taken 65,535 iterations together, and
// then the blocks behind would not count.
// A part of level 14 has 256 rows of 256 blocks, which take 256 * 257 iterations one by one, and
// 128 * 257 two by two.
// A part of level 13 takes 128 * 129, and no image of lavapipe has a level 15.
override BY_TWO_ROWS: bool;

var<workgroup> parts: array<Ends, WORKGROUP>;

// The ends of a block.
fn ends_of_block(at: vec2<u32>) -> Ends {
    let rows = source_quads(at);
    let by_row = in_row(joined4(rows[0]), joined4(rows[1]), joined4(rows[2]), joined4(rows[3]));
    return joined4(by_row);
}

// The ends of `side` x `side` blocks.
fn ends_of(begin: vec2<u32>, side: u32) -> Ends {
    let image = pyramid.levels[0];
    // Blocks past the edge repeat it: a part that begins there reads its own first block.
    let blocks = (vec2<u32>(image.width, image.height) + vec2<u32>(BLOCK - 1u)) / BLOCK;
    let end = max(min(begin + vec2<u32>(side), blocks), begin + vec2<u32>(1u));
    var ends = no_ends();
    for (var y = begin.y; y < end.y; y += select(1u, 2u, BY_TWO_ROWS)) {
        for (var x = begin.x; x < end.x; x += 1u) {
            let block = ends_of_block(vec2<u32>(x, y));
            ends = joined(ends, block);
            if BY_TWO_ROWS {
                let below = ends_of_block(vec2<u32>(x, min(y + 1u, end.y - 1u)));
                ends = joined(ends, below);
            }
        }
    }
    return ends;
}

@compute @workgroup_size(WORKGROUP, 1)
fn reduce_coarse(
    @builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    if REGION && lane == 0u && group.x == 0u && group.y == 0u {
        write_header();
    }
    let level = pyramid.levels[step.last];
    // Blocks along a side of a texel.
    let side = 1u << (step.last - BLOCK_LOG2);
    if !SHARED {
        let at = first_block() + place_of(group.xy, lane);
        if at.x < step.end.x && at.y < step.end.y {
            let index = level.offset + at.y * level.stride + ENDS * at.x;
            store_ends(index, ends_of(at * side, side));
        }
        return;
    }
    // Each invocation takes one of SIDE x SIDE parts of the texel.
    let part = side >> SIDE_LOG2;
    let texel = first_block() + group.xy;
    parts[lane] = ends_of(texel * side + place_in_square(lane) * part, part);
    workgroupBarrier();
    if lane == 0u {
        var ends = parts[0];
        for (var i = 1u; i < WORKGROUP; i += 1u) {
            ends = joined(ends, parts[i]);
        }
        store_ends(level.offset + texel.y * level.stride + ENDS * texel.x, ends);
    }
}
