// A copy of the stored levels in a texture, rows of one list: a software driver reads a texel of it in a quarter of the time that a
// word of a buffer takes (docs/performance.md).

// Texels of a row, as a power of two (twin: `crates/hiz_core/src/pyramid.rs`, COPY_ROW).
const COPY_ROW_LOG2: u32 = 12u;

@group(0) @binding(3) var texels: texture_storage_2d<r32uint, read>;

fn texel_bits(index: u32) -> u32 {
    return textureLoad(texels, vec2<u32>(index % (1u << COPY_ROW_LOG2), index >> COPY_ROW_LOG2)).x;
}
