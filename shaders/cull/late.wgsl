// The late pass of a frame: it lists what is visible and was not drawn by the early pass.
// It also writes the history: all that is visible, drawn already or not.

@group(2) @binding(1) var<storage, read_write> history: array<u32>;
// The mask of the early pass, without what exceeded the capacity of its list.
@group(2) @binding(2) var<storage, read> early: array<u32>;
@group(2) @binding(4) var<uniform> frame: Frame;

// Whether the early pass of this frame has drawn what a bit of the mask stands for.
// If it was dropped, or has not run yet, the mask is that of an older frame.
fn is_drawn(bit: u32) -> bool {
    let is_of_frame = frame.early != 0u && history[0] == frame.early;
    return is_of_frame && (early[bit / WORD_BITS] >> (bit % WORD_BITS) & 1u) != 0u;
}

// Tests the members of a group that belong to one of its invocations.
fn cull_run(group: u32, share: u32) {
    let first = group * GROUP + share;
    if first >= piece.count {
        return;
    }
    var kept = test_run(first);
    history[history_word(group, share)] = kept;
    for (; kept != 0u; kept &= kept - 1u) {
        let bit = mask_bit(first + countTrailingZeros(kept) * SHARE);
        if !is_drawn(bit) {
            set_mask_bit(bit);
        }
    }
}
