// Writes an index and a draw record for each kept instance, ascending: an invocation per word of a
// plane, whose bits stand in the order of indices (`emit.wgsl`).

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

// The instances have mesh ids; otherwise all have mesh 0.
override SORTED: bool;
// The indices are listed, too.
override LIST: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<Numbers>;
@group(0) @binding(2) var<storage, read> before: array<Packed>;
@group(0) @binding(3) var<storage, read> blocks: array<Numbers>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
// The mesh of an index, within the piece.
@group(0) @binding(5) var<storage, read> mesh_of: array<u32>;
@group(0) @binding(6) var<storage, read> templates: array<Template>;
@group(0) @binding(7) var<storage, read_write> list: array<u32>;
@group(0) @binding(8) var<storage, read_write> draws: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn emit_instances(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = id.x;
    if w >= emit.words {
        return;
    }
    var bits = in_any_set(w);
    let written = totals[emit.piece].written;
    var rank = of_plane(blocks[block_at(0u, w)] + unpack(before[w]), 0u);
    while bits != 0u && rank < written {
        let lowest = bits & (~bits + 1u);
        let index = WORD_BITS * w + countTrailingZeros(bits);
        var lod = 0u;
        for (var s = 0u; s < sets(); s += 1u) {
            let bits_of_set = planes[s * emit.words + w];
            if (in_any_plane(bits_of_set) & lowest) != 0u {
                lod = s * PLANES + plane_with(bits_of_set, lowest);
            }
        }
        var mesh = 0u;
        if SORTED {
            mesh = mesh_of[index];
        }
        // The list's entry `first_instance` is the index.
        write_draw(rank, templates[mesh * emit.lods + lod], 1u, rank);
        if LIST {
            list[rank] = emit.base + index;
        }
        bits &= bits - 1u;
        rank += 1u;
    }
}
