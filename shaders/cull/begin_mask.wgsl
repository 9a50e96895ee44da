// Chooses how a mask begins, after the tests of the groups: an invocation per few words.
//
// Where few groups are hidden, most bits would have to be set, one by one.
// So all of them are set here, and those of what is culled are cleared:
// `cull_members.wgsl` and `settle_groups.wgsl` flip the bits that are not right yet.
// Elsewhere the mask stays as it was cleared.
//
// Tuning: a bit is an atomic anywhere in the mask, which took a third of a cull that keeps
// everything (docs/performance_log.md).

// Twins: `WORKGROUP` and `WORDS_OF_INVOCATION` in `crates/hiz_core/src/cull/full_mask.rs`.
const WORKGROUP: u32 = 64u;
const WORDS_OF_INVOCATION: u32 = 8u;

// The mask begins full if fewer than one of so many groups are hidden.
const FULL_BELOW: u32 = 4u;

const ALL_BITS: u32 = 0xffffffffu;

// Members of accepted groups are looked at, even if they are kept: some may be absent or not asked
// for, or their verdicts are wanted.
override LOOKS_AT_ACCEPTED: bool;

// What the tests of the groups have left.
@group(0) @binding(0) var<storage, read_write> survivors: Parents;
@group(1) @binding(0) var<uniform> piece: Piece;
@group(2) @binding(0) var<storage, read_write> mask: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn begin_mask(@builtin(global_invocation_id) id: vec3<u32>) {
    let groups = (piece.count + (GROUP - 1u)) / GROUP;
    let hidden = groups - survivors.count - survivors.accept_count;
    if hidden * FULL_BELOW >= groups {
        return;
    }
    let begin = id.x * WORDS_OF_INVOCATION;
    let end = min(begin + WORDS_OF_INVOCATION, piece.words);
    for (var word = begin; word < end; word += 1u) {
        // Bits behind the last instance stay 0.
        let left = piece.count - word * WORD_BITS;
        mask[word] = select(ALL_BITS >> (WORD_BITS - left), ALL_BITS, left >= WORD_BITS);
    }
    if id.x == 0u {
        let looks = hidden > 0u || (LOOKS_AT_ACCEPTED && survivors.accept_count > 0u);
        survivors.is_full = 1u;
        survivors.accept_workgroups = select(0u, (groups + (RUN - 1u)) / RUN, looks);
    }
}
