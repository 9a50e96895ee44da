// Depth reduction: each invocation reads a block of 8x8 texels and makes three levels of it.
//
// The shape is that of AMD's Single Pass Downsampler (FidelityFX SPD, 2020), cut down to registers:
// no shared memory, no barrier, one pass per three levels.
//
// Sizes are halved and rounded up, and reads past an edge repeat the edge.
// So a texel of level k has the farthest depth of exactly the pixels [x << k, (x + 1) << k), or the
// nearest, or both (`../gpu/ends_one.wgsl`, `../gpu/ends_both.wgsl`).
// At odd sizes nothing is dropped, and no repeated read matters.
// The shader printed in Rakos 2010 has that defect.
//
// Levels are stored with room for whole blocks (`crates/hiz_core/src/pyramid/layout.rs`).
// So no store has to ask where the level ends: what repeats the edge goes into the padding.
// The pass that reads this level reads the padding like the rest.

// True: level 0, the source texture, is read; otherwise a stored level.
override FROM_SOURCE: bool;
// The first level that is stored, 1 to 3 above the one that is read.
// Level 1 of an image is the most expensive one to write.
override FIRST: u32;

// Rows 2y and 2y + 1 of a stored level, eight texels from column 8x on, halved to four texels.
fn stored_quads(level: Level, x: u32, y: u32) -> Ends4 {
    // The column of the row's last vector.
    let last = ((level.width + VECTOR_MASK) & ~VECTOR_MASK) - VECTOR;
    let left = min(BLOCK * x, last);
    let right = min(BLOCK * x + VECTOR, last);
    let top = level.offset + min(2u * y, level.height - 1u) * level.stride;
    let bottom = level.offset + min(2u * y + 1u, level.height - 1u) * level.stride;
    return pairs_in_row(
        halved(load_ends4(top + ENDS * left), load_ends4(bottom + ENDS * left)),
        halved(load_ends4(top + ENDS * right), load_ends4(bottom + ENDS * right)));
}

// Four quads of a block: columns 4x to 4x + 3 of row y of quads.
fn quad_row(level: Level, x: u32, y: u32) -> Ends4 {
    if FROM_SOURCE {
        return source_quad_row(x, y);
    }
    return stored_quads(level, x, y);
}

fn store_pair(level: Level, x: u32, y: u32, pair: Ends2) {
    store_ends2(level.offset + y * level.stride + ENDS * x, pair);
}

// Reads a block of the level `source_number` and writes its texels of the levels after it, up to
// `last`.
fn reduce_block(source_number: u32, last: u32, block: vec2<u32>) {
    let source_level = pyramid.levels[source_number];
    let half = pyramid.levels[source_number + 1u];
    let row = half.offset + BLOCK_QUADS * (block.y * half.stride + ENDS * block.x);
    // Two rows of quads at a time are a row of the level after the next.
    //
    // A loop keeps the code short, and is no slower on lavapipe.
    // Where each load and store chooses among chunks, SwiftShader compiles for 0.3 s with it, and
    // for ten seconds and more without.
    var q0: Ends2;
    var q1: Ends2;
    for (var i = 0u; i < BLOCK_QUADS; i += 2u) {
        let upper = quad_row(source_level, block.x, BLOCK_QUADS * block.y + i);
        let lower = quad_row(source_level, block.x, BLOCK_QUADS * block.y + i + 1u);
        if FIRST == 1u {
            store_ends4(row + i * half.stride, upper);
            store_ends4(row + (i + 1u) * half.stride, lower);
        }
        q0 = q1;
        q1 = halved(upper, lower);
    }
    if FIRST == 1u && source_number + 1u >= last {
        return;
    }
    if FIRST <= 2u {
        let quarter = pyramid.levels[source_number + 2u];
        store_pair(quarter, 2u * block.x, 2u * block.y, q0);
        store_pair(quarter, 2u * block.x, 2u * block.y + 1u, q1);
        if source_number + 2u >= last {
            return;
        }
    }
    let eighth = pyramid.levels[source_number + BLOCK_LOG2];
    let index = eighth.offset + block.y * eighth.stride + ENDS * block.x;
    store_ends(index, joined4(pairs_in_row(q0, q1)));
}

@compute @workgroup_size(WORKGROUP, 1)
fn reduce(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let place = place_of(workgroup.xy, lane);
    if REGION && step.reduction != 0u && place.x == 0u && place.y == 0u {
        write_header();
    }
    let block = first_block() + place;
    if block.x < step.end.x && block.y < step.end.y {
        // Tuning for software drivers, which fetch numbers of a level that is a constant once for
        // all invocations, and those of any other level once for each.
        reduce_block(select(step.source, 0u, FROM_SOURCE), step.last, block);
    }
}

// All levels that are left, made by one workgroup: they are less work than another dispatch.
@compute @workgroup_size(WORKGROUP, 1)
fn reduce_tail(@builtin(local_invocation_index) lane: u32) {
    var begin = first_block();
    var end = step.end;
    for (var source_number = step.source; source_number < step.last; source_number += BLOCK_LOG2) {
        let size = end - begin;
        for (var i = lane; i < size.x * size.y; i += WORKGROUP) {
            let at = begin + vec2<u32>(i % size.x, i / size.x);
            reduce_block(source_number, step.last, at);
        }
        storageBarrier();
        // The blocks of the level that was written last, as `passes` in `layout.rs` counts them.
        // Behind its last column the padding follows.
        let columns = pyramid.levels[min(source_number + BLOCK_LOG2, step.last)].width;
        let all = (columns + (BLOCK - 1u)) / BLOCK;
        begin /= BLOCK;
        end = (end + vec2<u32>(BLOCK - 1u)) / BLOCK;
        end.x = select(end.x, (all + VECTOR_MASK) & ~VECTOR_MASK, end.x >= all);
    }
}
