// The walk over a tile, for counts of pixels.
//
// Coarse levels are walked as a descent walks, with four texels of a row at a time.
// A texel that is surely behind or surely untouched decides all its pixels of the tile.
// What is open at the finest coarse level goes to a list, whose pixels are looked at then.
// Source: Greene, Kass and Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993.
//
// The two loops are apart because a driver that runs many invocations in step takes all ways
// through a loop: single pixels would pay for the coarse levels.
//
// What is used here and defined elsewhere:
//
// - `pixels_sure.wgsl`: `place_of`, `beyond`, `sure_of`
// - `pixels_row_*.wgsl`: `texel_row`, `nearest_row`, `pixel_row`, `near_pixel_row`

// True: a pixel of level 0 stands for all that its surface shows.
// False: it is the farthest of several samples.
// Then only the nearest one says what is behind the volume.
override ONE_SAMPLE: bool;

// Of coarse levels every other one is read.
// So the children of a texel are four rows of four.
const STEP: u32 = 2u;
// At the first level, a tile has fewer texels than this along its longer side.
const TOP_TEXELS: u32 = 12u;
// The bits of a level's four texels among those that are left to enter.
const ROW_BITS: u32 = 4u;
const ROW_MASK: u32 = (1u << ROW_BITS) - 1u;

// How many rows of four open texels a list holds.
const OPEN_ROWS: u32 = 16u;
// A row's number and its place fit one word: the level is 2 or above, of at most 2^15 pixels.
const OPEN_ROW_SHIFT: u32 = 16u;
const OPEN_GROUP_MASK: u32 = (1u << (OPEN_ROW_SHIFT - ROW_BITS)) - 1u;
// More texels than any level has.
const NO_BORDER: u32 = 0xffffffffu;

// No depth: it says nothing.
const UNKNOWN_BITS: u32 = 0xffffffffu;

// The pixels of four texels that `chosen` names.
fn pixels_of(chosen: vec4<bool>, pixels: vec4<u32>) -> u32 {
    let n = select(vec4<u32>(0u), pixels, chosen);
    return n.x + n.y + n.z + n.w;
}

// What a walk over a tile has counted, and what it may still read.
struct Walk {
    touched: u32,
    hidden: u32,
    open: u32,
    // Pixels that are decided, touched or not.
    done: u32,
    left: u32,
}

// Counts four texels, as far as they are `counted`, with `here` pixels each.
fn add(walk: ptr<function, Walk>, sure: Sure, counted: vec4<bool>, here: vec4<u32>) {
    let is_touched = counted & !sure.untouched;
    (*walk).touched += pixels_of(is_touched, here);
    (*walk).hidden += pixels_of(sure.hidden & is_touched, here);
    (*walk).open += pixels_of(sure.open & is_touched, here);
}

// The texels of level `base` that are left to look at pixel by pixel.
// Of four in a row there is one number: their row, their place in it, and a bit for each.
struct Open {
    list: array<u32, OPEN_ROWS>,
    count: u32,
}

// Where a walk over the coarse levels stands.
struct Coarse {
    level: u32,
    // The level that it began with.
    top: u32,
    // The finest coarse level.
    base: u32,
    at: vec2<u32>,
    // Of each level: which of the four texels are left to enter.
    to_enter: u32,
    is_over: bool,
}

// Where a level's bits begin among those that are left to enter.
fn bits_of(level: u32) -> u32 {
    return ROW_BITS * (level / STEP);
}

