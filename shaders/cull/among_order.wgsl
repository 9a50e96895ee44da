// From a mask in the caller's numbering to bits in stored order, which a cull reads (`among.wgsl`).
// An invocation writes a word: the bits of AMONG_BITS places.

// Twin: `WORKGROUP` in `crates/hiz_core/src/cull/among.rs`.
const WORKGROUP: u32 = 64u;

// Texels of a record, and which of them ends with the caller's index.
override TEXELS: u32;
override INDEX_TEXEL: u32;

@group(0) @binding(0) var<uniform> piece: Piece;
@group(0) @binding(1) var records: texture_storage_2d<rgba32uint, read>;
@group(0) @binding(2) var<storage, read> mask: array<u32>;
@group(0) @binding(3) var stored: texture_storage_2d<r32uint, write>;

@compute @workgroup_size(WORKGROUP)
fn among_order(@builtin(global_invocation_id) id: vec3<u32>) {
    let first = id.x * AMONG_BITS;
    let size = textureDimensions(stored);
    let position = among_position(id.x);
    if any(position >= size) {
        return;
    }
    var bits = 0u;
    for (var k = 0u; k < AMONG_BITS && first + k < piece.count; k += 1u) {
        let index = textureLoad(records, record_position(first + k, INDEX_TEXEL, TEXELS)).w;
        bits |= ((mask[index / WORD_BITS] >> (index % WORD_BITS)) & 1u) << k;
    }
    textureStore(stored, position, vec4<u32>(bits));
}
