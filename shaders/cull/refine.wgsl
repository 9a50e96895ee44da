// The verdicts of the members of hidden groups: an invocation tells those of one group.
//
// The cull hides a group with all its members and tests none of them.
// Here each member gets a verdict of its own:
//
// - Members of a group that is outside are outside.
// - Members of a group that is hidden by depth are outside if their own certificates say so, and
//   occluded otherwise.
// - Members that were not asked for are outside (`among.wgsl`).
//
// The group is marked as told.
// Another run, with other bounds even, changes nothing.

// Twin: `WORKGROUP` in `crates/hiz_core/src/cull/refine.rs`.
const WORKGROUP: u32 = 64u;

// A flag beside the verdict of a group: its members have verdicts of their own.
const REFINED: u32 = 8u;

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
    let of_group = word & VERDICT_MASK;
    if (word & REFINED) != 0u || of_group >= VISIBLE {
        return;
    }
    let verdicts = verdicts_begin(piece.words);
    let end = min(first + GROUP, piece.count);
    for (var place = first; place < end; place += 1u) {
        mask[verdicts + place] = select(OUTSIDE, of_group, is_among(place));
    }
    // `refine_groups.wgsl` adds a flag to OCCLUDED for groups that lie within the view.
    // Tuning for software drivers: a loop of its own, since they skip no branch but end a loop.
    let may_be_outside = word == OCCLUDED;
    for (var place = select(end, first, may_be_outside); place < end; place += 1u) {
        if classify(place).verdict == OUTSIDE {
            mask[verdicts + place] = OUTSIDE;
        }
    }
    group_verdicts[group] = of_group | REFINED;
}
