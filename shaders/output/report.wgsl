// What a cull leaves behind about the instances that it tests:
//
// - a bit per instance, in the caller's numbering
// - a verdict per instance, in the stored order
//
// What is done with those that are kept is in a file of its own: `report_alone.wgsl`, or
// `../cull/early.wgsl` and `../cull/late.wgsl` for the two passes of a frame.

// Write the verdict of each instance.
override VERDICTS: bool;

@group(1) @binding(0) var<uniform> piece: Piece;
// Bit i of the first words: the caller's instance i of the piece is kept.
// From `verdicts_begin` on: a word per place, the verdict of the instance that is stored there.
@group(2) @binding(0) var<storage, read_write> mask: array<atomic<u32>>;

// The bit of the mask that stands for the instance at a place.
fn mask_bit(place: u32) -> u32 {
    return caller_index(place);
}

fn set_mask_bit(bit: u32) {
    atomicOr(&mask[bit / WORD_BITS], 1u << (bit % WORD_BITS));
}

// Whether the instance at a place is kept; writes its verdict.
fn test(place: u32) -> bool {
    let outcome = classify(place);
    if VERDICTS {
        atomicStore(&mask[verdicts_begin(piece.words) + place], outcome.verdict);
    }
    if STATISTICS {
        count_texels(outcome.level, outcome.texels_read);
    }
    return outcome.verdict >= VISIBLE;
}

// Tests the RUN members of a group that belong to one of its SHARE invocations.
// The first of them is at place `first`, and they lie SHARE places apart.
// Bit k of what returns: member k is kept.
fn test_run(first: u32) -> u32 {
    var kept = 0u;
    var k = 0u;
    loop {
        let place = first + k * SHARE;
        if place < piece.count && test(place) {
            kept |= 1u << k;
        }
        continuing {
            k += 1u;
            break if k == RUN || first + k * SHARE >= piece.count;
        }
    }
    return kept;
}
