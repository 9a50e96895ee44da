// The planes of spheres and points, for counts of pixels: those of their candidates.
// Each is tried in front of the volume and behind it.

const OUTLINE_PLANES: u32 = OUTLINES;
const FACE_PLANES: u32 = CANDIDATES - OUTLINES;
// Of a sphere, each tangent has a parallel one on the other side.
const TWO_SIDED: bool = true;

fn fill_planes(planes: ptr<function, PixelPlanes>, p: Projected, most: vec2<f32>) {
    let columns = proved_interval(p.x, p.w, p.w_min);
    let rows = proved_interval(p.y, p.w, p.w_min);
    (*planes).left_top = vec2<f32>(columns.x, rows.x);
    (*planes).right_bottom = vec2<f32>(columns.y, rows.y);
    for (var i = 0u; i < OUTLINE_PLANES; i += 1u) {
        let tilt = usable(candidate(i, p).slope);
        let r = tilted(0.0, tilt.slope, p);
        let offset = proved_offset(r, ratio_interval(r, p.w).x, tilt.slope, most, p);
        (*planes).outline_slopes[i] = tilt.slope;
        (*planes).outlines[i] = select(offset, NO_PLANE, tilt.is_steep);
    }
    for (var i = 0u; i < FACE_PLANES; i += 1u) {
        let guess = candidate(OUTLINE_PLANES + i, p);
        let tilt = usable(guess.slope);
        let r = tilted(guess.facing, tilt.slope, p);
        let interval = ratio_interval(r, p.w);
        let front = proved_offset(r, interval.x, tilt.slope, most, p);
        let back = proved_offset(opposite(r), -interval.y, tilt.slope, most, p);
        (*planes).faces[i] = vec4<f32>(
            tilt.slope, select(vec2<f32>(front, back), vec2<f32>(NO_PLANE), tilt.is_steep));
    }
    let depth = tilted(farther_sign(), vec2<f32>(0.0), p);
    fill_depths(planes, ratio_interval(depth, p.w), p, most);
}