// Walks over the coarse levels of the tile first..=last until the list of open texels is full.
fn read_coarse(
    planes: ptr<function, PixelPlanes>, first: vec2<u32>, last: vec2<u32>,
    coarse: ptr<function, Coarse>, open: ptr<function, Open>, walk: ptr<function, Walk>,
) {
    var level = (*coarse).level;
    let top = (*coarse).top;
    let base = (*coarse).base;
    var at = (*coarse).at;
    var to_enter = (*coarse).to_enter;
    var is_over = (*coarse).is_over;
    while !is_over && (*walk).left > 0u && (*open).count < OPEN_ROWS {
        (*walk).left -= 1u;
        // The pixels of the four texels, cut at the tile.
        let columns = vec4<u32>(VECTOR * at.x) + vec4<u32>(0u, 1u, 2u, 3u);
        let begin = max(columns << vec4<u32>(level), vec4<u32>(first.x));
        let end = min((columns + vec4<u32>(1u)) << vec4<u32>(level), vec4<u32>(last.x + 1u));
        let rows = vec2<u32>(
            max(at.y << level, first.y), min((at.y + 1u) << level, last.y + 1u));
        let is_there = begin < end;
        let here = select(vec4<u32>(0u), (end - begin) * (rows.y - rows.x), is_there);
        let place = place_of(planes, begin, end, rows);
        let raw = texel_row(level, at.x, at.y);
        var near = vec4<u32>(UNKNOWN_BITS);
        if NEAREST {
            near = nearest_row(level, at.x, at.y);
        }
        let outline = beyond(planes, place, f32(1u << level) + 2.0 * view.reach);
        let sure = sure_of(planes, place, outline[0], raw, near);
        // A texel with untouched pixels is entered, so that these are not counted.
        let is_whole = outline[1] <= vec4<f32>(TEXEL_FLOOR);
        let is_decided = sure.untouched | ((sure.hidden | sure.open) & is_whole);
        add(walk, sure, is_decided & is_there, here);
        (*walk).done += pixels_of(is_decided, here);
        let left = select(
            vec4<u32>(0u), vec4<u32>(1u) << vec4<u32>(0u, 1u, 2u, 3u), !is_decided & is_there);
        let bits = left.x | left.y | left.z | left.w;
        if level > base {
            to_enter |= bits << bits_of(level);
        } else if bits != 0u {
            (*open).list[(*open).count] = (at.y << OPEN_ROW_SHIFT) | (at.x << ROW_BITS) | bits;
            (*open).count += 1u;
        }

        // On to the first texel to enter, or to the next row of texels.
        loop {
            let entered = (to_enter >> bits_of(level)) & ROW_MASK;
            if entered != 0u {
                let column = VECTOR * at.x + countTrailingZeros(entered);
                to_enter ^= (entered & (~entered + 1u)) << bits_of(level);
                level -= STEP;
                at = max(vec2<u32>(column, at.y) << vec2<u32>(STEP), first >> vec2<u32>(level));
                at.x >>= VECTOR_LOG2;
                break;
            }
            let is_top = level == top;
            let parent = vec2<u32>((VECTOR * at.x) >> STEP, at.y >> STEP);
            let border = select(
                ((parent + vec2<u32>(1u)) << vec2<u32>(STEP)) - vec2<u32>(1u),
                vec2<u32>(NO_BORDER), vec2<bool>(is_top));
            let end_here = min(border, last >> vec2<u32>(level));
            if VECTOR * (at.x + 1u) <= end_here.x {
                at.x += 1u;
                break;
            }
            if at.y < end_here.y {
                let begin_here = select(parent.x << STEP, 0u, is_top);
                at = vec2<u32>(max(begin_here, first.x >> level) >> VECTOR_LOG2, at.y + 1u);
                break;
            }
            if is_top {
                is_over = true;
                break;
            }
            at = vec2<u32>(parent.x >> VECTOR_LOG2, parent.y);
            level += STEP;
        }
    }
    (*coarse).level = level;
    (*coarse).at = at;
    (*coarse).to_enter = to_enter;
    (*coarse).is_over = is_over;
}

// A rectangle of pixels: the first and the last.
struct Block {
    first: vec2<u32>,
    last: vec2<u32>,
}

