// The boxes of an upper tier, each around GROUP boxes of the tier below: an invocation per box.
//
// They are formed from the records that culls read, after whatever has written those.
// So a box contains the boxes below it, whichever recordings have run, and an invalid one below
// makes it invalid.

// Twin: `FormUniform` in `crates/hiz_core/src/instances/tiers.rs`.
struct FormTier {
    // Boxes to form.
    count: u32,
    // Boxes of the tier below.
    below: u32,
    // 0, which no compiler knows: see `bar`.
    runtime_zero: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> source: FormTier;
// Which boxes, where they are not all of the tier.
@group(0) @binding(1) var<storage, read> chosen: array<u32>;
@group(0) @binding(2) var boxes_below: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(3) var boxes: texture_storage_2d<rgba32uint, write>;

// Only the chosen boxes are formed.
override SOME: bool;

// Twin: `WORKGROUP` in `crates/hiz_core/src/instances/tiers.rs`.
const WORKGROUP: u32 = 64u;

// The key of a float that is not above `hi + lo - half`, and of one that is not below
// `hi + lo + half`.
// Each sum is moved outwards by a float, which covers its rounding.
fn ends(hi: f32, lo: f32, half: f32) -> vec2<u32> {
    let least = bitcast<f32>(bits_of(key_below(lo - half)));
    let greatest = bitcast<f32>(bits_of(key_above(lo + half)));
    return vec2<u32>(key_below(hi + least), key_above(hi + greatest));
}

fn is_small(bits: vec3<u32>) -> bool {
    return all((bits & vec3<u32>(MAGNITUDE_BITS)) < vec3<u32>(LARGEST_BITS));
}

@compute @workgroup_size(WORKGROUP)
fn form_tier(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= source.count {
        return;
    }
    var here = id.x;
    if SOME { here = chosen[id.x]; }
    var around = Corners(vec3<u32>(INVALID_HIGH), vec3<u32>(INVALID_LOW));
    var is_valid = true;
    var is_absent = true;
    let first = here * GROUP;
    for (var i = first; i < min(first + GROUP, source.below); i += 1u) {
        let hi = textureLoad(boxes_below, record_position(i, 0u, BOX_TEXELS)).xyz;
        let lo = textureLoad(boxes_below, record_position(i, 1u, BOX_TEXELS)).xyz;
        let half = textureLoad(boxes_below, record_position(i, 2u, BOX_TEXELS)).xyz;
        if hi.x != ABSENT_CENTER_BITS {
            is_absent = false;
            is_valid = is_valid && is_small(hi) && is_small(lo) && is_small(half);
            let center = bitcast<vec3<f32>>(hi);
            let rest = bitcast<vec3<f32>>(lo);
            let reach = bitcast<vec3<f32>>(half);
            let x = ends(center.x, rest.x, reach.x);
            let y = ends(center.y, rest.y, reach.y);
            let z = ends(center.z, rest.z, reach.z);
            around = Corners(
                min(around.low, vec3<u32>(x.x, y.x, z.x)),
                max(around.high, vec3<u32>(x.y, y.y, z.y)));
        }
    }
    var formed = BoxTexels(vec3<u32>(0u), vec3<u32>(BEYOND_LIMITS_BITS));
    if is_absent {
        formed = BoxTexels(vec3<u32>(ABSENT_CENTER_BITS, 0u, 0u), vec3<u32>(0u));
    } else if is_valid {
        formed = box_texels(around);
    }
    textureStore(boxes, record_position(here, 0u, BOX_TEXELS), vec4<u32>(formed.center, 0u));
    textureStore(boxes, record_position(here, 1u, BOX_TEXELS), vec4<u32>(0u));
    textureStore(boxes, record_position(here, 2u, BOX_TEXELS), vec4<u32>(formed.half, 0u));
}
