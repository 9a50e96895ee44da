// How a cull emits bins: a bit plane per level of detail, which `emit_*.wgsl` turns into lists.

// The bits stand in the order of indices.
// Otherwise they stand in the order of slots, so that the bits of each mesh are neighbours.
override BY_INDEX: bool;

// Plane l begins at word `l * piece.words`.
@group(2) @binding(1) var<storage, read_write> planes: array<atomic<u32>>;

fn emit(place: u32, index: u32) {
    let bin = bin_of(place, index);
    let at = mask_place(select(bin.slot, index, BY_INDEX));
    atomicOr(&planes[bin.lod * piece.words + at.word], at.bit);
}
