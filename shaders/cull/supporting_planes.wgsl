// A volume's own outline and front: planes that bound all of it, tilted to its faces.
// A texel that lies beyond one of them shows nothing of the volume, or only parts that are farther
// than the texel's depth.
//
// A plane is a linear function of pixel position and depth:
// facing * z / w + slope . (x, y) / w > offset on all of the volume.
// The slope is a guess.
// One certificate proves the offset; after that a texel costs one multiplication per axis.
// docs/accuracy.md derives this, under "A volume's own outline and front".

//
// A round of the loop over planes compares four of them, because the loops of an invocation are
// limited (`crates/hiz_core/src/cull/descent.rs`).

// Planes of one round, and the rounds of all of them.
// Twins: in `crates/hiz_core/src/cull/descent.rs`.
const PLANES_OF_ROUND: u32 = 4u;
const MOST_ROUNDS: u32 = 6u;
const ROUNDS: u32 = (CANDIDATES + PLANES_OF_ROUND - 1u) / PLANES_OF_ROUND;
const_assert ROUNDS <= MOST_ROUNDS;

struct SupportingPlane {
    // Depth units per pixel; of an outline, pixels per pixel.
    slope: vec2<f32>,
    // 1, or -1 with reversed Z: the plane bounds the depth of a front face.
    // 0: it bounds the outline.
    facing: f32,
    offset: f32,
}

struct SupportingPlanes {
    // The rectangle around the volume, to fractions of a pixel.
    left_top: vec2<f32>,
    right_bottom: vec2<f32>,
    // The rest of the last round is NOTHING_BEYOND.
    list: array<SupportingPlane, PLANES_OF_ROUND * ROUNDS>,
    count: u32,
}

// A plane beyond which nothing lies.
const NOTHING_BEYOND: SupportingPlane = SupportingPlane(vec2<f32>(0.0), 0.0, -1.0);

// A volume on the four rows.
struct Projected {
    x: Value,
    y: Value,
    z: Value,
    w: Value,
    // A lower bound of w, above 0.
    w_min: f32,
}

// All bits of a float but the sign.
const MAGNITUDE_MASK: u32 = 0x7fffffffu;
// The bits of 2^60: squares of products could overflow from there on.
// It is decided on bits, because a compiler may assume that no float is NaN or infinite.
// Twin: `LARGEST` in `crates/hiz_core/src/instances/volume_record.rs`.
const LARGEST_BITS: u32 = 0x5d800000u;
// Errors below this keep a row's own size below 2^57, so that nothing overflows.
const LARGEST_ERROR: f32 = 0x1p38;
// The bits of 2^16: steeper planes say nothing, and could overflow a product.
const STEEPEST_BITS: u32 = 0x47800000u;
// Slopes below this are set to 0.
// A subnormal slope could be flushed in one product and not in another, while X' reaches 2^58.
const FLATTEST: f32 = 0x1p-100;
// Pixels from an image's middle to beyond any image, whose sides are at most 32768.
const BEYOND: f32 = 65536.0;
// A guessed end or offset is moved outwards by this many times its error, so it can be proved.
const GUESS_ERRORS: f32 = 3.0;

// The margin of a texel's comparison, in EPS of the magnitudes that are compared.
// Two products, three differences and the depth's own make at most 6 roundings.
const TEXEL_ULPS: f32 = 8.0;
// Covers what is flushed there.
const TEXEL_FLOOR: f32 = 0x1p-100;

fn is_small(bits: u32) -> bool {
    return (bits & MAGNITUDE_MASK) < LARGEST_BITS;
}

// The sign that makes farther greater.
fn farther_sign() -> f32 {
    return select(1.0, -1.0, REVERSED);
}

// A guess: the plane through a face or edge that may bound the volume, and the plane's value there.
struct Candidate {
    facing: f32,
    slope: vec2<f32>,
    own: f32,
}

// Bounds of r / w in pixels, where certificates prove them.
fn proved_interval(r: Value, w: Value, w_min: f32) -> vec2<f32> {
    return proved_ends(ratio_interval(r, w), r, w, w_min);
}

// The same from a guess of both.
fn proved_ends(guess: vec2<f32>, r: Value, w: Value, w_min: f32) -> vec2<f32> {
    let widened = GUESS_ERRORS * error_bound(r, max(abs(guess.x), abs(guess.y)), w) / w_min;
    // Barred, so that what is certified is what is returned.
    let low = bar(clamp(guess.x - widened, -BEYOND, BEYOND));
    let high = bar(clamp(guess.y + widened, -BEYOND, BEYOND));
    return vec2<f32>(
        select(-BEYOND, low, surely_above(r, low, w)),
        select(BEYOND, high, surely_below(r, high, w)));
}