// The next open texel, cut at the tile; `entry` is what is left of its row.
fn next_block(entry: ptr<function, u32>, base: u32, first: vec2<u32>, last: vec2<u32>) -> Block {
    let bits = *entry & ROW_MASK;
    let group = (*entry >> ROW_BITS) & OPEN_GROUP_MASK;
    let texel = vec2<u32>(VECTOR * group + countTrailingZeros(bits), *entry >> OPEN_ROW_SHIFT);
    *entry &= *entry - 1u;
    return Block(
        max(texel << vec2<u32>(base), first),
        min(((texel + vec2<u32>(1u)) << vec2<u32>(base)) - vec2<u32>(1u), last));
}

// Looks at each pixel of the open texels, or of all of the tile if `is_all`.
fn read_pixels(
    planes: ptr<function, PixelPlanes>, first: vec2<u32>, last: vec2<u32>, base: u32, is_all: bool,
    open: ptr<function, Open>, walk: ptr<function, Walk>,
) {
    var i = 0u;
    var entry = 0u;
    var block = Block(first, last);
    var at = vec2<u32>(0u);
    var is_over = false;
    if is_all {
        at = vec2<u32>(first.x >> VECTOR_LOG2, first.y);
    } else {
        entry = (*open).list[0];
        is_over = (*open).count == 0u;
        block = next_block(&entry, base, first, last);
        at = vec2<u32>(block.first.x >> VECTOR_LOG2, block.first.y);
    }
    while !is_over && (*walk).left > 0u {
        (*walk).left -= 1u;
        let columns = vec4<u32>(VECTOR * at.x) + vec4<u32>(0u, 1u, 2u, 3u);
        let is_there =
            columns >= vec4<u32>(block.first.x) & columns <= vec4<u32>(block.last.x);
        let place =
            place_of(planes, columns, columns + vec4<u32>(1u), vec2<u32>(at.y, at.y + 1u));
        let raw = pixel_row(at.x, at.y);
        var near = raw;
        if !ONE_SAMPLE {
            near = near_pixel_row(at.x, at.y);
        }
        let outline = beyond(planes, place, 0.0);
        let sure = sure_of(planes, place, outline[0], raw, near);
        add(walk, sure, is_there, vec4<u32>(1u));
        (*walk).done += min(VECTOR * at.x + VECTOR_MASK, block.last.x) + 1u
            - max(VECTOR * at.x, block.first.x);
        at.x += 1u;
        if VECTOR * at.x > block.last.x {
            at = vec2<u32>(block.first.x >> VECTOR_LOG2, at.y + 1u);
            if at.y > block.last.y {
                if (entry & ROW_MASK) == 0u {
                    i += 1u;
                    is_over = is_all || i >= (*open).count;
                    entry = (*open).list[min(i, OPEN_ROWS - 1u)];
                }
                block = next_block(&entry, base, first, last);
                at = vec2<u32>(block.first.x >> VECTOR_LOG2, block.first.y);
            }
        }
    }
}

// Counts the pixels first..=last of a tile, with at most `budget` reads.
fn count_tile(
    planes: ptr<function, PixelPlanes>, first: vec2<u32>, last: vec2<u32>, budget: u32,
) -> PixelCounts {
    // Every other level from `base` on.
    let base = max(first_stored, STEP);
    let side = max(last.x - first.x, last.y - first.y);
    var top = 0u;
    for (var above = base; above <= last_stored && (side >> top) >= TOP_TEXELS; above += STEP) {
        top = above;
    }
    var walk = Walk(0u, 0u, 0u, 0u, budget);
    var open: Open;
    let at = vec2<u32>((first.x >> top) >> VECTOR_LOG2, first.y >> top);
    var coarse = Coarse(top, top, base, at, 0u, top == 0u);
    loop {
        open.count = 0u;
        read_coarse(planes, first, last, &coarse, &open, &walk);
        read_pixels(planes, first, last, base, top == 0u, &open, &walk);
        if coarse.is_over || walk.left == 0u {
            break;
        }
    }
    // What the budget has left.
    let sides = last - first + vec2<u32>(1u);
    let undecided = sides.x * sides.y - walk.done;
    let inside = walk.touched - walk.hidden - walk.open + undecided;
    return PixelCounts(walk.touched + undecided, walk.hidden, inside, walk.open, undecided);
}

