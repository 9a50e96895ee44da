// Counts of pixels in large rectangles: a workgroup counts one after the other.
//
// Coarse levels are walked as a descent walks, and what is open at the finest of them is looked at
// pixel by pixel.
// The texels that are left to enter are shared out among the invocations, so none waits for others.
// Source: Greene, Kass and Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993.
//
// What is used here and defined elsewhere:
//
// - `pixels.wgsl`: `prepare`, `write_counts`, `large`
// - `pixels_look.wgsl`: `look_at_texels`, `look_at_pixels`

// Invocations of a workgroup, which count one rectangle together.
// Twin: `TEAM` in `crates/hiz_core/src/cull/pixels.rs`.
const TEAM: u32 = 8u;
// Those that count a huge one; they wait for one another, which a processor pays for.
// Twin: `LARGE_TEAM` there.
const LARGE_TEAM: u32 = 64u;

// Of coarse levels every other one is read.
// So the children of a texel are four rows of four.
const STEP: u32 = 2u;
const CHILD_ROWS: u32 = 1u << STEP;

// So many rows of four texels are looked at between two barriers, at most.
const CHUNK: u32 = 64u;
// So many texels they leave to enter, at most.
const LISTED: u32 = VECTOR * CHUNK;
// A list for each level that is read.
const LISTS: u32 = MAX_LEVELS / STEP;
// What the loops of an invocation take in a round beside its rows and blocks, at most: the round
// itself, and one for either loop.
const AROUND_ROUND: u32 = 3u;
// A texel's column and row fit one word: the level is 2 or above, of at most 2^15 pixels.
const ROW_SHIFT: u32 = 16u;
const COLUMN_MASK: u32 = (1u << ROW_SHIFT) - 1u;

var<workgroup> large_here: u32;
var<workgroup> rectangle: vec4<u32>;
// The texels that are left to enter, of one level after the other from the finest one on.
var<workgroup> lists: array<u32, LISTED * LISTS>;
// How many texels have been listed, ever.
var<workgroup> listed: atomic<u32>;
var<workgroup> listed_here: u32;
// What each invocation has counted.
var<workgroup> parts: array<vec4<u32>, LARGE_TEAM>;

// A place of a row of four in an area that is `width` of them wide.
fn place_in(t: u32, width: u32) -> vec2<u32> {
    return vec2<u32>(t % width, t / width);
}

// The number, from left and from above, of a block of 4x4 pixels in the listed texels.
// A texel has 4^sides_log2 of them.
fn block_of(t: u32, sides_log2: u32) -> vec2<u32> {
    let texel = lists[t >> (2u * sides_log2)];
    let mask = (1u << sides_log2) - 1u;
    let inner = vec2<u32>(t & mask, (t >> sides_log2) & mask);
    return (vec2<u32>(texel & COLUMN_MASK, texel >> ROW_SHIFT) << vec2<u32>(sides_log2)) + inner;
}

// Lists texel k of the four at `at`, if its bit is set; returns where the next one goes.
fn list_texel(bits: u32, k: u32, at: vec2<u32>, place: u32) -> u32 {
    if (bits & (1u << k)) == 0u {
        return place;
    }
    lists[place] = (at.y << ROW_SHIFT) | (VECTOR * at.x + k);
    return place + 1u;
}

// Counts the 4x4 pixels of a block, as far as they are in the rectangle r.
//
// They are no loop, because lavapipe takes each loop once too often.
fn look_at_block(
    planes: ptr<function, PixelPlanes>, block: vec2<u32>, r: vec4<u32>, walk: ptr<function, Walk>,
) {
    let at_0 = vec2<u32>(block.x, CHILD_ROWS * block.y);
    let at_1 = at_0 + vec2<u32>(0u, 1u);
    let at_2 = at_0 + vec2<u32>(0u, 2u);
    let at_3 = at_0 + vec2<u32>(0u, 3u);
    // All reads come first, so that each waits while others do.
    let depths_0 = read_depths(at_0);
    let depths_1 = read_depths(at_1);
    let depths_2 = read_depths(at_2);
    let depths_3 = read_depths(at_3);
    look_at_pixels(planes, at_0, depths_0, r, walk);
    look_at_pixels(planes, at_1, depths_1, r, walk);
    look_at_pixels(planes, at_2, depths_2, r, walk);
    look_at_pixels(planes, at_3, depths_3, r, walk);
}

