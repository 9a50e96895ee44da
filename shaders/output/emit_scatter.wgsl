// Writes the indices of the kept instances (`emit.wgsl`): an invocation per word of the planes.

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

// As in `emit_bins.wgsl`.
override RESERVED: bool;
// The slots are not the indices (`bin.wgsl`).
override SORTED: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<u32>;
@group(0) @binding(2) var<storage, read> before: array<u32>;
@group(0) @binding(3) var<storage, read> blocks: array<u32>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
@group(0) @binding(5) var<storage, read> bins: array<BinRange>;
// The index of the instance in a slot, and the mesh of an index, within the piece.
@group(0) @binding(6) var<storage, read> index_of: array<u32>;
@group(0) @binding(7) var<storage, read> mesh_of: array<u32>;
@group(0) @binding(8) var<storage, read_write> list: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn emit_scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = id.x;
    if w >= emit.lods * emit.words {
        return;
    }
    var bits = planes[w];
    if bits == 0u {
        return;
    }
    let lod = w / emit.words;
    let first_slot = WORD_BITS * (w - lod * emit.words);
    let written = totals[emit.piece].written;
    var rank = blocks[w >> BLOCK_LOG2_WORDS] + before[w];
    while bits != 0u && rank < written {
        var index = first_slot + countTrailingZeros(bits);
        if SORTED {
            index = index_of[index];
        }
        var at = rank;
        if RESERVED {
            var mesh = 0u;
            if SORTED {
                mesh = mesh_of[index];
            }
            at += bins[mesh * emit.lods + lod].shift;
        }
        list[at] = emit.base + index;
        bits &= bits - 1u;
        rank += 1u;
    }
}
