// What four pixels, or four texels of a level, of one row say about a volume.
//
// A texel that is surely behind or surely untouched decides all its pixels of the rectangle.
//
// What is used here and defined elsewhere:
//
// - `pixels_sure.wgsl`: `place_of`, `outline_of`, `sure_of`
// - `pixels_row_*.wgsl`: `texel_row`, `nearest_row`, `pixel_row`, `near_pixel_row`

// True: a pixel of level 0 stands for all that its surface shows.
// False: it is the farthest of several samples.
// Then only the nearest one says what is behind the volume.
override ONE_SAMPLE: bool;

// No depth: it says nothing.
const UNKNOWN_BITS: u32 = 0xffffffffu;

// The pixels of four texels that `chosen` names.
fn pixels_of(chosen: vec4<bool>, pixels: vec4<u32>) -> u32 {
    let n = select(vec4<u32>(0u), pixels, chosen);
    return n.x + n.y + n.z + n.w;
}

// What of a rectangle has been counted.
struct Walk {
    touched: u32,
    hidden: u32,
    open: u32,
    // Pixels that are decided, touched or not.
    done: u32,
}

// Counts four texels, as far as they are `counted`, with `here` pixels each.
fn add(walk: ptr<function, Walk>, sure: Sure, counted: vec4<bool>, here: vec4<u32>) {
    let is_touched = counted & !sure.untouched;
    (*walk).touched += pixels_of(is_touched, here);
    (*walk).hidden += pixels_of(sure.hidden & is_touched, here);
    (*walk).open += pixels_of(sure.open & is_touched, here);
}

// The counts of the rectangle r; what the budget has left out of it is undecided.
fn counts_of(walk: Walk, r: vec4<u32>) -> PixelCounts {
    let undecided = (r.z - r.x + 1u) * (r.w - r.y + 1u) - walk.done;
    let inside = walk.touched - walk.hidden - walk.open + undecided;
    return PixelCounts(walk.touched + undecided, walk.hidden, inside, walk.open, undecided);
}

// Four pixels of a row, as given: their depths, and those of their nearest samples.
struct Depths {
    far: vec4<u32>,
    near: vec4<u32>,
}

// The depths of row at.y and of the four columns from 4 at.x on.
fn read_depths(at: vec2<u32>) -> Depths {
    let raw = pixel_row(at.x, at.y);
    if ONE_SAMPLE {
        return Depths(raw, raw);
    }
    return Depths(raw, near_pixel_row(at.x, at.y));
}

// Counts these pixels, as far as they are in the rectangle from r.xy to r.zw.
fn look_at_pixels(
    planes: ptr<function, PixelPlanes>, at: vec2<u32>, depths: Depths, r: vec4<u32>,
    walk: ptr<function, Walk>,
) {
    let columns = vec4<u32>(VECTOR * at.x) + vec4<u32>(0u, 1u, 2u, 3u);
    let is_there = columns >= vec4<u32>(r.x) & columns <= vec4<u32>(r.z)
        & vec4<bool>(at.y >= r.y && at.y <= r.w);
    let place = place_of(planes, columns, columns + vec4<u32>(1u), vec2<u32>(at.y, at.y + 1u));
    let outline = outline_of(planes, place, 0.0);
    let sure = sure_of(planes, place, outline.all, depths.far, depths.near);
    add(walk, sure, is_there, vec4<u32>(1u));
    (*walk).done += pixels_of(is_there, vec4<u32>(1u));
}

// Counts what texels of a level decide, in row at.y and in the four columns from 4 at.x on.
// Returns which of them are left to enter, a bit for each.
// Pixels count from r.xy to r.zw.
fn look_at_texels(
    planes: ptr<function, PixelPlanes>, level: u32, at: vec2<u32>, r: vec4<u32>,
    walk: ptr<function, Walk>,
) -> u32 {
    let first = r.xy;
    let last = r.zw;
    // The pixels of the four texels, cut at the rectangle.
    let columns = vec4<u32>(VECTOR * at.x) + vec4<u32>(0u, 1u, 2u, 3u);
    let begin = max(columns << vec4<u32>(level), vec4<u32>(first.x));
    let end = min((columns + vec4<u32>(1u)) << vec4<u32>(level), vec4<u32>(last.x + 1u));
    let rows = vec2<u32>(max(at.y << level, first.y), min((at.y + 1u) << level, last.y + 1u));
    let is_there = begin < end & vec4<bool>(rows.x < rows.y);
    let here = select(vec4<u32>(0u), (end - begin) * (rows.y - rows.x), is_there);
    let place = place_of(planes, begin, end, rows);
    let raw = texel_row(level, at.x, at.y);
    var near = vec4<u32>(UNKNOWN_BITS);
    if NEAREST {
        near = nearest_row(level, at.x, at.y);
    }
    let outline = outline_of(planes, place, f32(1u << level) + 2.0 * view.reach);
    let sure = sure_of(planes, place, outline.all, raw, near);
    // A texel with untouched pixels is entered, so that these are not counted.
    let is_decided = sure.untouched | ((sure.hidden | sure.open) & !outline.some);
    add(walk, sure, is_decided & is_there, here);
    (*walk).done += pixels_of(is_decided, here);
    let left = select(
        vec4<u32>(0u), vec4<u32>(1u) << vec4<u32>(0u, 1u, 2u, 3u), !is_decided & is_there);
    return left.x | left.y | left.z | left.w;
}
