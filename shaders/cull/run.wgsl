// The run of a cull that is not one of two passes: all members are tested.

// Reports the members of a run that are kept: bit k of `kept` stands for member k.
fn report_run(group: u32, share: u32, kept: u32) {
    let first = group * GROUP + share;
    for (var left = kept; left != 0u; left &= left - 1u) {
        report(first + countTrailingZeros(left) * SHARE);
    }
}

// Tests the members of a group that belong to one of its invocations.
// Then it reports those that are kept: they are few, so the expensive part runs a few times.
fn cull_run(group: u32, share: u32) {
    report_run(group, share, test_run(group * GROUP + share));
}
