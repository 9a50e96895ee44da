// For `fit="volume"`: planes that bound all of a volume, tilted to its own outline and front.
// A texel that lies beyond one of them shows nothing of the volume, or only what is farther than
// the texel's depth.
//
// On all of the volume, `facing * z / w + dot(slope, (x, y) / w) > offset`.
// Here x, y, z and w are the view's rows (`view.wgsl`).
// The slope is a guess, and one certificate proves the offset, once per instance.
// After that, each texel costs one multiplication per axis.

struct SupportingPlane {
    // Depth units (an outline: pixels) per pixel.
    slope: vec2<f32>,
    // 1, or -1 with reversed Z, if the plane bounds the depth of a front face.
    // 0 if it bounds the outline.
    facing: f32,
    offset: f32,
}

struct SupportingPlanes {
    // The rectangle around the volume, to fractions of a pixel.
    left_top: vec2<f32>,
    right_bottom: vec2<f32>,
    list: array<SupportingPlane, CANDIDATES>,
    count: u32,
}

// A volume on the four rows.
struct Projected {
    x: Value,
    y: Value,
    z: Value,
    w: Value,
    // A lower bound of w, above 0.
    w_min: f32,
}

// The bits of 2^60, from which on squares of products could overflow.
// Bits are compared, because a compiler may assume that no float is NaN or infinite.
const LARGEST_BITS: u32 = 0x5d800000u;

fn is_small(bits: u32) -> bool {
    return (bits & 0x7fffffffu) < LARGEST_BITS;
}

// The bits of 2^16.
// Steeper planes say nothing, and could overflow a product.
const STEEPEST_BITS: u32 = 0x47800000u;
// A flatter slope becomes 0.
// A subnormal slope could be flushed in one product and not in another, and the row that it
// multiplies may be large.
const FLATTEST: f32 = 0x1p-100;

// The sign that makes farther greater.
fn farther_sign() -> f32 {
    return select(1.0, -1.0, REVERSED);
}

// A guess: the plane through a face or edge that may bound the volume.
// `own` is the plane's value at that face or edge.
struct Candidate {
    facing: f32,
    slope: vec2<f32>,
    own: f32,
}

// A distance in pixels from the image's middle that is beyond every image.
const BEYOND: f32 = 65536.0;

// Bounds of r / w in pixels, or -BEYOND and BEYOND where no certificate proves them.
fn proved_interval(r: Value, w: Value, w_min: f32) -> vec2<f32> {
    let guess = ratio_interval(r, w);
    let widened = 3.0 * error_bound(r, max(abs(guess.x), abs(guess.y)), w) / w_min;
    // Barred: what is certified is what is returned.
    let low = bar(clamp(guess.x - widened, -BEYOND, BEYOND));
    let high = bar(clamp(guess.y + widened, -BEYOND, BEYOND));
    return vec2<f32>(
        select(-BEYOND, low, surely_above(r, low, w)),
        select(BEYOND, high, surely_below(r, high, w)));
}

// Collects the candidates' planes that touch the volume and that a certificate proves.
// Each is moved away from the volume by a margin first.
// The result goes through a pointer, because a value of this size takes twice as long to compile.
fn supporting_planes(planes: ptr<function, SupportingPlanes>, p: Projected) {
    (*planes).count = 0u;
    let columns = proved_interval(p.x, p.w, p.w_min);
    let rows = proved_interval(p.y, p.w, p.w_min);
    (*planes).left_top = vec2<f32>(columns.x, rows.x);
    (*planes).right_bottom = vec2<f32>(columns.y, rows.y);
    for (var i = 0u; i < CANDIDATES; i += 1u) {
        let guess = candidate(i, p);
        if any((bitcast<vec2<u32>>(guess.slope) & vec2<u32>(0x7fffffffu)) > vec2<u32>(STEEPEST_BITS)) {
            continue;
        }
        // The barrier keeps a compiler from moving the slope's own quotient into the products.
        // That would certify another slope.
        var slope = bar2(select(guess.slope, vec2<f32>(0.0), abs(guess.slope) < vec2<f32>(FLATTEST)));
        var r = Value(
            guess.facing * p.z.center + slope.x * p.x.center + slope.y * p.y.center,
            abs(guess.facing) * p.z.error + abs(slope.x) * p.x.error + abs(slope.y) * p.y.error + ERROR_FLOOR,
            guess.facing * p.z.half + slope.x * p.x.half + slope.y * p.y.half);
        let interval = ratio_interval(r, p.w);
        let extent = interval.y - interval.x;
        var least = interval.x;
        if !on_border(guess.own, least, extent) {
            // The plane may touch the volume on its other side.
            // For an outline that side is an outline, too; for a front it would be a back.
            if guess.facing != 0.0 || !on_border(guess.own, interval.y, extent) {
                continue;
            }
            slope = -slope;
            r = Value(-r.center, r.error, -r.half);
            least = -interval.y;
        }
        let offset = bar(least - 3.0 * error_bound(r, least, p.w) / p.w_min);
        let small = is_small(bitcast<u32>(offset)) && error_bound(r, offset, p.w) < 0x1p38;
        if small && surely_above(r, offset, p.w) {
            (*planes).list[(*planes).count] = SupportingPlane(slope, guess.facing, offset);
            (*planes).count += 1u;
        }
    }
}

// True implies: pixels from `begin` to before `end` that are no farther than the stored depth show
// nothing of the volume.
fn surely_clear(planes: ptr<function, SupportingPlanes>, begin: vec2<u32>, end: vec2<u32>, bits: u32) -> bool {
    // The sums are exact, since their terms are multiples of 2^-8 below 2^16.
    // Minimum and maximum then choose one of two numbers.
    let left_top = max(vec2<f32>(begin) - view.reach - view.half_size, (*planes).left_top);
    let right_bottom = min(vec2<f32>(end) + view.reach - view.half_size, (*planes).right_bottom);
    // This holds at the far plane, too: what is farther is outside the frustum.
    let depth = bar(occluding_depth(bits) - view.z_slope);
    for (var i = 0u; i < (*planes).count; i += 1u) {
        let plane = (*planes).list[i];
        // The plane is nearest, or reaches farthest out, at this corner.
        let corner = select(left_top, right_bottom, plane.slope > vec2<f32>(0.0));
        let fall = plane.slope * corner;
        let bound = plane.facing * depth;
        // Two products, three differences and the depth's own: 6 roundings at most.
        let margin = 8.0 * EPS * (abs(plane.offset) + abs(fall.x) + abs(fall.y) + abs(bound)) + 0x1p-100;
        if plane.offset - fall.x - fall.y - margin > bound {
            return true;
        }
    }
    return false;
}