// The planes of the volume's candidates that touch it, less a margin, if a certificate proves them.
// They come through a pointer: returned by value, so much data takes twice as long to compile.
fn supporting_planes(planes: ptr<function, SupportingPlanes>, p: Projected) {
    (*planes).count = 0u;
    let columns = proved_interval(p.x, p.w, p.w_min);
    let rows = proved_interval(p.y, p.w, p.w_min);
    (*planes).left_top = vec2<f32>(columns.x, rows.x);
    (*planes).right_bottom = vec2<f32>(columns.y, rows.y);
    for (var i = 0u; i < CANDIDATES; i += 1u) {
        let guess = candidate(i, p);
        let steepness = bitcast<vec2<u32>>(guess.slope) & vec2<u32>(MAGNITUDE_MASK);
        if any(steepness > vec2<u32>(STEEPEST_BITS)) {
            continue;
        }
        // Barred, so that no compiler moves the quotient of the slope into the products.
        // That would certify another slope.
        var slope = bar2(
            select(guess.slope, vec2<f32>(0.0), abs(guess.slope) < vec2<f32>(FLATTEST)));
        var r = Value(
            guess.facing * p.z.center + slope.x * p.x.center + slope.y * p.y.center,
            abs(guess.facing) * p.z.error
                + abs(slope.x) * p.x.error + abs(slope.y) * p.y.error + ERROR_FLOOR,
            guess.facing * p.z.half + slope.x * p.x.half + slope.y * p.y.half);
        let interval = ratio_interval(r, p.w);
        let extent = interval.y - interval.x;
        var least = interval.x;
        if !on_border(guess.own, least, extent) {
            // The other side of an outline belongs to another edge; that of a front is a back.
            if guess.facing != 0.0 || !on_border(guess.own, interval.y, extent) {
                continue;
            }
            slope = -slope;
            r = Value(-r.center, r.error, -r.half);
            least = -interval.y;
        }
        let offset = bar(least - GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min);
        let small = is_small(bitcast<u32>(offset)) && error_bound(r, offset, p.w) < LARGEST_ERROR;
        if small && surely_above(r, offset, p.w) {
            (*planes).list[(*planes).count] = SupportingPlane(slope, guess.facing, offset);
            (*planes).count += 1u;
        }
    }
    // One of the last three is behind the list only if the last round is full.
    let last = PLANES_OF_ROUND * ROUNDS - 1u;
    let count = (*planes).count;
    if count <= last {
        (*planes).list[count] = NOTHING_BEYOND;
        (*planes).list[min(count + 1u, last)] = NOTHING_BEYOND;
        (*planes).list[min(count + 2u, last)] = NOTHING_BEYOND;
    }
}

// Whether all between the corners lies beyond a plane, or is farther than the depth there.
fn is_beyond(
    plane: SupportingPlane, left_top: vec2<f32>, right_bottom: vec2<f32>, depth: f32,
) -> bool {
    // At this corner the plane is nearest, or reaches farthest out.
    let corner = select(left_top, right_bottom, plane.slope > vec2<f32>(0.0));
    let fall = plane.slope * corner;
    let bound = plane.facing * depth;
    let magnitudes = abs(plane.offset) + abs(fall.x) + abs(fall.y) + abs(bound);
    let margin = TEXEL_ULPS * EPS * magnitudes + TEXEL_FLOOR;
    return plane.offset - fall.x - fall.y - margin > bound;
}

// True implies: no pixel from `begin` to before `end` shows anything of the volume, if its depth is
// no farther than the stored one.
fn surely_clear(
    planes: ptr<function, SupportingPlanes>, begin: vec2<u32>, end: vec2<u32>, bits: u32,
) -> bool {
    // Exact: multiples of 2^-8 below 2^16, and then one of two numbers.
    let left_top = max(vec2<f32>(begin) - view.reach - view.half_size, (*planes).left_top);
    let right_bottom = min(vec2<f32>(end) + view.reach - view.half_size, (*planes).right_bottom);
    // It may be the far plane, too, since anything farther is outside the view volume.
    let depth = bar(occluding_depth(bits) - view.z_slope);
    for (var i = 0u; i < (*planes).count; i += PLANES_OF_ROUND) {
        if is_beyond((*planes).list[i], left_top, right_bottom, depth)
            | is_beyond((*planes).list[i + 1u], left_top, right_bottom, depth)
            | is_beyond((*planes).list[i + 2u], left_top, right_bottom, depth)
            | is_beyond((*planes).list[i + 3u], left_top, right_bottom, depth) {
            return true;
        }
    }
    return false;
}
