// What the members of hidden groups are themselves: an invocation tells those of one.
// The cull hides them with their group and asks no more.
// Here those of a group outside the view are outside; of a group that is hidden by depth those are
// outside that their own certificates call so, and the others occluded.
// After it each place has a verdict, and the group is told: it may run again, and with other
// bounds, and changes nothing.

const WORKGROUP: u32 = 64u;

// Added to the verdict of a group whose members have theirs (twin:
// `crates/hiz_core/src/output/verdict.rs`).
const TOLD: u32 = 4u;

@group(1) @binding(0) var<uniform> piece: Piece;
// Behind the mask the verdicts.
@group(2) @binding(0) var<storage, read_write> mask: array<u32>;
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn refine(@builtin(global_invocation_id) id: vec3<u32>) {
    begin();
    let group = id.x;
    let first = group * GROUP;
    if first >= piece.count {
        return;
    }
    let word = group_verdicts[group];
    let of_group = word & 3u;
    if (word & TOLD) != 0u || of_group >= VISIBLE {
        return;
    }
    let verdicts = verdicts_begin(piece.words);
    let end = min(first + GROUP, piece.count);
    for (var place = first; place < end; place += 1u) {
        mask[verdicts + place] = of_group;
    }
    // `refine_groups.wgsl` adds more to those that lie within the view.
    // A loop of its own: a software driver skips no branch, but it ends a loop.
    let may_be_outside = word == OCCLUDED;
    for (var place = select(end, first, may_be_outside); place < end; place += 1u) {
        if classify(place).verdict == OUTSIDE {
            mask[verdicts + place] = OUTSIDE;
        }
    }
    group_verdicts[group] = of_group | TOLD;
}
