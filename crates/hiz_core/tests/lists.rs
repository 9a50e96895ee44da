//! The packed lists, their draw arguments, masks and counters: order, capacity, pieces, and nothing written past an end.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::Culling;
use hiz_core::{
    Bounds, CANARY_WORDS, Camera, CullOptions, DepthConvention, DrawIndexedIndirect, DrawTemplate, Floats,
    InstanceOptions, Instances, Order, Pyramid, VisibleOptions,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// A wall at depth 4 and what surely lies before or behind it.
fn scene() -> (Camera, Arc<Pyramid>) {
    let camera = camera_along_z(64, 64, CONVENTION);
    let depth = engine().upload_depth(&[ndc(4.0, CONVENTION); 64 * 64], &camera).unwrap();
    (camera, engine().pyramid(&depth).unwrap())
}

/// `n` specks, of which those at the returned indices lie before the wall and the others behind it.
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
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&vec![0.125; n]) };
    let options = InstanceOptions { piece_capacity: piece, ..InstanceOptions::default() };
    (engine().instances(&bounds, &options).unwrap(), kept)
}

fn cull(instances: &Arc<Instances>, order: Order, capacity: Option<u32>) -> Culling {
    let (camera, pyramid) = scene();
    let options = CullOptions { order, statistics: true, ..CullOptions::default() };
    let output = VisibleOptions { capacity, draw: DRAW, ..VisibleOptions::default() };
    engine().cull(instances, &camera, &pyramid, &options, &output).unwrap()
}

const DRAW: DrawTemplate = DrawTemplate { index_count: 36, first_index: 7, base_vertex: -3, first_instance: 0 };

/// The words of every list, canary included.
fn raw_lists(culling: &Culling) -> Vec<Vec<u32>> {
    culling.wait().unwrap();
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    (0..culling.visible().num_pieces())
        .map(|piece| {
            let list = culling.visible().list(piece).expect("indices were asked for");
            let staging = device.create_buffer(&hiz_core::wgpu::BufferDescriptor {
                label: Some("test.staging"),
                size: list.size(),
                usage: hiz_core::wgpu::BufferUsages::COPY_DST | hiz_core::wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            });
            let mut encoder = device.create_command_encoder(&hiz_core::wgpu::CommandEncoderDescriptor::default());
            encoder.copy_buffer_to_buffer(list, 0, &staging, 0, list.size());
            queue.submit([encoder.finish()]);
            staging.map_async(hiz_core::wgpu::MapMode::Read, .., |result| result.unwrap());
            device.poll(hiz_core::wgpu::PollType::wait_indefinitely()).unwrap();
            let view = staging.get_mapped_range(..).unwrap();
            view.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect()
        })
        .collect()
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
            assert_eq!(counts.levels.iter().sum::<u64>(), n as u64, "every speck was compared with some level");
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
            // The mask is whole whatever the capacity.
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

/// The capacity holds for all pieces together; the first pieces are served first.
#[test]
fn pieces_share_one_capacity() {
    let (instances, kept) = specks(2000, 0.5, Some(256), 3);
    for capacity in [0, 5, 130, 500, 2000] {
        for order in [Order::Stable, Order::Any] {
            let culling = cull(&instances, order, Some(capacity));
            let written = (capacity as usize).min(kept.len());
            let counts = culling.counts().unwrap();
            assert_eq!((counts.demand, counts.written), (kept.len() as u64, written as u64), "{capacity} {order:?}");
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

/// Past the binding and dispatch limits of lavapipe: 20 million instances come in pieces, and one answer comes out.
#[test]
fn twenty_million_instances() {
    let n = 20_000_000;
    let (instances, kept) = specks(n, 0.05, None, 4);
    assert!(instances.num_pieces() > 1);
    let culling = cull(&instances, Order::Stable, None);
    assert_eq!(culling.counts().unwrap().occluded, (n - kept.len()) as u64);
    assert!(culling.indices().unwrap() == kept, "the list differs");
}
