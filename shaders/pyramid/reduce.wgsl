// Depth reduction: each invocation reads a block of 8x8 texels of one level and writes the farthest
// depths to the next three.
//
// It has the shape of AMD's Single Pass Downsampler (FidelityFX SPD, 2020), cut to registers.
// There is no shared memory and no barrier, and one pass makes three levels.
//
// Sizes are ceil-halved, and reads past an edge repeat the edge.
// So a texel of level k is the farthest depth of exactly the pixels [x << k, (x + 1) << k).
// Nothing is dropped at odd sizes, which is the defect of the shader printed in Rakos 2010.
// What is read twice cannot change a farthest depth.
//
// Levels are stored with room for whole blocks (`crates/hiz_core/src/pyramid/layout.rs`).
// So no store asks where the level ends: the padding repeats the edge.
// The pass that reads this level reads the padding like the rest.

// True: level 0, the source texture, is read; otherwise a stored level.
override FROM_SOURCE: bool;
// The first level that is stored, counted from the level that is read: 1 to 3.
// Skipping level 1 of an image pays, because it is the largest to write.
override FIRST: u32;

// The farthest depth of each 2x2 texels of two rows.
fn halved(a: vec4<u32>, b: vec4<u32>) -> vec2<u32> {
    return vec2<u32>(farthest4(vec4<u32>(a.xy, b.xy)), farthest4(vec4<u32>(a.zw, b.zw)));
}

// Eight texels from column 8x on, of rows 2y and 2y + 1 of a stored level.
// They are reduced to four of one row.
fn stored_quads(level: Level, x: u32, y: u32) -> vec4<u32> {
    let last = ((level.width + 3u) & ~3u) - 4u;
    let left = min(8u * x, last);
    let right = min(8u * x + 4u, last);
    let top = level.offset + min(2u * y, level.height - 1u) * level.stride;
    let bottom = level.offset + min(2u * y + 1u, level.height - 1u) * level.stride;
    return vec4<u32>(
        halved(load4(top + left), load4(bottom + left)),
        halved(load4(top + right), load4(bottom + right)));
}

// The farthest depth of each of the 4x4 quads of a block; a quad is 2x2 texels.
fn quads(level: Level, block: vec2<u32>) -> array<vec4<u32>, 4> {
    if FROM_SOURCE {
        return source_quads(block);
    }
    let y = 4u * block.y;
    return array<vec4<u32>, 4>(
        stored_quads(level, block.x, y), stored_quads(level, block.x, y + 1u),
        stored_quads(level, block.x, y + 2u), stored_quads(level, block.x, y + 3u));
}

fn store_pair(level: Level, x: u32, y: u32, pair: vec2<u32>) {
    let index = level.offset + y * level.stride + x;
    store(index, pair.x);
    store(index + 1u, pair.y);
}

// Reduces one block of a level to the levels after it, but none after `last`.
fn reduce_block(source_number: u32, last: u32, block: vec2<u32>) {
    let rows = quads(pyramid.levels[source_number], block);
    if FIRST == 1u {
        let half = pyramid.levels[source_number + 1u];
        let row = half.offset + 4u * (block.y * half.stride + block.x);
        store4(row, rows[0]);
        store4(row + half.stride, rows[1]);
        store4(row + 2u * half.stride, rows[2]);
        store4(row + 3u * half.stride, rows[3]);
        if source_number + 1u >= last {
            return;
        }
    }
    let q0 = halved(rows[0], rows[1]);
    let q1 = halved(rows[2], rows[3]);
    if FIRST <= 2u {
        let quarter = pyramid.levels[source_number + 2u];
        store_pair(quarter, 2u * block.x, 2u * block.y, q0);
        store_pair(quarter, 2u * block.x, 2u * block.y + 1u, q1);
        if source_number + 2u >= last {
            return;
        }
    }
    let eighth = pyramid.levels[source_number + 3u];
    store(eighth.offset + block.y * eighth.stride + block.x, farthest4(vec4<u32>(q0, q1)));
}

@compute @workgroup_size(64, 1)
fn reduce(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let block = place_of(workgroup.xy, lane);
    if step.reduction != 0u && block.x == 0u && block.y == 0u {
        chunk_0[0] = vec4<u32>(step.reduction, 0u, 0u, 0u);
    }
    if block.x < step.blocks.x && block.y < step.blocks.y {
        reduce_block(step.source, step.last, block);
    }
}

// Makes the last levels, all of them by one workgroup: they are less work than another dispatch.
@compute @workgroup_size(64, 1)
fn reduce_tail(@builtin(local_invocation_index) lane: u32) {
    var blocks = step.blocks;
    for (var source_number = step.source; source_number < step.last; source_number += 3u) {
        for (var i = lane; i < blocks.x * blocks.y; i += 64u) {
            reduce_block(source_number, step.last, vec2<u32>(i % blocks.x, i / blocks.x));
        }
        storageBarrier();
        // The blocks of the level that was written last, as `layout.rs` counts them.
        blocks = (blocks + vec2<u32>(7u)) / 8u;
        blocks.x = (blocks.x + 3u) & ~3u;
    }
}
