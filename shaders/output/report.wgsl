// What a cull writes for each instance: a bit of the mask, a verdict, an entry of the list.
// Only what was asked for is written.
// Mask and list use the caller's indices; verdicts lie at places, the stored order.
// Twin: `crates/hiz_core/src/cull/pipelines.rs`, `ReportKey`.

// True: the mask is written, one bit per instance.
override MASK: bool;
// True: verdicts are written.
override VERDICTS: bool;
// True: kept instances are counted here, in the draw arguments, in the order in which invocations
// arrive.
// Otherwise `compact.wgsl` counts the mask later.
override APPEND: bool;
// True, with APPEND: they are also listed.
override LIST: bool;
// True: more instances may be kept than the lists hold.
override CAPPED: bool;

struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: atomic<u32>,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(1) @binding(0) var<uniform> piece: Piece;
// Bit i of the first words says whether instance i of the piece is kept, by the caller's index.
// From `verdicts_begin` on follows one word per place: the verdict of the instance stored there.
@group(2) @binding(0) var<storage, read_write> mask: array<atomic<u32>>;
@group(2) @binding(1) var<storage, read_write> list: array<u32>;
@group(2) @binding(2) var<storage, read_write> draws: array<DrawIndexedIndirect>;
// .x: how many indices may be written in all pieces together.
@group(2) @binding(4) var<uniform> capacity: vec4<u32>;

// How much of the capacity earlier pieces left.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, atomicLoad(&draws[p].instance_count));
    }
    return left;
}

// Adds an instance to the list; the draw's `instance_count` allocates the slot.
// An invocation that finds no room takes its one back, so the count never ends above the room.
// Once it has reached the room it never falls below it, so no slot is given out twice.
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

// Tests the instance at a place, writes its verdict, and returns whether it is kept.
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

// Reports the instance at a place as kept.
fn report(place: u32) {
    let index = caller_index(place);
    if MASK {
        atomicOr(&mask[index / 32u], 1u << (index % 32u));
    }
    if APPEND {
        append(index);
    }
}

// Tests RUN members of a group: those of one of the SHARE invocations that share the group.
// Then it reports those that are kept.
// They are few, so the atomics, which cost most, run for few.
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
