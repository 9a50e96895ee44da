// The members of accepted groups, which are kept without a test: all of their group shows.
// An invocation takes RUN members of one group, as in `cull_members.wgsl`.
//
// Tuning for software drivers, which skip no branch: it is a pass of its own.

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

@compute @workgroup_size(GROUP)
fn accept_members(
    @builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    begin();
    let slot = workgroup.x * RUN + lane / SHARE;
    if slot < parents.accept_count {
        // Accepted groups fill the list from its end.
        let groups = (piece.count + (GROUP - 1u)) / GROUP;
        let group = textureLoad(parent_list, survivor_position(groups - 1u - slot)).x;
        report_run(group, lane % SHARE, accept_run(group * GROUP + lane % SHARE));
    }
}
