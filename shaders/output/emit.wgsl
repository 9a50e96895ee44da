// What the passes of the emit stage share.
//
// A cull leaves a bit plane per level of detail, with a bit per slot (`report_planes.wgsl`).
// One plane or four make a set (`emit_planes.wgsl`).
// These passes make lists and draw arguments of the planes, in the order of their dispatches:
//
// 1. `emit_block` and `emit_top` count the bits before each word of all planes.
// 2. `emit_bins` finds where each bin begins and ends.
// 3. `emit_draws` writes the draw arguments of the bins that are not empty.
// 4. `emit_scatter` writes the indices.
//
// A bin is a mesh and a level of detail, and its bits are neighbours in its plane.
// So its begin and its length are differences of counts of bits.
// No atomic is needed, and every run and driver gives the same bits.

// Twin: `EmitUniform` in `crates/hiz_core/src/output/bins.rs`.
struct Emit {
    // The caller's index of the piece's first instance, and how many instances there are.
    base: u32,
    count: u32,
    // Words of a plane, and how many planes there are.
    words: u32,
    lods: u32,
    // The number of the piece.
    piece: u32,
    // How many indices may be written, in all pieces together.
    capacity: u32,
    // Draw records of a piece, and the first word of its draw records.
    records: u32,
    draws_begin: u32,
}

// What a piece keeps.
struct Total {
    // Instances that are kept, and how many of them the list holds.
    demand: u32,
    written: u32,
}

// A bin in the list.
// Twin: `BinRecord` in `crates/hiz_core/src/output/bins.rs`.
struct BinRange {
    // Among all kept instances: the rank of its first one, and how many are written.
    begin: u32,
    count: u32,
    // Added to the rank of an instance: where the list holds it.
    shift: u32,
    // In the first bin of an invocation of `emit_bins`: how many bins are not empty, of this
    // invocation and of earlier ones of its workgroup.
    filled: u32,
}

// A draw without its numbers of instances.
struct Template {
    // How many vertices or indices are drawn, and which is the first.
    count: u32,
    first: u32,
    base_vertex: u32,
    padding: u32,
}
