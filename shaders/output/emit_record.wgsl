// Writes draw records (`emit.wgsl`).

// The records are those of indexed draws, which have five words; the others have four.
// Twins: `DrawIndexedIndirect` and `DrawIndirect` in `crates/hiz_core/src/output/draw.rs`.
override INDEXED: bool;

// Words that both kinds of records have.
const COMMON_WORDS: u32 = 3u;

fn record_words() -> u32 {
    return COMMON_WORDS + select(1u, 2u, INDEXED);
}

fn write_draw(at: u32, draw: Template, count: u32, first_instance: u32) {
    let word = emit.draws_begin + at * record_words();
    draws[word] = draw.count;
    draws[word + 1u] = count;
    draws[word + 2u] = draw.first;
    if INDEXED {
        draws[word + COMMON_WORDS] = draw.base_vertex;
    }
    draws[word + record_words() - 1u] = first_instance;
}
