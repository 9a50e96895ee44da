// The test of the box around a group, or around the boxes of an upper tier's.
// It uses the same certificates as a test of an instance, and what hides the box hides all that it
// holds.
// What proves that all of the box shows proves it of all that it holds, too: that is accepted.
//
// The boxes that are not hidden are packed into a list, for the tests of what they hold:
// `cull_children.wgsl` or `cull_members.wgsl`.
//
// Which groups can survive differs in the early pass of a frame: `groups_alone.wgsl` and
// `groups_early.wgsl` have functions of the same names for it.
//
// Source: Akenine-Moller, Haines and others, "Real-Time Rendering", section "Hierarchical
// Z-Buffering".

// Which tier of boxes this is; 0: the boxes of groups.
override TIER: u32;
// The verdicts of groups are wanted, and the counts of what is tested.
override VERDICTS: bool;
// Which groups survive is wanted: the mask may begin full (`begin_mask.wgsl`).
override FLIPS: bool;

// Twin: `CULL_WORKGROUP` in `crates/hiz_core/src/instances/piece.rs`.
const WORKGROUP: u32 = 128u;
// Boxes of an upper tier whose children one workgroup tests.
const PARENTS: u32 = WORKGROUP / GROUP;

// Twin: `SurvivorsRecord` in `crates/hiz_core/src/output/survivors.rs`.
struct Survivors {
    // The arguments of the indirect dispatch that tests what survivors hold.
    workgroups: atomic<u32>,
    workgroups_y: u32,
    workgroups_z: u32,
    count: atomic<u32>,
    // What survivors hold: how much of it is tested, and how much is kept without a test.
    // Both are counted only where verdicts are wanted.
    tested: atomic<u32>,
    accepted: atomic<u32>,
    is_full: u32,
    padding: u32,
    // The arguments of the dispatch that accepts the members of groups, and how many groups.
    accept_workgroups: atomic<u32>,
    accept_workgroups_y: u32,
    accept_workgroups_z: u32,
    accept_count: atomic<u32>,
}

@group(1) @binding(0) var<uniform> tier: Tier;
@group(2) @binding(0) var<storage, read_write> survivors: Survivors;
// A word per group: its verdict, or VISIBLE where the members have verdicts of their own.
// UNOCCLUDED: all of it is accepted.
@group(2) @binding(1) var<storage, read_write> group_verdicts: array<u32>;
@group(2) @binding(2) var survivor_list: texture_storage_2d<r32uint, write>;

// Writes a verdict that all groups of a box have.
fn tell(box: u32, verdict: u32) {
    // Where verdicts are not wanted, the words of groups that do not survive stay 0.
    if !VERDICTS && (!FLIPS || verdict < VISIBLE) {
        return;
    }
    // The boxes of a survivor of an upper tier get verdicts of their own.
    if TIER > 0u && verdict >= VISIBLE {
        return;
    }
    for (var group = first_group(box); group < end_group(box); group += 1u) {
        group_verdicts[group] = verdict;
    }
}

// The groups of a box.
fn first_group(box: u32) -> u32 {
    return box << (GROUP_LOG2 * TIER);
}

fn end_group(box: u32) -> u32 {
    return min((box + 1u) << (GROUP_LOG2 * TIER), arrayLength(&group_verdicts));
}

// Accepted groups fill the list of groups from its end, the others from its beginning.
// Accepted boxes of upper tiers bear a flag.
fn survive(box: u32, is_accepted: bool) {
    if TIER == 0u && is_accepted {
        let slot = atomicAdd(&survivors.accept_count, 1u);
        let position = survivor_position(tier.count - 1u - slot);
        textureStore(survivor_list, position, vec4<u32>(box));
        if slot % RUN == 0u {
            atomicAdd(&survivors.accept_workgroups, 1u);
        }
    } else {
        let slot = atomicAdd(&survivors.count, 1u);
        let entry = box | select(0u, ACCEPTED, is_accepted);
        textureStore(survivor_list, survivor_position(slot), vec4<u32>(entry));
        if slot % select(PARENTS, RUN, TIER == 0u) == 0u {
            atomicAdd(&survivors.workgroups, 1u);
        }
    }
    if VERDICTS {
        let children = min(GROUP, tier.below - box * GROUP);
        if is_accepted {
            atomicAdd(&survivors.accepted, children);
        } else {
            atomicAdd(&survivors.tested, children);
        }
    }
}

// Whether all that a box with this outcome holds surely shows.
// In sample coverage some of it may lie between all samples, so that its own test culls it.
fn is_shown(outcome: Outcome) -> bool {
    return NEAREST && !SAMPLE_COVERAGE && outcome.verdict == UNOCCLUDED;
}

// `is_accepted`: the box of the tier above is accepted, with all that it holds.
fn cull_box(box: u32, is_accepted: bool) {
    if TIER == 0u {
        if !has_candidates(box) {
            return;
        }
        if !any_among(box) {
            tell(box, OUTSIDE);
            return;
        }
    }
    if NEAREST && is_accepted {
        tell(box, UNOCCLUDED);
        survive(box, true);
        return;
    }
    let outcome = classify(box);
    if STATISTICS {
        count_texels(outcome.level, outcome.texels_read);
    }
    tell(box, select(VISIBLE, outcome.verdict, outcome.verdict < VISIBLE || is_shown(outcome)));
    if is_candidate(outcome) {
        survive(box, is_shown(outcome));
    }
}
