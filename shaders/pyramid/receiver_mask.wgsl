// Receivers as a light sees them.
//
// Each pixel of the camera's depth image goes into the texels of the light's image that it may lie
// in, and each texel keeps its farthest receiver.
// A caster behind all receivers of its texels shadows none of them.
//
// A pixel stands for a box in pixel coordinates and depth: its square or its centre, and the slack.
// A row of the light is a linear function of these coordinates, up to a factor above 0.
// So certificates decide as in a cull; docs/accuracy.md derives this, under "A receiver mask".
//
// `scatter_receivers` has an invocation per pixel, and `finish_receivers` has one per texel.

// Twin: `MASK_SIDE` in `crates/hiz_core/src/pyramid/receiver_mask.rs`.
const SIDE: u32 = 8u;
// Texels along a side of a block; wide receivers mark whole blocks.
// Twin: `MASK_BLOCK_LOG2` in `crates/hiz_core/src/pyramid/receiver_mask.rs`.
const MASK_BLOCK_LOG2: u32 = 4u;
const WIDEST: i32 = 1 << MASK_BLOCK_LOG2;
// Receivers in more blocks than this mark all texels.
// Lavapipe ends all loops of eight invocations once they have taken 65,535 iterations together, and
// then the blocks behind had no receiver.
// One loop over all blocks of a receiver takes as many as the one of eight that has most.
const MOST_BLOCKS: u32 = 1u << 15u;

// Twins: `EPS` and `ERROR_ULPS` in `crates/hiz_core/src/input/view.rs`.
const EPS: f32 = 0x1p-23;
const ERROR_ULPS: f32 = 24.0;
const ERROR_FLOOR: f32 = 0x1p-70;
// An estimate is widened by what its certificate asks for, and by a quarter of it more.
const ESTIMATE_MARGIN: f32 = 1.25;
// What forming the interval of depths may lose, in EPS of it.
const INTERVAL_ULPS: f32 = 8.0;
// A pixel's centre lies this far from its corner, along each axis.
const HALF_PIXEL: f32 = 0.5;

// Twin: `MaskUniform` in `crates/hiz_core/src/pyramid/receiver_mask.rs`.
struct ReceiverMask {
    // The light's rows: x and y times half an image, z, w, as functions of the column and the row
    // from the middle of the camera's image, of depth counted from far, and of 1.
    x: vec4<f32>,
    y: vec4<f32>,
    z: vec4<f32>,
    w: vec4<f32>,
    // 1 / w of the camera, by which all rows are scaled.
    scale: vec4<f32>,
    // Upper bounds of the coefficients, and in EPS of their errors.
    x_size: vec4<f32>,
    y_size: vec4<f32>,
    z_size: vec4<f32>,
    w_size: vec4<f32>,
    scale_size: vec4<f32>,
    // How much each row of the light changes within the filter's radius.
    growth: vec4<f32>,
    camera_half_size: vec2<f32>,
    // How far from its pixel's centre a receiver may lie, in pixels.
    reach: f32,
    // How far depths may be off: relative to them, and in all.
    slack: f32,
    camera_size: vec2<u32>,
    light_size: vec2<u32>,
    // Where the camera's image begins in its texture.
    origin: vec2<u32>,
    slack_abs: f32,
    // Texels from a row of the light's image to the next, and blocks.
    stride: u32,
    blocks: u32,
    light_is_reversed: u32,
    padding: vec2<u32>,
}

// For each texel, then for each block, and at last for all texels: the farthest receiver as a key.
// Keys of farther receivers are greater, and 0 is none.
@group(1) @binding(0) var<storage, read_write> keys: array<atomic<u32>>;
@group(1) @binding(1) var<uniform> mask: ReceiverMask;

// For `source_part.wgsl`.
fn part_origin() -> vec2<u32> {
    return mask.origin;
}

fn part_edge() -> vec2<u32> {
    return mask.camera_size - vec2<u32>(1u);
}

// A key of a depth of the light, from 1 for near to FARTHEST_KEY for far.
const FARTHEST_KEY: u32 = ONE_BITS + 1u;

