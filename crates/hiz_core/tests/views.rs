//! Answers that come by themselves, several views at once, and the device's own times.

mod common;

use std::sync::Arc;

use common::{camera_along_z, engine, ndc};
use hiz_core::headless::{CULLS_IN_FLIGHT, Engine};
use hiz_core::{
    Bounds, CullOptions, DepthConvention, Error, Floats, Hierarchy, InstanceOptions, Instances,
    Outputs, Pyramid, Verdict, wgpu,
};

const CONVENTION: DepthConvention = DepthConvention::Reversed;
const SIZE: (u32, u32) = (64, 48);

/// Where a sphere stands; each is far from every border, so its verdict is known without a cull.
/// The wall at depth 8 covers the left half of the image.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Before,
    Behind,
    Beside,
    Outside,
}

/// The place of sphere `i`: a mixture without a pattern of 32 or 64.
fn place(i: usize) -> Place {
    [Place::Before, Place::Behind, Place::Beside, Place::Outside, Place::Behind][i * 7919 / 3 % 5]
}

fn verdict(i: usize) -> Verdict {
    match place(i) {
        Place::Before | Place::Beside => Verdict::Visible,
        Place::Behind => Verdict::Occluded,
        Place::Outside => Verdict::Outside,
    }
}

fn spheres(count: usize) -> (Vec<f32>, Vec<f32>) {
    let centers = (0..count).flat_map(|i| {
        let (x, z) = match place(i) {
            Place::Before => (-0.5, 4.0),
            Place::Behind => (-0.5, 16.0),
            Place::Beside => (0.5, 16.0),
            Place::Outside => (3.0, 16.0),
        };
        let y = (i % 101) as f32 / 101.0 - 0.5;
        [x * z, y * z, z]
    });
    (centers.collect(), vec![0.01; count])
}

fn upload(engine: &Engine, count: usize, piece_capacity: Option<u32>) -> Arc<Instances> {
    let (centers, radii) = spheres(count);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let options = InstanceOptions { piece_capacity, ..InstanceOptions::default() };
    engine.instances(&bounds, &options).unwrap()
}

fn pyramid(engine: &Engine) -> Arc<Pyramid> {
    let camera = camera_along_z(SIZE.0, SIZE.1, CONVENTION);
    let image: Vec<f32> = (0..SIZE.0 * SIZE.1)
        .map(|i| if i % SIZE.0 < SIZE.0 / 2 { ndc(8.0, CONVENTION) } else { 0.0 })
        .collect();
    engine.pyramid(&engine.upload_depth(&image, &camera).unwrap()).unwrap()
}

fn expected_mask(count: usize) -> Vec<bool> {
    (0..count).map(|i| verdict(i) == Verdict::Visible).collect()
}

// -- answers that come by themselves ---------------------------------------------------------------

#[test]
fn what_was_copied_ahead_is_what_the_cull_found() {
    let engine = engine();
    let camera = camera_along_z(SIZE.0, SIZE.1, CONVENTION);
    let pyramid = pyramid(&engine);
    for (count, pieces) in [(0, None), (1, None), (700, None), (700, Some(128))] {
        let instances = upload(&engine, count, pieces);
        let mask = expected_mask(count);
        let kept: Vec<u32> = (0..count as u32).filter(|i| mask[*i as usize]).collect();
        for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
            let options = CullOptions { hierarchy, statistics: true, ..CullOptions::default() };
            let culling =
                engine.cull_ahead(&instances, &camera, &pyramid, &options, &Outputs::ALL).unwrap();
            while !culling.is_ready().unwrap() {
                std::thread::yield_now();
            }
            // What lies on the device is spoiled, so only the copies can be right.
            let visible = culling.visible();
            for piece in 0..visible.num_pieces() {
                let buffers = [visible.mask(piece).unwrap(), visible.list(piece).unwrap()];
                for buffer in buffers.into_iter().chain(visible.draw_arguments()) {
                    engine.queue().write_buffer(buffer, 0, &vec![0xA5; buffer.size() as usize]);
                }
            }
            engine.queue().submit([]);
            let what = format!("{count} {pieces:?} {hierarchy:?}");
            assert!(culling.mask().unwrap() == mask, "{what}");
            let verdicts: Vec<_> = (0..count).map(verdict).collect();
            assert!(culling.verdicts().unwrap() == verdicts, "{what}");
            assert_eq!(culling.indices().unwrap(), kept, "{what}");
            let drawn: u32 = culling.draws().unwrap().iter().map(|draw| draw.instance_count).sum();
            assert_eq!(drawn as usize, kept.len(), "{what}");
            let counts = culling.counts().unwrap();
            assert_eq!(counts.visible as usize, kept.len(), "{what}");
            assert_eq!(
                counts.outside as usize,
                verdicts.iter().filter(|verdict| **verdict == Verdict::Outside).count(),
                "{what}"
            );
            assert!(count == 0 || counts.texels_read > 0, "{what}");
        }
    }
}

