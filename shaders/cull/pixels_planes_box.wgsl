// The planes of boxes, for counts of pixels.
//
// All of them come from the eight projected corners: a plane through each of the six faces, and
// one through each edge of the outline, which has at most six.
// Where the choice of an edge is wrong its plane still touches the box, as no corner is below it.
// All that counts is proved by `proved_offset`.

const OUTLINE_PLANES: u32 = 6u;
const FACE_PLANES: u32 = 6u;
// A face is in front of the box, or behind it.
const TWO_SIDED: bool = false;

// Four corners, of a face: their columns, rows and depths, measured towards the farther side.
struct Face {
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
}

fn projected_face(along: f32, p: Projected) -> Face {
    // Signs on the axes 1 and 2; that on axis 0 is `along`.
    let sign_1 = vec4<f32>(1.0, 1.0, -1.0, -1.0);
    let sign_2 = vec4<f32>(1.0, -1.0, 1.0, -1.0);
    let w = 1.0 / (p.w.center + along * p.w.half.x + sign_1 * p.w.half.y + sign_2 * p.w.half.z);
    return Face(
        (p.x.center + along * p.x.half.x + sign_1 * p.x.half.y + sign_2 * p.x.half.z) * w,
        (p.y.center + along * p.y.half.x + sign_1 * p.y.half.y + sign_2 * p.y.half.z) * w,
        farther_sign()
            * (p.z.center + along * p.z.half.x + sign_1 * p.z.half.y + sign_2 * p.z.half.z) * w);
}

fn sum4(v: vec4<f32>) -> f32 {
    return v.x + v.y + v.z + v.w;
}

// The least and the greatest of eight numbers.
fn ends_of(a: vec4<f32>, b: vec4<f32>) -> vec2<f32> {
    let low = min(a, b);
    let high = max(a, b);
    return vec2<f32>(
        min(min(low.x, low.y), min(low.z, low.w)), max(max(high.x, high.y), max(high.z, high.w)));
}

// The plane through a face, whose opposite face is `other`.
// Of a flat box, where both are the same, the first face is in front.
fn face_plane(
    face: Face, other: Face, is_first: bool, p: Projected, most: vec2<f32>,
) -> vec4<f32> {
    let normal = cross(
        vec3<f32>(face.x.x - face.x.w, face.y.x - face.y.w, face.z.x - face.z.w),
        vec3<f32>(face.x.y - face.x.z, face.y.y - face.y.z, face.z.y - face.z.z));
    let guess = usable(normal.xy / normal.z);
    let own = face.z + guess.slope.x * face.x + guess.slope.y * face.y;
    let others = other.z + guess.slope.x * other.x + guess.slope.y * other.y;
    // What is on its farther side is behind it.
    let distance = sum4(others) - sum4(own);
    let in_front = distance > 0.0 || (is_first && distance == 0.0);
    let sign = select(-1.0, 1.0, in_front);
    let slope = sign * guess.slope;
    let ends = ends_of(own, own);
    let least = select(-ends.y, ends.x, in_front);
    let offset = proved_offset(tilted(sign * farther_sign(), slope, p), least, slope, most, p);
    let is_front = in_front && !guess.is_steep;
    let is_back = !in_front && !guess.is_steep;
    return vec4<f32>(
        slope, select(NO_PLANE, offset, is_front), select(NO_PLANE, offset, is_back));
}

// Whether the first face of a pair is in front (1), the second one (-1), or none (0).
fn facing_of(first: vec4<f32>, second: vec4<f32>) -> f32 {
    return select(0.0, 1.0, first.z > NO_PLANE) - select(0.0, 1.0, second.z > NO_PLANE);
}

// Signs of two edges of the outline that run along an axis, on the two axes across it.
// An edge is there between a face in front and another one; `facing` is that of both axes.
fn outline_signs(facing: vec2<f32>) -> vec4<f32> {
    let some = facing != vec2<f32>(0.0);
    // With one pair of faces in front or behind, both edges are at that face.
    let a = select(facing.x, 1.0, !some.x);
    let b = select(facing.y, 1.0, !some.y);
    let is_both = some.x && some.y;
    return vec4<f32>(
        a, select(b, -b, is_both),
        select(a, -a, is_both || !some.x), select(b, -b, some.x && !some.y));
}

// The number at these signs; `v` has them in the order of `projected_face`.
fn at_signs(v: vec4<f32>, signs: vec2<f32>) -> f32 {
    let pair = select(v.zw, v.xy, signs.x > 0.0);
    return select(pair.y, pair.x, signs.y > 0.0);
}

// The plane through an edge of the outline: its slope and offset.
// All corners are those of the faces a and b.
fn edge_plane(
    begin: Face, end: Face, signs: vec2<f32>, a: Face, b: Face, p: Projected, most: vec2<f32>,
) -> vec3<f32> {
    let start = vec2<f32>(at_signs(begin.x, signs), at_signs(begin.y, signs));
    let along = vec2<f32>(at_signs(end.x, signs), at_signs(end.y, signs)) - start;
    let across = vec2<f32>(along.y, -along.x) / max(abs(along.x), abs(along.y));
    let guess = usable(across);
    let of_a = guess.slope.x * a.x + guess.slope.y * a.y;
    let of_b = guess.slope.x * b.x + guess.slope.y * b.y;
    let ends = ends_of(of_a, of_b);
    let own = dot(guess.slope, start);
    let is_low = own - ends.x < ends.y - own;
    let sign = select(-1.0, 1.0, is_low);
    let slope = sign * guess.slope;
    let least = select(-ends.y, ends.x, is_low);
    let offset = proved_offset(tilted(0.0, slope, p), least, slope, most, p);
    return vec3<f32>(slope, select(offset, NO_PLANE, guess.is_steep));
}