fn key_of(bits: u32) -> u32 {
    return select(bits + 1u, FARTHEST_KEY - bits, mask.light_is_reversed != 0u);
}

// A row over the box of a pixel.
struct Term {
    center: f32,
    error: f32,
    half: vec3<f32>,
}

fn term_of(row: vec4<f32>, size: vec4<f32>, at: vec3<f32>, half: vec3<f32>, growth: f32) -> Term {
    let sizes = dot(size.xyz, abs(at) + half) + size.w;
    let error = ERROR_ULPS * EPS * sizes + ERROR_FLOOR + growth;
    return Term(dot(row.xyz, at) + row.w, error, row.xyz * half);
}

fn reach_of(half: vec3<f32>) -> f32 {
    return abs(half.x) + abs(half.y) + abs(half.z);
}

// True implies: r - t w > 0 on all of the box.
fn surely_above(r: Term, t: f32, w: Term) -> bool {
    let error = r.error + abs(t) * w.error;
    return (r.center - t * w.center) - error > reach_of(r.half - t * w.half);
}

// True implies: r - t w < 0 on all of the box.
fn surely_below(r: Term, t: f32, w: Term) -> bool {
    let error = r.error + abs(t) * w.error;
    return -(r.center - t * w.center) - error > reach_of(r.half - t * w.half);
}

// An estimate of the least and greatest r / w.
fn interval_of(r: Term, w: Term, w_min: f32) -> vec2<f32> {
    let ratio = r.center / w.center;
    let reach = reach_of(r.half - ratio * w.half) + r.error + abs(ratio) * w.error;
    let widened = ESTIMATE_MARGIN * reach / w_min;
    return vec2<f32>(ratio - widened, ratio + widened);
}

// The first and last texel along an axis in which the box may lie.
// What certificates cannot prove becomes the whole side.
fn texels_of(r: Term, w: Term, w_min: f32, size: u32) -> vec2<i32> {
    let edge = f32(size);
    let half = edge / 2.0;
    let interval = interval_of(r, w, w_min) + half;
    let low = clamp(floor(interval.x), 0.0, edge - 1.0);
    let high = clamp(floor(interval.y), 0.0, edge - 1.0);
    let is_low = low == 0.0 || surely_above(r, low - half, w);
    let is_high = high == edge - 1.0 || surely_below(r, high + 1.0 - half, w);
    return vec2<i32>(vec2<f32>(select(0.0, low, is_low), select(edge - 1.0, high, is_high)));
}

// The key of a depth of the light that is surely not nearer than the box.
fn farthest_key(z: Term, w: Term, w_min: f32) -> u32 {
    let interval = interval_of(z, w, w_min);
    if mask.light_is_reversed != 0u {
        let depth = clamp(interval.x, 0.0, 1.0);
        // What is nearer than the near plane counts as on it.
        let is_proved = depth > 0.0 && surely_above(z, depth, w);
        return select(FARTHEST_KEY, key_of(bitcast<u32>(depth)), is_proved);
    }
    let depth = clamp(interval.y, 0.0, 1.0);
    let is_proved = depth < 1.0 && surely_below(z, depth, w);
    return select(FARTHEST_KEY, key_of(bitcast<u32>(depth)), is_proved);
}

fn mark(index: u32, key: u32) {
    // Most receivers of a texel are not its farthest: a load is cheaper than an atomic.
    if atomicLoad(&keys[index]) < key {
        atomicMax(&keys[index], key);
    }
}

fn first_block() -> u32 {
    return mask.stride * mask.light_size.y;
}

fn blocks_high() -> u32 {
    return (mask.light_size.y + (1u << MASK_BLOCK_LOG2) - 1u) >> MASK_BLOCK_LOG2;
}

// The key that counts for all texels.
fn whole_image() -> u32 {
    return first_block() + mask.blocks * blocks_high();
}

