//! The packed lists, their draw arguments, masks and counters.
//! Checks order, capacity and pieces, and that nothing is written past an end.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc, words_of};
use hiz_core::headless::Culling;
use hiz_core::{
    Bounds, Camera, Coverage, CullOptions, DepthConvention, DrawIndexedIndirect, DrawTemplate,
    Floats, Hierarchy, InstanceOptions, Instances, Order, Outputs, Pyramid, testing::CANARY_WORDS,
    wgpu,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// A camera and the pyramid of a wall at depth 4.
fn scene() -> (Camera, Arc<Pyramid>) {
    let camera = camera_along_z(64, 64, CONVENTION);
    let depth = engine().upload_depth(&[ndc(4.0, CONVENTION); 64 * 64], &camera).unwrap();
    (camera, engine().pyramid(&depth).unwrap())
}

/// `n` specks.
/// Those at the returned indices are in front of the wall, the others behind it.
fn specks(n: usize, share: f64, piece: Option<u32>, seed: u64) -> (Arc<Instances>, Vec<u32>) {
    let mut random = Random(seed);
    let mut kept = Vec::new();
    let mut centers = Vec::with_capacity(3 * n);
    for i in 0..n {
        let before = random.unit() < share;
        if before {
            kept.push(i as u32);
        }
        centers.extend([0.0, 0.0, if before { 2.0_f32 } else { 8.0 }]);
    }
    let bounds =
        Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&vec![0.125; n]) };
    let options = InstanceOptions { piece_capacity: piece, ..InstanceOptions::default() };
    (engine().instances(&bounds, &options).unwrap(), kept)
}

fn cull(instances: &Arc<Instances>, order: Order, capacity: Option<u32>) -> Culling {
    let (camera, pyramid) = scene();
    let options = CullOptions { order, statistics: true, ..CullOptions::default() };
    let output = Outputs { capacity, draw: DRAW, ..Outputs::default() };
    engine().cull(instances, &camera, &pyramid, &options, &output).unwrap()
}

const DRAW: DrawTemplate =
    DrawTemplate { index_count: 36, first_index: 7, base_vertex: -3, first_instance: 0 };

/// Counts of levels and of texels.
/// The boxes of 2, 4 and 8 pixels begin at texel borders of the level that fits them.
#[test]
fn statistics_say_which_level_was_read() {
    let camera = camera_along_z(64, 64, CONVENTION);
    let pyramid = scene().1;
    // At depth 8 a pixel is a quarter of a unit; the middle is the border of column and row 32.
    // A box half a pixel wide reads one pixel.
    let (mut min, mut max) = (Vec::new(), Vec::new());
    for (pixels, copies) in [(0.5, 1), (1.5, 2), (3.5, 3), (7.5, 4), (30.0, 5)] {
        for _ in 0..copies {
            min.extend([0.05, -0.25 * pixels - 0.05, 8.0]);
            max.extend([0.25 * pixels + 0.05, -0.05, 8.0]);
        }
    }
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    for hierarchy in [Hierarchy::Never, Hierarchy::Auto] {
        let options = CullOptions { statistics: true, hierarchy, ..CullOptions::default() };
        let culling =
            engine().cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
        let counts = culling.counts().unwrap();
        // 1 pixel and 2 x 2 pixels of level 0, then 2 x 2 texels each.
        let mut levels = [0; 16];
        (levels[0], levels[1], levels[2], levels[4]) = (3, 3, 4, 5);
        assert_eq!((counts.levels, counts.texels_read), (levels, 1 + 4 * 14));
        assert_eq!((counts.occluded, counts.visible), (15, 0));
    }
}

/// The words of every list, including the canary.
fn raw_lists(culling: &Culling) -> Vec<Vec<u32>> {
    culling.wait().unwrap();
    (0..culling.visible().num_pieces())
        .map(|piece| {
            words_of(&engine(), culling.visible().list(piece).expect("indices were asked for"))
        })
        .collect()
}

