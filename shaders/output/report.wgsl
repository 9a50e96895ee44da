// What a cull leaves behind, as far as it was asked for:
//
// - a bit per instance, in the caller's numbering
// - a verdict per instance, in the stored order
// - what `emit` leaves, which is in a file of its own for each way to emit:
//   `report_list.wgsl`, `report_planes.wgsl`, `report_bins.wgsl` or `report_mask.wgsl`
//
// Which instances are tested and reported is in a file of its own, too: `../cull/run.wgsl`, or
// `../cull/early.wgsl` and `../cull/late.wgsl` for the two passes of a frame.

// Set the bit of each instance that is kept.
override MASK: bool;
// The mask may have begun full (`../cull/begin_mask.wgsl`).
override FLIPS: bool;
// Write its verdict.
override VERDICTS: bool;

@group(1) @binding(0) var<uniform> piece: Piece;
// Bit i of the first words: the caller's instance i of the piece is kept.
// From `verdicts_begin` on: a word per place, the verdict of the instance that is stored there.
@group(2) @binding(0) var<storage, read_write> mask: array<atomic<u32>>;

// Where a mask holds an instance.
struct MaskPlace {
    word: u32,
    bit: u32,
}

fn mask_place(index: u32) -> MaskPlace {
    return MaskPlace(index / WORD_BITS, 1u << (index % WORD_BITS));
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

// Reports that the instance at a place is kept; where FLIPS, that its bit is not as it began.
// In each pass an instance is reported at most once.
fn report(place: u32) {
    let index = caller_index(place);
    if MASK {
        let at = mask_place(index);
        if FLIPS {
            atomicXor(&mask[at.word], at.bit);
        } else {
            atomicOr(&mask[at.word], at.bit);
        }
    }
    emit(place, index);
}

// Which members of a run are asked for: bit k stands for the place `first + k * SHARE`.
// The others are outside.
// It is for culls of some instances alone.
fn asked_of_run(first: u32) -> u32 {
    var asked = 0u;
    if AMONG {
        for (var k = 0u; k < RUN && first + k * SHARE < piece.count; k += 1u) {
            let place = first + k * SHARE;
            if is_among(place) {
                asked |= 1u << k;
            } else if VERDICTS {
                atomicStore(&mask[verdicts_begin(piece.words) + place], OUTSIDE);
            }
        }
    }
    return asked;
}

// Tests the RUN members of a group that belong to one of its SHARE invocations.
// The first of them is at place `first`, and they lie SHARE places apart.
// Bit k of what returns: member k is kept.
fn test_run(first: u32) -> u32 {
    var kept = 0u;
    var asked = asked_of_run(first);
    var k = 0u;
    loop {
        // Software drivers skip no branch but end a loop.
        // So the loop goes from one that is asked for to the next.
        if AMONG {
            if asked == 0u {
                break;
            }
            k = countTrailingZeros(asked);
            asked &= asked - 1u;
        }
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