@compute @workgroup_size(SIDE, SIDE)
fn scatter_receivers(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= mask.camera_size) {
        return;
    }
    let bits = source_given(id.x, id.y);
    let is_depth = bits <= ONE_BITS || bits == NEGATIVE_ZERO_BITS;
    if !is_depth {
        // It may be anywhere on its ray.
        mark(whole_image(), FARTHEST_KEY);
        return;
    }
    if sanitized(bits) == far_bits() {
        return;
    }
    let depth = bitcast<f32>(sanitized(bits));
    let slack = (depth * mask.slack + mask.slack_abs) * (1.0 + INTERVAL_ULPS * EPS);
    // Counted from far, where float32 is finest: the difference loses no more than the interval
    // has room for.
    let from_far = select(1.0 - depth, depth, REVERSED);
    let low_end = max(from_far - slack, 0.0);
    let high_end = min(from_far + slack, 1.0);
    let middle = (low_end + high_end) / 2.0;
    let at = vec3<f32>(
        vec2<f32>(id.xy) + vec2<f32>(HALF_PIXEL) - mask.camera_half_size, middle);
    let half = vec3<f32>(
        vec2<f32>(mask.reach), (high_end - low_end) / 2.0 + INTERVAL_ULPS * EPS * middle);

    let scale = term_of(mask.scale, mask.scale_size, at, half, 0.0);
    let growth = mask.growth * (max(scale.center, 0.0) + reach_of(scale.half) + scale.error);
    let x = term_of(mask.x, mask.x_size, at, half, growth.x);
    let y = term_of(mask.y, mask.y_size, at, half, growth.y);
    let z = term_of(mask.z, mask.z_size, at, half, growth.z);
    let w = term_of(mask.w, mask.w_size, at, half, growth.w);

    // 1. Is it surely outside of what the light's image shows?
    let border = vec2<f32>(mask.light_size) / 2.0;
    if surely_below(w, 0.0, w) || surely_above(x, border.x, w) || surely_below(x, -border.x, w)
        || surely_above(y, border.y, w) || surely_below(y, -border.y, w) {
        return;
    }

    // 2. Does it cross the plane of the light's eye? Then it may be anywhere.
    let w_min = w.center - reach_of(w.half) - w.error;
    if !(w_min > 0.0) {
        mark(whole_image(), FARTHEST_KEY);
        return;
    }

    // 3. Which texels may it lie in, and how far from the light?
    let columns = texels_of(x, w, w_min, mask.light_size.x);
    let rows = texels_of(y, w, w_min, mask.light_size.y);
    let key = farthest_key(z, w, w_min);
    if columns.y - columns.x < WIDEST && rows.y - rows.x < WIDEST {
        for (var row = rows.x; row <= rows.y; row += 1) {
            for (var column = columns.x; column <= columns.y; column += 1) {
                mark(u32(row) * mask.stride + u32(column), key);
            }
        }
        return;
    }
    let shift = vec2<u32>(MASK_BLOCK_LOG2);
    let block_columns = vec2<u32>(columns) >> shift;
    let block_rows = vec2<u32>(rows) >> shift;
    let width = block_columns.y - block_columns.x + 1u;
    let blocks = width * (block_rows.y - block_rows.x + 1u);
    if blocks > MOST_BLOCKS {
        mark(whole_image(), key);
        return;
    }
    let corner = first_block() + block_rows.x * mask.blocks + block_columns.x;
    for (var i = 0u; i < blocks; i += 1u) {
        mark(corner + i / width * mask.blocks + i % width, key);
    }
}

// Keys become depths of the light; a texel without a receiver is near, where nothing is in front.
@compute @workgroup_size(SIDE, SIDE)
fn finish_receivers(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= mask.stride || id.y >= mask.light_size.y {
        return;
    }
    let index = id.y * mask.stride + id.x;
    var key = atomicLoad(&keys[index]);
    if id.x < mask.light_size.x {
        let block = (id.y >> MASK_BLOCK_LOG2) * mask.blocks + (id.x >> MASK_BLOCK_LOG2);
        key = max(key, atomicLoad(&keys[first_block() + block]));
        key = max(key, atomicLoad(&keys[whole_image()]));
    }
    key = max(key, 1u);
    atomicStore(&keys[index], select(key - 1u, FARTHEST_KEY - key, mask.light_is_reversed != 0u));
}
