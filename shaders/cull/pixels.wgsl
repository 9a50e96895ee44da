// Counts of pixels: in how many pixels of the depth image a volume is hidden, in how many one looks
// through it, and in how many neither is certain.
//
// It is a pass of its own behind the cull.
// First each invocation of a workgroup prepares one instance.
// Its rectangle is cut into tiles, and then the invocations share the tiles of all of them.
//
// A tile is walked as a descent walks, with four texels of a row at a time.
// A texel that is surely behind or surely untouched decides all its pixels of the tile.
// Source: Greene, Kass and Miller, "Hierarchical Z-Buffer Visibility", SIGGRAPH 1993.
//
// What is used here and defined elsewhere:
//
// - `pixels_planes.wgsl`: `PixelPlanes`, `pixel_planes`
// - `pixels_row_*.wgsl`: `texel_row`, `near_pixel_row`
// - `classify.wgsl`: `pixel_interval`, `between_samples`, `inside_block`

// True: a pixel of level 0 stands for all that its surface shows.
// False: it is the farthest of several samples.
// Then only the nearest one says what is behind the volume.
override ONE_SAMPLE: bool;
// True: set the bit of each instance that may show in more than a negligible number of pixels.
override SHOWN: bool;

// Invocations of a workgroup, and the instances that they prepare.
// Their planes fit the 16 KiB that WebGPU promises a workgroup.
// Twin: `WORKGROUP` in `crates/hiz_core/src/cull/pixels.rs`.
const WORKGROUP: u32 = 32u;

// A rectangle of at most this many pixels is one tile.
const ONE_TILE: u32 = 1024u;
// Otherwise tiles have at least this side, as a power of two, and there are at most MAX_TILES.
const TILE_LOG2: u32 = 5u;
const MAX_TILES: u32 = 16u;
const WHOLE_IMAGE_LOG2: u32 = 15u;

// A level is read along with the next but one.
// So the children of a texel are four rows of four.
const STEP: u32 = 2u;
// At the first level, a rectangle has fewer texels than this along its longer side.
const TOP_TEXELS: u32 = 8u;
// The bits of a level's four texels among those that are left to enter.
const ROW_BITS: u32 = 4u;
const ROW_MASK: u32 = (1u << ROW_BITS) - 1u;
// More texels than any level has.
const NO_BORDER: u32 = 0xffffffffu;
// No depth: it says nothing.
const UNKNOWN_BITS: u32 = 0xffffffffu;

// Twin: `PixelCounts` in `crates/hiz_core/src/output/pixels.rs`.
struct PixelCounts {
    touched: u32,
    hidden: u32,
    inside: u32,
    open: u32,
    undecided: u32,
}

