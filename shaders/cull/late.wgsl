// The late pass of a frame: it reports what is visible and was not drawn by the early pass.
// It also writes the history: all that is visible, drawn already or not.

@group(2) @binding(2) var<storage, read_write> history: array<atomic<u32>>;
@group(2) @binding(4) var<uniform> frame: Frame;

// Where a copy of the early pass's mask begins in the mask, behind the verdicts.
// It is without what exceeded the capacity of the early pass's list.
// Twin: `early_offset` in `crates/hiz_core/src/output/visible.rs`.
fn early_begin() -> u32 {
    let verdicts = select(0u, piece.count, VERDICTS);
    return verdicts_begin(piece.words) + verdicts_begin(verdicts);
}

// Whether the early pass of this frame has drawn an instance.
// If that pass was dropped, or has not run yet, the copy is of an older frame.
fn is_drawn(index: u32) -> bool {
    let is_of_frame = frame.early != 0u && atomicLoad(&history[0]) == frame.early;
    let at = mask_place(index);
    return is_of_frame && (atomicLoad(&mask[early_begin() + at.word]) & at.bit) != 0u;
}

// Reports the members of a run that are kept and not drawn yet, and notes all that are kept.
fn report_run(group: u32, share: u32, found: u32) {
    let first = group * GROUP + share;
    if first >= piece.count {
        return;
    }
    if found != 0u {
        atomicOr(&history[history_word(group, share)], found << history_shift(share));
    }
    for (var kept = found; kept != 0u; kept &= kept - 1u) {
        let place = first + countTrailingZeros(kept) * SHARE;
        if !is_drawn(caller_index(place)) {
            report(place);
        }
    }
}

// Tests the members of a group that belong to one of its invocations.
fn cull_run(group: u32, share: u32) {
    report_run(group, share, test_run(group * GROUP + share));
}
