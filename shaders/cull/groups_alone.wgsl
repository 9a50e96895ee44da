// The groups of a cull that is not one of two passes: all are tested, and none has a history.

fn has_candidates(group: u32) -> bool {
    return true;
}

// Whether what a box with this outcome holds is tested or accepted.
fn is_candidate(outcome: Outcome) -> bool {
    return outcome.verdict >= VISIBLE;
}

fn forget(group: u32) {}