/// Two are in flight; a third call waits for the oldest.
/// Whether it waits for others, no driver tells: Mesa's runs one submission at a time.
/// `slots.rs` has a test of that.
#[test]
fn a_third_cull_waits_for_the_oldest() {
    let engine = Engine::new(None).unwrap();
    let (count, camera) = (400_000, camera_along_z(SIZE.0, SIZE.1, CONVENTION));
    let (instances, pyramid) = (upload(&engine, count, None), pyramid(&engine));
    let options = CullOptions { hierarchy: Hierarchy::Never, ..CullOptions::default() };
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let cull = || engine.cull_ahead(&instances, &camera, &pyramid, &options, &outputs).unwrap();
    cull().wait().unwrap(); // compiles
    let in_flight: Vec<_> = (0..CULLS_IN_FLIGHT).map(|_| cull()).collect();
    let third = cull();
    // Nobody else has asked the device since.
    assert!(in_flight[0].timings().wall_ms > 0.0);
    for culling in in_flight.iter().chain([&third]) {
        assert!(culling.mask().unwrap() == expected_mask(count));
        assert!(culling.is_ready().unwrap());
    }
    for _ in 0..10 {
        drop(cull());
    }
    assert!(cull().mask().unwrap() == expected_mask(count));
}

#[test]
fn threads_share_the_slots_and_get_their_own_answers() {
    let engine = engine();
    let pyramid = pyramid(&engine);
    let crowds: Vec<_> = (0..4).map(|t| upload(&engine, 500 + 77 * t, None)).collect();
    std::thread::scope(|scope| {
        for instances in &crowds {
            let (engine, pyramid) = (&engine, &pyramid);
            scope.spawn(move || {
                let camera = camera_along_z(SIZE.0, SIZE.1, CONVENTION);
                let (options, outputs) = (CullOptions::default(), Outputs::ALL);
                for _ in 0..20 {
                    let culling =
                        engine.cull_ahead(instances, &camera, pyramid, &options, &outputs).unwrap();
                    assert!(culling.mask().unwrap() == expected_mask(instances.len() as usize));
                }
            });
        }
    });
}

/// A ring on the caller's device: recorded, submitted and polled by the caller alone.
#[test]
fn a_ring_brings_answers_and_refuses_one_too_many() {
    let engine = engine();
    let (device, hiz) = (engine.device(), engine.context());
    let camera = camera_along_z(SIZE.0, SIZE.1, CONVENTION);
    let (pyramid, options) = (pyramid(&engine), CullOptions::default());
    let encoder = || device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    assert!(matches!(hiz.create_readback(0), Err(Error::Invalid { .. })));
    for (count, pieces, capacity) in
        [(0, None, None), (33, None, None), (700, Some(128), None), (700, Some(128), Some(150))]
    {
        let instances = upload(&engine, count, pieces);
        let visible =
            hiz.create_visible(&instances, &Outputs { capacity, ..Outputs::ALL }).unwrap();
        let ring = hiz.create_readback(2).unwrap();
        let mut waiting = Vec::new();
        for _ in 0..2 {
            let mut encoder = encoder();
            hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
                .unwrap();
            waiting.push(hiz.record_readback(&mut encoder, &visible, &ring).unwrap());
            engine.queue().submit([encoder.finish()]);
        }
        assert_eq!((ring.slots(), ring.in_flight()), (2, 2));
        let refused = hiz.record_readback(&mut encoder(), &visible, &ring).unwrap_err().to_string();
        assert!(
            refused.contains("ring: expected a free slot, got 2 answers in flight"),
            "{refused}"
        );
        // Dropping one frees its slot; the next was recorded, and its encoder never submitted.
        drop(waiting.pop());
        assert_eq!(ring.in_flight(), 1);
        let never = hiz.record_readback(&mut encoder(), &visible, &ring).unwrap();
        engine.wait().unwrap();
        assert!(!never.is_ready());
        assert!(matches!(never.answer(), Err(Error::Device(_))));
        let first = waiting.pop().unwrap();
        assert!(first.is_ready());
        let answer = first.answer().unwrap();
        assert_eq!(ring.in_flight(), 0);
        let mask = expected_mask(count);
        assert!((0..count as u32).all(|i| answer.is_kept(i) == mask[i as usize]));
        assert_eq!(answer.mask.len(), count.div_ceil(32));
        let kept: Vec<u32> = (0..count as u32).filter(|i| mask[*i as usize]).collect();
        let listed = kept.len().min(capacity.map_or(usize::MAX, |capacity| capacity as usize));
        assert_eq!(answer.indices, kept[..listed]);
        let drawn: u32 = answer.draws.iter().map(|draw| draw.instance_count).sum();
        assert_eq!((drawn as usize, answer.draws.len()), (listed, visible.num_pieces()));
        let other = Engine::new(None).unwrap();
        let elsewhere = other.context().create_readback(1).unwrap();
        let error = hiz.record_readback(&mut encoder(), &visible, &elsewhere).unwrap_err();
        assert!(matches!(error, Error::Mismatch { .. }), "{error}");
    }
}
