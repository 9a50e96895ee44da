// How a cull emits the bins of one mesh at once, without planes: each LOD has a draw record whose
// `instance_count` is its allocator.
// The indices stand in the order in which invocations arrive, in the words that are reserved for
// the LOD.

// More instances may be kept than the lists hold.
override CAPPED: bool;
// And list them.
override LIST: bool;
// Words of a draw record.
override RECORD_WORDS: u32;

@group(2) @binding(1) var<storage, read_write> list: array<u32>;
// Behind the records of a piece one more counts the instances of all LODs.
@group(2) @binding(2) var<storage, read_write> draws: array<atomic<u32>>;
@group(2) @binding(4) var<uniform> bins: Emit;

// The word that counts the instances of a record of this piece.
fn instance_count(piece_begin: u32, record: u32) -> u32 {
    return piece_begin + record * RECORD_WORDS + 1u;
}

// The capacity that earlier pieces have left.
fn room() -> u32 {
    let words_of_piece = (bins.records + 1u) * RECORD_WORDS;
    var left = bins.capacity;
    for (var p = 0u; p < bins.piece; p += 1u) {
        left -= min(left, atomicLoad(&draws[instance_count(p * words_of_piece, bins.records)]));
    }
    return left;
}

// An instance past the capacity takes back its count.
// So the counts end within the capacity, and no place in the list is handed out twice.
fn emit(place: u32, index: u32) {
    if CAPPED {
        let all = instance_count(bins.draws_begin, bins.records);
        if atomicAdd(&draws[all], 1u) >= room() {
            atomicSub(&draws[all], 1u);
            return;
        }
    }
    let lod = bin_of(place, index).lod;
    let at = atomicAdd(&draws[instance_count(bins.draws_begin, lod)], 1u);
    if LIST {
        list[lod * bins.count + at] = bins.base + index;
    }
}