// Puts the planes of two faces behind those of four others.
fn push_faces(planes: ptr<function, PixelPlanes>, first: vec4<f32>, second: vec4<f32>) {
    (*planes).faces[0] = (*planes).faces[2];
    (*planes).faces[1] = (*planes).faces[3];
    (*planes).faces[2] = (*planes).faces[FACE_PLANES - 2u];
    (*planes).faces[3] = (*planes).faces[FACE_PLANES - 1u];
    (*planes).faces[FACE_PLANES - 2u] = first;
    (*planes).faces[FACE_PLANES - 1u] = second;
}

// Puts a plane of the outline behind five others.
fn push_edge(planes: ptr<function, PixelPlanes>, edge: vec3<f32>) {
    (*planes).outline_slopes[0] = (*planes).outline_slopes[1];
    (*planes).outline_slopes[1] = (*planes).outline_slopes[2];
    (*planes).outline_slopes[2] = (*planes).outline_slopes[3];
    (*planes).outline_slopes[3] = (*planes).outline_slopes[OUTLINE_PLANES - 2u];
    (*planes).outline_slopes[OUTLINE_PLANES - 2u] =
        (*planes).outline_slopes[OUTLINE_PLANES - 1u];
    (*planes).outline_slopes[OUTLINE_PLANES - 1u] = edge.xy;
    (*planes).outlines[0] = (*planes).outlines[1];
    (*planes).outlines[1] = (*planes).outlines[2];
    (*planes).outlines[2] = (*planes).outlines[3];
    (*planes).outlines[3] = (*planes).outlines[OUTLINE_PLANES - 2u];
    (*planes).outlines[OUTLINE_PLANES - 2u] = (*planes).outlines[OUTLINE_PLANES - 1u];
    (*planes).outlines[OUTLINE_PLANES - 1u] = edge.z;
}

// The faces at both ends of each axis.
struct Axes {
    first_0: Face,
    second_0: Face,
    first_1: Face,
    second_1: Face,
    first_2: Face,
    second_2: Face,
}

// The same, with axis 1 in the place of axis 0.
fn next_axis(v: Axes) -> Axes {
    return Axes(v.first_1, v.second_1, v.first_2, v.second_2, v.first_0, v.second_0);
}

fn fill_planes(planes: ptr<function, PixelPlanes>, p: Projected, most: vec2<f32>) {
    let a = projected_face(1.0, p);
    let b = projected_face(-1.0, p);
    let columns = proved_ends(ends_of(a.x, b.x), p.x, p.w, p.w_min);
    let rows = proved_ends(ends_of(a.y, b.y), p.y, p.w, p.w_min);
    (*planes).left_top = vec2<f32>(columns.x, rows.x);
    (*planes).right_bottom = vec2<f32>(columns.y, rows.y);
    fill_depths(planes, ends_of(a.z, b.z), p, most);

    // The faces at both ends of the axes 1 and 2; those of axis 0 are a and b.
    let c = Face(
        vec4<f32>(a.x.xy, b.x.xy), vec4<f32>(a.y.xy, b.y.xy), vec4<f32>(a.z.xy, b.z.xy));
    let d = Face(
        vec4<f32>(a.x.zw, b.x.zw), vec4<f32>(a.y.zw, b.y.zw), vec4<f32>(a.z.zw, b.z.zw));
    let e = Face(
        vec4<f32>(a.x.xz, b.x.xz), vec4<f32>(a.y.xz, b.y.xz), vec4<f32>(a.z.xz, b.z.xz));
    let f = Face(
        vec4<f32>(a.x.yw, b.x.yw), vec4<f32>(a.y.yw, b.y.yw), vec4<f32>(a.z.yw, b.z.yw));
    // Loops over the axes keep the code short.
    // Without them SwiftShader takes tens of gigabytes to compile it.
    // Each step hands on the next axis, and moves planes on by constant places, since lavapipe is
    // slow to index arrays.
    var axes = Axes(a, b, c, d, e, f);
    var facing = vec3<f32>(0.0);
    for (var axis = 0u; 2u * axis < FACE_PLANES; axis += 1u) {
        let first = face_plane(axes.first_0, axes.second_0, true, p, most);
        let second = face_plane(axes.second_0, axes.first_0, false, p, most);
        push_faces(planes, first, second);
        facing = vec3<f32>(facing.yz, facing_of(first, second));
        axes = next_axis(axes);
    }
    // Two edges of the outline along each axis; the facing is that of the other two axes.
    for (var axis = 0u; 2u * axis < OUTLINE_PLANES; axis += 1u) {
        let signs = outline_signs(select(facing.yz, facing.zy, axis == 1u));
        let begin = axes.second_0;
        let end = axes.first_0;
        push_edge(planes, edge_plane(begin, end, signs.xy, a, b, p, most));
        push_edge(planes, edge_plane(begin, end, signs.zw, a, b, p, most));
        facing = facing.yzx;
        axes = next_axis(axes);
    }
}
