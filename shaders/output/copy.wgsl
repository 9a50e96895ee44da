// Copies the caller's own records of the kept instances, ascending: an invocation per word of the
// mask, in place of `scatter` of `compact.wgsl`.

// Words of a record.
override RECORD_WORDS: u32;

// The records of the piece's instances, by index.
@group(0) @binding(6) var<storage, read> records: array<u32>;

@compute @workgroup_size(SCATTER_WORKGROUP)
fn copy_records(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = id.x;
    if word >= piece.words {
        return;
    }
    let written = draws[piece.index].instance_count;
    var slot = before[word];
    var bits = mask[word];
    while bits != 0u && slot < written {
        let first = (WORD_BITS * word + countTrailingZeros(bits)) * RECORD_WORDS;
        for (var k = 0u; k < RECORD_WORDS; k += 1u) {
            list[slot * RECORD_WORDS + k] = records[first + k];
        }
        bits &= bits - 1u;
        slot += 1u;
    }
}
