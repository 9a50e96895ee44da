// Why one instance got its verdict: the cull's own steps for it, written out.

struct Explanation {
    verdict: u32,
    stage: u32,
    level: u32,
    farthest_bits: u32,
    pixels: vec4<i32>,
    texels: vec4<u32>,
    texel_bits: vec4<u32>,
    // An estimate of the bounds' least and greatest NDC depth; meaningless where they cross w = 0.
    depths: vec2<f32>,
    padding: vec2<f32>,
}

// .x: the instance within its piece.
@group(1) @binding(0) var<uniform> which: vec4<u32>;
@group(2) @binding(0) var<storage, read_write> explanation: Explanation;

@compute @workgroup_size(1)
fn explain() {
    begin();
    let outcome = classify(which.x);
    explanation.verdict = outcome.verdict;
    explanation.stage = outcome.stage;
    explanation.level = outcome.level;
    explanation.farthest_bits = outcome.farthest_bits;
    explanation.pixels = outcome.pixels;
    explanation.texels = outcome.texels;
    if outcome.stage >= AT_DEPTH {
        let t = outcome.texels;
        explanation.texel_bits = vec4<u32>(
            texel(outcome.level, t.x, t.y), texel(outcome.level, t.z, t.y),
            texel(outcome.level, t.x, t.w), texel(outcome.level, t.z, t.w));
    }
    let volume = load_volume(which.x);
    let w = value_of(view.w, 0.0, volume);
    explanation.depths = ratio_interval(value_of(view.z, 0.0, volume), w) + vec2<f32>(view.z_slope);
}
