// What a cull that is not one of two passes does with the instances that it keeps:
//
// - it sets their bits in the mask
// - it lists them for the draw, and counts the list

// Set the bit of each instance that is kept.
override MASK: bool;
// Count the kept instances in the draw arguments, in the order in which invocations arrive.
// Otherwise `compact.wgsl` counts the mask.
override APPEND: bool;
// And list them.
override LIST: bool;
// More instances may be kept than the lists hold.
override CAPPED: bool;

// Twin: `DrawIndexedIndirect` in `crates/hiz_core/src/output/draw.rs`.
struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: atomic<u32>,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(2) @binding(1) var<storage, read_write> list: array<u32>;
@group(2) @binding(2) var<storage, read_write> draws: array<DrawIndexedIndirect>;
// .x: how many indices may be written, in all pieces together.
@group(2) @binding(4) var<uniform> capacity: vec4<u32>;

// The capacity that earlier pieces have left.
fn room() -> u32 {
    var left = capacity.x;
    for (var p = 0u; p < piece.index; p += 1u) {
        left -= min(left, atomicLoad(&draws[p].instance_count));
    }
    return left;
}

// `instance_count` is also the allocator.
// An invocation whose slot exceeds the remaining capacity undoes its increment.
// So the count ends within the capacity, and no slot is handed out twice.
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

// Reports that the instance at a place is kept.
fn report(place: u32) {
    if MASK {
        set_mask_bit(mask_bit(place));
    }
    if APPEND {
        append(caller_index(place));
    }
}

// Tests the members of a group that belong to one of its invocations.
// Then it reports those that are kept: they are few, so the expensive part runs a few times.
fn cull_run(group: u32, share: u32) {
    let first = group * GROUP + share;
    for (var kept = test_run(first); kept != 0u; kept &= kept - 1u) {
        report(first + countTrailingZeros(kept) * SHARE);
    }
}
