//! Answers that come by themselves, several views at once, and the device's own times.

mod common;

use std::sync::Arc;

use common::{camera_along_z, engine, ndc};
use hiz_core::headless::{AmongSource, CULLS_IN_FLIGHT, CullExtras, Engine};
use hiz_core::{
    AmongMask, Bounds, Camera, CullOptions, DepthConvention, DrawOptions, Error, Floats, Hierarchy,
    InstanceOptions, Instances, MeshData, OccluderOptions, Outputs, Pyramid, Rasteriser, Verdict,
    View, ViewsOutputs, wgpu,
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

// -- answers that come by themselves --------------------------------------------------------------

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

// -- several views in one call --------------------------------------------------------------------

/// Which half of a view's image a wall at depth 8 covers.
#[derive(Clone, Copy, PartialEq)]
enum Wall {
    Left,
    Right,
    Nowhere,
}

/// A view: its image, its convention and its wall.
type Seen = ((u32, u32), DepthConvention, Wall);

/// Two eyes that differ in everything, and a third view that hides what the first one hides.
const VIEWS: [Seen; 3] = [
    ((64, 48), DepthConvention::Reversed, Wall::Left),
    ((35, 21), DepthConvention::Standard, Wall::Right),
    ((16, 80), DepthConvention::Reversed, Wall::Left),
];

fn is_kept(i: usize, wall: Wall) -> bool {
    match place(i) {
        Place::Before => true,
        Place::Behind => wall != Wall::Left,
        Place::Beside => wall != Wall::Right,
        Place::Outside => false,
    }
}

fn camera_of((size, convention, _): Seen) -> Camera {
    camera_along_z(size.0, size.1, convention)
}

fn pyramid_of(engine: &Engine, seen: Seen) -> Arc<Pyramid> {
    let ((width, height), convention, wall) = seen;
    let pixel = |i: u32| {
        let is_left = 2 * (i % width) < width;
        let is_wall = match wall {
            Wall::Left => is_left,
            Wall::Right => !is_left || 2 * (i % width) + 1 == width,
            Wall::Nowhere => false,
        };
        let far = if convention == DepthConvention::Standard { 1.0 } else { 0.0 };
        if is_wall { ndc(8.0, convention) } else { far }
    };
    let image: Vec<f32> = (0..width * height).map(pixel).collect();
    engine.pyramid(&engine.upload_depth(&image, &camera_of(seen)).unwrap()).unwrap()
}

fn bytes_of(engine: &Engine, buffer: &wgpu::Buffer) -> Vec<u8> {
    let (told, answer) = std::sync::mpsc::channel();
    let (device, queue) = (engine.device(), engine.queue());
    wgpu::util::DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytes.unwrap().to_vec()).unwrap();
    });
    engine.wait().unwrap();
    answer.recv().unwrap()
}

fn bit(bytes: &[u8], i: usize) -> bool {
    bytes[i / 8] >> (i % 8) & 1 == 1
}

/// What `record_cull_views` leaves for these views: a mask per view, and the list of any.
fn recorded_views(
    engine: &Engine,
    views: &[Seen],
    count: usize,
    pieces: Option<u32>,
    among: Option<&[u32]>,
) -> (Vec<Vec<bool>>, Vec<u32>) {
    let (device, hiz) = (engine.device(), engine.context());
    let instances = upload(engine, count, pieces);
    let cameras: Vec<_> = views.iter().map(|seen| camera_of(*seen)).collect();
    let pyramids: Vec<_> = views.iter().map(|seen| pyramid_of(engine, *seen)).collect();
    let of_views: Vec<_> =
        cameras.iter().zip(&pyramids).map(|(camera, pyramid)| View { camera, pyramid }).collect();
    let visible =
        hiz.create_visible_views(&instances, views.len(), &ViewsOutputs::default()).unwrap();
    let restricted = hiz.create_among(&instances).unwrap();
    // What an earlier recording has left must not show.
    let junk = vec![0xFF_u8; visible.any().mask(0).unwrap().size() as usize];
    engine.queue().write_buffer(visible.any().mask(0).unwrap(), 0, &junk);
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    if let Some(bits) = among {
        let mask = AmongMask::Bits(bits);
        hiz.record_among(&mut encoder, &instances, &mask, &restricted).unwrap();
    }
    let among = among.map(|_| &restricted);
    let options = CullOptions::default();
    hiz.record_cull_views(&mut encoder, &instances, &of_views, among, &visible, &options).unwrap();
    let ring = hiz.create_readback(1).unwrap();
    let any = hiz.record_readback(&mut encoder, visible.any(), &ring).unwrap();
    engine.queue().submit([encoder.finish()]);
    engine.wait().unwrap();
    assert_eq!(visible.mask_stride() % 256, 0);
    let rows = bytes_of(engine, visible.masks());
    let rows: Vec<Vec<bool>> = rows
        .chunks_exact(visible.mask_stride() as usize)
        .map(|row| (0..count).map(|i| bit(row, i)).collect())
        .collect();
    assert_eq!((rows.len(), visible.num_views()), (views.len(), views.len()));
    for (view, row) in rows.iter().enumerate() {
        let mut own = Vec::new();
        for piece in 0..visible.view(view).num_pieces() {
            let bytes = bytes_of(engine, visible.view(view).mask(piece).unwrap());
            let left = count - own.len();
            let here = pieces.map_or(left, |most| left.min(most as usize));
            own.extend((0..here).map(|i| bit(&bytes, i)));
        }
        if own != *row {
            // As where a fault is planted.
            return (vec![own], Vec::new());
        }
    }
    (rows, any.answer().unwrap().indices)
}

