//! Planted faults of the passes of bins are seen.

use crate::common::Random;
use crate::expected::{check, emits, large_crowd};
use crate::{Crowd, Made, World};

/// Each fault must show: in a list, in the draws or in their number.
#[test]
fn planted_faults_are_seen() {
    for (what, by, name, way) in [
        ("ranks(s, starts[share.x])", "ranks(s, starts[share.x] + 1u)", "starts off by one", 0),
        (
            "starts[mesh + 1u]), written)",
            "starts[mesh + 1u] + 1u), written)",
            "the end of a bin",
            0,
        ),
        (
            "let through_block = blocks[block_at(s, w)];",
            "let through_block = Numbers();",
            "a rank",
            0,
        ),
        (
            "unpack(before[at]) + blocks[block_at(s, workgroup.x * WORKGROUP)]",
            "unpack(before[at])",
            "a scatter without its block",
            0,
        ),
        ("packed >> vec2<u32>(COUNT_BITS)", "packed", "the counts of two planes", 0),
        ("earlier = Numbers(kept) +", "earlier =", "what earlier sets keep", 0),
        ("+ sum_before(all)", "", "what earlier planes keep", 0),
        ("if rank < written {", "if true {", "a list past its capacity", 0),
        ("min(kept, room())", "min(kept, emit.capacity)", "the capacity that is left", 0),
        ("index = index_of[index];", "", "slots as indices", 0),
        ("bin.lod / PLANES * piece.words + at.word", "at.word", "the set", 0),
        ("word_of_set * PLANES + bin.lod % PLANES", "word_of_set * PLANES", "the plane", 0),
        ("*ranks += select(Numbers(0u), Numbers(1u), has);", "", "the ranks of a plane", 0),
        ("*ranks += 1u;", "", "the ranks of the one plane", 0),
        ("at += filled_through(min(id.x - 1u, last));", "", "the draws of earlier shares", 0),
        ("select(0u, filled, w < workgroup.x)", "0u", "the draws of earlier workgroups", 0),
        ("write_draw(bin, Template(), 0u, 0u);", "", "the tail of the draws", 0),
        (
            "draw_counts[emit.piece] = all.y;",
            "draw_counts[emit.piece] = emit.records;",
            "the number of draws",
            0,
        ),
        (
            "lod * emit.count + starts[mesh] - begin",
            "lod * emit.count + starts[mesh]",
            "the shift of a bin",
            1,
        ),
        ("s * PLANES + plane_with(bits, bit)", "plane_with(bits, bit)", "a level of a set", 1),
        ("lod = s * PLANES + plane_with(bits_of_set, lowest);", "", "a draw of another level", 2),
    ] {
        let world = World::new(&[(what, by)]);
        // Two pieces, of which the first has more than one block of words; one plane; and draws of
        // several workgroups.
        let crowds = [(vec![6, 3, 1], 40_000), (vec![1; 3], 3000), (vec![1; 600], 1000)];
        let seen = crowds.into_iter().any(|(lods, n)| {
            let made = Crowd::random(n, &lods, 0.9, 0.1, &mut Random(4));
            let crowd = Crowd::new(&world, made, Some(36_864), true);
            let emit = emits(&world.table(&lods, true))[way].clone();
            let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u32;
            [None, Some(kept - 10), Some(kept / 2)]
                .into_iter()
                .any(|capacity| check(&world, &crowd, &lods, &emit, capacity, true).is_err())
        });
        assert!(seen, "{name}: nothing shows it");
    }
}

/// A prefix sum adds the sums of all rows of its workgroup.
#[test]
fn planted_faults_of_the_prefix_sum_are_seen() {
    for (what, by, name) in [
        ("through += row_sums[r];", "", "earlier rows"),
        ("r < row;", "r <= row;", "its own row twice"),
        ("var l = row * ROW;", "var l = row * ROW + 1u;", "the first of each row"),
        ("l <= lane;", "l < lane;", "its own number"),
        ("all += row_sums[r];", "all = row_sums[0];", "all of the first row alone"),
        ("r < ROWS;", "r < ROWS - 1u;", "all but the last row"),
    ] {
        let world = World::new(&[(what, by)]);
        let is_red = |lods: &[usize], crowd: &Crowd| {
            let emit = emits(&world.table(lods, true))[0].clone();
            check(&world, crowd, lods, &emit, None, true).is_err()
        };
        // The last row of all has something where draws are of more meshes than 57 workgroups take.
        let many = vec![1; 30_000];
        let made = |i: u32| Made { mesh: 29_000 + i, lod: 0, shows: true };
        let seen = is_red(&[1, 2, 1], &large_crowd(&world, &[1, 2, 1]))
            || is_red(&many, &Crowd::new(&world, (0..40).map(made).collect(), None, true));
        assert!(seen, "{name}: nothing shows it");
    }
}
