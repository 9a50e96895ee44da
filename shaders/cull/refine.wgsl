// The refinement: it writes a verdict for every member of a culled group, one invocation per group.
// The cull itself stops at the group, and this pass runs only if verdicts are read.
//
// - The group is outside: so are its members.
// - The group is occluded: a member whose own certificates say so is outside, the others are
//   occluded.
//
// Then every place has a verdict, and the group is marked as TOLD.
// A second run, even after an update of the bounds, changes nothing.

const WORKGROUP: u32 = 64u;

// Added to the verdict of a group once its members have verdicts.
// Twin: `crates/hiz_core/src/output/verdict.rs`.
const TOLD: u32 = 4u;

@group(1) @binding(0) var<uniform> piece: Piece;
// The mask, and behind it the verdicts.
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
    // False also for the groups within the view: `refine_groups.wgsl` has added WITHIN to them.
    // This loop is separate, because a software driver skips no branch, but it does end a loop.
    let may_be_outside = word == OCCLUDED;
    for (var place = select(end, first, may_be_outside); place < end; place += 1u) {
        if classify(place).verdict == OUTSIDE {
            mask[verdicts + place] = OUTSIDE;
        }
    }
    group_verdicts[group] = of_group | TOLD;
}
