// Counts of pixels: in how many pixels of the depth image a volume is hidden, in how many one looks
// through it, and in how many neither is certain.
//
// It is a pass of its own behind the cull, with two dispatches.
// In the first one, `count_of_pixels` or `count_of_pixels_by_few`, an invocation looks at all of
// the pixels of a small rectangle.
// Large rectangles are listed for the second one, which is in `pixels_large.wgsl`.
//
// Lavapipe ends all loops of eight invocations once they have taken MOST_ITERATIONS together
// (`crates/hiz_core/src/gpu/loops.rs`), and then rectangles would have no counts.
// So what a workgroup's loops may take is summed up before they take it, and what is too much for
// them is listed, too.
//
// What is used here and defined elsewhere:
//
// - `pixels_planes.wgsl`, `pixels_planes_box.wgsl`, `pixels_planes_any.wgsl`: `PixelPlanes`,
//   `fill_planes`
// - `pixels_look.wgsl`: `look_at_pixels`
// - `classify.wgsl`: `pixel_interval`, `between_samples`, `inside_block`

// Invocations of a workgroup, and those of one on a processor.
// Twins: `WORKGROUP` and `FEW` in `crates/hiz_core/src/cull/pixels.rs`.
const WORKGROUP: u32 = 128u;
const FEW: u32 = 8u;
// How many instances a workgroup orders by the size of their rectangles, at most.
// Twin: `MOST_ORDERED` there.
const MOST_ORDERED: u32 = 512u;

// A rectangle is large if it has more groups of four pixels of a row.
const SMALL_ROWS: u32 = 1023u;
// Rectangles are ordered by classes of their sizes, so that neighbours take about as long.
// There are four classes per power of two of the number of groups.
const CLASSES_LOG2: u32 = 2u;
const CLASSES: u32 = 40u;

// What the loops of an invocation take for one rectangle beside its rows, at most.
// These are those of `rectangle_of` and of `fill_planes`: 3, and 16 + 1 + 8 + 1 for a sphere's.
// Loops over planes at each pixel are of 16 rounds at most, which Mesa unrolls.
const AROUND_SMALL: u32 = 64u;

// How many workgroups there are in a row of the dispatches of large rectangles on a processor.
const TEAMS_PER_ROW: u32 = 4096u;
// What counts a large rectangle looks at so many pixels or more in an iteration of its loops.
// Twin: `PIXELS_OF_ITERATION` in `crates/hiz_core/src/cull/pixels.rs`, which has the proof.
const PIXELS_OF_ITERATION: u32 = 80u;
// So many of them are counted by one workgroup, at most, if there are many.
// Each may take its share of the iterations.
// Twin: `LARGE_OF_TEAM` there.
const LARGE_OF_TEAM: u32 = 2u;
// From so many workgroups on.
const FEW_TEAMS: u32 = 32u;

// True: set the bit of each instance that may show in more than a negligible number of pixels.
override SHOWN: bool;

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
    // How many instances a workgroup takes, up to MOST_ORDERED.
    ordered: u32,
    // How many iterations the loops over rectangles may take.
    iterations: u32,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// By the caller's index.
@group(2) @binding(0) var<storage, read_write> counts: array<PixelCounts>;
@group(2) @binding(1) var<storage, read_write> shown: array<atomic<u32>>;
@group(2) @binding(2) var<uniform> counting: Counting;
// How many instances have large rectangles, how many huge ones, and which.
// The huge ones are listed from the end on.
@group(2) @binding(3) var<storage, read_write> large: array<atomic<u32>>;
const LISTED_FROM: u32 = 2u;
// On a processor, the arguments of the dispatches that count large ones, and huge ones.
@group(3) @binding(0) var<storage, read_write> teams: array<atomic<u32>, 6>;

// Nothing is known about so many pixels.
fn unknown(pixels: u32) -> PixelCounts {
    return PixelCounts(pixels, 0u, pixels, 0u, pixels);
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

// The rectangle of an instance; `projected` is what its planes come from.
fn rectangle_of(i: u32, projected: ptr<function, Projected>) -> Prepared {
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
            *projected = Projected(x, y, z, w, w_min);
            return Prepared(none, vec4<u32>(f, l), true);
        }
    }
    return answered(everything);
}

