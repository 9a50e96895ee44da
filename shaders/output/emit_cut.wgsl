// The cut of bins: it clears the bits of a mask whose instances exceed the capacity of the list
// (`emit.wgsl`): an invocation per word of a set.
// Then the mask says what is listed, and not what should have been.

// Twin: `CUT_WORKGROUP` in `crates/hiz_core/src/output/cut.rs`.
const WORKGROUP: u32 = 64u;

// As in `emit_scan.wgsl`.
override BY_INDEX: bool;
// The slots are not the indices (`bin.wgsl`).
override SORTED: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<Numbers>;
@group(0) @binding(2) var<storage, read> before: array<Packed>;
@group(0) @binding(3) var<storage, read> blocks: array<Numbers>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
// The index of the instance in a slot, within the piece.
@group(0) @binding(5) var<storage, read> index_of: array<u32>;
@group(0) @binding(6) var<storage, read_write> mask: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn emit_cut(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = id.x;
    let s = id.y;
    if w >= emit.words {
        return;
    }
    var bits_of_set = planes[s * emit.words + w];
    if BY_INDEX {
        bits_of_set = of_first(in_any_set(w));
    }
    let ranks = blocks[block_at(s, w)] + unpack(before[s * emit.words + w]);
    let written = totals[emit.piece].written;
    for (var p = 0u; p < PLANES; p += 1u) {
        var bits = of_plane(bits_of_set, p);
        var rank = of_plane(ranks, p);
        while bits != 0u {
            if rank >= written {
                var index = WORD_BITS * w + countTrailingZeros(bits);
                if SORTED && !BY_INDEX {
                    index = index_of[index];
                }
                atomicAnd(&mask[index / WORD_BITS], ~(1u << (index % WORD_BITS)));
            }
            bits &= bits - 1u;
            rank += 1u;
        }
    }
}