fn expected_views(
    views: &[Seen],
    count: usize,
    among: impl Fn(usize) -> bool,
) -> (Vec<Vec<bool>>, Vec<u32>) {
    let row = |(_, _, wall): &Seen| (0..count).map(|i| among(i) && is_kept(i, *wall)).collect();
    let rows: Vec<Vec<bool>> = views.iter().map(row).collect();
    let any = (0..count as u32).filter(|i| rows.iter().any(|row| row[*i as usize]));
    (rows.clone(), any.collect())
}

/// Each view decides for itself, whatever its size and convention, and the list is of their union.
/// A list of what one eye sees lacks what only the other one sees: a fault that engines have had.
#[test]
fn views_keep_what_each_of_them_sees() {
    let engine = engine();
    for (count, pieces) in [(0, None), (1, None), (33, None), (700, None), (700, Some(128))] {
        for views in [&VIEWS[..], &VIEWS[..1], &VIEWS[1..], &[VIEWS[0], VIEWS[0], VIEWS[2]]] {
            let found = recorded_views(&engine, views, count, pieces, None);
            assert!(found == expected_views(views, count, |_| true), "{count} {pieces:?}");
        }
    }
    let one_eye = expected_views(&VIEWS[..1], 700, |_| true);
    assert_ne!(one_eye.1, expected_views(&VIEWS, 700, |_| true).1, "the eyes differ");
}

#[test]
fn views_in_groups_keep_the_same() {
    let engine = engine();
    let found = recorded_views(&engine, &VIEWS, 40_000, None, None);
    assert!(found == expected_views(&VIEWS, 40_000, |_| true));
}

/// Bits of a mask without a pattern of groups.
fn asked(i: usize) -> bool {
    (i * i / 5 + i / 64).is_multiple_of(3) && i / 128 != 2
}

fn words_of(count: usize, asked: impl Fn(usize) -> bool) -> Vec<u32> {
    let word = |w: usize| {
        (0..32).filter(|k| 32 * w + k < count && asked(32 * w + k)).fold(0, |word, k| word | 1 << k)
    };
    (0..count.div_ceil(32)).map(word).collect()
}

#[test]
fn views_of_some_instances_keep_none_of_the_others() {
    let engine = engine();
    for (count, pieces) in [(0, None), (65, None), (700, Some(128)), (40_000, None)] {
        let words = words_of(count, asked);
        let found = recorded_views(&engine, &VIEWS, count, pieces, Some(&words));
        assert!(found == expected_views(&VIEWS, count, asked), "{count} {pieces:?}");
    }
}

