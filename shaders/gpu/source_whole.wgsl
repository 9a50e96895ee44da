// Level 0 is all of a texture's level.

fn source_origin() -> vec2<u32> {
    return vec2<u32>(0u);
}