// The rectangle of an instance, and its planes.
fn prepare(i: u32, planes: ptr<function, PixelPlanes>) -> Prepared {
    var projected: Projected;
    let prepared = rectangle_of(i, &projected);
    let r = prepared.rectangle;
    let first_edge = vec2<f32>(r.xy) - view.reach - view.half_size;
    let last_edge = vec2<f32>(r.zw + vec2<u32>(1u)) + view.reach - view.half_size;
    fill_planes(planes, projected, max(abs(first_edge), abs(last_edge)));
    return prepared;
}

// How many groups of four pixels of a row a rectangle meets.
fn rows_of_four(r: vec4<u32>) -> u32 {
    return ((r.z >> VECTOR_LOG2) - (r.x >> VECTOR_LOG2) + 1u) * (r.w - r.y + 1u);
}

// The class of a small rectangle; the largest ones come first.
fn size_class(rows: u32) -> u32 {
    let bit = leading_bit(rows);
    let part = ((rows << CLASSES_LOG2) >> bit) - (1u << CLASSES_LOG2);
    return CLASSES - 1u - (part + (bit << CLASSES_LOG2));
}

// The most groups of four that a rectangle of a class meets.
fn most_rows(class_here: u32) -> u32 {
    let number = CLASSES - 1u - class_here;
    let part = number & ((1u << CLASSES_LOG2) - 1u);
    return ((part + (1u << CLASSES_LOG2) + 1u) << (number >> CLASSES_LOG2)) >> CLASSES_LOG2;
}

// Lists an instance as one with a large rectangle.
fn list_large(i: u32) {
    atomicStore(&large[LISTED_FROM + atomicAdd(&large[0], 1u)], i);
}

// Lists an instance as one with a rectangle that is more than the loops for large ones can take.
fn list_huge(i: u32) {
    atomicStore(&large[arrayLength(&large) - 1u - atomicAdd(&large[1], 1u)], i);
}

fn write_counts(i: u32, found: PixelCounts) {
    let index = caller_index(i);
    counts[index] = found;
    if SHOWN {
        let may_show = found.touched - found.hidden > counting.negligible;
        let bit = select(0u, 1u << (index % WORD_BITS), may_show);
        // Mesa 22.3 crashes in compiling a branch around the atomic.
        atomicOr(&shown[index / WORD_BITS], bit);
    }
}

// Reads both ends of each row of a rectangle, which brings them near.
// Nothing is done in between, so that a processor waits for many of them at the same time.
// Returns 0.
fn touch_rows(r: vec4<u32>) -> u32 {
    let ends = r.xz >> vec2<u32>(VECTOR_LOG2);
    var bits = 0u;
    var y = r.y;
    loop {
        bits |= pixel_row(ends.x, y).x | pixel_row(ends.y, y).x;
        y += 1u;
        continuing {
            break if y > r.w;
        }
    }
    return bits & view.runtime_zero;
}

// Looks at the pixels of a small rectangle, one row after the other.
fn count_small(planes: ptr<function, PixelPlanes>, r: vec4<u32>) -> PixelCounts {
    var walk = Walk(0u, 0u, 0u, 0u);
    var left = counting.budget - touch_rows(r);
    let begin = r.x >> VECTOR_LOG2;
    var at = vec2<u32>(begin, r.y);
    loop {
        left -= 1u;
        look_at_pixels(planes, at, read_depths(at), r, &walk);
        at.x += 1u;
        if VECTOR * at.x > r.z {
            at = vec2<u32>(begin, at.y + 1u);
        }
        continuing {
            break if at.y > r.w || left == 0u;
        }
    }
    return counts_of(walk, r);
}

// Of each class: how many rectangles there are, and then where they begin.
var<workgroup> classes: array<atomic<u32>, CLASSES>;
// Of each instance the class of its rectangle, and its place in that class.
var<workgroup> keys: array<u32, MOST_ORDERED>;
const CLASS_SHIFT: u32 = 16u;
const PLACE_MASK: u32 = (1u << CLASS_SHIFT) - 1u;
// The instance has no small rectangle.
const NO_KEY: u32 = 0xffffffffu;
// How many instances the workgroup takes.
var<workgroup> ordered_here: u32;
var<workgroup> small_count: u32;
// The instances with small rectangles, by class.
var<workgroup> small: array<u32, MOST_ORDERED>;

