// One coarse level of a depth image alone, in one dispatch.
//
// Source: Mike Turitzin, "Hierarchical Depth Buffers", 2020, "Generating a single level".
// A workgroup makes one texel of TILE x TILE pixels.
// Its invocations take the least of their pixels, and join them by atomic minima of float bits in
// shared memory.
// The six entry points have the same pixels per workgroup, and differ in its shape.
// The text's own table of shapes could not be looked up, so these six are a choice.
//
// Bits order like numbers only where no sign is set: -0.0 and NaN are lost.
// The minimum begins at 1.0, as in the text, so numbers above 1.0 become 1.0.
// The library's own reduction has neither defect (`shaders/gpu/depth_bits.wgsl`).
//
// `tree` joins the same pixels by halving, which is what atomic minima replace.

// Pixels along a side of a texel, for level 4.
// Twin: `TILE` in `crates/hiz_core/src/methods/coarse_level.rs`.
const TILE: u32 = 16u;
const TILE_PIXELS: u32 = TILE * TILE;
const HALF_TILE: u32 = TILE / 2u;
const QUARTER_TILE: u32 = HALF_TILE / 2u;
const ONE_BITS: u32 = 0x3f800000u;

@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var<storage, read_write> level: array<u32>;

var<workgroup> least: atomic<u32>;
var<workgroup> bits: array<u32, TILE_PIXELS>;

fn pixel(tile: vec2<u32>, at: vec2<u32>) -> u32 {
    let last = textureDimensions(image) - vec2<u32>(1u);
    return bitcast<u32>(textureLoad(image, min(TILE * tile + at, last), 0).x);
}

fn store(tile: vec2<u32>, value: u32) {
    let width = (textureDimensions(image).x + TILE - 1u) / TILE;
    level[tile.y * width + tile.x] = value;
}

// Neighbouring invocations read neighbouring pixels, and each goes on a workgroup's side further.
fn join(tile: vec2<u32>, invocation: vec2<u32>, sides: vec2<u32>) {
    let is_first = all(invocation == vec2<u32>(0u));
    if is_first {
        atomicStore(&least, ONE_BITS);
    }
    workgroupBarrier();
    var own = ONE_BITS;
    for (var y = invocation.y; y < TILE; y += sides.y) {
        for (var x = invocation.x; x < TILE; x += sides.x) {
            own = min(own, pixel(tile, vec2<u32>(x, y)));
        }
    }
    atomicMin(&least, own);
    workgroupBarrier();
    if is_first {
        store(tile, atomicLoad(&least));
    }
}

@compute @workgroup_size(TILE, TILE)
fn atomic_16x16(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(TILE, TILE));
}

@compute @workgroup_size(TILE, HALF_TILE)
fn atomic_16x8(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(TILE, HALF_TILE));
}

@compute @workgroup_size(TILE, QUARTER_TILE)
fn atomic_16x4(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(TILE, QUARTER_TILE));
}

@compute @workgroup_size(HALF_TILE, HALF_TILE)
fn atomic_8x8(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(HALF_TILE, HALF_TILE));
}

@compute @workgroup_size(HALF_TILE, QUARTER_TILE)
fn atomic_8x4(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(HALF_TILE, QUARTER_TILE));
}

@compute @workgroup_size(QUARTER_TILE, QUARTER_TILE)
fn atomic_4x4(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_id) at: vec3<u32>,
) {
    join(tile.xy, at.xy, vec2<u32>(QUARTER_TILE, QUARTER_TILE));
}

@compute @workgroup_size(TILE_PIXELS)
fn tree(
    @builtin(workgroup_id) tile: vec3<u32>, @builtin(local_invocation_index) index: u32,
) {
    bits[index] = pixel(tile.xy, vec2<u32>(index % TILE, index / TILE));
    for (var apart = TILE_PIXELS / 2u; apart > 0u; apart /= 2u) {
        workgroupBarrier();
        if index < apart {
            bits[index] = min(bits[index], bits[index + apart]);
        }
    }
    if index == 0u {
        store(tile.xy, bits[0]);
    }
}
