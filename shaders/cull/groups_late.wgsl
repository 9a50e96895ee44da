// The groups of a late pass: none of the members of a rejected group is visible.

@group(2) @binding(4) var<storage, read_write> history: array<u32>;

fn has_candidates(group: u32) -> bool {
    return true;
}

// Whether what a box with this outcome holds is tested or accepted.
fn is_candidate(outcome: Outcome) -> bool {
    return outcome.verdict >= VISIBLE;
}

// The early pass of the next frame reads every word, also those of groups that it would skip.
fn forget(group: u32) {
    for (var share = 0u; share < SHARE; share += 1u) {
        history[history_word(group, share)] = 0u;
    }
}
