// Adds up particles of one pixel each, in any order: an invocation per particle.
//
// A particle shows where it is nearer than the scene.
// Sums of whole numbers are the same in every order, so no particle has to be sorted.

// Asks one coarse level before the depth image.
override COARSE: bool;
// A particle shows in four shares, one for each of the 2x2 pixels that it may touch.
// Otherwise one pixel decides.
override SOFT: bool;
// Counts how the particles were decided.
override COUNTED: bool;

// Twin: `View` in `particles.rs`.
struct View {
    // Rows of clip space.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    size: vec2<u32>,
    particles: u32,
    // Pixels of a texel, as a power of two.
    level: u32,
    // Words of the level: of its farthest and of its nearest depths, and from row to row.
    farthest: u32,
    nearest: u32,
    stride: u32,
    step: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var<storage, read> farthest: array<f32>;
@group(0) @binding(3) var<storage, read> nearest: array<f32>;
@group(0) @binding(4) var<storage, read_write> picture: array<atomic<u32>>;
// Particles in the image; before all of their texel, and behind all of it.
@group(0) @binding(5) var<storage, read_write> counts: array<atomic<u32>, 3>;

// Particles of a puff, whose numbers are neighbours.
const PUFF: u32 = 512u;
const RADIUS: f32 = 0.6;

// Source: Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020 (pcg3d).
fn random(seed: vec3<u32>) -> vec3<f32> {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3<u32>(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return vec3<f32>(v >> vec3<u32>(8u)) / 16777216.0;
}

// Puffs drift in a hall of 40 by 8 by 40 metres.
fn position(particle: u32) -> vec3<f32> {
    let puff = random(vec3<u32>(particle / PUFF, 7u, 1u));
    let within = random(vec3<u32>(particle, 3u, 2u)) - 0.5;
    return vec3<f32>(40.0, 8.0, 40.0) * (puff - 0.5) + 2.0 * RADIUS * within;
}

// The shares of a particle that all pixels let through.
const FULL: u32 = 4u;

fn shares_in_front(pixel: vec2<u32>, z: f32) -> u32 {
    if !SOFT {
        return select(0u, FULL, z > textureLoad(depth, pixel, 0));
    }
    let last = min(pixel + 1u, view.size - 1u);
    return u32(z > textureLoad(depth, pixel, 0))
        + u32(z > textureLoad(depth, vec2<u32>(last.x, pixel.y), 0))
        + u32(z > textureLoad(depth, vec2<u32>(pixel.x, last.y), 0))
        + u32(z > textureLoad(depth, last, 0));
}

@compute @workgroup_size(64)
fn draw(@builtin(global_invocation_id) id: vec3<u32>) {
    let particle = id.x;
    if particle >= view.particles {
        return;
    }
    let p = vec4<f32>(position(particle), 1.0);
    let clip = vec4<f32>(dot(view.x, p), dot(view.y, p), dot(view.z, p), dot(view.w, p));
    if clip.w <= 0.0 || any(abs(clip.xy) >= vec2<f32>(clip.w)) || clip.z >= clip.w {
        return;
    }
    let ndc = clip.xyz / clip.w;
    let size = vec2<f32>(view.size);
    let place = vec2<f32>(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size;
    let pixel = min(vec2<u32>(place), view.size - 1u);
    // Reversed Z: nearer is greater.
    var shares = 0u;
    var undecided = 1u;
    if COARSE {
        let texel = pixel >> vec2<u32>(view.level);
        let word = texel.y * view.stride + view.step * texel.x;
        let before_all = ndc.z > nearest[view.nearest + word];
        let behind_all = ndc.z <= farthest[view.farthest + word];
        // The pixels of a soft test have to lie in the texel, too.
        let last = min(pixel + u32(SOFT), view.size - 1u) >> vec2<u32>(view.level);
        let decided = all(last == texel) && (before_all || behind_all);
        shares = select(0u, FULL, before_all);
        undecided = select(1u, 0u, decided);
        if COUNTED {
            atomicAdd(&counts[1], u32(decided && before_all));
            atomicAdd(&counts[2], u32(decided && behind_all));
        }
    }
    if COUNTED {
        atomicAdd(&counts[0], 1u);
    }
    // Tuning for software drivers: they skip no branch, but end a loop.
    for (var turn = 0u; turn < undecided; turn += 1u) {
        shares = shares_in_front(pixel, ndc.z);
    }
    if shares > 0u {
        let brightness = 1u + (particle & 15u);
        atomicAdd(&picture[pixel.y * view.size.x + pixel.x], shares * brightness);
    }
}
