// The groups of an early pass: it looks into those that hold a candidate.

@group(2) @binding(4) var<storage, read> history: array<u32>;
@group(2) @binding(5) var<uniform> frame: Frame;

fn has_candidates(group: u32) -> bool {
    if EARLY_SET != SET_BY_HISTORY {
        return true;
    }
    var any = 0u;
    for (var share = 0u; share < SHARE; share += SHARES_OF_WORD) {
        any |= history[history_word(group, share)];
    }
    return any != 0u;
}
