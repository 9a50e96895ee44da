// Level 0 is a rectangle of a texture: a viewport, or what dynamic resolution uses of it.
// Its neighbours may hold anything, so no pixel beside the rectangle counts.
// `part_origin` and `part_edge` come from what reads it: `../pyramid/pyramid_write.wgsl` or
// `../pyramid/texels_apart.wgsl`.

fn source_origin() -> vec2<u32> {
    return part_origin();
}
