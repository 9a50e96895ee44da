// A piece: the instances that fit one storage binding and one dispatch.
// The indices of its instances are those of the caller.

// Twin: `PieceUniform` in `crates/hiz_core/src/instances/piece.rs`.
struct Piece {
    // The caller's index of this piece's first instance, and how many instances there are.
    base: u32,
    count: u32,
    // The number of the piece, which is also that of its draw arguments.
    index: u32,
    // Words of the mask.
    words: u32,
}

// Instances per word of the mask: its bits.
const WORD_BITS: u32 = 32u;
// The verdicts begin at a multiple of this, so that they can be read as vectors.
// Twin: `VERDICT_MULTIPLE` in `crates/hiz_core/src/output/visible.rs`.
const VERDICT_MULTIPLE: u32 = 4u;

// The word behind the mask where the verdicts begin.
fn verdicts_begin(words: u32) -> u32 {
    return (words + (VERDICT_MULTIPLE - 1u)) / VERDICT_MULTIPLE * VERDICT_MULTIPLE;
}