// Answers an instance, or lists it as a large one, or finds the class of its rectangle.
fn key_of(i: u32) -> u32 {
    var projected: Projected;
    var own = answered(PixelCounts(0u, 0u, 0u, 0u, 0u));
    if i < piece.count {
        own = rectangle_of(i, &projected);
        if !own.is_open {
            write_counts(i, own.counts);
        }
    }
    let rows = rows_of_four(own.rectangle);
    var key = NO_KEY;
    if own.is_open && rows <= SMALL_ROWS {
        let class_here = size_class(rows);
        key = (class_here << CLASS_SHIFT) | atomicAdd(&classes[class_here], 1u);
    } else if own.is_open {
        let pixels = (own.rectangle.z - own.rectangle.x + 1u)
            * (own.rectangle.w - own.rectangle.y + 1u);
        if pixels / PIXELS_OF_ITERATION >= counting.iterations / LARGE_OF_TEAM {
            list_huge(i);
        } else {
            list_large(i);
        }
    }
    return key;
}

// Counts an instance with a small rectangle.
fn count_alone(i: u32) {
    var planes: PixelPlanes;
    // A compiler may fuse what is computed anew in another way, so all of it is from here.
    let prepared = prepare(i, &planes);
    var found = prepared.counts;
    if prepared.is_open {
        found = count_small(&planes, prepared.rectangle);
    }
    write_counts(i, found);
}

// Counts the instances of a workgroup of so many invocations; `lane` is one of them.
fn count_by(invocations: u32, group: u32, lane: u32) {
    begin();
    // The memory of a workgroup holds anything at first.
    for (var k = lane; k < CLASSES; k += invocations) {
        atomicStore(&classes[k], 0u);
    }
    // Mesa 22.3 crashes in compiling a loop that ends at a number of a uniform here.
    if lane == 0u {
        ordered_here = counting.ordered;
    }
    let ordered = workgroupUniformLoad(&ordered_here);
    var t = lane;
    loop {
        keys[t] = key_of(ordered * group + t);
        t += invocations;
        continuing {
            break if t >= ordered;
        }
    }
    workgroupBarrier();
    if lane == 0u {
        var sum = 0u;
        for (var k = 0u; k < CLASSES; k += 1u) {
            let of_class = atomicLoad(&classes[k]);
            atomicStore(&classes[k], sum);
            sum += of_class;
        }
        small_count = sum;
    }
    workgroupBarrier();
    t = lane;
    loop {
        let key = keys[t];
        if key != NO_KEY {
            small[atomicLoad(&classes[key >> CLASS_SHIFT]) + (key & PLACE_MASK)] =
                ordered * group + t;
        }
        t += invocations;
        continuing {
            break if t >= ordered;
        }
    }
    workgroupBarrier();
    // Which of them the loops can take: from the smallest ones on, so that others get the largest.
    let last_round = (max(small_count, 1u) - 1u) / invocations * invocations;
    var first = last_round + invocations;
    var left = counting.iterations;
    var round = last_round;
    loop {
        // All of a round take as long as the longest one, which is of the class of the first.
        // It touches its rows in one loop, and looks at them in another.
        let longest = keys[small[round] - ordered * group] >> CLASS_SHIFT;
        let needed = 2u * most_rows(longest) + AROUND_SMALL;
        first = select(first, round, needed <= left);
        left -= min(needed, left);
        round -= invocations;
        continuing {
            break if round > last_round;
        }
    }
    t = first + lane;
    loop {
        if t < small_count {
            count_alone(small[t]);
        }
        t += invocations;
        continuing {
            break if t >= small_count;
        }
    }
    for (t = lane; t < min(first, small_count); t += invocations) {
        list_large(small[t]);
    }
}

@compute @workgroup_size(WORKGROUP)
fn count_of_pixels(
    @builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    count_by(WORKGROUP, group.x, lane);
}

// The same on a processor, which pays for each eight invocations that wait at a barrier.
@compute @workgroup_size(FEW)
fn count_of_pixels_by_few(
    @builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    count_by(FEW, group.x, lane);
    storageBarrier();
    // Workgroups for those that were listed so far.
    let number = atomicLoad(&large[0]);
    ask_for_teams(0u, max((number + LARGE_OF_TEAM - 1u) / LARGE_OF_TEAM, min(number, FEW_TEAMS)));
    ask_for_teams(3u, atomicLoad(&large[1]));
}

// Asks for so many workgroups at least; their arguments begin at `first`.
fn ask_for_teams(first: u32, number: u32) {
    atomicMax(&teams[first], min(number, TEAMS_PER_ROW));
    atomicMax(&teams[first + 1u], (number + TEAMS_PER_ROW - 1u) / TEAMS_PER_ROW);
    atomicMax(&teams[first + 2u], 1u);
}
