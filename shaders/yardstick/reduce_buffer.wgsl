// A yardstick, not a part of the library: the reduction as one dispatch per level on a flat buffer.
// Most Hi-Z implementations have this shape.
// An invocation makes four texels of a level, so that all loads and stores are vectors.

struct YardstickLevel {
    // In vectors of four texels.
    offset: u32,
    stride: u32,
    // In texels.
    width: u32,
    height: u32,
}

struct YardstickStep {
    read: YardstickLevel,
    written: YardstickLevel,
}

@group(0) @binding(2) var<uniform> step: YardstickStep;
@group(0) @binding(3) var<storage, read_write> texels: array<vec4<u32>>;

// True: level 0, the source texture, is read.
override FROM_SOURCE: bool;

fn pairs(a: vec4<u32>, b: vec4<u32>) -> vec2<u32> {
    return vec2<u32>(farthest4(vec4<u32>(a.xy, b.xy)), farthest4(vec4<u32>(a.zw, b.zw)));
}

@compute @workgroup_size(64, 1)
fn reduce_buffer(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= step.written.stride || id.y >= step.written.height {
        return;
    }
    var out: vec4<u32>;
    if FROM_SOURCE {
        out = source_quad_row(id.x, id.y);
    } else {
        let top = step.read.offset + (2u * id.y) * step.read.stride;
        let bottom = step.read.offset + min(2u * id.y + 1u, step.read.height - 1u) * step.read.stride;
        let left = 2u * id.x;
        // A row's padding repeats its edge.
        let right = min(left + 1u, step.read.stride - 1u);
        out = vec4<u32>(pairs(texels[top + left], texels[bottom + left]), pairs(texels[top + right], texels[bottom + right]));
    }
    texels[step.written.offset + id.y * step.written.stride + id.x] = out;
}
