// Which bits of a mask are flipped, where it may begin full (`begin_mask.wgsl`).

// Bit k: member k of the run at place `first` lies within the piece.
fn there(first: u32) -> u32 {
    let behind = (max(piece.count, first) - first + (SHARE - 1u)) / SHARE;
    return (1u << min(behind, RUN)) - 1u;
}

// The members of a run whose bits are not as the mask began; `kept` are those that are kept.
fn flipped(first: u32, kept: u32) -> u32 {
    return select(kept, there(first) & ~kept, parents.is_full != 0u);
}
