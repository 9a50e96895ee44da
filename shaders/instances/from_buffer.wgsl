// Bounds from the caller's buffer: records of instances, and the boxes around their groups.
// All of a piece is written anew, so nothing here depends on what ran before.
//
// An invocation takes all members of a group, one after the other, and then writes its box.
// So no two invocations share anything.
//
// `corners.wgsl` has what forms boxes.

// Twin: `FromBufferUniform` in `crates/hiz_core/src/instances/from_buffer.rs`.
struct FromBuffer {
    // Instances of the piece.
    count: u32,
    // The word where the bounds of the piece's first instance begin.
    first: u32,
    // Words from one instance's bounds to the next one's.
    stride: u32,
    // 0, which no compiler knows: see `bar`.
    runtime_zero: u32,
}

@group(0) @binding(0) var<uniform> source: FromBuffer;
@group(0) @binding(1) var<storage, read> given: array<u32>;
// By place, relative to the piece's first instance; not read if places and indices are the same.
@group(0) @binding(2) var<storage, read> indices: array<u32>;
@group(0) @binding(3) var records: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(4) var group_records: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(5) var<storage, read_write> sequence: Sequence;

// Whether the instances are stored in another order than the caller's.
override SORTED: bool;

// Twin: `WORKGROUP` in `crates/hiz_core/src/instances/from_buffer.rs`.
const WORKGROUP: u32 = 64u;

@compute @workgroup_size(WORKGROUP)
fn take_bounds(@builtin(global_invocation_id) id: vec3<u32>) {
    let group = id.x;
    let first = group * GROUP;
    if first >= source.count {
        return;
    }
    if group == 0u {
        // Group boxes of updates from the host do not know these bounds.
        sequence.broken = 1u;
    }
    var around = Corners(vec3<u32>(INVALID_HIGH), vec3<u32>(INVALID_LOW));
    for (var place = first; place < min(first + GROUP, source.count); place += 1u) {
        var index = place;
        if SORTED { index = indices[place]; }
        let corners = take(place, index, source.first + index * source.stride);
        around = Corners(min(around.low, corners.low), max(around.high, corners.high));
    }
    var box = BoxTexels(vec3<u32>(0u), vec3<u32>(BEYOND_LIMITS_BITS));
    if around.low.x != INVALID_LOW {
        box = box_texels(around);
    }
    textureStore(group_records, record_position(group, 0u, BOX_TEXELS), vec4<u32>(box.center, 0u));
    textureStore(group_records, record_position(group, 1u, BOX_TEXELS), vec4<u32>(0u));
    textureStore(group_records, record_position(group, 2u, BOX_TEXELS), vec4<u32>(box.half, 0u));
}
