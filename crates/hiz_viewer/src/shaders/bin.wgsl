// Lists the bodies of each kind that a mask keeps, and writes the kind's draw arguments.

// Twin: `culler.rs`, `KindRecord`.
struct Kind {
    first: u32,
    count: u32,
    index_count: u32,
    first_index: u32,
    base_vertex: u32,
}

@group(0) @binding(0) var<storage, read> kinds: array<Kind>;
@group(0) @binding(1) var<storage, read> kept: array<u32>;
@group(0) @binding(2) var<storage, read> without: array<u32>;
@group(0) @binding(3) var<storage, read_write> list: array<u32>;
@group(0) @binding(4) var<storage, read_write> draws: array<u32>;

@compute @workgroup_size(64)
fn bin(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&kinds) {
        return;
    }
    let kind = kinds[id.x];
    var end = kind.first;
    for (var i = kind.first; i < kind.first + kind.count; i++) {
        let word = kept[i / 32u] & ~without[i / 32u];
        if ((word >> (i % 32u)) & 1u) == 1u {
            list[end] = i;
            end += 1u;
        }
    }
    draws[5u * id.x] = kind.index_count;
    draws[5u * id.x + 1u] = end - kind.first;
    draws[5u * id.x + 2u] = kind.first_index;
    draws[5u * id.x + 3u] = kind.base_vertex;
    draws[5u * id.x + 4u] = kind.first;
}
