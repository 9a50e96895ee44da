//! Bins by mesh and level of detail hold what a loop finds.

use hiz_core::{
    ABSENT, Bounds, CullOptions, Emit, Floats, Hierarchy, InstanceOptions, Order, Outputs,
    Placement, Verdict, WarmUp, WarmUpMore, wgpu,
};

use crate::common::Random;
use crate::engine::first_record;
use crate::expected::{check, emits, large_crowd};
use crate::{Crowd, Made, World};

/// Levels of detail per mesh, instances, the share before the wall, the share absent, and how many
/// instances a piece has.
type Case<'a> = (&'a [usize], usize, f64, f64, Option<u32>);

/// The sizes at which the passes change: words, blocks, pieces, capacities.
#[test]
fn bins_hold_what_a_loop_finds() {
    let world = World::new(&[]);
    let mut random = Random(1);
    let cases: [Case<'_>; 12] = [
        (&[1], 1, 1.0, 0.0, None),
        (&[1], 1000, 0.3, 0.1, None),
        (&[4], 5000, 0.5, 0.1, None),
        (&[1; 40], 33, 1.0, 0.0, None),
        (&[2, 1, 8, 3], 3000, 0.5, 0.3, Some(1024)),
        (&[1, 4, 2], 3000, 0.5, 0.0, Some(384)),
        (&[3; 7], 2000, 0.4, 1.0, None),
        (&[3; 7], 2000, 0.0, 0.0, None),
        // A mesh per instance, and a word beside a block of 1024 words.
        (&[1; 2000], 2000, 0.6, 0.1, None),
        (&[2, 2], 32 * 1024 - 1, 0.3, 0.05, None),
        (&[2, 2], 32 * 1024, 1.0, 0.0, None),
        (&[2, 2], 32 * 1024 + 1, 0.3, 0.05, None),
    ];
    for (lods, n, share, absent, piece) in cases {
        let crowd =
            Crowd::new(&world, Crowd::random(n, lods, share, absent, &mut random), piece, true);
        let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u32;
        for indexed in [true, false] {
            let meshes = world.table(lods, indexed);
            for emit in emits(&meshes) {
                for capacity in [None, Some(0), Some(1), Some(kept / 2), Some(kept + 1)] {
                    check(&world, &crowd, lods, &emit, capacity, indexed).unwrap();
                }
            }
        }
    }
}

/// A piece of more blocks of words than a row of a workgroup adds up.
#[test]
fn large_pieces_add_up_all_blocks() {
    let world = World::new(&[]);
    let lods = [1, 2, 1];
    let crowd = large_crowd(&world, &lods);
    let meshes = world.table(&lods, true);
    for emit in emits(&meshes) {
        for capacity in [None, Some(50_000)] {
            check(&world, &crowd, &lods, &emit, capacity, true).unwrap();
        }
    }
}

/// Meshes that no instance has lie before, between and behind those that are used.
#[test]
fn empty_meshes_have_no_draws() {
    let world = World::new(&[]);
    let lods = [2; 9];
    let made = |i: u32| Made { mesh: [2, 5][(i % 2) as usize], lod: i / 2 % 2, shows: true };
    let crowd = Crowd::new(&world, (0..101).map(made).collect(), None, true);
    let meshes = world.table(&lods, true);
    for emit in emits(&meshes) {
        check(&world, &crowd, &lods, &emit, None, true).unwrap();
    }
}

/// More meshes than the invocations of a workgroup of the draws have workgroups to add up.
#[test]
fn draws_of_many_meshes_stand_together() {
    let world = World::new(&[]);
    let lods = vec![1; 33_000];
    let mesh = |i: u32| [0, 511, 512, 600, 32_767, 32_768, 32_999][i as usize % 7];
    let made = |i| Made { mesh: mesh(i), lod: 0, shows: i % 3 > 0 };
    let crowd = Crowd::new(&world, (0..40).map(made).collect(), None, true);
    let emit = emits(&world.table(&lods, true))[0].clone();
    check(&world, &crowd, &lods, &emit, None, true).unwrap();
}

/// Without mesh ids and scales all have mesh 0, and their slots are their indices.
#[test]
fn instances_without_ids_have_mesh_0() {
    let world = World::new(&[]);
    let mut random = Random(2);
    // The scale is 1, so the LOD is 1 where there are two.
    for (lods, lod) in [(&[1][..], 0), (&[2, 1][..], 1)] {
        let make = |_| Made { mesh: 0, lod, shows: random.unit() < 0.4 };
        let crowd = Crowd::new(&world, (0..3000).map(make).collect(), Some(1024), false);
        let meshes = world.table(lods, true);
        for emit in emits(&meshes) {
            for capacity in [None, Some(700)] {
                check(&world, &crowd, lods, &emit, capacity, true).unwrap();
            }
        }
    }
}

