//! What an engine tells of bins, and records that are copied in place of indices.

use hiz_core::headless::{Culling, NO_LOD};
use hiz_core::testing::CANARY_WORDS;
use hiz_core::{ABSENT, CullOptions, Emit, Order, Outputs, Placement, wgpu};

use crate::common::Random;
use crate::expected::{emits, record};
use crate::{Crowd, World};

/// The record of the first mesh.
pub(crate) fn first_record(lod: u32, count: usize) -> Vec<u32> {
    record(true, (0, lod), count, 0)
}

/// What can be read of an engine's cull: draws, their number, bins and LODs.
#[test]
fn an_engines_cull_tells_its_bins() {
    let world = World::new(&[]);
    let mut random = Random(5);
    let lods = [2, 1, 3];
    let made = Crowd::random(2500, &lods, 0.5, 0.2, &mut random);
    let crowd = Crowd::new(&world, made, Some(1024), true);
    let kept = crowd.made.iter().filter(|m| m.is_kept()).count() as u64;
    let absent = crowd.made.iter().filter(|m| m.mesh == ABSENT).count() as u64;
    let indices: Vec<u32> = (0..2500).filter(|i: &u32| crowd.made[*i as usize].is_kept()).collect();
    for emit in emits(&world.table(&lods, true)) {
        let outputs = Outputs { emit: emit.clone(), ..Outputs::ALL };
        let options = CullOptions::default();
        let World { engine, camera, pyramid, .. } = &world;
        let culling = engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        let by_index = culling.lods().unwrap();
        for (made, lod) in crowd.made.iter().zip(&by_index) {
            assert_eq!(*lod, if made.is_kept() { made.lod as u8 } else { NO_LOD });
        }
        let draws = culling.draws().unwrap();
        assert_eq!(draws.len(), 3 * culling.visible().max_draws() as usize);
        assert_eq!(draws.iter().map(|d| u64::from(d.instance_count)).sum::<u64>(), kept);
        let counts = culling.draw_counts().unwrap();
        let used = draws.iter().filter(|d| d.instance_count > 0).count() as u32;
        assert_eq!(counts.iter().sum::<u32>(), used);
        assert_eq!(culling.demand_and_written().unwrap(), (Some(kept), kept));
        // Mask, list and verdicts are those of any cull.
        assert_eq!(culling.indices().unwrap(), indices);
        assert_eq!(culling.mask().unwrap().iter().filter(|kept| **kept).count() as u64, kept);
        let counts = culling.counts().unwrap();
        assert_eq!((counts.absent, counts.tested, counts.visible), (absent, 2500 - absent, kept));
        assert_eq!((counts.outside, counts.occluded), (0, 2500 - absent - kept));
        let Emit::Binned { .. } = emit else {
            assert!(culling.bin(0, 0).unwrap_err().to_string().contains("Emit::Instances"));
            continue;
        };
        for (mesh, lods) in (0..).zip(lods) {
            for lod in 0..lods as u32 {
                let of_pieces = crowd.pieces();
                let all = of_pieces.iter().flat_map(|p| crowd.bin(p, mesh, lod));
                assert_eq!(culling.bin(mesh, lod).unwrap(), all.collect::<Vec<_>>());
            }
            assert!(culling.bin(mesh, lods as u32).unwrap_err().to_string().starts_with("lod: "));
        }
        assert!(culling.bin(3, 0).unwrap_err().to_string().starts_with("mesh: expected"));
        // Without a mask, too, more is known than what was written.
        let outputs = Outputs { indices: true, capacity: Some(9), emit, ..Outputs::NONE };
        let culling = engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        assert_eq!(culling.demand_and_written().unwrap(), (Some(kept), 9));
    }
}

/// The indices of a cull are those that its bins list, whatever cuts them and else was asked for.
#[test]
fn indices_are_those_of_the_bins() {
    let world = World::new(&[]);
    let mut random = Random(8);
    for (lods, piece) in [(&[2, 1, 3][..], Some(1024)), (&[4], None)] {
        let made = Crowd::random(2500, lods, 0.5, 0.2, &mut random);
        let crowd = Crowd::new(&world, made, piece, true);
        let World { engine, camera, pyramid, .. } = &world;
        for emit in emits(&world.table(lods, true)) {
            let reserved = matches!(emit, Emit::Binned { placement: Placement::Reserved, .. });
            let orders = [Order::Stable, Order::Any];
            let orders = &orders[..if reserved && lods.len() == 1 { 2 } else { 1 }];
            for (order, mask, capacity) in orders.iter().flat_map(|order| {
                let capacities = [None, Some(0), Some(90), Some(5000)];
                let both = |capacity| [(*order, true, capacity), (*order, false, capacity)];
                capacities.into_iter().flat_map(both)
            }) {
                let emit = emit.clone();
                let outputs = Outputs { mask, indices: true, capacity, emit, ..Outputs::NONE };
                let options = CullOptions { order, ..CullOptions::default() };
                let culling =
                    engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
                let what = format!("{order:?}, mask {mask}, {capacity:?}, {outputs:?}");
                let got = culling.indices().unwrap();
                assert!(got.is_sorted(), "{what}");
                assert_eq!(got.len() as u64, culling.demand_and_written().unwrap().1, "{what}");
                let Emit::Binned { .. } = outputs.emit else { continue };
                let mut listed = Vec::new();
                for (mesh, lods) in (0..).zip(lods) {
                    for lod in 0..*lods as u32 {
                        listed.extend(culling.bin(mesh, lod).unwrap());
                    }
                }
                listed.sort_unstable();
                assert!(got == listed, "{what}");
            }
        }
    }
}

