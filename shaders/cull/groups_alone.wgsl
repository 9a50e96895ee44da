// The groups of a cull that is not one of two passes: all are tested, and none has a history.

fn has_candidates(group: u32) -> bool {
    return true;
}

// Whether the members of a group with this outcome are tested.
fn is_candidate(outcome: Outcome) -> bool {
    return outcome.verdict >= VISIBLE;
}

fn forget(group: u32) {}
