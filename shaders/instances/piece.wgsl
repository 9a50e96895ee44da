// A piece of the instances: as many as one storage binding and one dispatch can hold.
// Twin: `crates/hiz_core/src/instances/piece.rs`, `PieceUniform`.

struct Piece {
    // The caller's index of this piece's first instance, and how many there are.
    base: u32,
    count: u32,
    // The number of the piece, which is also the number of its draw.
    index: u32,
    // Words of the mask.
    words: u32,
}

// Where the verdicts begin behind the mask, in words: at the next multiple of 4.
fn verdicts_begin(words: u32) -> u32 {
    return (words + 3u) / 4u * 4u;
}
