// The members of accepted groups, which are kept without a test: all of their group shows.

// Some instances are absent.
override ABSENT: bool;

fn is_absent(place: u32) -> bool {
    return ABSENT && record_texel(place, 0u).x == ABSENT_CENTER_BITS;
}

// Bit k: member k of the run at place `first` is there and asked for.
// A group with invalid bounds is never accepted.
fn accept_run(first: u32) -> u32 {
    var kept = 0u;
    for (var k = 0u; k < RUN && first + k * SHARE < piece.count; k += 1u) {
        let place = first + k * SHARE;
        let is_kept = is_among(place) && !is_absent(place);
        kept |= select(0u, 1u << k, is_kept);
        if VERDICTS {
            let verdict = select(OUTSIDE, UNOCCLUDED, is_kept);
            atomicStore(&mask[verdicts_begin(piece.words) + place], verdict);
        }
    }
    return kept;
}
