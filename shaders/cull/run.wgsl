// The run of a cull that is not one of two passes: all members are tested.

// Reports members of a run: bit k of `reported` stands for member k.
fn report_run(group: u32, share: u32, reported: u32) {
    let first = group * GROUP + share;
    for (var left = reported; left != 0u; left &= left - 1u) {
        report(first + countTrailingZeros(left) * SHARE);
    }
}

// Tests the members of a group that belong to one of its invocations.
// Then it reports those whose bits `flipped` names (`flipped.wgsl`, `not_flipped.wgsl`): they are
// few, so the expensive part runs a few times.
fn cull_run(group: u32, share: u32) {
    let first = group * GROUP + share;
    report_run(group, share, flipped(first, test_run(first)));
}
