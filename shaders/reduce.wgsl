// Depth reduction: each invocation reads an 8x8 block of one level and writes what it makes of the next three.
//
// The shape of AMD's Single Pass Downsampler (FidelityFX SPD, 2020) cut to registers: no shared memory, no barrier, a pass
// for every three levels. Sizes are ceil-halved, and reads past an edge repeat the edge, so a texel of level k is the
// farthest depth of exactly the pixels [x << k, (x + 1) << k): nothing is dropped at odd sizes and nothing is read twice
// that could matter (the defect of the shader printed in Rakos 2010).

@group(0) @binding(2) var<uniform> pyramid: Pyramid;
@group(0) @binding(3) var<storage, read_write> chunk_0: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> chunk_1: array<vec4<u32>>;
@group(0) @binding(5) var<storage, read_write> chunk_2: array<vec4<u32>>;
// .x: the level that is read; the next three are written where they exist. .y: this reduction's number, for the header.
@group(1) @binding(0) var<uniform> step: vec4<u32>;

// True: level 0, the source texture, is read; otherwise a stored level.
override FROM_SOURCE: bool;

fn texel_bits(index: u32) -> u32 {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { return chunk_0[i >> 2u][i & 3u]; }
        case 1u: { return chunk_1[i >> 2u][i & 3u]; }
        default: { return chunk_2[i >> 2u][i & 3u]; }
    }
}

fn store(index: u32, bits: u32) {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { chunk_0[i >> 2u][i & 3u] = bits; }
        case 1u: { chunk_1[i >> 2u][i & 3u] = bits; }
        default: { chunk_2[i >> 2u][i & 3u] = bits; }
    }
}

// `index` is a multiple of 4, and so is the size of a chunk.
fn store4(index: u32, bits: vec4<u32>) {
    let chunk = select(index >> pyramid.chunk_shift, 0u, CHUNKS == 1u);
    let i = index - (chunk << pyramid.chunk_shift);
    switch chunk {
        case 0u: { chunk_0[i >> 2u] = bits; }
        case 1u: { chunk_1[i >> 2u] = bits; }
        default: { chunk_2[i >> 2u] = bits; }
    }
}

// The farthest depth of the texels (2x, 2y) to (2x + 1, 2y + 1) of the level that is read.
fn quad(level: Level, x: u32, y: u32) -> u32 {
    if FROM_SOURCE {
        return farthest4(source_quad(x, y));
    }
    let x0 = min(2u * x, level.width - 1u);
    let x1 = min(2u * x + 1u, level.width - 1u);
    let row_0 = level.offset + min(2u * y, level.height - 1u) * level.stride;
    let row_1 = level.offset + min(2u * y + 1u, level.height - 1u) * level.stride;
    return farthest4(vec4<u32>(
        texel_bits(row_0 + x0), texel_bits(row_0 + x1), texel_bits(row_1 + x0), texel_bits(row_1 + x1)));
}

fn row_of_quads(level: Level, x: u32, y: u32) -> vec4<u32> {
    return vec4<u32>(quad(level, x, y), quad(level, x + 1u, y), quad(level, x + 2u, y), quad(level, x + 3u, y));
}

// The farthest of two rows, and of neighbours in them.
fn halved(a: vec4<u32>, b: vec4<u32>) -> vec2<u32> {
    return vec2<u32>(farthest4(vec4<u32>(a.xy, b.xy)), farthest4(vec4<u32>(a.zw, b.zw)));
}

fn store_pair(level: Level, x: u32, y: u32, pair: vec2<u32>) {
    if y < level.height {
        let row = level.offset + y * level.stride;
        if x < level.width { store(row + x, pair.x); }
        if x + 1u < level.width { store(row + x + 1u, pair.y); }
    }
}

@compute @workgroup_size(64, 1)
fn reduce(@builtin(global_invocation_id) id: vec3<u32>) {
    let from_level = step.x;
    if from_level == 0u && id.x == 0u && id.y == 0u {
        chunk_0[0] = vec4<u32>(step.y, 0u, 0u, 0u);
    }
    let source_level = pyramid.levels[from_level];
    let half = pyramid.levels[from_level + 1u];
    let x = 4u * id.x;
    let y = 4u * id.y;
    if x >= half.width || y >= half.height {
        return;
    }
    let r0 = row_of_quads(source_level, x, y);
    let r1 = row_of_quads(source_level, x, y + 1u);
    let r2 = row_of_quads(source_level, x, y + 2u);
    let r3 = row_of_quads(source_level, x, y + 3u);
    // A row's padding takes what lies past the edge; nobody reads it.
    let row = half.offset + y * half.stride + x;
    store4(row, r0);
    if y + 1u < half.height { store4(row + half.stride, r1); }
    if y + 2u < half.height { store4(row + 2u * half.stride, r2); }
    if y + 3u < half.height { store4(row + 3u * half.stride, r3); }

    if from_level + 2u >= pyramid.num_levels {
        return;
    }
    let quarter = pyramid.levels[from_level + 2u];
    let q0 = halved(r0, r1);
    let q1 = halved(r2, r3);
    store_pair(quarter, 2u * id.x, 2u * id.y, q0);
    store_pair(quarter, 2u * id.x, 2u * id.y + 1u, q1);

    if from_level + 3u >= pyramid.num_levels {
        return;
    }
    let eighth = pyramid.levels[from_level + 3u];
    store(eighth.offset + id.y * eighth.stride + id.x, farthest4(vec4<u32>(q0, q1)));
}