/// Buffers that a renderer uses frame after frame hold the last result and nothing of earlier ones.
/// The same holds for what a pyramid keeps for the next cull.
/// If it is culled with other options, the result is right for those.
#[test]
fn buffers_and_bindings_that_are_used_again_answer_for_the_last_cull() {
    let (instances, kept) = specks(3000, 0.3, Some(1024), 5);
    let (camera, wall) = scene();
    let open = engine().pyramid(&engine().upload_depth(&[0.0; 64 * 64], &camera).unwrap()).unwrap();
    for (order, hierarchy) in [
        (Order::Stable, Hierarchy::Never),
        (Order::Any, Hierarchy::Never),
        (Order::Stable, Hierarchy::Always),
        (Order::Any, Hierarchy::Always),
    ] {
        let visible = engine().context().create_visible(&instances, &Outputs::default()).unwrap();
        let cull = |pyramid: &Pyramid, options: &CullOptions| {
            let mut encoder = engine()
                .device()
                .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let options = CullOptions { order, hierarchy, ..options.clone() };
            engine()
                .context()
                .record_cull(&mut encoder, &instances, &camera, pyramid, &visible, &options)
                .unwrap();
            engine().queue().submit([encoder.finish()]);
            let draws = words_of(&engine(), visible.draw_arguments().unwrap());
            let (mut bits, mut indices) = (Vec::new(), Vec::new());
            for piece in 0..visible.num_pieces() {
                let first = 1024 * piece as u32;
                let here = (3000 - first).min(1024);
                let mask = words_of(&engine(), visible.mask(piece).unwrap());
                bits.extend(
                    (0..here)
                        .filter(|i| mask[*i as usize / 32] >> (i % 32) & 1 == 1)
                        .map(|i| first + i),
                );
                let count = draws[(visible.draw_offset(piece) / 4) as usize + 1] as usize;
                indices
                    .extend_from_slice(&words_of(&engine(), visible.list(piece).unwrap())[..count]);
            }
            indices.sort_unstable();
            assert_eq!(indices, bits, "{order:?} {hierarchy:?}");
            bits
        };
        let all: Vec<u32> = (0..3000).collect();
        let plain = CullOptions::default();
        // The specks are at 1/8 and the wall at 1/4, so with a slack of 0.2 nothing is hidden.
        let slack = CullOptions { depth_slack_abs: 0.2, ..plain.clone() };
        for (pyramid, options, expected) in [
            (&open, &plain, &all),
            (&wall, &plain, &kept),
            (&wall, &slack, &all),
            (&wall, &plain, &kept),
            (&open, &plain, &all),
            (&wall, &plain, &kept),
        ] {
            assert!(cull(pyramid, options) == *expected, "{order:?} {hierarchy:?}");
        }
    }
    // A box a quarter of a pixel beside an open column, and a speck between pixel centres.
    // Each option makes a binding of its own.
    let camera = camera_along_z(16, 16, CONVENTION);
    let mut depth = [ndc(4.0, CONVENTION); 256];
    (0..16).for_each(|row| depth[16 * row + 8] = 0.0);
    let pyramid = engine().pyramid(&engine().upload_depth(&depth, &camera).unwrap()).unwrap();
    let (min, max) = ([-1.5, -0.5, 8.0, 0.0, 0.0, 2.0], [-0.25, 0.5, 8.0, 0.0, 0.0, 2.0]);
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let instances = engine().instances(&bounds, &InstanceOptions::default()).unwrap();
    let plain = CullOptions::default;
    let sample = CullOptions { coverage: Coverage::Sample, ..plain() };
    for (options, expected) in [
        (plain(), [false, true]),
        (CullOptions { guard_px: Some(0.5), ..plain() }, [true, true]),
        (plain(), [false, true]),
        (sample.clone(), [false, false]),
        (CullOptions { guard_px: Some(0.5), ..sample.clone() }, [false, true]),
        (CullOptions { depth_slack: 0.5, ..plain() }, [true, true]),
        (sample, [false, false]),
        (CullOptions { transform_slack: 1e6, ..plain() }, [true, true]),
        (plain(), [false, true]),
    ] {
        let culling =
            engine().cull(&instances, &camera, &pyramid, &options, &Outputs::default()).unwrap();
        assert_eq!(culling.mask().unwrap(), expected, "{options:?}");
    }
}

#[test]
fn none_one_and_every_size_around_a_word_and_a_workgroup() {
    for n in [0, 1, 2, 31, 32, 33, 127, 128, 129, 255, 256, 257, 4095, 4097] {
        let (instances, kept) = specks(n, 0.4, None, n as u64);
        for order in [Order::Stable, Order::Any] {
            let culling = cull(&instances, order, None);
            let mut indices = culling.indices().unwrap();
            if order == Order::Any {
                indices.sort_unstable();
            }
            assert_eq!(indices, kept, "{n} {order:?}");
            let mask = culling.mask().unwrap();
            assert_eq!(mask.len(), n);
            assert!((0..n).all(|i| mask[i] == kept.binary_search(&(i as u32)).is_ok()));
            let counts = culling.counts().unwrap();
            assert_eq!(
                (counts.tested, counts.visible, counts.demand, counts.written),
                (n as u64, kept.len() as u64, kept.len() as u64, kept.len() as u64)
            );
            assert_eq!((counts.outside, counts.invalid), (0, 0));
            assert_eq!(counts.occluded, (n - kept.len()) as u64);
            assert_eq!(
                counts.levels.iter().sum::<u64>(),
                n as u64,
                "every speck was compared with some level"
            );
            let draw = DrawIndexedIndirect {
                index_count: 36,
                instance_count: kept.len() as u32,
                first_index: 7,
                base_vertex: -3,
                first_instance: 0,
            };
            assert_eq!(culling.draws().unwrap(), [draw]);
        }
    }
}