/// Faults of the masks, the union and the restriction; each must lose or add an instance.
#[test]
fn planted_faults_of_views_are_found() {
    let faults = [
        ("join.view * join.stride", "join.view * join.words", "a stride without alignment"),
        ("masks[join.view", "masks[(join.view / 2u)", "each view writes where another does"),
        ("joined |= any_mask[word]", "joined &= any_mask[word]", "OR as AND"),
        ("joined |= any_mask[word]", "joined = any_mask[word]", "one eye decides for both"),
        ("if join.view > 0u", "if join.view >= 0u", "the union of an earlier recording"),
        (
            "textureLoad(records, record_position(first + k, INDEX_TEXEL, TEXELS)).w",
            "first + k",
            "places taken for indices",
        ),
        ("(word) | among_word(word + 1u)) != 0u", "(word)) != 0u", "half of a group forgotten"),
        ("(place % AMONG_BITS)", "((place + 1u) % AMONG_BITS)", "a place beside"),
        ("if is_among(place) {", "if is_among(place) || place >= 0u {", "all are asked for"),
    ];
    // Only the second half of a group is asked for where there is one.
    let asked = |i: usize| if i < 20_000 { asked(i) } else { i % 64 >= 32 && i % 640 < 64 };
    let count = 40_000;
    let words = words_of(count, asked);
    let whole = engine();
    let expected = expected_views(&VIEWS, count, asked);
    assert!(recorded_views(&whole, &VIEWS, count, None, Some(&words)) == expected);
    for (what, by, name) in faults {
        let engine = Engine::with_planted_faults(None, &[(what, by)]).unwrap();
        let found = recorded_views(&engine, &VIEWS, count, None, Some(&words));
        assert!(found != expected, "{name}");
    }
}

/// Verdicts, counts, texels and explanations of a cull of some instances.
#[test]
fn what_is_not_asked_for_is_outside_and_costs_no_test() {
    let engine = engine();
    let (camera, pyramid) = (camera_of(VIEWS[0]), pyramid_of(&engine, VIEWS[0]));
    for (count, pieces) in [(700, None), (700, Some(128)), (1, None)] {
        let instances = upload(&engine, count, pieces);
        let flags: Vec<bool> = (0..count).map(asked).collect();
        let among = engine.among(&instances, &AmongSource::Mask(&flags)).unwrap();
        for (hierarchy, ahead) in
            [(Hierarchy::Never, false), (Hierarchy::Always, false), (Hierarchy::Always, true)]
        {
            let what = format!("{count} {pieces:?} {hierarchy:?} {ahead}");
            let options = CullOptions { hierarchy, statistics: true, ..CullOptions::default() };
            let extras = CullExtras { among: Some(&among), ahead, ..CullExtras::default() };
            let cull = |outputs| {
                engine
                    .cull_given(&instances, &camera, &pyramid, &options, outputs, &extras)
                    .unwrap()
            };
            // Buffers are lent again, so the verdicts of another cull lie there before.
            engine.cull(&instances, &camera, &pyramid, &options, &Outputs::ALL).unwrap();
            let culling = cull(&Outputs::ALL);
            let expected = |i: usize| if asked(i) { verdict(i) } else { Verdict::Outside };
            assert!(culling.verdicts().unwrap() == (0..count).map(expected).collect::<Vec<_>>());
            let kept: Vec<u32> =
                (0..count).filter(|i| expected(*i) == Verdict::Visible).map(|i| i as u32).collect();
            assert_eq!(culling.indices().unwrap(), kept, "{what}");
            let counts = culling.counts().unwrap();
            assert_eq!(counts.visible as usize, kept.len(), "{what}");
            if hierarchy == Hierarchy::Never {
                // Each that is asked for and in view is compared with depth once, no other.
                let compared = (0..count).filter(|i| asked(*i) && place(*i) != Place::Outside);
                assert_eq!(counts.levels.iter().sum::<u64>() as usize, compared.count(), "{what}");
            }
            let other = (0..count).find(|i| !asked(*i) && place(*i) == Place::Before);
            if let Some(i) = other {
                let told = culling.explain(i as u64).unwrap();
                assert_eq!(told.verdict, Verdict::Outside);
                assert!(told.reason.starts_with("not among the instances"), "{}", told.reason);
            }
            // The same with the mask in the cull's own submission.
            let mut words = Vec::new();
            let mask = Some(AmongSource::Mask(&flags).mask(&instances, &mut words).unwrap());
            let extras = CullExtras { mask, ahead, ..CullExtras::default() };
            let own = engine
                .cull_given(&instances, &camera, &pyramid, &options, &Outputs::ALL, &extras)
                .unwrap();
            assert!(own.verdicts().unwrap() == (0..count).map(expected).collect::<Vec<_>>());
            assert_eq!(own.indices().unwrap(), kept, "{what}");
            let both = CullExtras { among: Some(&among), ..extras };
            let refused = engine
                .cull_given(&instances, &camera, &pyramid, &options, &Outputs::ALL, &both)
                .unwrap_err();
            assert!(refused.to_string().starts_with("mask: expected no among beside it"));
            // What this cull has kept restricts the next one: the mask never visits the host.
            let next = engine.among(&instances, &AmongSource::Kept(&culling)).unwrap();
            let extras = CullExtras { among: Some(&next), ahead, ..CullExtras::default() };
            let (camera, pyramid) = (camera_of(VIEWS[1]), pyramid_of(&engine, VIEWS[1]));
            let both = engine
                .cull_given(&instances, &camera, &pyramid, &options, &Outputs::ALL, &extras)
                .unwrap();
            let in_both = |i: usize| asked(i) && is_kept(i, Wall::Left) && is_kept(i, Wall::Right);
            assert!(both.mask().unwrap() == (0..count).map(in_both).collect::<Vec<_>>(), "{what}");
            let mut words = Vec::new();
            let mask = Some(AmongSource::Kept(&culling).mask(&instances, &mut words).unwrap());
            let extras = CullExtras { mask, ahead, ..CullExtras::default() };
            let both = engine
                .cull_given(&instances, &camera, &pyramid, &options, &Outputs::ALL, &extras)
                .unwrap();
            assert!(both.mask().unwrap() == (0..count).map(in_both).collect::<Vec<_>>(), "{what}");
        }
        let nobody = engine.among(&instances, &AmongSource::Mask(&vec![false; count])).unwrap();
        let options = CullOptions { statistics: true, ..CullOptions::default() };
        let extras = CullExtras { among: Some(&nobody), ahead: false, ..CullExtras::default() };
        let culling = engine
            .cull_given(&instances, &camera, &pyramid, &options, &Outputs::ALL, &extras)
            .unwrap();
        assert_eq!(culling.counts().unwrap().texels_read, 0);
        assert_eq!(culling.indices().unwrap(), []);
    }
    // Invalid bounds are kept, but only where they are asked for.
    let (centers, radii) = ([f32::NAN; 6], [1.0; 2]);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let among = engine.among(&instances, &AmongSource::Mask(&[false, true])).unwrap();
    let extras = CullExtras { among: Some(&among), ahead: false, ..CullExtras::default() };
    let (options, outputs) = (CullOptions::default(), Outputs::ALL);
    let culling =
        engine.cull_given(&instances, &camera, &pyramid, &options, &outputs, &extras).unwrap();
    assert_eq!(culling.verdicts().unwrap(), [Verdict::Outside, Verdict::Invalid]);
}

