// One coarse level alone, straight from the depth image, in one dispatch.
// It serves levels whose texels stand for 16x16 pixels or more.
//
// A texel of up to 32x32 pixels is made by one invocation.
// A larger one is shared by the 64 invocations of a workgroup.
//
// The usual atomicMin on float bits has two faults that this avoids.
// Bits are sanitized before they are compared, so -0 and NaN cannot break the integer order.
// Nothing begins with a depth of 1, which would cap larger ones.

// True: a texel is shared by a workgroup.
override SHARED: bool;

const WORKGROUP: u32 = 64u;
// The workgroup's invocations along a side of its texel (`place_in_square`).
const SIDE_LOG2: u32 = 3u;

var<workgroup> parts: array<u32, WORKGROUP>;

// The farthest depth of `side` x `side` blocks of 8x8 pixels.
fn farthest_of(begin: vec2<u32>, side: u32) -> u32 {
    let image = pyramid.levels[0];
    // What lies past the edge repeats it: a part that begins there takes its own first block.
    let blocks = (vec2<u32>(image.width, image.height) + vec2<u32>(7u)) / 8u;
    let end = max(min(begin + vec2<u32>(side), blocks), begin + vec2<u32>(1u));
    var bits = near_bits();
    for (var y = begin.y; y < end.y; y += 1u) {
        for (var x = begin.x; x < end.x; x += 1u) {
            let rows = source_quads(vec2<u32>(x, y));
            let by_row = vec4<u32>(farthest4(rows[0]), farthest4(rows[1]), farthest4(rows[2]), farthest4(rows[3]));
            bits = farthest(bits, farthest4(by_row));
        }
    }
    return bits;
}

@compute @workgroup_size(64, 1)
fn reduce_coarse(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    if lane == 0u && group.x == 0u && group.y == 0u {
        chunk_0[0] = vec4<u32>(step.reduction, 0u, 0u, 0u);
    }
    let level = pyramid.levels[step.last];
    // Blocks along a side of a texel.
    let side = 1u << (step.last - 3u);
    if !SHARED {
        let at = place_of(group.xy, lane);
        if at.x < step.blocks.x && at.y < step.blocks.y {
            store(level.offset + at.y * level.stride + at.x, farthest_of(at * side, side));
        }
        return;
    }
    let part = side >> SIDE_LOG2;
    parts[lane] = farthest_of(group.xy * side + place_in_square(lane) * part, part);
    workgroupBarrier();
    if lane == 0u {
        var bits = parts[0];
        for (var i = 1u; i < WORKGROUP; i += 1u) {
            bits = farthest(bits, parts[i]);
        }
        store(level.offset + group.y * level.stride + group.x, bits);
    }
}
