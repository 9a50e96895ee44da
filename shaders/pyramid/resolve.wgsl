// Multisampled depth becomes one depth per pixel: its farthest sample, its nearest, or both.
//
// The farthest of them is behind all that the pixel shows, so a pyramid of it is as safe as one of
// each sample.
// An average, or the first sample alone, would hide what shows through the other samples.
//
// An invocation takes VECTOR pixels of a row and stores them as one vector into a buffer.
// The buffer is copied into a texture of four pixels per texel afterwards.
// On software drivers this takes half of the time of stores into a texture.

// How many samples a pixel has.
override SAMPLES: i32;
// Which ends are made.
override FARTHEST: bool;
override NEAREST: bool;

// Invocations of a workgroup, in a row.
// Twin: `WORKGROUP` in `crates/hiz_core/src/pyramid/resolve.rs`.
const WORKGROUP: u32 = 64u;

// Twin: `ResolvedUniform` in `crates/hiz_core/src/pyramid/resolve.rs`.
struct ResolvedImage {
    // Where the image begins in its texture, and its size, in pixels.
    origin: vec2<u32>,
    size: vec2<u32>,
}

// Twin: `BandUniform` in `crates/hiz_core/src/pyramid/resolve.rs`.
struct Band {
    // The first of the rows that the buffer takes at a time, and how many they are.
    first: u32,
    rows: u32,
    // Vectors from a row to the next, and to the same row of the nearest depths.
    stride: u32,
    nearest: u32,
}

@group(0) @binding(1) var<storage, read_write> resolved: array<vec4<u32>>;
@group(0) @binding(2) var<uniform> image: ResolvedImage;
@group(1) @binding(0) var<uniform> band: Band;

// Four samples from sample k on; those past the last one repeat it.
fn four_samples(at: vec2<u32>, k: i32) -> vec4<u32> {
    let last = SAMPLES - 1;
    return vec4<u32>(
        sample_bits(at, k), sample_bits(at, min(k + 1, last)),
        sample_bits(at, min(k + 2, last)), sample_bits(at, min(k + 3, last)));
}

// A pixel of the image in its texture; pixels past the edge are replaced by pixels at the edge.
fn place(x: u32, y: u32) -> vec2<u32> {
    return image.origin + min(vec2<u32>(x, y), image.size - vec2<u32>(1u));
}

fn farthest_sample(x: u32, y: u32) -> u32 {
    let at = place(x, y);
    var bits = near_bits();
    for (var k = 0; k < SAMPLES; k += i32(VECTOR)) {
        bits = farthest(bits, farthest_sanitized4(four_samples(at, k)));
    }
    return bits;
}

fn nearest_sample(x: u32, y: u32) -> u32 {
    let at = place(x, y);
    var bits = far_bits();
    for (var k = 0; k < SAMPLES; k += 1) {
        bits = nearest(bits, sanitized_near(sample_bits(at, k)));
    }
    return bits;
}

@compute @workgroup_size(WORKGROUP, 1)
fn resolve(@builtin(global_invocation_id) id: vec3<u32>) {
    let x = VECTOR * id.x;
    let y = band.first + id.y;
    if x >= image.size.x || id.y >= band.rows {
        return;
    }
    let index = id.y * band.stride + id.x;
    if FARTHEST {
        resolved[index] = vec4<u32>(
            farthest_sample(x, y), farthest_sample(x + 1u, y),
            farthest_sample(x + 2u, y), farthest_sample(x + 3u, y));
    }
    if NEAREST {
        resolved[band.nearest + index] = vec4<u32>(
            nearest_sample(x, y), nearest_sample(x + 1u, y),
            nearest_sample(x + 2u, y), nearest_sample(x + 3u, y));
    }
}