#[test]
fn all_kinds_of_bounds_are_restricted_in_stored_order() {
    let engine = engine();
    let (camera, pyramid) = (camera_of(VIEWS[0]), pyramid_of(&engine, VIEWS[0]));
    let count = 700;
    let (centers, _) = spheres(count);
    let corner = |sign: f32| centers.iter().map(|c| c + 0.005 * sign).collect::<Vec<_>>();
    let (low, high) = (corner(-1.0), corner(1.0));
    let rotations: Vec<f32> =
        (0..count).flat_map(|_| [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).collect();
    let half = vec![0.005; 3 * count];
    let boxes = Bounds::Boxes { min: Floats::F32(&low), max: Floats::F32(&high) };
    let oriented = Bounds::OrientedBoxes {
        centers: Floats::F32(&centers),
        half_sizes: Floats::F32(&half),
        rotations: Floats::F32(&rotations),
    };
    let flags: Vec<bool> = (0..count).map(asked).collect();
    for bounds in [boxes, oriented] {
        let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
        let among = engine.among(&instances, &AmongSource::Mask(&flags)).unwrap();
        let extras = CullExtras { among: Some(&among), ahead: false, ..CullExtras::default() };
        let (options, outputs) = (CullOptions::default(), Outputs::ALL);
        let culling =
            engine.cull_given(&instances, &camera, &pyramid, &options, &outputs, &extras).unwrap();
        let expected = |i: usize| asked(i) && is_kept(i, Wall::Left);
        assert!(culling.mask().unwrap() == (0..count).map(expected).collect::<Vec<_>>());
    }
}

#[test]
fn views_without_a_renderer_answer_in_one_readback() {
    let engine = engine();
    let cameras: Vec<_> = VIEWS.iter().map(|seen| camera_of(*seen)).collect();
    let pyramids: Vec<_> = VIEWS.iter().map(|seen| pyramid_of(&engine, *seen)).collect();
    let views: Vec<_> = cameras.iter().zip(&pyramids).collect();
    for (count, pieces) in [(0, None), (700, None), (700, Some(128)), (40_000, None)] {
        let instances = upload(&engine, count, pieces);
        let (rows, any) = expected_views(&VIEWS, count, |_| true);
        for ahead in [false, true, true] {
            let outputs = ViewsOutputs {
                each: Outputs { mask: true, verdicts: true, ..Outputs::NONE },
                ..ViewsOutputs::default()
            };
            let extras = CullExtras { ahead, ..CullExtras::default() };
            let options = CullOptions::default();
            let culling =
                engine.cull_views(&instances, &views, &options, &outputs, &extras).unwrap();
            while !culling.is_ready().unwrap() {
                std::thread::yield_now();
            }
            assert!(culling.masks().unwrap() == rows.concat());
            assert_eq!(culling.any_indices().unwrap(), any);
            let kept: Vec<u32> = (0..count as u32)
                .zip(culling.any().unwrap())
                .filter_map(|(i, kept)| kept.then_some(i))
                .collect();
            assert_eq!(kept, any);
            let drawn: u32 = culling.any_draws().unwrap().iter().map(|d| d.instance_count).sum();
            assert_eq!(drawn as usize, any.len());
            for (view, row) in rows.iter().enumerate() {
                let one = culling.view(view);
                assert!(one.mask().unwrap() == *row);
                let kept = row.iter().filter(|kept| **kept).count();
                assert_eq!(one.counts().unwrap().visible as usize, kept);
                assert_eq!(one.indices().unwrap().len(), kept);
            }
            // Those that any view has kept are all that the next call asks for.
            let among = engine.among(&instances, &AmongSource::KeptByAny(&culling)).unwrap();
            let extras = CullExtras { among: Some(&among), ahead, ..CullExtras::default() };
            let empty = ((9, 9), DepthConvention::Reversed, Wall::Nowhere);
            let (camera, pyramid) = (camera_of(empty), pyramid_of(&engine, empty));
            let (one, outputs) = ([(&camera, &pyramid)], ViewsOutputs::default());
            let next = engine.cull_views(&instances, &one, &options, &outputs, &extras).unwrap();
            assert_eq!(next.any_indices().unwrap(), any);
        }
    }
}

#[test]
fn views_that_do_not_belong_together_are_refused() {
    let engine = engine();
    let hiz = engine.context();
    let (instances, others) = (upload(&engine, 100, None), upload(&engine, 90, None));
    let (camera, pyramid) = (camera_of(VIEWS[0]), pyramid_of(&engine, VIEWS[0]));
    let outputs = ViewsOutputs::default();
    for views in [0, 257] {
        let error = hiz.create_visible_views(&instances, views, &outputs).unwrap_err().to_string();
        assert!(error.contains("views: expected 1..=256 views"), "{error}");
    }
    let visible = hiz.create_visible_views(&instances, 2, &outputs).unwrap();
    let view = View { camera: &camera, pyramid: &pyramid };
    let descriptor = wgpu::CommandEncoderDescriptor::default();
    let mut encoder = engine.device().create_command_encoder(&descriptor);
    let mut record =
        |instances: &Instances, views: &[View<'_>], among: Option<&hiz_core::Among>| {
            let options = CullOptions::default();
            hiz.record_cull_views(&mut encoder, instances, views, among, &visible, &options)
                .map_or_else(|error| error.to_string(), |()| "no error".to_owned())
        };
    assert!(record(&instances, &[view], None).contains("views: expected 2 views"));
    assert!(record(&others, &[view; 2], None).contains("visible: expected buffers that were"));
    let among = hiz.create_among(&others).unwrap();
    let error = record(&instances, &[view; 2], Some(&among));
    assert!(error.contains("among: expected one of these 100 instances, got one of 90"), "{error}");
    assert_eq!(record(&instances, &[view; 2], None), "no error");
    let bits = AmongMask::Bits(&[0]);
    let among = hiz.create_among(&instances).unwrap();
    let error = hiz.record_among(&mut encoder, &instances, &bits, &among).unwrap_err().to_string();
    assert!(error.contains("mask: expected 4 words for 100 instances, got 1"), "{error}");
    let no_mask = hiz.create_visible(&instances, &Outputs { draws: true, ..Outputs::NONE });
    let kept = no_mask.unwrap();
    let error =
        hiz.record_among(&mut encoder, &instances, &AmongMask::Kept(&kept), &among).unwrap_err();
    assert!(error.to_string().contains("expected a cull that was asked for mask"), "{error}");
}

// -- times of the stages --------------------------------------------------------------------------

/// Raster, reduction, update and a cull in groups, each submitted by itself.
fn a_frame(engine: &Engine) {
    let camera = camera_of(VIEWS[0]);
    let corners = [-9.0, -9.0, 8.0, 0.0, -9.0, 8.0, 0.0, 9.0, 8.0];
    let wall =
        MeshData { vertices: Floats::F32(&corners), triangles: &[0, 1, 2], transforms: None };
    let walls = engine.occluders(&[wall], &OccluderOptions::default()).unwrap();
    let all = DrawOptions::default();
    let (depth, _) = engine.render_depth_with(&walls, &camera, Rasteriser::Device, &all).unwrap();
    let pyramid = engine.pyramid(&depth).unwrap();
    let instances = upload(engine, 700, None);
    let (centers, radii) = spheres(5);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    engine.update(&instances, 0, &bounds, false).unwrap();
    let options = CullOptions { hierarchy: Hierarchy::Always, ..CullOptions::default() };
    let culling = engine.cull(&instances, &camera, &pyramid, &options, &Outputs::ALL).unwrap();
    culling.wait().unwrap();
    let own = culling.stage_times().unwrap().map(|stages| stages.len());
    assert!(own.is_none() || own == Some(3));
}

/// Behind a render pass, where Mesa 22.3's software driver has no trustworthy timestamps.
#[test]
fn stages_are_timed_where_the_clock_can_be_trusted() {
    let engine = Engine::new(None).unwrap();
    a_frame(&engine); // compiles
    engine.start_timing().unwrap();
    assert!(engine.start_timing().unwrap_err().to_string().contains("expected one at a time"));
    let start = std::time::Instant::now();
    a_frame(&engine);
    engine.wait().unwrap();
    let wall_ms = 1e3 * start.elapsed().as_secs_f64();
    let stages = engine.stop_timing().unwrap();
    let names: Vec<_> = stages.iter().map(|stage| stage.stage).collect();
    assert_eq!(names, ["raster", "reduce", "update", "cull groups", "cull members", "list"]);
    let is_right = engine.clock_is_right().unwrap();
    eprintln!("{}: clock {is_right}, {stages:?}", engine.adapter());
    let sum: Option<f64> = stages.iter().map(|stage| stage.gpu_ms).sum();
    assert_eq!(sum.is_some(), is_right, "{stages:?}");
    assert!(sum.is_none_or(|ms| ms > 0.0 && ms <= 1.05 * wall_ms), "{sum:?} of {wall_ms}");
    if engine.adapter().to_string().contains("Mesa 22.") {
        assert!(!is_right, "a driver that is known to be wrong");
    }
    assert!(engine.stop_timing().is_err());
    a_frame(&engine);
}

/// A device without timestamps: the stages are named, and nothing is written.
#[test]
fn stages_have_no_times_without_the_feature() {
    let engine = engine();
    let (hiz, device) = (engine.context(), engine.device());
    let has_it = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    let instances = upload(&engine, 100, None);
    let (camera, pyramid) = (camera_of(VIEWS[0]), pyramid_of(&engine, VIEWS[0]));
    let visible = hiz.create_visible(&instances, &Outputs::default()).unwrap();
    let timer = hiz.create_stage_timer(engine.queue()).unwrap();
    let descriptor = wgpu::CommandEncoderDescriptor::default();
    let mut encoder = device.create_command_encoder(&descriptor);
    let options = CullOptions::default();
    let mut cull = || {
        hiz.record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options).unwrap();
    };
    timer.time(&mut cull);
    cull(); // not timed
    let times = hiz.record_stage_times(&mut encoder, &timer).unwrap();
    engine.queue().submit([encoder.finish()]);
    engine.wait().unwrap();
    assert!(times.is_ready());
    let stages = times.stages().unwrap();
    let passes: Vec<_> = stages.iter().map(|stage| (stage.stage, stage.passes)).collect();
    assert_eq!(passes, [("cull", 1), ("list", 1)]);
    eprintln!("ticks {:?}", times.ticks());
    assert_eq!(times.ticks().len(), if has_it { 4 } else { 0 });
    if !has_it {
        assert!(stages.iter().all(|stage| stage.gpu_ms.is_none()));
    }
    // Nothing was timed since.
    let mut encoder = device.create_command_encoder(&descriptor);
    let times = hiz.record_stage_times(&mut encoder, &timer).unwrap();
    assert!(times.is_ready() && times.stages().unwrap().is_empty());
}
