// The early pass of a frame: it lists what is drawn before there is a depth image.
// Any set is right (docs/accuracy.md), so what lies outside of the view is left out.
// Its mask is the set that the late pass does not draw again.

@group(2) @binding(2) var<storage, read> history: array<u32>;
@group(2) @binding(4) var<uniform> frame: Frame;
// Bit i: the caller's instance i may be drawn.
@group(2) @binding(5) var<storage, read> given: array<u32>;

const WHOLE_RUN: u32 = (1u << RUN) - 1u;

// Bit k: member k of the run at place `first` is a candidate.
fn candidates(group: u32, share: u32, first: u32) -> u32 {
    if EARLY_SET == SET_BY_HISTORY {
        return (history[history_word(group, share)] >> history_shift(share)) & WHOLE_RUN;
    }
    if EARLY_SET == SET_GIVEN {
        var found = 0u;
        for (var k = 0u; k < RUN && first + k * SHARE < piece.count; k += 1u) {
            let index = piece.base + caller_index(first + k * SHARE);
            found |= (given[index / WORD_BITS] >> (index % WORD_BITS) & 1u) << k;
        }
        return found;
    }
    return WHOLE_RUN;
}

// Tests the candidates among the members of a group that belong to one of its invocations.
// Most of them are kept, so each is reported where it was tested: its record is at hand there.
fn cull_run(group: u32, share: u32) {
    let first = group * GROUP + share;
    for (var left = candidates(group, share, first); left != 0u; left &= left - 1u) {
        let place = first + countTrailingZeros(left) * SHARE;
        if place < piece.count && is_candidate(classify(place)) {
            report(place);
        }
    }
}