// Counts a rectangle, together with the other invocations, of which there are `team`.
//
// The end of `most` iterations of its loops ends it like that of the instance's budget.
fn count_together(
    planes: ptr<function, PixelPlanes>, r: vec4<u32>, most: u32, team: u32, lane: u32,
) -> Walk {
    var walk = Walk(0u, 0u, 0u, 0u);
    var left = counting.budget;
    var iterations = most;
    let base = max(pyramid.first_stored, STEP);
    // The level to begin with: the finest one with few texels.
    var top = 0u;
    var corner = vec2<u32>(r.x >> VECTOR_LOG2, r.y);
    var width = (r.z >> VECTOR_LOG2) - corner.x + 1u;
    var rows = width * (r.w - r.y + 1u);
    for (var level = base; level <= pyramid.last_stored && (top == 0u || rows > CHUNK);
        level += STEP) {
        top = level;
        corner = (r.xy >> vec2<u32>(level)) >> vec2<u32>(VECTOR_LOG2, 0u);
        let end = (r.zw >> vec2<u32>(level)) >> vec2<u32>(VECTOR_LOG2, 0u);
        width = end.x - corner.x + 1u;
        rows = width * (end.y - corner.y + 1u);
    }
    if top == 0u {
        // No level is stored.
        let high = (r.w >> STEP) - (r.y >> STEP) + 1u;
        let all = select(iterations * team, width * high, width * high / team < iterations);
        let blocks = min(all, left / CHILD_ROWS);
        var t = lane;
        loop {
            if t < blocks {
                look_at_block(planes, (r.xy >> vec2<u32>(STEP)) + place_in(t, width), r, &walk);
            }
            t += team;
            continuing {
                break if t >= blocks;
            }
        }
        return walk;
    }

    // How many texels each list has.
    var counts_of_lists: array<u32, LISTS>;
    // Which of them have some, a bit for each.
    var filled = 0u;
    // The list to enter next; LISTS: the first level is next.
    var list = LISTS;
    // How many rows of the first level have been looked at.
    var next = 0u;
    // How many texels had been listed before.
    var before = workgroupUniformLoad(&listed_here);
    // What the rows of a round take.
    let of_round = AROUND_ROUND + CHUNK / team;
    loop {
        if iterations < of_round {
            left = 0u;
        }
        iterations -= min(of_round, iterations);
        let is_top = list == LISTS;
        var level = top;
        var begin = next;
        var chunk = min(CHUNK, rows - next);
        if is_top {
            next += chunk;
        } else {
            level = base + STEP * (list - 1u);
            let entered = min(counts_of_lists[list], CHUNK / CHILD_ROWS);
            counts_of_lists[list] -= entered;
            filled &= ~select(0u, 1u << list, counts_of_lists[list] == 0u);
            begin = list * LISTED + counts_of_lists[list];
            chunk = CHILD_ROWS * entered;
        }
        chunk = min(chunk, left);
        left -= chunk;
        let below = (level - base) / STEP;
        var t = lane;
        loop {
            if t < chunk {
                var at = corner + place_in(begin + t, width);
                if !is_top {
                    let texel = lists[begin + t / CHILD_ROWS];
                    at = vec2<u32>(
                        texel & COLUMN_MASK, CHILD_ROWS * (texel >> ROW_SHIFT) + t % CHILD_ROWS);
                }
                let bits = look_at_texels(planes, level, at, r, &walk);
                var place = below * LISTED + atomicAdd(&listed, countOneBits(bits)) - before;
                place = list_texel(bits, 0u, at, place);
                place = list_texel(bits, 1u, at, place);
                place = list_texel(bits, 2u, at, place);
                place = list_texel(bits, 3u, at, place);
            }
            t += team;
            continuing {
                break if t >= chunk;
            }
        }
        workgroupBarrier();
        if lane == 0u {
            listed_here = atomicLoad(&listed);
        }
        let after = workgroupUniformLoad(&listed_here);
        counts_of_lists[below] = after - before;
        filled |= select(0u, 1u << below, after > before);
        before = after;

        // The pixels of what is open at the finest coarse level.
        let blocks_log2 = base - STEP;
        let reads = CHILD_ROWS << (2u * blocks_log2);
        let of_texel = max((1u << (2u * blocks_log2)) / team, 1u);
        let entered = min(counts_of_lists[0], min(left / reads, iterations / of_texel));
        let blocks = entered << (2u * blocks_log2);
        iterations -= (blocks + team - 1u) / team;
        t = lane;
        loop {
            if t < blocks {
                look_at_block(planes, block_of(t, blocks_log2), r, &walk);
            }
            t += team;
            continuing {
                break if t >= blocks;
            }
        }
        left = select(left - entered * reads, 0u, entered < counts_of_lists[0]);
        counts_of_lists[0] = 0u;
        filled &= ~1u;
        // The finest level with texels to enter is next, and at last the first level.
        list = select(LISTS, firstTrailingBit(filled), filled != 0u);
        workgroupBarrier();
        continuing {
            break if left == 0u || (list == LISTS && next == rows);
        }
    }
    return walk;
}

