// The cut: it clears the bits of a mask that exceed the capacity of the list.
// Then the mask says what is listed, and not what should have been.

// Twin: `CUT_WORKGROUP` in `crates/hiz_core/src/output/cut.rs`.
const WORKGROUP: u32 = 64u;

// Twin: `DrawIndexedIndirect` in `crates/hiz_core/src/output/draw.rs`.
struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> piece: Piece;
@group(0) @binding(1) var<storage, read_write> mask: array<u32>;
@group(0) @binding(2) var<storage, read> draws: array<DrawIndexedIndirect>;
// How many bits are set before each word of the mask; `compact.wgsl` has counted them.
@group(0) @binding(3) var<storage, read> before: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn cut(@builtin(global_invocation_id) id: vec3<u32>) {
    let word = id.x;
    if word >= piece.words {
        return;
    }
    let listed = draws[piece.index].instance_count;
    var room = listed - min(listed, before[word]);
    var bits = mask[word];
    var left = 0u;
    while bits != 0u && room != 0u {
        left |= bits & (~bits + 1u);
        bits &= bits - 1u;
        room -= 1u;
    }
    mask[word] = left;
}
