// How a cull emits one list of kept instances and its length.

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

fn emit(place: u32, index: u32) {
    if APPEND {
        append(index);
    }
}
