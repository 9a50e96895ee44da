// Visibility tests as published texts print them.
// They prove nothing, and they hide some instances that can be seen.
// They exist to be measured beside the certified cull.
//
// Sources, each with an entry point:
//
// - `cull_rakos`: Daniel Rakos, "Hierarchical-Z map based occlusion culling", 2010: boxes.
// - `cull_arm`: ARM, "Occlusion Culling with Hierarchical-Z" (OpenGL ES SDK): spheres, with the
//   bounds of Mara and McGuire, "2D Polyhedral Bounds of a Clipped, Perspective-Projected 3D
//   Sphere", 2013.
// - `cull_darnell`: Nick Darnell, "Hierarchical Z-Buffer Occlusion Culling", 2010: spheres.
// - `cull_one_lookup`: the rectangle of the first, and one texel at its centre.
//
// They share one depth image in reversed Z: 1 is near, and 0 is far.
// The texts have the other direction, so their maximum of depths is a minimum here.
// Level k of the texture has `max(1, size >> k)` texels along each side.

// Invocations of a workgroup.
// Twin: `WORKGROUP` in `crates/hiz_core/src/methods/texts.rs`.
const WORKGROUP: u32 = 64u;
// Twin: `MAX_LEVELS` in `crates/hiz_core/src/pyramid/levels.rs`.
const MAX_LEVELS: u32 = 16u;

const HALF: f32 = 0.5;
const CORNERS: u32 = 8u;
const PLANES: u32 = 6u;
// Corners of a square about a sphere.
const SQUARE: u32 = 4u;

// Twin: `TextUniform` in `crates/hiz_core/src/methods/texts.rs`.
// A matrix holds its rows as columns, so that `v * m` multiplies the matrix with `v`.
struct TextView {
    clip_from_world: mat4x4<f32>,
    view_from_world: mat4x4<f32>,
    clip_from_view: mat4x4<f32>,
    // Of the frustum, with unit normals that look inside.
    planes: array<vec4<f32>, PLANES>,
    eye: vec4<f32>,
    up: vec4<f32>,
    // Of the image, in pixels.
    size: vec2<f32>,
    near: f32,
    count: u32,
    // Where each level begins in `texels`, and its width and height.
    levels: array<vec4<u32>, MAX_LEVELS>,
    num_levels: u32,
}

@group(0) @binding(0) var<uniform> view: TextView;
// A box has its least and its greatest corner, a sphere its centre and radius.
@group(0) @binding(1) var<storage, read> bounds: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> texels: array<f32>;
// 1 for what is kept, 0 for what is hidden or outside.
@group(0) @binding(3) var<storage, read_write> kept: array<u32>;

fn texel(level: vec4<u32>, at: vec2<i32>) -> f32 {
    let last = vec2<i32>(level.yz) - vec2<i32>(1);
    let inside = vec2<u32>(clamp(at, vec2<i32>(0), last));
    return texels[level.x + inside.y * level.y + inside.x];
}

fn level_of(lod: f32) -> vec4<u32> {
    return view.levels[u32(clamp(lod, 0.0, f32(view.num_levels - 1u)))];
}

// What a sampler with nearest filtering and clamped edges returns.
fn lookup(uv: vec2<f32>, lod: f32) -> f32 {
    let level = level_of(lod);
    return texel(level, vec2<i32>(floor(uv * vec2<f32>(level.yz))));
}

fn uv_of(ndc: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(HALF, -HALF) * ndc + HALF;
}

fn report(i: u32, is_kept: bool) {
    kept[i] = select(0u, 1u, is_kept);
}

// The rectangle about a box's corners, and their nearest depth.
struct BoxInView {
    is_outside: bool,
    low: vec2<f32>,
    high: vec2<f32>,
    nearest: f32,
}

// All corners are divided by their w, whatever its sign, as in the text.
fn box_in_view(i: u32) -> BoxInView {
    let ends = array<vec3<f32>, 2>(bounds[2u * i].xyz, bounds[2u * i + 1u].xyz);
    var below = vec3<bool>(true);
    var above = vec3<bool>(true);
    var box: BoxInView;
    for (var k = 0u; k < CORNERS; k += 1u) {
        let corner = vec3<f32>(ends[k & 1u].x, ends[(k >> 1u) & 1u].y, ends[k >> 2u].z);
        let clip = vec4<f32>(corner, 1.0) * view.clip_from_world;
        let least = vec3<f32>(-clip.w, -clip.w, 0.0);
        below = below & (clip.xyz < least);
        above = above & (clip.xyz > vec3<f32>(clip.w));
        let ndc = clip.xyz / clip.w;
        let uv = uv_of(ndc.xy);
        box.low = select(min(box.low, uv), uv, k == 0u);
        box.high = select(max(box.high, uv), uv, k == 0u);
        box.nearest = select(max(box.nearest, ndc.z), ndc.z, k == 0u);
    }
    box.is_outside = any(below) || any(above);
    return box;
}

