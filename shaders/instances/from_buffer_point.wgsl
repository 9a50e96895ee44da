// Points from the caller's buffer: x, y and z, three float32.
// A record and the corners hold these numbers as they are, so nothing is rounded.

// Texels of a record; see `bounds_point.wgsl`.
const RECORD_TEXELS: u32 = 1u;

// Writes the record of the point at `word` of the buffer, and returns its corners.
fn take(place: u32, index: u32, word: u32) -> Corners {
    var position = vec3<u32>(given[word], given[word + 1u], given[word + 2u]);
    let is_valid = all((position & vec3<u32>(MAGNITUDE_BITS)) < vec3<u32>(LARGEST_BITS));
    var corners = invalid_corners();
    if is_valid {
        let keys = keys_of(position);
        corners = Corners(keys, keys);
    } else {
        position = vec3<u32>(BEYOND_LIMITS_BITS, 0u, 0u);
    }
    textureStore(records, record_position(place, 0u, RECORD_TEXELS), vec4<u32>(position, index));
    return corners;
}

// -0 counts as 0, so that equal coordinates have equal keys.
fn keys_of(bits: vec3<u32>) -> vec3<u32> {
    return vec3<u32>(key_of_number(bits.x), key_of_number(bits.y), key_of_number(bits.z));
}

fn key_of_number(bits: u32) -> u32 {
    return key_of(select(bits, 0u, bits == SIGN_BIT));
}