// Counts every `groups`-th large rectangle, from number `group` on, by a workgroup of `team`: the
// huge ones, or the others.
fn count_large(team: u32, is_huge: bool, group: u32, groups: u32, lane: u32) {
    begin();
    if lane == 0u {
        large_here = atomicLoad(&large[select(0u, 1u, is_huge)]);
        listed_here = 0u;
        atomicStore(&listed, 0u);
    }
    let count = workgroupUniformLoad(&large_here);
    if group >= count {
        return;
    }
    let most = select(counting.iterations / LARGE_OF_TEAM, counting.iterations, is_huge);
    var k = group;
    loop {
        let place = select(LISTED_FROM + k, arrayLength(&large) - 1u - k, is_huge);
        count_one(atomicLoad(&large[place]), most, team, lane);
        k += groups;
        continuing {
            break if k >= count;
        }
    }
}

// Counts a large rectangle, by at most so many iterations.
fn count_one(i: u32, most: u32, team: u32, lane: u32) {
    var planes: PixelPlanes;
    let prepared = prepare(i, &planes);
    if lane == 0u {
        rectangle = prepared.rectangle;
    }
    let r = workgroupUniformLoad(&rectangle);
    let walk = count_together(&planes, r, most, team, lane);
    parts[lane] = vec4<u32>(walk.touched, walk.hidden, walk.open, walk.done);
    workgroupBarrier();
    if lane == 0u {
        var sum = parts[0];
        for (var part = 1u; part < team; part += 1u) {
            sum += parts[part];
        }
        var found = prepared.counts;
        if prepared.is_open {
            found = counts_of(Walk(sum.x, sum.y, sum.z, sum.w), r);
        }
        write_counts(i, found);
    }
}

@compute @workgroup_size(TEAM)
fn count_of_many_pixels(
    @builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    count_large(TEAM, false, group.y * groups.x + group.x, groups.x * groups.y, lane);
}

@compute @workgroup_size(LARGE_TEAM)
fn count_of_most_pixels(
    @builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    count_large(LARGE_TEAM, true, group.y * groups.x + group.x, groups.x * groups.y, lane);
}