// Twin: `CountingUniform` in `crates/hiz_core/src/cull/pixels.rs`.
struct Counting {
    // How many rows of four texels an instance may read.
    budget: u32,
    // Pixels of an instance that count as none.
    negligible: u32,
    padding: vec2<u32>,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// By the caller's index.
@group(2) @binding(0) var<storage, read_write> counts: array<PixelCounts>;
@group(2) @binding(1) var<storage, read_write> shown: array<atomic<u32>>;
@group(2) @binding(2) var<uniform> counting: Counting;

fn bar4(x: vec4<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(bitcast<vec4<u32>>(x) ^ vec4<u32>(view.runtime_zero));
}

// Nothing is known about so many pixels.
fn unknown(pixels: u32) -> PixelCounts {
    return PixelCounts(pixels, 0u, pixels, 0u, pixels);
}

// Which bits are depths; others say nothing about their pixels.
fn are_depths(bits: vec4<u32>) -> vec4<bool> {
    return bits <= vec4<u32>(ONE_BITS) | bits == vec4<u32>(NEGATIVE_ZERO_BITS);
}

// `sanitized` of each.
fn all_sanitized(bits: vec4<u32>) -> vec4<u32> {
    let is_zero =
        bits < vec4<u32>(LEAST_NORMAL_BITS) | bits == vec4<u32>(NEGATIVE_ZERO_BITS);
    let flushed = select(bits, vec4<u32>(0u), is_zero);
    return select(vec4<u32>(far_bits()), flushed, are_depths(bits));
}

// How far stored depths are at most, and at least, as `surely_clear` compares them.
// They are measured from z_slope, and raised by the margin of the comparison.
fn hiding_bounds(bits: vec4<u32>) -> vec4<f32> {
    let given = bitcast<vec4<f32>>(bits);
    let stored =
        select(max(given, vec4<f32>(LEAST_NORMAL)), min(given, vec4<f32>(1.0)), REVERSED);
    let moved = bar4(stored * view.depth_factor + view.depth_offset);
    return with_margin(farther_sign() * bar4(moved - view.z_slope));
}

fn opening_bounds(bits: vec4<u32>) -> vec4<f32> {
    let given = bitcast<vec4<f32>>(bits);
    let stored = select(given, max(given, vec4<f32>(LEAST_NORMAL)), REVERSED);
    let moved = bar4(stored * view.near_factor + view.near_offset);
    return with_margin(-farther_sign() * bar4(moved - view.z_slope));
}

fn with_margin(bound: vec4<f32>) -> vec4<f32> {
    return bound + (TEXEL_ULPS * EPS * abs(bound) + TEXEL_FLOOR);
}

// What is sure about four texels of a row, whose pixels begin and end there.
struct Sure {
    untouched: vec4<bool>,
    // No pixel of the texel is surely untouched, as far as the outline tells.
    whole: vec4<bool>,
    // All of the volume is behind the texel's depth, in each of its pixels.
    hidden: vec4<bool>,
    // All of the volume is in front of the depth, in each of its pixels.
    open: vec4<bool>,
}

fn sure_of(
    planes: ptr<function, PixelPlanes>,
    left: vec4<f32>, right: vec4<f32>, top: f32, bottom: f32, raw: vec4<u32>, near: vec4<u32>,
) -> Sure {
    // How far the outline's planes are inside of the texel's nearest pixel, and of its farthest.
    var outside = vec4<f32>(NO_PLANE);
    var partly = vec4<f32>(NO_PLANE);
    for (var i = 0u; i < OUTLINES; i += 1u) {
        let slope = (*planes).outline_slopes[i];
        let offset = (*planes).outlines[i];
        let rows = slope.y * select(vec2<f32>(top, bottom), vec2<f32>(bottom, top), slope.y > 0.0);
        let is_right = slope.x > 0.0;
        outside = max(outside,
            vec4<f32>(offset - rows.x) - slope.x * select(left, right, is_right));
        partly = max(partly,
            vec4<f32>(offset - rows.y) - slope.x * select(right, left, is_right));
    }
    var front = vec4<f32>(NO_PLANE);
    var back = vec4<f32>(NO_PLANE);
    for (var i = 0u; i < DEPTH_PLANES; i += 1u) {
        // At one corner the plane is nearest, at the opposite one farthest.
        let slope = (*planes).face_slopes[i];
        let rows = slope.y * select(vec2<f32>(top, bottom), vec2<f32>(bottom, top), slope.y > 0.0);
        let is_right = slope.x > 0.0;
        front = max(front,
            vec4<f32>((*planes).fronts[i] - rows.x) - slope.x * select(left, right, is_right));
        back = max(back,
            vec4<f32>((*planes).backs[i] + rows.y) + slope.x * select(right, left, is_right));
    }
    let hidden = front > hiding_bounds(all_sanitized(raw));
    // Background hides nothing, however far the volume is.
    let is_background = near == vec4<u32>(far_bits());
    let open = are_depths(near) & (is_background | back > opening_bounds(all_sanitized(near)));
    // Nothing of the volume is there if it would have to be behind the surface and in front of it.
    return Sure(
        outside > vec4<f32>(TEXEL_FLOOR) | (hidden & open), partly <= vec4<f32>(TEXEL_FLOOR),
        hidden, open);
}

// The nearest depths of four texels, of which `raw` are the farthest.
fn nearest_of(level: u32, at: vec2<u32>, raw: vec4<u32>) -> vec4<u32> {
    var near = vec4<u32>(UNKNOWN_BITS);
    if NEAREST {
        near = nearest_row(level, at.x, at.y);
    }
    if ONE_SAMPLE {
        near = select(near, raw, level == 0u);
    } else if level == 0u {
        near = near_pixel_row(at.x, at.y);
    }
    return near;
}

// The pixels of four texels that `chosen` names.
fn pixels_of(chosen: vec4<bool>, pixels: vec4<u32>) -> u32 {
    let n = select(vec4<u32>(0u), pixels, chosen);
    return n.x + n.y + n.z + n.w;
}

// The level that is read below another one, and above it.
fn level_below(level: u32, base: u32) -> u32 {
    return select(level - STEP, 0u, level <= base);
}

fn level_above(level: u32, base: u32) -> u32 {
    return select(level + STEP, base, level == 0u);
}

// Where a level's bits begin among those that are left to enter.
fn bits_of(level: u32) -> u32 {
    return ROW_BITS * (level / STEP);
}

// Counts the pixels first..=last, with at most `budget` reads.
fn walk(
    planes: ptr<function, PixelPlanes>, first: vec2<u32>, last: vec2<u32>, budget: u32,
) -> PixelCounts {
    // Level 0, and every other level from `base` on.
    let base = max(first_stored, STEP);
    let side = max(last.x - first.x, last.y - first.y);
    var level = 0u;
    for (var above = base; above <= last_stored && (side >> level) >= TOP_TEXELS; above += STEP) {
        level = above;
    }
    let top = level;
    var at = vec2<u32>((first.x >> level) >> VECTOR_LOG2, first.y >> level);
    var to_enter = 0u;
    var left = budget;
    let sides = last - first + vec2<u32>(1u);
    let pixels = sides.x * sides.y;
    var done = 0u;
    var found = PixelCounts(0u, 0u, 0u, 0u, 0u);
    var is_over = false;
    while !is_over && left > 0u {
        left -= 1u;
        // The pixels of the four texels, cut at the rectangle.
        let columns = vec4<u32>(VECTOR * at.x) + vec4<u32>(0u, 1u, 2u, 3u);
        let begin = max(columns << vec4<u32>(level), vec4<u32>(first.x));
        let end = min((columns + vec4<u32>(1u)) << vec4<u32>(level), vec4<u32>(last.x + 1u));
        let begin_y = max(at.y << level, first.y);
        let end_y = min((at.y + 1u) << level, last.y + 1u);
        let is_there = begin < end;
        let here = select(vec4<u32>(0u), (end - begin) * (end_y - begin_y), is_there);
        // Exact: multiples of 2^-8 below 2^16, and then one of two numbers.
        let low = vec4<f32>(begin) - view.reach - view.half_size.x;
        let high = vec4<f32>(end) + view.reach - view.half_size.x;
        let low_y = f32(begin_y) - view.reach - view.half_size.y;
        let high_y = f32(end_y) + view.reach - view.half_size.y;
        let raw = texel_row(level, at.x, at.y);
        let sure = sure_of(
            planes,
            clamp(vec4<f32>((*planes).left_top.x), low, high),
            clamp(vec4<f32>((*planes).right_bottom.x), low, high),
            clamp((*planes).left_top.y, low_y, high_y),
            clamp((*planes).right_bottom.y, low_y, high_y),
            raw, nearest_of(level, at, raw));
        // A texel with untouched pixels is entered, so that these are not counted.
        let is_decided = sure.untouched | ((sure.hidden | sure.open) & sure.whole);
        let is_left = !is_decided & is_there & vec4<bool>(level > 0u);
        let is_counted = !sure.untouched & !is_left;
        found.hidden += pixels_of(sure.hidden & is_counted, here);
        found.open += pixels_of(sure.open & is_counted, here);
        found.inside += pixels_of(!(sure.hidden | sure.open) & is_counted, here);
        done += pixels_of(!is_left, here);
        let left_bits = select(vec4<u32>(0u), vec4<u32>(1u) << vec4<u32>(0u, 1u, 2u, 3u), is_left);
        to_enter |= (left_bits.x | left_bits.y | left_bits.z | left_bits.w) << bits_of(level);

        // On to the first texel to enter, or to the next row of texels.
        loop {
            let entered = (to_enter >> bits_of(level)) & ROW_MASK;
            if entered != 0u {
                let column = VECTOR * at.x + countTrailingZeros(entered);
                to_enter ^= (entered & (~entered + 1u)) << bits_of(level);
                let below = level_below(level, base);
                let down = vec2<u32>(level - below);
                level = below;
                at = max(vec2<u32>(column, at.y) << down, first >> vec2<u32>(level));
                at.x >>= VECTOR_LOG2;
                break;
            }
            let is_top = level == top;
            let up = level_above(level, base) - level;
            let parent = vec2<u32>((VECTOR * at.x) >> up, at.y >> up);
            let border = select(
                ((parent + vec2<u32>(1u)) << vec2<u32>(up)) - vec2<u32>(1u),
                vec2<u32>(NO_BORDER), vec2<bool>(is_top));
            let end_here = min(border, last >> vec2<u32>(level));
            if VECTOR * (at.x + 1u) <= end_here.x {
                at.x += 1u;
                break;
            }
            if at.y < end_here.y {
                let begin_here = select(parent.x << up, 0u, is_top);
                at = vec2<u32>(max(begin_here, first.x >> level) >> VECTOR_LOG2, at.y + 1u);
                break;
            }
            if is_top {
                is_over = true;
                break;
            }
            at = vec2<u32>(parent.x >> VECTOR_LOG2, parent.y);
            level += up;
        }
    }
    // What the budget has left.
    found.undecided = pixels - done;
    found.inside += found.undecided;
    found.touched = found.hidden + found.inside + found.open;
    return found;
}

// What is known of an instance before any depth is read.
struct Prepared {
    counts: PixelCounts,
    // First column, first row, last column, last row.
    rectangle: vec4<u32>,
    // Whether the pixels of the rectangle are to be counted.
    // Otherwise `counts` are the answer.
    is_open: bool,
}

fn answered(counts: PixelCounts) -> Prepared {
    return Prepared(counts, vec4<u32>(0u), false);
}

fn prepare(i: u32, planes: ptr<function, PixelPlanes>) -> Prepared {
    let none = PixelCounts(0u, 0u, 0u, 0u, 0u);
    let everything = unknown(u32(view.size.x) * u32(view.size.y));
    let volume = load_volume(i);
    if !is_among(i) || volume.center.x < ABSENT_BELOW {
        return answered(none);
    }
    if !(volume.size < view.coordinate_limit) {
        return answered(everything);
    }
    let errors = errors_of(volume);
    let x = value_of(view.x, errors.x, volume);
    let y = value_of(view.y, errors.y, volume);
    let z = value_of(view.z, errors.z, volume);
    let w = value_of(view.w, errors.w, volume);
    if surely_outside(x, y, z, w) {
        return answered(none);
    }
    let w_min = w.center - support(w.half) - error_bound(w, 0.0, w);
    if !(w_min > LEAST_W) {
        return answered(everything);
    }
    let ends_x = extent_of(x, w, w_min);
    let ends_y = extent_of(y, w, w_min);
    let per_w = RECTANGLE_MARGIN / w_min;
    let columns = pixel_interval(ends_x, per_w, view.half_size.x, view.size.x);
    let rows = pixel_interval(ends_y, per_w, view.half_size.y, view.size.y);
    let is_empty = columns.x > columns.y || rows.x > rows.y;
    if SAMPLE_COVERAGE && is_empty {
        if (columns.x > columns.y && between_samples(x, w, columns.x, view.half_size.x))
            || (rows.x > rows.y && between_samples(y, w, rows.x, view.half_size.y)) {
            return answered(none);
        }
    }
    // The rectangle is an estimate.
    // If it is empty or cannot be proved, one that is wider by a pixel can, nearly always.
    var first = vec2<i32>(columns.x, rows.x);
    var last = vec2<i32>(columns.y, rows.y);
    let edge = view.size - vec2<i32>(1);
    for (var wider = select(0, 1, is_empty); wider < 2; wider += 1) {
        first = clamp(first - vec2<i32>(wider), vec2<i32>(0), edge);
        last = clamp(last + vec2<i32>(wider), vec2<i32>(0), edge);
        let f = vec2<u32>(first);
        let l = vec2<u32>(last);
        if all(f <= l)
            && inside_block(x, w, ends_x, w_min, f.x, l.x, 0u, view.half_size.x, view.size.x)
            && inside_block(y, w, ends_y, w_min, f.y, l.y, 0u, view.half_size.y, view.size.y) {
            if !is_reduced {
                return answered(unknown((l.x - f.x + 1u) * (l.y - f.y + 1u)));
            }
            let first_edge = vec2<f32>(f) - view.reach - view.half_size;
            let last_edge = vec2<f32>(l + vec2<u32>(1u)) + view.reach - view.half_size;
            let most = max(abs(first_edge), abs(last_edge));
            pixel_planes(planes, Projected(x, y, z, w, w_min), most);
            return Prepared(none, vec4<u32>(f, l), true);
        }
    }
    return answered(everything);
}

// How a rectangle is cut into tiles.
struct Tiling {
    // Tiles begin at multiples of 2^log2 pixels.
    log2: u32,
    columns: u32,
    // The number of the first tile among those of the workgroup, and how many there are.
    begin: u32,
    count: u32,
}

fn tiling(r: vec4<u32>) -> Tiling {
    let sides = r.zw - r.xy + vec2<u32>(1u);
    if sides.x * sides.y <= ONE_TILE {
        return Tiling(WHOLE_IMAGE_LOG2, 1u, 0u, 1u);
    }
    var log2 = TILE_LOG2;
    loop {
        let tiles = (r.zw >> vec2<u32>(log2)) - (r.xy >> vec2<u32>(log2)) + vec2<u32>(1u);
        if tiles.x * tiles.y <= min(MAX_TILES, counting.budget) {
            return Tiling(log2, tiles.x, 0u, tiles.x * tiles.y);
        }
        log2 += 1u;
    }
    return Tiling(WHOLE_IMAGE_LOG2, 1u, 0u, 1u);
}

// Of the instances of a workgroup.
var<workgroup> all_planes: array<PixelPlanes, WORKGROUP>;
var<workgroup> rectangles: array<vec4<u32>, WORKGROUP>;
var<workgroup> tilings: array<Tiling, WORKGROUP>;
var<workgroup> hidden_sums: array<atomic<u32>, WORKGROUP>;
var<workgroup> inside_sums: array<atomic<u32>, WORKGROUP>;
var<workgroup> open_sums: array<atomic<u32>, WORKGROUP>;
var<workgroup> undecided_sums: array<atomic<u32>, WORKGROUP>;
// Of each tile: whose it is.
var<workgroup> owners: array<u32, WORKGROUP * MAX_TILES>;
var<workgroup> tile_count: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn count_of_pixels(
    @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    // The memory of a workgroup holds anything at first.
    atomicStore(&hidden_sums[lane], 0u);
    atomicStore(&inside_sums[lane], 0u);
    atomicStore(&open_sums[lane], 0u);
    atomicStore(&undecided_sums[lane], 0u);
    if lane == 0u {
        atomicStore(&tile_count, 0u);
    }
    workgroupBarrier();
    var planes: PixelPlanes;
    var own = answered(PixelCounts(0u, 0u, 0u, 0u, 0u));
    let is_there = id.x < piece.count;
    if is_there {
        own = prepare(id.x, &planes);
    }
    if own.is_open {
        var tiles = tiling(own.rectangle);
        tiles.begin = atomicAdd(&tile_count, tiles.count);
        all_planes[lane] = planes;
        rectangles[lane] = own.rectangle;
        tilings[lane] = tiles;
        for (var k = 0u; k < tiles.count; k += 1u) {
            owners[tiles.begin + k] = lane;
        }
    }
    workgroupBarrier();
    let count = atomicLoad(&tile_count);
    for (var t = lane; t < count; t += WORKGROUP) {
        let owner = owners[t];
        planes = all_planes[owner];
        let r = rectangles[owner];
        let tiles = tilings[owner];
        let k = t - tiles.begin;
        let at = (r.xy >> vec2<u32>(tiles.log2)) + vec2<u32>(k % tiles.columns, k / tiles.columns);
        let first = max(at << vec2<u32>(tiles.log2), r.xy);
        let last = min(((at + vec2<u32>(1u)) << vec2<u32>(tiles.log2)) - vec2<u32>(1u), r.zw);
        let found = walk(&planes, first, last, counting.budget / tiles.count);
        atomicAdd(&hidden_sums[owner], found.hidden);
        atomicAdd(&inside_sums[owner], found.inside);
        atomicAdd(&open_sums[owner], found.open);
        atomicAdd(&undecided_sums[owner], found.undecided);
    }
    workgroupBarrier();
    if is_there {
        var found = own.counts;
        if own.is_open {
            found.hidden = atomicLoad(&hidden_sums[lane]);
            found.inside = atomicLoad(&inside_sums[lane]);
            found.open = atomicLoad(&open_sums[lane]);
            found.undecided = atomicLoad(&undecided_sums[lane]);
            found.touched = found.hidden + found.inside + found.open;
        }
        let index = caller_index(id.x);
        counts[index] = found;
        if SHOWN {
            let may_show = found.touched - found.hidden > counting.negligible;
            let bit = select(0u, 1u << (index % WORD_BITS), may_show);
            // Mesa 22.3 crashes in compiling a branch around the atomic.
            atomicOr(&shown[index / WORD_BITS], bit);
        }
    }
}
