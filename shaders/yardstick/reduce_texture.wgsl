// A yardstick, not a part of the library: the reduction with one dispatch per level, on the mip
// levels of a texture.
// An invocation makes one texel, as in the published tutorials.
// Sizes are halved and rounded up, so that it reads what the library reads.

// Invocations along a side of a workgroup.
// Twin: `TEXTURE_WORKGROUP_SIDE` in `crates/hiz_core/src/yardstick/reduce.rs`.
const SIDE: u32 = 8u;

// .xy: the size of the level that is written; .zw: of the one that is read.
@group(0) @binding(2) var<uniform> sizes: vec4<u32>;
@group(0) @binding(3) var finer: texture_2d<f32>;
@group(0) @binding(4) var written: texture_storage_2d<r32float, write>;

// True: level 0, the source texture, is read.
override FROM_SOURCE: bool;

fn finer_bits(x: u32, y: u32) -> u32 {
    if FROM_SOURCE {
        return sanitized(source_given(x, y));
    }
    return bitcast<u32>(textureLoad(finer, vec2<u32>(x, y), 0).x);
}

@compute @workgroup_size(SIDE, SIDE)
fn reduce_texture(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= sizes.x || id.y >= sizes.y {
        return;
    }
    let a = 2u * id.xy;
    let b = min(a + vec2<u32>(1u), sizes.zw - vec2<u32>(1u));
    let bits = farthest4(vec4<u32>(
        finer_bits(a.x, a.y), finer_bits(b.x, a.y), finer_bits(a.x, b.y), finer_bits(b.x, b.y)));
    textureStore(written, id.xy, vec4<f32>(bitcast<f32>(bits), 0.0, 0.0, 0.0));
}
