// The planes that bound a volume from all sides, for counts of pixels (`pixels.wgsl`).
//
// They are the supporting planes of `supporting_planes.wgsl`, in places that are fixed.
// A face gives a plane in front of the volume, or one behind it:
//
// facing * (z / w - A) > front - slope . (x, y) on all of the volume
// -facing * (z / w - A) > back - slope . (x, y) on all of the volume
//
// docs/accuracy.md derives the margins, under "Counts of pixels".
//
// What is used here and defined elsewhere:
//
// - `pixels_planes_box.wgsl` or `pixels_planes_any.wgsl`: `OUTLINE_PLANES`, `FACE_PLANES`,
//   `TWO_SIDED`, and `fill_planes`, which fills what is here

// No array is empty.
const OUTLINE_PLACES: u32 = max(OUTLINE_PLANES, 1u);
const FACE_PLACES: u32 = max(FACE_PLANES, 1u);
// The offset of a plane that says nothing.
const NO_PLANE: f32 = -0x1p100;

struct PixelPlanes {
    // The rectangle around the volume, to fractions of a pixel.
    left_top: vec2<f32>,
    right_bottom: vec2<f32>,
    // The offsets of planes of slope 0, at the nearest and the farthest depth of the volume.
    front: f32,
    back: f32,
    outline_slopes: array<vec2<f32>, OUTLINE_PLACES>,
    outlines: array<f32, OUTLINE_PLACES>,
    // Slope, and the offsets in front and behind.
    // Where TWO_SIDED is true, the plane behind has the opposite slope.
    faces: array<vec4<f32>, FACE_PLACES>,
}

// An offset less than the least r / w, if a certificate proves it, less the margin of its
// comparison with a pixel.
// No pixel's corner is farther from the image's middle than `most`.
fn proved_offset(r: Value, least: f32, slope: vec2<f32>, most: vec2<f32>, p: Projected) -> f32 {
    let offset = bar(least - GUESS_ERRORS * error_bound(r, least, p.w) / p.w_min);
    let holds = is_small(bitcast<u32>(offset)) && error_bound(r, offset, p.w) < LARGEST_ERROR
        && surely_above(r, offset, p.w);
    let magnitudes = abs(offset) + dot(abs(slope), most);
    let margin = TEXEL_ULPS * EPS * magnitudes + TEXEL_FLOOR;
    return select(NO_PLANE, offset - margin, holds);
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

// The planes of slope 0, whose rows reach from `depths.x` to `depths.y` of the farther side.
fn fill_depths(
    planes: ptr<function, PixelPlanes>, depths: vec2<f32>, p: Projected, most: vec2<f32>,
) {
    let none = vec2<f32>(0.0);
    let depth = tilted(farther_sign(), none, p);
    (*planes).front = proved_offset(depth, depths.x, none, most, p);
    (*planes).back = proved_offset(opposite(depth), -depths.y, none, most, p);
}
