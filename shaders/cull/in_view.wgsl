// The test of a candidate of an early pass: may any of it lie in the view?
// `classify`, the last function, takes the place of that of `classify.wgsl` where the last late
// pass or the caller names the candidates.
//
// It is the first step of the whole test.
// The others look for a rectangle and for depth, which these candidates do not need.
// Software drivers skip no branch, so the whole test would take twice the time.
// No pixel and no depth is looked at, so the options of `decision.wgsl` change nothing here.

fn classify(i: u32) -> Outcome {
    var out = Outcome(INVALID, AT_VALIDITY, vec4<i32>(0), 0u, vec4<u32>(0u), 0u, 0u, 0u);
    let volume = load_volume(i);
    if !(volume.size < view.coordinate_limit) {
        if volume.center.x < ABSENT_BELOW {
            out.verdict = OUTSIDE;
        }
        return out;
    }
    let errors = errors_of(volume);
    let x = value_of(view.x, errors.x, volume);
    let y = value_of(view.y, errors.y, volume);
    let z = value_of(view.z, errors.z, volume);
    let w = value_of(view.w, errors.w, volume);
    out.stage = AT_FRUSTUM;
    out.verdict = select(VISIBLE, OUTSIDE, surely_outside(x, y, z, w));
    return out;
}
