// A piece of the instances: what one storage binding and one dispatch can hold.
// Its indices stay the caller's.

struct Piece {
    // The caller's index of this piece's first instance, and how many there are.
    base: u32,
    count: u32,
    // Which piece, that is which draw.
    index: u32,
    // Words of the mask.
    words: u32,
}

// Where the verdicts begin behind the mask.
fn verdicts_begin(words: u32) -> u32 {
    return (words + 3u) / 4u * 4u;
}
