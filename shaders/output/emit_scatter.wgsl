// Writes the indices of the kept instances (`emit.wgsl`): an invocation per word of a set.

// As in `emit_bins.wgsl`.
override RESERVED: bool;
// The slots are not the indices (`bin.wgsl`).
override SORTED: bool;

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<Numbers>;
@group(0) @binding(2) var<storage, read> before: array<Packed>;
@group(0) @binding(3) var<storage, read> blocks: array<Numbers>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
@group(0) @binding(5) var<storage, read> bins: array<BinRange>;
// The index of the instance in a slot, and the mesh of an index, within the piece.
@group(0) @binding(6) var<storage, read> index_of: array<u32>;
@group(0) @binding(7) var<storage, read> mesh_of: array<u32>;
@group(0) @binding(8) var<storage, read_write> list: array<u32>;

// Kept instances of a word that make it worth while to ask for all its indices at once.
const MANY: u32 = 8u;
// Indices of a line of a cache.
const LINE: u32 = 16u;
// The bit that no index has: 2^31 instances would not fit a piece.
const NO_INDEX_BIT: u32 = 31u;

// Returns 0, after reading an index of each line that holds the indices of a word's slots.
// So both lines come from memory at the same time, and the walk over the slots finds them near.
fn bring_indices(w: u32) -> u32 {
    let slot = WORD_BITS * w;
    // The last word may have fewer slots than bits.
    let of_second_line = min(slot + LINE, arrayLength(&index_of) - 1u);
    return (index_of[slot] | index_of[of_second_line]) >> NO_INDEX_BIT;
}

// All planes of a set are walked at once, slot by slot.
// Neighbouring invocations then have about as many slots each, however the LODs are spread.
@compute @workgroup_size(WORKGROUP)
fn emit_scatter(
    @builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) workgroup: vec3<u32>,
) {
    let w = id.x;
    if w >= emit.words {
        return;
    }
    let s = workgroup.y;
    let at = s * emit.words + w;
    let bits = planes[at];
    // A workgroup's words are of one block.
    var ranks = unpack(before[at]) + blocks[block_at(s, workgroup.x * WORKGROUP)];
    var left = in_any_plane(bits);
    var written = totals[emit.piece].written;
    if SORTED && countOneBits(left) > MANY {
        written += bring_indices(w);
    }
    while left != 0u {
        let bit = left & (~left + 1u);
        left ^= bit;
        let rank = take_rank(&ranks, bits, bit);
        if rank < written {
            var index = WORD_BITS * w + countTrailingZeros(bit);
            if SORTED {
                index = index_of[index];
            }
            var place = rank;
            if RESERVED {
                var mesh = 0u;
                if SORTED {
                    mesh = mesh_of[index];
                }
                let lod = s * PLANES + plane_with(bits, bit);
                place += bins[mesh * emit.lods + lod].shift;
            }
            list[place] = emit.base + index;
        }
    }
}