/// Bins of one mesh in any order: the same sets, each within its reserved words.
#[test]
fn any_order_fills_the_bins_of_one_mesh() {
    let world = World::new(&[]);
    let mut random = Random(3);
    let lods = [4];
    for piece in [None, Some(1024)] {
        let made = Crowd::random(3000, &lods, 0.5, 0.1, &mut random);
        let crowd = Crowd::new(&world, made, piece, true);
        let meshes = world.table(&lods, true);
        let emit = Emit::Binned { meshes, placement: Placement::Reserved };
        for capacity in [None, Some(0), Some(1), Some(700), Some(3000)] {
            let outputs = Outputs {
                mask: true,
                indices: true,
                capacity,
                emit: emit.clone(),
                ..Outputs::NONE
            };
            let visible =
                world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
            let options = CullOptions { order: Order::Any, ..CullOptions::default() };
            for _ in 0..2 {
                world.cull(&crowd, &visible, &options).unwrap();
                let draws = world.words(visible.draw_arguments().unwrap());
                let mut total = 0;
                for (p, piece) in crowd.pieces().iter().enumerate() {
                    let list = world.words(visible.list(p).unwrap());
                    for lod in 0..4 {
                        let (offset, bytes) = visible.bin(p, 0, lod).unwrap();
                        let record = &draws[offset as usize / 4..][..5];
                        let count = record[1] as usize;
                        assert_eq!(record, first_record(lod, count));
                        let words = &list[bytes.start as usize / 4..bytes.end as usize / 4];
                        let mut got = words[..count].to_vec();
                        got.sort_unstable();
                        let want = crowd.bin(piece, 0, lod);
                        if capacity.is_none_or(|c| c >= 3000) {
                            assert_eq!(got, want, "piece {p}, LOD {lod}");
                        }
                        assert!(got.iter().all(|i| want.contains(i)), "piece {p}, LOD {lod}");
                        got.dedup();
                        assert_eq!(got.len(), count, "piece {p}, LOD {lod}: listed twice");
                        total += count;
                    }
                    assert!(list[4 * piece.len()..].iter().all(|word| *word == u32::MAX));
                }
                let kept = crowd.made.iter().filter(|m| m.is_kept()).count();
                assert_eq!(total, kept.min(capacity.unwrap_or(3000) as usize), "{capacity:?}");
            }
        }
    }
}

/// An absent instance is in no group's box, whatever its bounds are, and an update leaves it so.
#[test]
fn absent_instances_are_not_there() {
    let world = World::new(&[]);
    let World { engine, camera, pyramid, .. } = &world;
    // One group before the wall if it were not absent, and 63 instances behind it.
    let n = 64;
    let centers = |absent: f32| -> Vec<f32> {
        (0..n).flat_map(|i| [0.0, 0.0, if i == 7 { absent } else { 8.0 }]).collect()
    };
    let ids: Vec<u32> = (0..n).map(|i| if i == 7 { ABSENT } else { 0 }).collect();
    let radii = vec![0.125; n];
    for depth in [2.0, f32::NAN] {
        let centers = centers(depth);
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let options =
            InstanceOptions { strict: true, mesh_ids: Some(&ids), ..InstanceOptions::default() };
        let instances = engine.instances(&bounds, &options).unwrap();
        assert_eq!((instances.num_absent(), instances.invalid().unwrap().len()), (1, 0));
        let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
        for _ in 0..2 {
            let culling =
                engine.cull(&instances, camera, pyramid, &options, &Outputs::ALL).unwrap();
            let counts = culling.counts().unwrap();
            assert_eq!((counts.tested_groups, counts.tested_instances), (1, 0), "a whole group");
            assert_eq!((counts.occluded, counts.outside, counts.absent), (63, 0, 1));
            assert_eq!(culling.verdicts().unwrap()[7], Verdict::Outside);
            assert!(culling.explain(7).unwrap().reason.contains("absent"));
            assert!(culling.indices().unwrap().is_empty());
            engine.update(&instances, 0, &bounds, true).unwrap();
        }
    }
    // All absent: the group is hidden, too.
    let ids = [ABSENT; 64];
    let centers = centers(2.0);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let options = InstanceOptions { mesh_ids: Some(&ids), ..InstanceOptions::default() };
    let instances = engine.instances(&bounds, &options).unwrap();
    for hierarchy in [Hierarchy::Always, Hierarchy::Never] {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let culling = engine.cull(&instances, camera, pyramid, &options, &Outputs::ALL).unwrap();
        let counts = culling.counts().unwrap();
        assert_eq!((counts.tested, counts.outside, counts.absent, counts.demand), (0, 0, 64, 0));
    }
}

/// Frames make no objects once the first culls have run, and a warm-up leaves nothing to draw.
#[test]
fn frames_of_bins_make_nothing() {
    let world = World::new(&[]);
    let mut random = Random(9);
    let lods = [2, 4];
    let crowd = Crowd::new(&world, Crowd::random(500, &lods, 0.5, 0.1, &mut random), None, true);
    for emit in emits(&world.table(&lods, true)) {
        let outputs = Outputs { indices: true, draws: true, emit, ..Outputs::NONE };
        let hiz = world.engine.context();
        let visible = hiz.create_visible(&crowd.instances, &outputs).unwrap();
        let options = CullOptions::default();
        let mut before = hiz.made();
        for frame in 0..8 {
            if frame == 3 {
                world.engine.wait().unwrap();
                before = hiz.made();
            }
            world.cull(&crowd, &visible, &options).unwrap();
            world.engine.wait().unwrap();
        }
        assert_eq!(hiz.made(), before);
        let depth = world.engine.upload_depth(&[0.0; 64 * 64], &world.camera).unwrap();
        let view = depth.texture().create_view(&wgpu::TextureViewDescriptor::default());
        let frame = WarmUp {
            occluders: None,
            depth: &view,
            camera: &world.camera,
            pyramid: &world.pyramid,
            instances: &crowd.instances,
            visible: &visible,
            options: &options,
            updates: false,
            more: WarmUpMore::default(),
        };
        let descriptor = wgpu::CommandEncoderDescriptor::default();
        let mut encoder = world.engine.device().create_command_encoder(&descriptor);
        hiz.record_warm_up(&mut encoder, &frame).unwrap();
        world.engine.queue().submit([encoder.finish()]);
        let draws = world.words(visible.draw_arguments().unwrap());
        assert!(draws.iter().all(|word| *word == 0), "nothing is drawn");
    }
}
