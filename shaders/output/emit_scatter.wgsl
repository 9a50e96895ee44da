// Writes the indices of the kept instances (`emit.wgsl`): an invocation per word of a plane.

// Twin: `WORKGROUP` in `crates/hiz_core/src/output/emit_passes.rs`.
const WORKGROUP: u32 = 64u;

// As in `emit_bins.wgsl`.
override RESERVED: bool;
// The number of planes.
override LODS: u32;
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

// Planes whose bits and ranks stand in one vector.
const FOUR: u32 = 4u;
const NUMBERS: vec4<u32> = vec4<u32>(0u, 1u, 2u, 3u);

// A word of four planes, beginning with plane `first`.
struct Word {
    bits: vec4<u32>,
    // In the list: where the next instance of each plane goes.
    ranks: vec4<u32>,
}

// .x: the bits of word w of plane l; .y: the rank of the first of them.
// Both are 0 where there is no such plane.
fn bits_and_rank(w: u32, l: u32) -> vec2<u32> {
    if l >= LODS {
        return vec2<u32>(0u);
    }
    let at = l * emit.words + w;
    return vec2<u32>(planes[at], blocks[at >> BLOCK_LOG2_WORDS] + before[at]);
}

fn word_of(w: u32, first: u32) -> Word {
    let a = bits_and_rank(w, first);
    let b = bits_and_rank(w, first + 1u);
    let c = bits_and_rank(w, first + 2u);
    let d = bits_and_rank(w, first + 3u);
    return Word(vec4<u32>(a.x, b.x, c.x, d.x), vec4<u32>(a.y, b.y, c.y, d.y));
}

fn sum(v: vec4<u32>) -> u32 {
    return v.x + v.y + v.z + v.w;
}

// All planes are walked at once, slot by slot.
// Neighbouring invocations then have about as many slots each, however the LODs are spread.
@compute @workgroup_size(WORKGROUP)
fn emit_scatter(@builtin(global_invocation_id) id: vec3<u32>) {
    let w = id.x;
    if w >= emit.words {
        return;
    }
    var low = word_of(w, 0u);
    var high = word_of(w, FOUR);
    let either = low.bits | high.bits;
    var bits = either.x | either.y | either.z | either.w;
    let written = totals[emit.piece].written;
    while bits != 0u {
        let bit = vec4<u32>(bits & (~bits + 1u));
        let in_low = (low.bits & bit) != vec4<u32>(0u);
        let ones = select(vec4<u32>(0u), vec4<u32>(1u), in_low);
        var rank = sum(select(vec4<u32>(0u), low.ranks, in_low));
        low.ranks += ones;
        var lod = sum(select(vec4<u32>(0u), NUMBERS, in_low));
        if LODS > FOUR {
            let in_high = (high.bits & bit) != vec4<u32>(0u);
            let high_ones = select(vec4<u32>(0u), vec4<u32>(1u), in_high);
            rank += sum(select(vec4<u32>(0u), high.ranks, in_high));
            high.ranks += high_ones;
            lod += sum(select(vec4<u32>(0u), NUMBERS + FOUR, in_high));
        }
        if rank < written {
            var index = WORD_BITS * w + countTrailingZeros(bits);
            if SORTED {
                index = index_of[index];
            }
            var at = rank;
            if RESERVED {
                var mesh = 0u;
                if SORTED {
                    mesh = mesh_of[index];
                }
                at += bins[mesh * LODS + lod].shift;
            }
            list[at] = emit.base + index;
        }
        bits &= bits - 1u;
    }
}
