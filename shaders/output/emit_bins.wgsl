// Finds where each bin begins and ends in the list (`emit.wgsl`): an invocation per
// eight meshes.

// Every bin has room for all instances of its mesh, and a draw record of its own.
override RESERVED: bool;

@group(0) @binding(0) var<uniform> emit: Emit;
@group(0) @binding(1) var<storage, read> planes: array<Numbers>;
@group(0) @binding(2) var<storage, read> before: array<Packed>;
@group(0) @binding(3) var<storage, read> blocks: array<Numbers>;
@group(0) @binding(4) var<storage, read> totals: array<Total>;
// The first slot of each mesh; one more word holds the number of all slots.
@group(0) @binding(5) var<storage, read> starts: array<u32>;
@group(0) @binding(6) var<storage, read_write> bins: array<BinRange>;
@group(0) @binding(7) var<storage, read> templates: array<Template>;
@group(0) @binding(8) var<storage, read_write> draws: array<u32>;

// Non-empty bins.
alias Sum = u32;

// For each plane of a set: how many bits are set before this slot, and in all earlier planes.
fn ranks(s: u32, slot: u32) -> Numbers {
    let w = slot / WORD_BITS;
    let through_block = blocks[block_at(s, w)];
    if w >= emit.words {
        return through_block;
    }
    let at = s * emit.words + w;
    let earlier = planes[at] & Numbers((1u << (slot % WORD_BITS)) - 1u);
    return through_block + unpack(before[at]) + countOneBits(earlier);
}

// Writes the bins of the meshes of a share in one set, and returns how many are not empty.
fn write_bins(s: u32, share: vec2<u32>) -> u32 {
    // A list that is too short ends within a bin, and the bins behind it are empty.
    let written = Numbers(totals[emit.piece].written);
    var filled = 0u;
    var begins = min(ranks(s, starts[share.x]), written);
    for (var mesh = share.x; mesh < share.y; mesh += 1u) {
        let ends = min(ranks(s, starts[mesh + 1u]), written);
        for (var p = 0u; p < PLANES && s * PLANES + p < emit.lods; p += 1u) {
            let lod = s * PLANES + p;
            let bin = mesh * emit.lods + lod;
            let begin = of_plane(begins, p);
            let count = of_plane(ends, p) - begin;
            var shift = 0u;
            if RESERVED {
                shift = lod * emit.count + starts[mesh] - begin;
                write_draw(bin, templates[bin], count, 0u);
            }
            bins[bin] = BinRange(begin, count, shift, 0u);
            filled += select(0u, 1u, count > 0u);
        }
        begins = ends;
    }
    return filled;
}

@compute @workgroup_size(WORKGROUP)
fn emit_bins(
    @builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32,
) {
    let share = share_of(id.x);
    var filled = 0u;
    if share.x < share.y {
        for (var s = 0u; s < sets(); s += 1u) {
            filled += write_bins(s, share);
        }
    }
    if !RESERVED {
        let through = prefix(lane, filled);
        if share.x < share.y {
            bins[share.x * emit.lods].filled = through;
        }
    }
}