/// A mask tells neither bins nor what a capacity cuts of them.
#[test]
fn what_a_mask_does_not_tell_of_bins_is_refused() {
    let world = World::new(&[]);
    let lods = [2, 3];
    let made = Crowd::random(200, &lods, 0.5, 0.1, &mut Random(10));
    let crowd = Crowd::new(&world, made, None, true);
    let World { engine, camera, pyramid, .. } = &world;
    let options = CullOptions::default();
    let expected = "expected a cull that was asked for ";
    for emit in emits(&world.table(&lods, true)) {
        let cull = |outputs: Outputs| {
            engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap()
        };
        let alone = cull(Outputs { mask: true, emit: emit.clone(), ..Outputs::NONE });
        for error in [
            alone.draws().unwrap_err(),
            alone.draw_counts().unwrap_err(),
            alone.lods().unwrap_err(),
            alone.bin(0, 0).unwrap_err(),
        ] {
            assert!(
                error
                    .to_string()
                    .contains(&format!("{expected}draws or indices, got one with mask"))
            );
        }
        let kept = crowd.made.iter().filter(|made| made.is_kept()).count();
        assert_eq!(alone.indices().unwrap().len(), kept);
        let drawn = Outputs { mask: true, draws: true, capacity: Some(9), emit, ..Outputs::NONE };
        let error = cull(drawn.clone()).indices().unwrap_err().to_string();
        assert!(error.contains(&format!("{expected}indices, got one with mask, draws")), "{error}");
        assert_eq!(cull(Outputs { capacity: None, ..drawn }).indices().unwrap().len(), kept);
    }
}

/// What the cull's own submission copies holds bins, too, so no read of them waits.
#[test]
fn bins_arrive_with_the_cull() {
    let world = World::new(&[]);
    let mut random = Random(9);
    let lods = [2, 1, 3];
    let made = Crowd::random(2500, &lods, 0.5, 0.2, &mut random);
    let crowd = Crowd::new(&world, made, Some(1024), true);
    let World { engine, camera, pyramid, .. } = &world;
    for emit in emits(&world.table(&lods, true)) {
        let outputs = Outputs { capacity: Some(1000), emit, ..Outputs::ALL };
        let options = CullOptions::default();
        let later = engine.cull(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        let ahead =
            engine.cull_ahead(&crowd.instances, camera, pyramid, &options, &outputs).unwrap();
        ahead.wait().unwrap();
        let answers = |culling: &Culling| {
            let bins = (0..).zip(lods).flat_map(|(mesh, n)| (0..n as u32).map(move |l| (mesh, l)));
            let bins: Vec<_> = bins.map(|(mesh, lod)| culling.bin(mesh, lod).ok()).collect();
            let lists = (culling.indices().unwrap(), culling.lods().unwrap(), bins);
            (culling.draws().unwrap(), culling.draw_counts().unwrap(), lists)
        };
        // What lies on the device is spoiled, so only the copies can be right.
        let visible = ahead.visible();
        let lists = (0..visible.num_pieces()).map(|piece| visible.list(piece).unwrap());
        for buffer in lists.chain(visible.draw_arguments()).chain(visible.draw_count()) {
            engine.queue().write_buffer(buffer, 0, &vec![0xA5; buffer.size() as usize]);
        }
        engine.queue().submit([]);
        assert!(answers(&ahead) == answers(&later), "{outputs:?}");
    }
}

/// The caller's records are listed in place of indices.
#[test]
fn records_are_copied_in_place_of_indices() {
    let world = World::new(&[]);
    let mut random = Random(6);
    for (n, piece, stride) in [(3000, Some(384), 4), (700, None, 256), (3000, Some(1024), 36)] {
        let made = Crowd::random(n, &[1], 0.4, 0.1, &mut random);
        let crowd = Crowd::new(&world, made, piece, true);
        let words = stride as usize / 4;
        let data: Vec<u32> =
            (0..n * words).map(|i| (i as u32).wrapping_mul(2_654_435_761)).collect();
        let records = world.engine.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("test.records"),
            size: 4 * data.len() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let bytes: Vec<u8> = data.iter().flat_map(|word| word.to_le_bytes()).collect();
        world.engine.queue().write_buffer(&records, 0, &bytes);
        let emit = Emit::Copy { records, stride };
        for capacity in [None, Some(0), Some(100), Some(n as u32)] {
            let outputs = Outputs { indices: true, capacity, emit: emit.clone(), ..Outputs::NONE };
            let visible =
                world.engine.context().create_visible(&crowd.instances, &outputs).unwrap();
            world.cull(&crowd, &visible, &CullOptions::default()).unwrap();
            let draws = world.words(visible.draw_arguments().unwrap());
            let mut room = capacity.map_or(n, |c| c as usize);
            for (p, piece) in crowd.pieces().iter().enumerate() {
                let kept = piece.clone().filter(|i| crowd.made[*i].is_kept());
                let kept: Vec<usize> = kept.take(room).collect();
                room -= kept.len();
                assert_eq!(draws[5 * p + 1] as usize, kept.len());
                let list = world.words(visible.list(p).unwrap());
                let want = kept.iter().flat_map(|i| &data[i * words..(i + 1) * words]);
                let (got, behind) = list.split_at(kept.len() * words);
                assert!(got.iter().eq(want), "{n} {stride} {capacity:?} {p}");
                assert!(behind.iter().all(|word| *word == u32::MAX), "past the end");
                assert!(behind.len() >= CANARY_WORDS as usize);
            }
            let options = CullOptions { order: Order::Any, ..CullOptions::default() };
            let text = world.cull(&crowd, &visible, &options).unwrap_err().to_string();
            assert!(text.starts_with("order: expected Order::Stable for Emit::Copy"), "{text}");
        }
    }
}
