// Which bits of a mask are set, where it begins empty: those of the members that are kept.

fn flipped(first: u32, kept: u32) -> u32 {
    return kept;
}
