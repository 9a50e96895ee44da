//! An image that the host has drawn is read where the host has written it, and comes to its texture
//! for those who read it there.
//!
//! Images are lent again, so a texture that a copy was forgotten for holds an older image.

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use common::{BLOCK_SIZES, CONVENTIONS, Random, camera_along_z, engine, occluders, wall, words_of};
use hiz_core::headless::{Culling, DepthImage, Engine};
use hiz_core::{
    AtlasUse, Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, DepthLoad,
    Depths, DrawOptions, Fit, Floats, Footprint, InstanceOptions, Instances, MipDepths, MipOptions,
    OccluderDepth, Occluders, Outputs, Pyramid, PyramidOptions, Rasteriser, ReceiverMaskOptions,
    StoredLevels, wgpu,
};

/// Triangles at random places of the image.
fn triangles(engine: &Engine, seed: u64, count: u32) -> Arc<Occluders> {
    let mut random = Random(seed);
    let mut vertices = Vec::new();
    for _ in 0..count {
        let (z, size) = (random.range(2.0, 12.0), random.range(0.1, 1.2));
        let middle = [random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
        for _ in 0..3 {
            let [x, y] = middle.map(|m| (m + size * random.range(-1.0, 1.0)) * z);
            vertices.extend([x, y, z]);
        }
    }
    let all: Vec<u32> = (0..3 * count).collect();
    occluders(engine, &vertices, &all)
}

fn drawn(engine: &Engine, occluders: &Occluders, camera: &Camera) -> DepthImage {
    let all = DrawOptions::default();
    engine.render_depth_with(occluders, camera, Rasteriser::Host, &all).unwrap().0
}

/// An image of `occluders` that is not in its texture, which holds an older one: a near wall.
fn held(engine: &Engine, occluders: &Occluders, camera: &Camera) -> DepthImage {
    let before = drawn(engine, &wall(engine, 1.1), camera);
    before.read().unwrap();
    // A reduction asks for levels, so that the next drawing makes them, too.
    engine.pyramid(&before).unwrap();
    drop(before);
    engine.wait().unwrap();
    drawn(engine, occluders, camera)
}

/// The same pixels in an image that was uploaded.
fn uploaded(engine: &Engine, depth: &DepthImage) -> DepthImage {
    let camera = depth.camera();
    // What is read here is not read through this image again.
    engine.upload_depth(&depth.clone().read().unwrap(), camera).unwrap()
}

/// Whether images stay where the host has written them.
fn is_processor(engine: &Engine) -> bool {
    let info = engine.device().adapter_info();
    info.device_type == wgpu::DeviceType::Cpu && info.backend == wgpu::Backend::Vulkan
}

fn instances(engine: &Engine, kind: BoundsKind, count: usize) -> Arc<Instances> {
    let mut random = Random(11);
    let (mut centers, mut sizes, mut ends) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..count {
        let z = random.range(1.5, 30.0);
        let center = [random.range(-z, z), random.range(-z, z), z].map(|v| v as f32);
        let size = (z * random.unit().powi(4) * 0.4) as f32;
        centers.extend(center);
        sizes.push(size);
        ends.extend(center.map(|v| v + size));
    }
    let centers_of = Floats::F32(&centers);
    let bounds = match kind {
        BoundsKind::Point => Bounds::Points { positions: centers_of },
        BoundsKind::Sphere => Bounds::Spheres { centers: centers_of, radii: Floats::F32(&sizes) },
        _ => Bounds::Boxes { min: centers_of, max: Floats::F32(&ends) },
    };
    engine.instances(&bounds, &InstanceOptions::default()).unwrap()
}

fn pyramid(engine: &Engine, depth: &DepthImage, levels: StoredLevels) -> Arc<Pyramid> {
    let options = PyramidOptions { levels, atlas: AtlasUse::Never, ..PyramidOptions::default() };
    engine.pyramid_with(depth, &options).unwrap()
}

const KINDS: [BoundsKind; 3] = [BoundsKind::Point, BoundsKind::Sphere, BoundsKind::Box];

fn ways() -> [CullOptions; 6] {
    let plain = CullOptions::default();
    [
        plain.clone(),
        CullOptions { footprint: Footprint::One, descent: 7, ..plain.clone() },
        CullOptions { footprint: Footprint::Four, ..plain.clone() },
        CullOptions { footprint: Footprint::Eight, descent: 50, ..plain.clone() },
        CullOptions { fit: Fit::Volume, descent: 20, ..plain.clone() },
        CullOptions { coverage: Coverage::Sample, ..plain },
    ]
}

fn all_of(culling: &Culling) -> (Vec<bool>, Vec<hiz_core::PixelCounts>) {
    (culling.mask().unwrap(), culling.pixels().unwrap())
}

#[test]
fn culls_find_what_they_find_in_an_uploaded_image() {
    let engine = &*engine();
    let outputs = Outputs { mask: true, pixels: true, ..Outputs::NONE };
    let (mut hidden, mut count) = (0, 0);
    // All ways for one size, and all sizes for one way.
    let (large, [plain, others @ ..]) = ((333, 70), ways());
    let all_ways = others.map(|options| (DepthConvention::Reversed, large, options));
    let all_sizes = CONVENTIONS.into_iter().flat_map(|convention| {
        let sizes = BLOCK_SIZES.into_iter().chain([large]);
        sizes.map(move |size| (convention, size)).collect::<Vec<_>>()
    });
    let all_sizes = all_sizes.map(|(convention, size)| (convention, size, plain.clone()));
    for (convention, (width, height), options) in all_sizes.chain(all_ways) {
        let camera = camera_along_z(width, height, convention);
        let depth = held(engine, &triangles(engine, u64::from(width), 12), &camera);
        let first = pyramid(engine, &depth, StoredLevels::ALL);
        let is_large = width.max(height) > 1;
        assert_eq!(first.is_in_place(), is_processor(engine) && is_large, "{width}x{height}");
        let there = pyramid(engine, &uploaded(engine, &depth), StoredLevels::ALL);
        // One whose image has not come to its texture, as it has by now.
        drop((first, depth));
        let depth = held(engine, &triangles(engine, u64::from(width), 12), &camera);
        let here = pyramid(engine, &depth, StoredLevels::ALL);
        assert!(!there.is_in_place());
        for kind in KINDS {
            let instances = instances(engine, kind, 300);
            // An engine brings the image to its texture before it counts pixels.
            let words = [&here, &there].map(|pyramid| {
                let visible = engine.context().create_visible(&instances, &outputs).unwrap();
                let mut own = engine.device().create_command_encoder(&Default::default());
                let hiz = engine.context();
                hiz.record_cull(&mut own, &instances, &camera, pyramid, &visible, &options)
                    .unwrap();
                engine.queue().submit([own.finish()]);
                words_of(engine, visible.pixels(0).expect("counts"))
            });
            assert!(words[0] == words[1], "{width}x{height} {convention:?} {kind:?} {options:?}");
            let [here, there] = [&here, &there].map(|pyramid| {
                engine.cull(&instances, &camera, pyramid, &options, &outputs).unwrap()
            });
            let found = all_of(&here);
            hidden += found.0.iter().filter(|seen| !**seen).count();
            count += found.0.len();
            let of = format!("{width}x{height} {convention:?} {kind:?} {options:?}");
            assert!(found == all_of(&there), "{of}");
            let explained = [&here, &there].map(|culling| culling.explain(3).unwrap());
            assert_eq!(explained[0], explained[1], "{of}");
        }
    }
    assert!(hidden > count / 10, "{hidden} of {count} are hidden");
}

/// Culls in place read rows where they lie: with a row in the wrong place the masks differ.
#[test]
fn a_planted_row_is_seen() {
    let fault = ("place.x + y * place.y", "place.x + (y / 2u) * place.y");
    let engine = &Engine::with_planted_faults(None, &[fault]).unwrap();
    if !is_processor(engine) {
        eprintln!("skipped: on a GPU no cull reads in place");
        return;
    }
    let camera = camera_along_z(333, 70, DepthConvention::Reversed);
    let depth = held(engine, &triangles(engine, 333, 12), &camera);
    let here = pyramid(engine, &depth, StoredLevels::ALL);
    assert!(here.is_in_place());
    let there = pyramid(engine, &uploaded(engine, &depth), StoredLevels::ALL);
    let boxes = instances(engine, BoundsKind::Box, 300);
    let [here, there] = [&here, &there].map(|pyramid| {
        let (how, outputs) = (CullOptions::default(), Outputs::default());
        engine.cull(&boxes, &camera, pyramid, &how, &outputs).unwrap().mask().unwrap()
    });
    let lost = there.iter().zip(&here).filter(|(seen, kept)| **seen && !**kept).count();
    assert!(lost > 0, "no visible box was lost");
}

/// The bits that a reader finds, of an image and of the same pixels in an uploaded one.
type Reader = (&'static str, fn(&Engine, &DepthImage) -> Vec<u32>);

fn bits(depths: Vec<f32>) -> Vec<u32> {
    depths.into_iter().map(f32::to_bits).collect()
}

fn levels_of(engine: &Engine, depth: &DepthImage, options: &PyramidOptions) -> Vec<u32> {
    let pyramid = engine.pyramid_with(depth, options).unwrap();
    let stored = pyramid.stored_levels().unwrap();
    let levels = std::iter::once(0).chain(stored.first..=stored.last);
    levels.flat_map(|k| bits(engine.read_level(&pyramid, k).unwrap())).collect()
}

fn mask_of(engine: &Engine, depth: &DepthImage, options: &PyramidOptions) -> Vec<u32> {
    let pyramid = engine.pyramid_with(depth, options).unwrap();
    let boxes = instances(engine, BoundsKind::Box, 2000);
    let (how, outputs) = (CullOptions::default(), Outputs::default());
    let culling = engine.cull(&boxes, depth.camera(), &pyramid, &how, &outputs).unwrap();
    culling.mask().unwrap().into_iter().map(u32::from).collect()
}

/// The pixels in the texture of an image, whose rows have a multiple of 256 bytes.
fn words_of_texture(engine: &Engine, texture: &wgpu::Texture) -> Vec<u32> {
    let bytes = 16 * u64::from(texture.width()) * u64::from(texture.height());
    let buffer = engine.device().create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut copy = engine.device().create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(16 * texture.width()),
        rows_per_image: None,
    };
    let into = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    copy.copy_texture_to_buffer(texture.as_image_copy(), into, texture.size());
    engine.queue().submit([copy.finish()]);
    words_of(engine, &buffer)
}

/// A pyramid whose levels fit a binding that does not hold the image, too.
fn narrow(atlas: AtlasUse) -> PyramidOptions {
    PyramidOptions { atlas, chunk_shift: Some(13), ..Default::default() }
}

const READERS: [Reader; 13] = [
    ("read", |_, depth| bits(depth.read().unwrap())),
    ("texture", |engine, depth| words_of_texture(engine, depth.texture())),
    ("level 0", |engine, depth| levels_of(engine, depth, &PyramidOptions::default())),
    ("both ends", |engine, depth| {
        levels_of(engine, depth, &PyramidOptions { depths: Depths::Both, ..Default::default() })
    }),
    ("some levels", |engine, depth| {
        let levels = StoredLevels::from(2);
        mask_of(engine, depth, &PyramidOptions { levels, ..Default::default() })
    }),
    ("an atlas", |engine, depth| {
        mask_of(engine, depth, &PyramidOptions { atlas: AtlasUse::Always, ..Default::default() })
    }),
    ("both ends, culled", |engine, depth| {
        mask_of(engine, depth, &PyramidOptions { depths: Depths::Both, ..Default::default() })
    }),
    ("chunks", |engine, depth| {
        mask_of(engine, depth, &PyramidOptions { chunk_shift: Some(12), ..Default::default() })
    }),
    ("a chunk without room for the image", |engine, depth| {
        mask_of(engine, depth, &narrow(AtlasUse::Never))
    }),
    ("the same beside an atlas", |engine, depth| mask_of(engine, depth, &narrow(AtlasUse::Always))),
    ("mips", |engine, depth| {
        let pyramid = engine.pyramid(depth).unwrap();
        let options = MipOptions { depths: MipDepths::Farthest, ..Default::default() };
        let mips = engine.mips(&pyramid, &options).unwrap();
        bits(engine.read_mip(&mips, 1).unwrap())
    }),
    ("a receiver mask", |engine, depth| {
        let light = camera_along_z(64, 64, depth.camera().convention());
        let mask = engine.receiver_mask(depth, &light, &ReceiverMaskOptions::default()).unwrap();
        bits(mask.read().unwrap())
    }),
    ("a part, renewed", |engine, depth| {
        let pyramid = engine.pyramid(depth).unwrap();
        let size = depth.size();
        let all = [0, 0, size.width - 1, size.height - 1];
        engine.renew_pyramid(&pyramid, depth, all).unwrap();
        assert!(!pyramid.is_in_place());
        let boxes = instances(engine, BoundsKind::Box, 2000);
        let (how, outputs) = (CullOptions::default(), Outputs::default());
        let culling = engine.cull(&boxes, depth.camera(), &pyramid, &how, &outputs).unwrap();
        culling.mask().unwrap().into_iter().map(u32::from).collect()
    }),
];

#[test]
fn whoever_reads_the_texture_finds_the_last_drawing() {
    let engine = &*engine();
    for convention in CONVENTIONS {
        // Rows of the texture have a multiple of 256 bytes.
        let camera = camera_along_z(192, 70, convention);
        let scene = triangles(engine, 8, 9);
        for (name, read) in READERS {
            let expected = read(engine, &uploaded(engine, &held(engine, &scene, &camera)));
            let found = read(engine, &held(engine, &scene, &camera));
            assert!(found == expected, "{name} {convention:?}");
        }
    }
}

/// What is added goes to the texture with all that was there before.
#[test]
fn more_is_drawn_into_an_image_that_is_not_in_its_texture() {
    let engine = &*engine();
    let camera = camera_along_z(132, 70, DepthConvention::Reversed);
    let (first, second) = (triangles(engine, 1, 6), triangles(engine, 2, 1));
    for is_reduced in [false, true] {
        let depth = held(engine, &first, &camera);
        if is_reduced {
            assert_eq!(pyramid(engine, &depth, StoredLevels::ALL).is_in_place(), {
                is_processor(engine)
            });
        }
        let add = DrawOptions { load: DepthLoad::Load, ..DrawOptions::default() };
        engine.render_depth_into(&depth, &second, &add).unwrap();
        let nearer = |a: f32, b: f32| a.max(b);
        let [a, b] = [&first, &second].map(|o| drawn(engine, o, &camera).read().unwrap());
        let expected: Vec<f32> = a.into_iter().zip(b).map(|(a, b)| nearer(a, b)).collect();
        assert!(depth.read().unwrap() == expected, "{is_reduced}");
        let there = uploaded(engine, &depth);
        let [here, there] = [&depth, &there].map(|depth| {
            let pyramid = pyramid(engine, depth, StoredLevels::ALL);
            assert!(!pyramid.is_in_place());
            (0..8).map(|k| bits(engine.read_level(&pyramid, k).unwrap())).collect::<Vec<_>>()
        });
        assert!(here == there, "{is_reduced}");
    }
}

/// A texture that was handed out has each later drawing, one that came at the same time as well.
#[test]
fn a_texture_that_is_handed_out_keeps_up_with_drawings() {
    let engine = &*engine();
    let camera = camera_along_z(64, 8, DepthConvention::Reversed);
    let walls = [8.0, 4.0].map(|z| wall(engine, z));
    let sizes = [1800, 1801, 1802].map(|side| camera_along_z(side, side, camera.convention()));
    let is_done = &AtomicBool::new(false);
    let rounds = 300 * common::soak_times();
    std::thread::scope(|scope| {
        // Images that give way to others slow down whoever notes that an image is not lent again.
        scope.spawn(|| {
            let others = sizes.iter().cycle().take(20 * rounds);
            for other in others.take_while(|_| !is_done.load(Ordering::Relaxed)) {
                drawn(engine, &walls[0], other);
            }
        });
        for round in 0..rounds {
            let depth = drawn(engine, &walls[0], &camera);
            engine.pyramid(&depth).unwrap();
            let (same, wall, all) = (depth.clone(), &walls[1], DrawOptions::default());
            let drawing = scope.spawn(move || engine.render_depth_into(&same, wall, &all));
            let texture = depth.texture();
            drawing.join().unwrap().unwrap();
            let found = words_of_texture(engine, texture);
            let is_last = found.iter().all(|word| f32::from_bits(*word) == 0.25);
            is_done.fetch_or(!is_last || round + 1 == rounds, Ordering::Relaxed);
            assert!(is_last, "round {round}: {}", f32::from_bits(found[0]));
        }
    });
}

/// A buffer is written again only when no pyramid and no cull on its way reads it.
#[test]
fn frames_on_their_way_keep_their_own_images() {
    let engine = &*engine();
    let camera = camera_along_z(132, 70, DepthConvention::Standard);
    let boxes = instances(engine, BoundsKind::Box, 500);
    let (how, outputs) = (CullOptions::default(), Outputs::default());
    let cull = |pyramid: &Arc<Pyramid>| engine.cull(&boxes, &camera, pyramid, &how, &outputs);
    let scenes: Vec<_> = (0..9).map(|i| triangles(engine, 30 + i, 4 + i as u32)).collect();
    let expected: Vec<_> = scenes
        .iter()
        .map(|scene| {
            let depth = uploaded(engine, &drawn(engine, scene, &camera));
            cull(&pyramid(engine, &depth, StoredLevels::ALL)).unwrap().mask().unwrap()
        })
        .collect();
    for round in 0..3 {
        let mut kept = Vec::new();
        let mut found = Vec::new();
        for (i, scene) in scenes.iter().enumerate() {
            let depth = drawn(engine, scene, &camera);
            let pyramid = pyramid(engine, &depth, StoredLevels::ALL);
            found.push(cull(&pyramid).unwrap());
            // Some pyramids outlive their image, and are culled with once more.
            if (i + round) % 3 == 0 {
                kept.push((i, pyramid));
            }
            if (i + round) % 4 == 0 {
                engine.wait().unwrap();
            }
        }
        let late: Vec<_> = kept.iter().map(|(i, pyramid)| (*i, cull(pyramid).unwrap())).collect();
        let in_order = found.into_iter().enumerate();
        for (i, culling) in late.into_iter().chain(in_order) {
            assert!(culling.mask().unwrap() == expected[i], "round {round}, frame {i}");
        }
    }
}

/// A cull in an encoder of the caller's own may be submitted when its image and pyramid are gone.
#[test]
fn a_recorded_cull_holds_what_it_reads() {
    let engine = &*engine();
    let camera = camera_along_z(132, 70, DepthConvention::Reversed);
    let boxes = instances(engine, BoundsKind::Box, 500);
    let how = CullOptions::default();
    let (first, other) = (triangles(engine, 70, 12), triangles(engine, 71, 3));
    // Counts of pixels, and culls with other levels, read the texture.
    for (levels, pixels) in
        [(StoredLevels::ALL, false), (StoredLevels::ALL, true), (StoredLevels::from(2), false)]
    {
        let outputs = Outputs { pixels, ..Outputs::default() };
        let frame = |scene: &Occluders| {
            let depth = drawn(engine, scene, &camera);
            pyramid(engine, &depth, levels)
        };
        let here = frame(&first);
        let at_once = engine.cull(&boxes, &camera, &here, &how, &outputs).unwrap();
        let (expected, counts) = (at_once.mask().unwrap(), pixels.then(|| at_once.pixels()));
        let counts = counts.transpose().unwrap();
        let visible = engine.context().create_visible(&boxes, &outputs).unwrap();
        let mut late = engine.device().create_command_encoder(&Default::default());
        engine.context().record_cull(&mut late, &boxes, &camera, &here, &visible, &how).unwrap();
        drop((here, at_once));
        let late = late.finish();
        for _ in 0..6 {
            engine.wait().unwrap();
            // Images that come to their textures.
            engine.mips(&frame(&other), &MipOptions::default()).unwrap();
        }
        engine.queue().submit([late]);
        let words = words_of(engine, visible.mask(0).expect("a mask"));
        let is_kept = |i: usize| words[i / 32] >> (i % 32) & 1 == 1;
        let found: Vec<_> = (0..expected.len()).map(is_kept).collect();
        assert!(found == expected, "{levels:?}");
        let words = visible.pixels(0).map(|counts| words_of(engine, counts));
        let found = words.as_ref().map(|words| &words[..5 * boxes.len() as usize]);
        assert!(found == counts.as_ref().map(|counts| bytemuck::cast_slice(counts)));
    }
}

/// Images that take turns share the buffers that their rows are written into.
#[test]
fn images_that_take_turns_share_their_buffers() {
    let engine = &*engine();
    let hiz = engine.context();
    let camera = camera_along_z(132, 70, DepthConvention::Reversed);
    let (scene, all) = (triangles(engine, 5, 5), DrawOptions::default());
    let pyramid = hiz.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let image = || hiz.create_occluder_depth(camera.size(), Rasteriser::Host).unwrap();
    let mut buffers_made = |depth: &OccluderDepth| {
        let before = hiz.made().buffers;
        let mut encoder = engine.device().create_command_encoder(&Default::default());
        hiz.record_occluder_depth(&mut encoder, &scene, &camera, depth, &all).unwrap();
        hiz.record_reduce(&mut encoder, depth, &camera, &pyramid).unwrap();
        engine.queue().submit([encoder.finish()]);
        engine.wait().unwrap();
        hiz.made().buffers - before
    };
    let first = image();
    buffers_made(&first);
    assert_eq!(buffers_made(&first), 1, "levels are held until the next ones are written");
    assert_eq!(buffers_made(&first), 0);
    // Each image has a number of its own, and holds its levels.
    let others = [image(), image()];
    let of_others: u64 = others.iter().map(&mut buffers_made).sum();
    assert!(of_others <= 4, "{of_others}: rows go through the buffer of the first image");
    for depth in others.iter().chain([&first]).cycle().take(9) {
        buffers_made(depth);
    }
    let later: u64 = others.iter().chain([&first]).map(buffers_made).sum();
    assert_eq!(later, 0, "they take turns with the same buffers");
}
