// What a cull leaves behind: for each instance a bit in the caller's numbering, a verdict in the
// stored one, and its place in the draw's list; of these what was asked for.

// A bit for each instance that is kept.
override MASK: bool;
// Its verdict.
override VERDICTS: bool;
// Count what is kept in the draw arguments, here, in whatever order invocations arrive; otherwise
// `compact.wgsl` counts the mask.
override APPEND: bool;
// And list it.
override LIST: bool;
// More may be kept than the lists hold.
override CAPPED: bool;

struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: atomic<u32>,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// Bit i of the first words: the caller's instance i of the piece is kept.
// Then, from a multiple of 4 on, a word for each place: the verdict of who is stored there.
@group(2) @binding(0) var<storage, read_write> mask: array<atomic<u32>>;
@group(2) @binding(1) var<storage, read_write> list: array<u32>;
@group(2) @binding(2) var<storage, read_write> draws: array<DrawIndexedIndirect>;
// .x: how many indices may be written in all pieces together.
@group(2) @binding(4) var<uniform> capacity: vec4<u32>;

// What earlier pieces left of the capacity.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, atomicLoad(&draws[p].instance_count));
    }
    return left;
}

// The count is the draw's own: it never ends above the room, for who finds none takes its one back,
// and nobody can have taken a slot below the room before.
fn append(index: u32) {
    let slot = atomicAdd(&draws[piece.index].instance_count, 1u);
    if CAPPED {
        if slot >= room() {
            atomicSub(&draws[piece.index].instance_count, 1u);
            return;
        }
    }
    if LIST {
        list[slot] = piece.base + index;
    }
}

// Whether the instance at a place is kept; its verdict is written.
fn test(place: u32) -> bool {
    let outcome = classify(place);
    if VERDICTS {
        atomicStore(&mask[verdicts_begin(piece.words) + place], outcome.verdict);
    }
    if STATISTICS {
        count_texels(outcome.level, outcome.texels_read);
    }
    return outcome.verdict >= VISIBLE;
}

// The instance at a place is kept.
fn report(place: u32) {
    let index = caller_index(place);
    if MASK {
        atomicOr(&mask[index / 32u], 1u << (index % 32u));
    }
    if APPEND {
        append(index);
    }
}

// Tests the RUN members of a group that one of the SHARE invocations has, and then reports those
// that are kept: few, so that the dear part is done for few.
fn cull_run(group: u32, share: u32) {
    let first = group * GROUP + share;
    var kept = 0u;
    var k = 0u;
    loop {
        let place = first + k * SHARE;
        if place < piece.count && test(place) {
            kept |= 1u << k;
        }
        continuing {
            k += 1u;
            break if k == RUN || first + k * SHARE >= piece.count;
        }
    }
    for (; kept != 0u; kept &= kept - 1u) {
        report(first + countTrailingZeros(kept) * SHARE);
    }
}
