// Axis-aligned boxes from the caller's buffer: least and greatest corner, six float32.

// Texels of a record; see `bounds_box.wgsl`.
const RECORD_TEXELS: u32 = 3u;

// Writes the record of the box at `word` of the buffer, and returns its corners.
fn take(place: u32, index: u32, word: u32) -> Corners {
    let low = vec3<u32>(given[word], given[word + 1u], given[word + 2u]);
    let second = word + 3u;
    let high = vec3<u32>(given[second], given[second + 1u], given[second + 2u]);
    let corners = Corners(keys_of(low), keys_of(high));
    var box = BoxTexels(vec3<u32>(0u), vec3<u32>(BEYOND_LIMITS_BITS));
    if are_corners(low) && are_corners(high) && all(corners.low <= corners.high) {
        box = box_texels(corners);
    }
    textureStore(records, record_position(place, 0u, RECORD_TEXELS), vec4<u32>(box.center, 0u));
    textureStore(records, record_position(place, 1u, RECORD_TEXELS), vec4<u32>(0u, 0u, 0u, index));
    textureStore(records, record_position(place, 2u, RECORD_TEXELS), vec4<u32>(box.half, 0u));
    if box.half.x == BEYOND_LIMITS_BITS {
        return invalid_corners();
    }
    return corners;
}

// Whether all are finite, and small enough for sums of them.
fn are_corners(bits: vec3<u32>) -> bool {
    return all((bits & vec3<u32>(MAGNITUDE_BITS)) < vec3<u32>(LARGEST_CORNER_BITS));
}

// -0 counts as 0, so that a box from 0 to -0 is a flat one.
fn keys_of(bits: vec3<u32>) -> vec3<u32> {
    return vec3<u32>(key_of_number(bits.x), key_of_number(bits.y), key_of_number(bits.z));
}

fn key_of_number(bits: u32) -> u32 {
    return key_of(select(bits, 0u, bits == SIGN_BIT));
}
