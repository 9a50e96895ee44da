// Finds where each bin begins and ends in the list (`emit.wgsl`): an invocation per bin.

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

// Every bin has room for all instances of its mesh, and a draw record of its own.
override RESERVED: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<u32>;
@group(0) @binding(2) var<storage, read> before: array<u32>;
@group(0) @binding(3) var<storage, read> blocks: array<u32>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
// The first slot of each mesh; one more word holds the number of all slots.
@group(0) @binding(5) var<storage, read> starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> bins: array<BinRange>;
@group(0) @binding(7) var<storage, read> templates: array<Template>;
@group(0) @binding(8) var<storage, read_write> draws: array<u32>;

// How many bits are set in all planes before this slot of plane l.
fn rank(l: u32, slot: u32) -> u32 {
    let w = l * emit.words + slot / WORD_BITS;
    let words = emit.lods * emit.words;
    if w >= words {
        return blocks[blocks_of(words)];
    }
    let earlier = planes[w] & ((1u << (slot % WORD_BITS)) - 1u);
    return blocks[w >> BLOCK_LOG2_WORDS] + before[w] + countOneBits(earlier);
}

@compute @workgroup_size(WORKGROUP)
fn emit_bins(@builtin(global_invocation_id) id: vec3<u32>) {
    let bin = id.x;
    if bin >= emit.records {
        return;
    }
    let mesh = bin / emit.lods;
    let lod = bin % emit.lods;
    let written = totals[emit.piece].written;
    // A list that is too short ends within a bin, and the bins behind it are empty.
    let begin = min(rank(lod, starts[mesh]), written);
    let end = min(rank(lod, starts[mesh + 1u]), written);
    var shift = 0u;
    if RESERVED {
        shift = lod * emit.count + starts[mesh] - begin;
        write_draw(bin, templates[bin], end - begin, 0u);
    }
    bins[bin] = BinRange(begin, end - begin, shift, 0u);
}
