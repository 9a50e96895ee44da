// Why one instance got its verdict: the steps of the cull for this instance, written down.

// Twin: `ExplanationRecord` in `crates/hiz_core/src/cull/explain.rs`.
struct Explanation {
    verdict: u32,
    stage: u32,
    level: u32,
    farthest_bits: u32,
    pixels: vec4<i32>,
    // Estimates: the least and greatest NDC depth of the bounds, then their least and greatest w.
    // The depths are meaningless where the bounds cross w = 0.
    depths: vec4<f32>,
    // The last reading, whether it had room in `readings` or not.
    last: vec4<u32>,
    // How many texels were read, and how many of them by the footprint.
    texels_read: u32,
    of_footprint: u32,
    // The farthest of the depths that all of the volume is behind, and whether there is one.
    farthest_before: u32,
    any_before: u32,
    // As in `Outcome`.
    nearest_bits: u32,
    padding: array<u32, 3>,
}

// .x: the instance's place within its piece.
@group(1) @binding(0) var<uniform> which: vec4<u32>;
@group(2) @binding(0) var<storage, read_write> explanation: Explanation;
// A reading per texel, in order: level and flags, column, row, the bits of the depth.
// Readings that have no room are only counted.
@group(2) @binding(1) var<storage, read_write> readings: array<vec4<u32>>;

// The flags in the first word of a reading.
// Twins: `BEHIND` and `CLEAR` in `crates/hiz_core/src/cull/explain.rs`.
//
// All of the volume is behind the depth of the texel.
const BEHIND: u32 = 0x100u;
// The volume's own outline and front prove that the texel shows nothing of it.
const CLEAR: u32 = 0x200u;

var<private> texels_read: u32 = 0u;
var<private> last: vec4<u32>;
var<private> farthest_before: u32;
var<private> any_before: u32 = 0u;

fn write_down(reading: vec4<u32>) {
    last = reading;
    if texels_read < arrayLength(&readings) {
        readings[texels_read] = reading;
    }
    texels_read += 1u;
}

fn note_corners(level: u32, t: vec4<u32>, bits: vec4<u32>) {
    note_texel(level, t.x, t.y, bits.x, false);
    if t.z != t.x { note_texel(level, t.z, t.y, bits.y, false); }
    if t.w != t.y { note_texel(level, t.x, t.w, bits.z, false); }
    if t.z != t.x && t.w != t.y { note_texel(level, t.z, t.w, bits.w, false); }
}

fn note_texel(level: u32, x: u32, y: u32, bits: u32, is_behind: bool) {
    let depth = sanitized(bits);
    write_down(vec4<u32>(level | select(0u, BEHIND, is_behind), x, y, depth));
    if is_behind {
        farthest_before = select(depth, farthest(depth, farthest_before), any_before != 0u);
        any_before = 1u;
    }
}

// Adds to the reading of the texel that was told last.
fn note_clear(is_clear: bool) {
    if is_clear {
        texels_read -= 1u;
        write_down(last | vec4<u32>(CLEAR, 0u, 0u, 0u));
    }
}

@compute @workgroup_size(1)
fn explain() {
    begin();
    let outcome = classify(which.x);
    explanation.verdict = outcome.verdict;
    explanation.stage = outcome.stage;
    explanation.level = outcome.level;
    explanation.farthest_bits = outcome.farthest_bits;
    explanation.pixels = outcome.pixels;
    explanation.nearest_bits = outcome.nearest_bits;
    explanation.last = last;
    explanation.texels_read = texels_read;
    explanation.farthest_before = farthest_before;
    explanation.any_before = any_before;
    if outcome.stage >= AT_DEPTH && is_reduced {
        let t = outcome.texels;
        let sides = t.zw - t.xy + vec2<u32>(1u);
        explanation.of_footprint =
            select(0u, sides.x * sides.y, max(sides.x, sides.y) <= (1u << FOOTPRINT_LOG2));
    }
    let volume = load_volume(which.x);
    let w = value_of(view.w, 0.0, volume);
    let z = ratio_interval(value_of(view.z, 0.0, volume), w) + vec2<f32>(view.z_slope);
    let w_reach = support(w.half);
    explanation.depths = vec4<f32>(z, w.center - w_reach, w.center + w_reach);
}
