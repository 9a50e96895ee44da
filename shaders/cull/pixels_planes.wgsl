// The planes that bound a volume from all sides, for counts of pixels (`pixels.wgsl`).
//
// They are the supporting planes of `supporting_planes.wgsl`, in places that are fixed.
// A face gives a plane in front of the volume, or one behind it:
//
// facing * (z / w - A) > front - slope . (x, y) on all of the volume
// -facing * (z / w - A) > back + slope . (x, y) on all of the volume
//
// Of a sphere, each tangent has a parallel one on the other side.
// docs/accuracy.md derives the margins, under "Counts of pixels".

// Candidates that bound the depth; those that bound the outline come first.
const FACE_PLANES: u32 = CANDIDATES - OUTLINES;
// And one of slope 0 behind them, at the nearest and farthest depth of all of the volume.
const DEPTH_PLANES: u32 = FACE_PLANES + 1u;
// No array is empty.
const OUTLINE_PLACES: u32 = max(OUTLINES, 1u);
// The offset of a plane that says nothing.
const NO_PLANE: f32 = -0x1p100;

struct PixelPlanes {
    // The rectangle around the volume, to fractions of a pixel.
    left_top: vec2<f32>,
    right_bottom: vec2<f32>,
    outline_slopes: array<vec2<f32>, OUTLINE_PLACES>,
    outlines: array<f32, OUTLINE_PLACES>,
    face_slopes: array<vec2<f32>, DEPTH_PLANES>,
    fronts: array<f32, DEPTH_PLANES>,
    backs: array<f32, DEPTH_PLANES>,
}

// An offset less than the least r / w, if a certificate proves it, less the margin of its
// comparison with a pixel.
// No pixel's corner is farther from the image's middle than `most`.
fn proved_offset(r: Value, least: f32, slope: vec2<f32>, most: vec2<f32>, p: Projected) -> f32 {
    let offset = bar(least - GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min);
    let holds = is_small(bitcast<u32>(offset)) && error_bound(r, offset, p.w) < LARGEST_ERROR
        && surely_above(r, offset, p.w);
    let magnitudes = abs(offset) + dot(abs(slope), most);
    return select(NO_PLANE, offset - TEXEL_ULPS * EPS * magnitudes, holds);
}

// A slope that can be certified, or 0 with `is_steep` where there is none.
struct Slope {
    slope: vec2<f32>,
    is_steep: bool,
}

fn usable(guess: vec2<f32>) -> Slope {
    let steepness = bitcast<vec2<u32>>(guess) & vec2<u32>(MAGNITUDE_MASK);
    let is_steep = any(steepness > vec2<u32>(STEEPEST_BITS));
    let is_flat = abs(guess) < vec2<f32>(FLATTEST) | vec2<bool>(is_steep);
    return Slope(bar2(select(guess, vec2<f32>(0.0), is_flat)), is_steep);
}

// The row of a plane with this slope.
fn tilted(facing: f32, slope: vec2<f32>, p: Projected) -> Value {
    return Value(
        facing * p.z.center + slope.x * p.x.center + slope.y * p.y.center,
        abs(facing) * p.z.error
            + abs(slope.x) * p.x.error + abs(slope.y) * p.y.error + ERROR_FLOOR,
        facing * p.z.half + slope.x * p.x.half + slope.y * p.y.half);
}

fn opposite(r: Value) -> Value {
    return Value(-r.center, r.error, -r.half);
}

fn pixel_planes(planes: ptr<function, PixelPlanes>, p: Projected, most: vec2<f32>) {
    let columns = proved_interval(p.x, p.w, p.w_min);
    let rows = proved_interval(p.y, p.w, p.w_min);
    (*planes).left_top = vec2<f32>(columns.x, rows.x);
    (*planes).right_bottom = vec2<f32>(columns.y, rows.y);
    for (var i = 0u; i < OUTLINES; i += 1u) {
        let guess = candidate(i, p);
        let tilt = usable(guess.slope);
        let r = tilted(0.0, tilt.slope, p);
        let interval = ratio_interval(r, p.w);
        let extent = interval.y - interval.x;
        let is_low = on_border(guess.own, interval.x, extent);
        let is_border = is_low || on_border(guess.own, interval.y, extent);
        // The other side of an outline belongs to another edge.
        let sign = select(-1.0, 1.0, is_low);
        let slope = sign * tilt.slope;
        let row = Value(sign * r.center, r.error, sign * r.half);
        let least = select(-interval.y, interval.x, is_low);
        let offset = proved_offset(row, least, slope, most, p);
        (*planes).outline_slopes[i] = slope;
        (*planes).outlines[i] = select(NO_PLANE, offset, is_border && !tilt.is_steep);
    }
    for (var i = 0u; i < FACE_PLANES; i += 1u) {
        let guess = candidate(OUTLINES + i, p);
        let tilt = usable(guess.slope);
        let r = tilted(guess.facing, tilt.slope, p);
        let interval = ratio_interval(r, p.w);
        let extent = interval.y - interval.x;
        let in_front = on_border(guess.own, interval.x, extent) && !tilt.is_steep;
        let behind = on_border(guess.own, interval.y, extent) && !tilt.is_steep;
        let front = proved_offset(r, interval.x, tilt.slope, most, p);
        let back = proved_offset(opposite(r), -interval.y, tilt.slope, most, p);
        (*planes).face_slopes[i] = tilt.slope;
        (*planes).fronts[i] = select(NO_PLANE, front, in_front);
        (*planes).backs[i] = select(NO_PLANE, back, behind);
    }
    let none = vec2<f32>(0.0);
    let depth = tilted(farther_sign(), none, p);
    let depths = ratio_interval(depth, p.w);
    (*planes).face_slopes[FACE_PLANES] = none;
    (*planes).fronts[FACE_PLANES] = proved_offset(depth, depths.x, none, most, p);
    (*planes).backs[FACE_PLANES] = proved_offset(opposite(depth), -depths.y, none, most, p);
}
