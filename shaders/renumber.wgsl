// Renumbering: instances are stored along a curve through space, the caller knows them by the order in which they came. The cull
// wrote its planes (and with order "any" its list) about places; here they are written about the caller's indices.

struct DrawIndexedIndirect {
    index_count: u32,
    instance_count: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> piece: Piece;
// The index of each stored instance, relative to piece.base.
@group(0) @binding(1) var<storage, read> indices: array<u32>;
// Both planes about places.
@group(0) @binding(2) var<storage, read> stored_planes: array<u32>;
// Both planes about indices, all zero.
@group(0) @binding(3) var<storage, read_write> planes: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read_write> list: array<u32>;
@group(0) @binding(5) var<storage, read> draws: array<DrawIndexedIndirect>;

@compute @workgroup_size(128)
fn renumber_planes(@builtin(global_invocation_id) id: vec3<u32>) {
    let place = id.x;
    if place >= piece.count {
        return;
    }
    let word = place / 32u;
    let bit = place % 32u;
    let kept = (stored_planes[word] >> bit) & 1u;
    let low = (stored_planes[piece.words + word] >> bit) & 1u;
    let index = indices[place];
    if kept != 0u { atomicOr(&planes[index / 32u], 1u << (index % 32u)); }
    if low != 0u { atomicOr(&planes[piece.words + index / 32u], 1u << (index % 32u)); }
}

@compute @workgroup_size(128)
fn renumber_list(@builtin(global_invocation_id) id: vec3<u32>) {
    let slot = id.x;
    if slot >= draws[piece.index].instance_count {
        return;
    }
    list[slot] = piece.base + indices[list[slot] - piece.base];
}
