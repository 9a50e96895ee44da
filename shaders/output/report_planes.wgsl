// How a cull emits bins: a bit plane per level of detail, which `emit_*.wgsl` turns into lists.

// The bits stand in the order of indices.
// Otherwise they stand in the order of slots, so that the bits of each mesh are neighbours.
override BY_INDEX: bool;
// Planes of a set (`emit_planes.wgsl`).
override PLANES: u32;

// The words of a set with the same number lie side by side.
@group(2) @binding(1) var<storage, read_write> planes: array<atomic<u32>>;

fn emit(place: u32, index: u32) {
    let bin = bin_of(place, index);
    let at = mask_place(select(bin.slot, index, BY_INDEX));
    let word_of_set = bin.lod / PLANES * piece.words + at.word;
    atomicOr(&planes[word_of_set * PLANES + bin.lod % PLANES], at.bit);
}
