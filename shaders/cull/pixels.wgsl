// Counts of pixels: in how many pixels of the depth image a volume is hidden, in how many one looks
// through it, and in how many neither is certain.
//
// It is a pass of its own behind the cull.
// First each invocation of a workgroup prepares one instance.
// Its rectangle is cut into tiles, and then the invocations share the tiles of all of them.
//
// What is used here and defined elsewhere:
//
// - `pixels_planes.wgsl`, `pixels_planes_box.wgsl`, `pixels_planes_any.wgsl`: `PixelPlanes`,
//   `fill_planes`
// - `pixels_walk.wgsl`: `count_tile`
// - `classify.wgsl`: `pixel_interval`, `between_samples`, `inside_block`

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

// Tiles are ordered by classes of their sizes, so that neighbours take about as long.
// There are two per power of two of the number of rows of four pixels.
const CLASSES: u32 = 16u;

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
            fill_planes(planes, Projected(x, y, z, w, w_min), most);
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

// The class of a rectangle, or of one of its tiles if there are several.
fn size_class(r: vec4<u32>, tiles: Tiling) -> u32 {
    if tiles.count > 1u {
        return CLASSES - 1u;
    }
    let rows = ((r.z >> VECTOR_LOG2) - (r.x >> VECTOR_LOG2) + 1u) * (r.w - r.y + 1u);
    let bit = leading_bit(rows);
    return min(((2u * rows) >> bit) + 2u * bit - 2u, CLASSES - 1u);
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
// Of each class of sizes: how many tiles there are.
var<workgroup> class_counts: array<atomic<u32>, CLASSES>;

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
    if lane < CLASSES {
        atomicStore(&class_counts[lane], 0u);
    }
    workgroupBarrier();
    var planes: PixelPlanes;
    var own = answered(PixelCounts(0u, 0u, 0u, 0u, 0u));
    let is_there = id.x < piece.count;
    if is_there {
        own = prepare(id.x, &planes);
    }
    var tiles: Tiling;
    var own_class = 0u;
    if own.is_open {
        tiles = tiling(own.rectangle);
        own_class = size_class(own.rectangle, tiles);
        tiles.begin = atomicAdd(&class_counts[own_class], tiles.count);
    }
    workgroupBarrier();
    var count = 0u;
    for (var k = 0u; k < CLASSES; k += 1u) {
        let of_class = atomicLoad(&class_counts[k]);
        tiles.begin += select(0u, of_class, k < own_class);
        count += of_class;
    }
    if own.is_open {
        all_planes[lane] = planes;
        rectangles[lane] = own.rectangle;
        tilings[lane] = tiles;
        for (var k = 0u; k < tiles.count; k += 1u) {
            owners[tiles.begin + k] = lane;
        }
    }
    workgroupBarrier();
    for (var t = lane; t < count; t += WORKGROUP) {
        let owner = owners[t];
        planes = all_planes[owner];
        let r = rectangles[owner];
        let cut = tilings[owner];
        let k = t - cut.begin;
        let at = (r.xy >> vec2<u32>(cut.log2)) + vec2<u32>(k % cut.columns, k / cut.columns);
        let first = max(at << vec2<u32>(cut.log2), r.xy);
        let last = min(((at + vec2<u32>(1u)) << vec2<u32>(cut.log2)) - vec2<u32>(1u), r.zw);
        let found = count_tile(&planes, first, last, counting.budget / cut.count);
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
