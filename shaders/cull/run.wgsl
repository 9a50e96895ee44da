// The run of a cull that is not one of two passes: all members are tested.

// Tests the members of a group that belong to one of its invocations, or accepts them.
// Then it reports those that are kept: they are few, so the expensive part runs a few times.
fn cull_run(group: u32, share: u32, is_accepted: bool) {
    let first = group * GROUP + share;
    for (var kept = kept_of_run(first, is_accepted); kept != 0u; kept &= kept - 1u) {
        report(first + countTrailingZeros(kept) * SHARE);
    }
}
