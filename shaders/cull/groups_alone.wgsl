// The groups of a late pass, and of a cull that is not one of two passes: all are tested.

fn has_candidates(group: u32) -> bool {
    return true;
}

// Whether what a box with this outcome holds is tested or accepted.
fn is_candidate(outcome: Outcome) -> bool {
    return outcome.verdict >= VISIBLE;
}
