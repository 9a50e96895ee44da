// Spheres from the caller's buffer: x, y, z and radius, four float32.
// A record holds these numbers as they are, so nothing is rounded but the sphere's corners.

// Texels of a record; see `bounds_sphere.wgsl`.
const RECORD_TEXELS: u32 = 2u;

// Writes the record of the sphere at `word` of the buffer, and returns its corners.
fn take(place: u32, index: u32, word: u32) -> Corners {
    var center = vec3<u32>(given[word], given[word + 1u], given[word + 2u]);
    var radius = given[word + 3u];
    let is_valid = all((center & vec3<u32>(MAGNITUDE_BITS)) < vec3<u32>(LARGEST_BITS))
        && (radius < LARGEST_BITS || radius == SIGN_BIT);
    radius &= MAGNITUDE_BITS;
    var corners = invalid_corners();
    if is_valid {
        corners = corners_of(bitcast<vec3<f32>>(center), bitcast<f32>(radius));
    } else {
        center = vec3<u32>(0u);
        radius = BEYOND_LIMITS_BITS;
    }
    textureStore(records, record_position(place, 0u, RECORD_TEXELS), vec4<u32>(center, radius));
    textureStore(records, record_position(place, 1u, RECORD_TEXELS), vec4<u32>(0u, 0u, 0u, index));
    return corners;
}

fn corners_of(center: vec3<f32>, radius: f32) -> Corners {
    let low = center - radius;
    let high = center + radius;
    return Corners(
        vec3<u32>(key_below(low.x), key_below(low.y), key_below(low.z)),
        vec3<u32>(key_above(high.x), key_above(high.y), key_above(high.z)));
}
