// What the members of hidden groups are themselves: an invocation tells RUN members of one. The cull hides them with their group and
// asks no more. Here those of a group outside the view are outside; of a group that is hidden by depth those are outside that their
// own certificates call so, and the others occluded. After it each place has a verdict, and the group is told: it may run again, and
// with other bounds, and changes nothing.

// Added to the verdict of a group whose members have theirs (twin: `crates/hiz_core/src/cull/refine.rs`).
const TOLD: u32 = 4u;

@group(1) @binding(0) var<uniform> piece: Piece;
// Behind the mask the verdicts.
@group(2) @binding(0) var<storage, read_write> mask: array<u32>;
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;

@compute @workgroup_size(GROUP)
fn refine(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    begin();
    let group = workgroup.x * RUN + lane / SHARE;
    var of_group = TOLD;
    if group * GROUP < piece.count {
        of_group = group_verdicts[group];
    }
    if of_group < VISIBLE {
        for (var k = 0u; k < RUN; k += 1u) {
            let place = group * GROUP + k * SHARE + lane % SHARE;
            if place < piece.count {
                var verdict = of_group;
                if of_group == OCCLUDED && classify(place).verdict == OUTSIDE {
                    verdict = OUTSIDE;
                }
                mask[verdicts_begin(piece.words) + place] = verdict;
            }
        }
    }
    // All that share the group have seen what it is.
    storageBarrier();
    if of_group < VISIBLE && lane % SHARE == 0u {
        group_verdicts[group] = of_group | TOLD;
    }
}
