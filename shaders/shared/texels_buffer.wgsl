// The stored levels where the reduction left them.

@group(0) @binding(3) var<storage, read> chunk_0: array<u32>;
@group(0) @binding(4) var<storage, read> chunk_1: array<u32>;
@group(0) @binding(5) var<storage, read> chunk_2: array<u32>;

fn texel_bits(index: u32) -> u32 {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { return chunk_0[i]; }
        case 1u: { return chunk_1[i]; }
        default: { return chunk_2[i]; }
    }
}