#[test]
fn a_capacity_too_small_reports_the_demand_and_writes_nothing_past_the_end() {
    let (instances, kept) = specks(5000, 0.5, None, 1);
    let demand = kept.len() as u32;
    for capacity in [0, 1, 2, 63, 64, 1000, demand - 1, demand, demand + 1, 5000, 9000] {
        for order in [Order::Stable, Order::Any] {
            let culling = cull(&instances, order, Some(capacity));
            let written = capacity.min(demand);
            let counts = culling.counts().unwrap();
            assert_eq!(
                (counts.demand, counts.written),
                (u64::from(demand), u64::from(written)),
                "{capacity} {order:?}"
            );
            assert_eq!(culling.draws().unwrap()[0].instance_count, written);
            let indices = culling.indices().unwrap();
            match order {
                Order::Stable => assert_eq!(indices, kept[..written as usize]),
                Order::Any => {
                    let mut unique = indices.clone();
                    unique.sort_unstable();
                    unique.dedup();
                    assert_eq!(unique.len(), written as usize);
                    assert!(unique.iter().all(|i| kept.binary_search(i).is_ok()));
                }
            }
            let list = &raw_lists(&culling)[0];
            assert!(list.len() as u64 >= u64::from(written) + CANARY_WORDS);
            assert!(
                list[written as usize..].iter().all(|word| *word == u32::MAX),
                "words behind the count were written"
            );
            // The mask is complete, whatever the capacity.
            assert_eq!(culling.mask().unwrap().iter().filter(|m| **m).count(), kept.len());
        }
    }
}

#[test]
fn pieces_join_to_one_answer() {
    let (whole, kept) = specks(3000, 0.3, None, 2);
    for piece in [128, 256, 1024] {
        let (pieces, same) = specks(3000, 0.3, Some(piece), 2);
        assert_eq!(same, kept);
        assert_eq!(pieces.num_pieces(), 3000_usize.div_ceil(piece as usize));
        for order in [Order::Stable, Order::Any] {
            let (a, b) = (cull(&whole, order, None), cull(&pieces, order, None));
            assert_eq!(a.mask().unwrap(), b.mask().unwrap());
            assert_eq!(a.verdicts().unwrap(), b.verdicts().unwrap());
            let mut indices = b.indices().unwrap();
            if order == Order::Any {
                indices.sort_unstable();
            }
            assert_eq!(indices, kept);
            assert_eq!(a.counts().unwrap(), b.counts().unwrap());
            let draws = b.draws().unwrap();
            assert_eq!(draws.iter().map(|d| d.instance_count as usize).sum::<usize>(), kept.len());
        }
    }
}

/// All pieces share the capacity, and the first pieces are served first.
#[test]
fn pieces_share_one_capacity() {
    let (instances, kept) = specks(2000, 0.5, Some(256), 3);
    for capacity in [0, 5, 130, 500, 2000] {
        for order in [Order::Stable, Order::Any] {
            let culling = cull(&instances, order, Some(capacity));
            let written = (capacity as usize).min(kept.len());
            let counts = culling.counts().unwrap();
            assert_eq!(
                (counts.demand, counts.written),
                (kept.len() as u64, written as u64),
                "{capacity} {order:?}"
            );
            let indices = culling.indices().unwrap();
            assert_eq!(indices.len(), written);
            if order == Order::Stable {
                assert_eq!(indices, kept[..written]);
            }
            for (list, draw) in raw_lists(&culling).iter().zip(culling.draws().unwrap()) {
                assert!(list[draw.instance_count as usize..].iter().all(|word| *word == u32::MAX));
            }
        }
    }
}

#[test]
fn piece_sizes_that_do_not_fit_are_refused() {
    let bounds = Bounds::Spheres { centers: Floats::F32(&[]), radii: Floats::F32(&[]) };
    for piece in [0, 100, u32::MAX] {
        let options = InstanceOptions { piece_capacity: Some(piece), ..InstanceOptions::default() };
        let message = engine().instances(&bounds, &options).unwrap_err().to_string();
        assert!(message.starts_with("piece_capacity: expected a multiple of 128"), "{message}");
    }
}

/// Past the binding and dispatch limits of lavapipe.
/// 20 million instances are split into pieces, and the results are joined.
#[test]
fn twenty_million_instances() {
    let n = 20_000_000;
    let (instances, kept) = specks(n, 0.05, None, 4);
    assert!(instances.num_pieces() > 1);
    let culling = cull(&instances, Order::Stable, None);
    assert_eq!(culling.counts().unwrap().occluded, (n - kept.len()) as u64);
    assert!(culling.indices().unwrap() == kept, "the list differs");
}