@compute @workgroup_size(WORKGROUP)
fn cull_rakos(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= view.count {
        return;
    }
    let box = box_in_view(i);
    let pixels = (box.high - box.low) * view.size;
    let lod = ceil(log2(max(pixels.x, pixels.y) / 2.0));
    let farthest = min(
        min(lookup(box.low, lod), lookup(vec2<f32>(box.low.x, box.high.y), lod)),
        min(lookup(box.high, lod), lookup(vec2<f32>(box.high.x, box.low.y), lod)));
    report(i, !box.is_outside && !(box.nearest < farthest));
}

@compute @workgroup_size(WORKGROUP)
fn cull_one_lookup(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= view.count {
        return;
    }
    let box = box_in_view(i);
    let pixels = (box.high - box.low) * view.size;
    let lod = ceil(log2(max(pixels.x, pixels.y)));
    let farthest = lookup(HALF * (box.low + box.high), lod);
    report(i, !box.is_outside && !(box.nearest < farthest));
}

fn sphere_is_outside(sphere: vec4<f32>) -> bool {
    for (var k = 0u; k < PLANES; k += 1u) {
        if dot(view.planes[k], vec4<f32>(sphere.xyz, 1.0)) < -sphere.w {
            return true;
        }
    }
    return false;
}

// Depth of a point in view space.
fn depth_of(point: vec3<f32>) -> f32 {
    let clip = vec4<f32>(point, 1.0) * view.clip_from_view;
    return clip.z / clip.w;
}

// Where the tangents to a circle meet depth 1, least first.
// `center` is along an axis of the image and along the direction of view.
fn tangents(center: vec2<f32>, radius: f32) -> vec2<f32> {
    let squared = radius * radius;
    let root = radius * sqrt(dot(center, center) - squared);
    let middle = center.x * center.y;
    return (vec2<f32>(middle) + vec2<f32>(-root, root)) / (center.y * center.y - squared);
}

@compute @workgroup_size(WORKGROUP)
fn cull_arm(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= view.count {
        return;
    }
    let sphere = bounds[i];
    let center = (vec4<f32>(sphere.xyz, 1.0) * view.view_from_world).xyz;
    let nearest_z = center.z + sphere.w;
    if sphere_is_outside(sphere) || nearest_z >= -view.near {
        report(i, !sphere_is_outside(sphere));
        return;
    }
    // Only the scales of the projection are used, as in the text; an off-centre one has more.
    let scale = vec2<f32>(view.clip_from_view[0].x, view.clip_from_view[1].y);
    let x = scale.x * tangents(vec2<f32>(center.x, -center.z), sphere.w);
    let y = scale.y * tangents(vec2<f32>(center.y, -center.z), sphere.w);
    let low = uv_of(vec2<f32>(x.x, y.y));
    let high = uv_of(vec2<f32>(x.y, y.x));
    let pixels = (high - low) * view.size;
    let lod = ceil(log2(max(max(pixels.x, pixels.y), 1.0)));
    let nearest = depth_of(vec3<f32>(0.0, 0.0, nearest_z));
    // A comparing sampler with linear filtering: the 2x2 texels about the middle, by their weights.
    let level = level_of(lod);
    let place = HALF * (low + high) * vec2<f32>(level.yz) - HALF;
    let first = vec2<i32>(floor(place));
    let second = select(vec2<i32>(0), vec2<i32>(1), fract(place) > vec2<f32>(0.0));
    let farthest = min(
        min(texel(level, first), texel(level, first + vec2<i32>(second.x, 0))),
        min(texel(level, first + vec2<i32>(0, second.y)), texel(level, first + second)));
    report(i, nearest >= farthest);
}

@compute @workgroup_size(WORKGROUP)
fn cull_darnell(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if i >= view.count {
        return;
    }
    let sphere = bounds[i];
    let toward = view.eye.xyz - sphere.xyz;
    let distance_to_eye = length(toward);
    // A square about the sphere, that faces the eye on one axis.
    let spread = distance_to_eye * tan(asin(sphere.w / distance_to_eye));
    let up = view.up.xyz * spread;
    let right = normalize(cross(toward, view.up.xyz)) * spread;
    let corners = array<vec3<f32>, SQUARE>(
        sphere.xyz + up - right, sphere.xyz + up + right,
        sphere.xyz - up - right, sphere.xyz - up + right);
    var uv: array<vec2<f32>, SQUARE>;
    for (var k = 0u; k < SQUARE; k += 1u) {
        let clip = vec4<f32>(corners[k], 1.0) * view.clip_from_world;
        uv[k] = uv_of(clip.xy / clip.w);
    }
    let lod = ceil(log2(distance(uv[0], uv[1]) * max(view.size.x, view.size.y)));
    // The point of the sphere that is nearest in space, which need not have the least depth.
    let center = (vec4<f32>(sphere.xyz, 1.0) * view.view_from_world).xyz;
    let nearest = depth_of(center - normalize(center) * sphere.w);
    let farthest = min(
        min(lookup(uv[0], lod), lookup(uv[1], lod)),
        min(lookup(uv[2], lod), lookup(uv[3], lod)));
    report(i, !sphere_is_outside(sphere) && !(nearest < farthest));
}
