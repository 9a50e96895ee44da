//! Levels that the host makes with an image that it draws: the bits of a reduction on the device,
//! in whichever order recordings run.

mod common;

use std::sync::Arc;

use common::{BLOCK_SIZES, CONVENTIONS, Random, camera_along_z, engine, occluders, wall};
use hiz_core::headless::Engine;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, DepthLoad, DepthSource, Depths,
    DrawOptions, Floats, ImageSize, InstanceOptions, Instances, OccluderDepth, Occluders, Pyramid,
    PyramidOptions, Rasteriser, StoredLevels, wgpu,
};

/// Triangles at random places of the image, also across its edges.
fn triangles(engine: &Engine, seed: u64, count: u32) -> Arc<Occluders> {
    let mut random = Random(seed);
    let mut vertices = Vec::new();
    for _ in 0..count {
        let (z, size) = (random.range(1.1, 40.0), random.range(0.01, 0.6));
        let middle = [random.range(-1.1, 1.1), random.range(-1.1, 1.1)];
        for _ in 0..3 {
            let at = |k: usize, r: &mut Random| (middle[k] + size * r.range(-1.0, 1.0)) * z;
            let (x, y) = (at(0, &mut random), at(1, &mut random));
            vertices.extend([x, y, z + random.range(-0.05, 0.05)]);
        }
    }
    let all: Vec<u32> = (0..3 * count).collect();
    occluders(engine, &vertices, &all)
}

fn encoder(engine: &Engine) -> wgpu::CommandEncoder {
    engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

/// What frames are recorded with.
struct Frame<'a> {
    engine: &'a Engine,
    camera: Camera,
    depth: OccluderDepth,
}

impl<'a> Frame<'a> {
    fn new(engine: &'a Engine, (width, height): (u32, u32), convention: DepthConvention) -> Self {
        let camera = camera_along_z(width, height, convention);
        let depth = engine.context().create_occluder_depth(camera.size(), Rasteriser::Host);
        Self { engine, camera, depth: depth.unwrap() }
    }

    fn draw(&self, occluders: &Occluders, load: DepthLoad) -> wgpu::CommandBuffer {
        let mut commands = encoder(self.engine);
        let options = DrawOptions { load, ..DrawOptions::default() };
        let hiz = self.engine.context();
        hiz.record_occluder_depth(&mut commands, occluders, &self.camera, &self.depth, &options)
            .unwrap();
        commands.finish()
    }

    fn pyramid(&self, levels: StoredLevels) -> Arc<Pyramid> {
        let options =
            PyramidOptions { levels, atlas: AtlasUse::Never, ..PyramidOptions::default() };
        Arc::new(self.engine.context().create_pyramid(self.camera.size(), &options).unwrap())
    }

    fn reduce<'d>(
        &self,
        depth: impl Into<DepthSource<'d>>,
        pyramid: &Pyramid,
    ) -> wgpu::CommandBuffer {
        let mut commands = encoder(self.engine);
        let hiz = self.engine.context();
        hiz.record_reduce(&mut commands, depth, &self.camera, pyramid).unwrap();
        commands.finish()
    }

    fn submit(&self, commands: wgpu::CommandBuffer) {
        self.engine.queue().submit([commands]);
    }

    fn levels(&self, pyramid: &Pyramid) -> Vec<Vec<u32>> {
        let stored = pyramid.stored_levels().into_iter().flat_map(|s| s.first..=s.last);
        let level = |k| self.engine.read_level(pyramid, k).unwrap();
        stored.map(|k| level(k).into_iter().map(f32::to_bits).collect()).collect()
    }
}

const STORED: [StoredLevels; 5] = [
    StoredLevels::ALL,
    StoredLevels::from(2),
    StoredLevels::from(4),
    StoredLevels { first: 1, last: 2 },
    StoredLevels::only(3),
];

#[test]
fn levels_have_the_bits_of_a_reduction_on_the_device() {
    let engine = &*engine();
    let (mut copied, mut texels) = (0, 0);
    for (convention, size) in CONVENTIONS.into_iter().flat_map(|c| {
        BLOCK_SIZES.into_iter().chain([(1921, 1079), (333, 70)]).map(move |size| (c, size))
    }) {
        let frame = Frame::new(engine, size, convention);
        for (levels, count) in STORED.into_iter().zip([300, 40, 0, 1000, 7]) {
            let occluders = triangles(engine, u64::from(size.0 * 7 + count), count);
            frame.submit(frame.draw(&occluders, DepthLoad::Clear));
            let [host, device] = [(); 2].map(|()| frame.pyramid(levels));
            frame.submit(frame.reduce(&frame.depth, &host));
            frame.submit(frame.reduce(frame.depth.view(), &device));
            assert!(!device.has_host_levels(), "a texture alone has no levels");
            assert!(host.has_host_levels() || levels != StoredLevels::ALL || size == (1, 1));
            copied += u32::from(host.has_host_levels());
            let (host, device) = (frame.levels(&host), frame.levels(&device));
            texels += host.iter().map(Vec::len).sum::<usize>();
            assert!(host == device, "{size:?} {convention:?} {levels:?}");
        }
    }
    assert!(copied > 90 && texels > 1_000_000, "{copied} pyramids were copied, {texels} texels");
}

/// What has levels of another form is reduced on the device.
#[test]
fn other_pyramids_and_sources_are_reduced_on_the_device() {
    let engine = &*engine();
    let frame = Frame::new(engine, (64, 48), DepthConvention::Reversed);
    frame.submit(frame.draw(&wall(engine, 4.0), DepthLoad::Clear));
    let reduced = |depth: DepthSource<'_>, options: &PyramidOptions| {
        let pyramid = engine.context().create_pyramid(frame.camera.size(), options).unwrap();
        frame.submit(frame.reduce(depth, &pyramid));
        pyramid.has_host_levels()
    };
    let (plain, of_drawn) = (PyramidOptions::default(), DepthSource::from(&frame.depth));
    assert!(reduced(of_drawn, &plain));
    assert!(!reduced(DepthSource::from(frame.depth.texture()), &plain));
    for depths in [Depths::Nearest, Depths::Both, Depths::Receivers] {
        assert!(!reduced(of_drawn, &PyramidOptions { depths, ..plain.clone() }), "{depths:?}");
    }
    let in_chunks = PyramidOptions { chunk_shift: Some(11), ..plain.clone() };
    assert!(!reduced(of_drawn, &in_chunks));
    // Another image's texture with these levels.
    let other = Frame::new(engine, (64, 48), DepthConvention::Reversed);
    other.submit(other.draw(&wall(engine, 8.0), DepthLoad::Clear));
    let mixed = DepthSource { levels: of_drawn.levels, ..DepthSource::from(&other.depth) };
    assert!(!reduced(mixed, &plain));
    // A camera of the other convention, to which other depths are farthest.
    let camera = camera_along_z(64, 48, DepthConvention::Standard);
    let pyramid = frame.pyramid(StoredLevels::ALL);
    let mut commands = encoder(engine);
    engine.context().record_reduce(&mut commands, &frame.depth, &camera, &pyramid).unwrap();
    assert!(!pyramid.has_host_levels());
    // The device's rasteriser leaves the levels to the device.
    let size = frame.camera.size();
    let drawn = engine.context().create_occluder_depth(size, Rasteriser::Device).unwrap();
    assert!(DepthSource::from(&drawn).levels.is_none());
}

/// Levels cost time, so they are made while somebody takes them.
#[test]
fn they_are_made_while_reductions_ask_for_them() {
    let engine = &*engine();
    let frame = Frame::new(engine, (64, 48), DepthConvention::Standard);
    let (pyramid, walls) = (frame.pyramid(StoredLevels::ALL), wall(engine, 4.0));
    let mut found = Vec::new();
    for is_reduced in [true, true, false, false, true, true, true] {
        frame.submit(frame.draw(&walls, DepthLoad::Clear));
        if is_reduced {
            frame.submit(frame.reduce(&frame.depth, &pyramid));
            found.push(pyramid.has_host_levels());
        }
    }
    assert_eq!(found, [true, true, false, true, true]);
    // What is added to the image is reduced on the device, and so is a part of it.
    frame.submit(frame.draw(&wall(engine, 2.0), DepthLoad::Load));
    frame.submit(frame.reduce(&frame.depth, &pyramid));
    assert!(!pyramid.has_host_levels());
    let near = frame.levels(&pyramid);
    assert!(near.iter().flatten().all(|bits| *bits == 0.5_f32.to_bits()), "{near:?}");
}

/// A sphere behind the wall at a depth of 4, and one before it.
fn two_spheres(engine: &Engine) -> Arc<Instances> {
    let (centers, radii) = ([0.0, 0.0, 20.0, 0.0, 0.0, 2.0], [4.0, 0.5]);
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    engine.instances(&bounds, &InstanceOptions::default()).unwrap()
}

const KEPT: [bool; 2] = [true, true];
const HIDDEN: [bool; 2] = [false, true];

/// The number of the drawing is what tells; see `pyramid/host_levels.rs`.
#[test]
fn culls_keep_everything_where_the_image_came_from_another_drawing() {
    let engine = &*engine();
    let spheres = two_spheres(engine);
    let (before, nothing) = (wall(engine, 4.0), occluders(engine, &[], &[]));
    let nearer = wall(engine, 3.0);
    let is_kept = |frame: &Frame<'_>, pyramid: &Arc<Pyramid>| {
        let options = CullOptions::default();
        let culling =
            engine.cull(&spheres, &frame.camera, pyramid, &options, &Default::default()).unwrap();
        culling.mask().unwrap()
    };
    for convention in CONVENTIONS {
        let frame = Frame::new(engine, (64, 48), convention);
        let [pyramid, asking] = [(); 2].map(|()| frame.pyramid(StoredLevels::ALL));
        // Each drawing makes levels, because a reduction has asked for them.
        let draw = |occluders: &Occluders| {
            drop(frame.reduce(&frame.depth, &asking));
            frame.draw(occluders, DepthLoad::Clear)
        };
        let reduce = || {
            let commands = frame.reduce(&frame.depth, &pyramid);
            assert!(pyramid.has_host_levels());
            commands
        };
        frame.submit(draw(&before));
        frame.submit(reduce());
        assert_eq!(is_kept(&frame, &pyramid), HIDDEN, "in order");

        frame.submit(draw(&nothing));
        drop(draw(&before));
        frame.submit(reduce());
        assert_eq!(is_kept(&frame, &pyramid), KEPT, "a drawing was dropped");

        let (first, reduction) = (draw(&before), reduce());
        let second = draw(&nothing);
        [first, second, reduction].into_iter().for_each(|commands| frame.submit(commands));
        assert_eq!(is_kept(&frame, &pyramid), KEPT, "another drawing ran in between");

        let (drawing, reduction) = (draw(&before), reduce());
        frame.submit(reduction);
        assert_eq!(is_kept(&frame, &pyramid), KEPT, "the reduction ran before its drawing");
        frame.submit(drawing);
        assert_eq!(is_kept(&frame, &pyramid), KEPT, "and was not repeated");
        frame.submit(reduce());
        assert_eq!(is_kept(&frame, &pyramid), HIDDEN, "now it is");

        let (drawing, reduction) = (draw(&before), reduce());
        let added = frame.draw(&nearer, DepthLoad::Load);
        [drawing, added, reduction].into_iter().for_each(|commands| frame.submit(commands));
        assert_eq!(is_kept(&frame, &pyramid), KEPT, "something was added in between");
    }
}

/// Buffers come back to be written again, but not while a recording may still copy from them.
#[test]
fn frames_on_their_way_keep_their_own_levels() {
    let engine = &*engine();
    let size = (120, 70);
    let frame = Frame::new(engine, size, DepthConvention::Reversed);
    for round in 0..4_u64 {
        let scenes: Vec<_> =
            (0..7).map(|i| triangles(engine, 100 * round + i, 30 + 5 * i as u32)).collect();
        let mut late = Vec::new();
        let pyramids: Vec<_> = (0..)
            .zip(&scenes)
            .map(|(i, occluders)| {
                let pyramid = frame.pyramid(StoredLevels::ALL);
                frame.submit(frame.draw(occluders, DepthLoad::Clear));
                let reduction = frame.reduce(&frame.depth, &pyramid);
                assert!(pyramid.has_host_levels());
                // Some are submitted after further drawings, and some are dropped and repeated.
                match (i + round) % 3 {
                    0 => frame.submit(reduction),
                    1 => late.push(reduction),
                    _ => {
                        drop(reduction);
                        frame.submit(frame.reduce(&frame.depth, &pyramid));
                    }
                }
                if i == 3 {
                    engine.wait().unwrap();
                }
                pyramid
            })
            .collect();
        late.into_iter().for_each(|commands| frame.submit(commands));
        for (occluders, pyramid) in scenes.iter().zip(&pyramids) {
            let (alone, found) = (Frame::new(engine, size, DepthConvention::Reversed), pyramid);
            alone.submit(alone.draw(occluders, DepthLoad::Clear));
            let expected = alone.pyramid(StoredLevels::ALL);
            alone.submit(alone.reduce(alone.depth.view(), &expected));
            assert!(frame.levels(found) == alone.levels(&expected), "round {round}");
        }
    }
}

/// Whoever has seen the texture may have written into it.
#[test]
fn an_image_whose_texture_was_seen_is_reduced_on_the_device() {
    let engine = &*engine();
    let camera = camera_along_z(64, 48, DepthConvention::Reversed);
    let (walls, all) = (wall(engine, 4.0), DrawOptions::default());
    let drawn = || engine.render_depth_with(&walls, &camera, Rasteriser::Host, &all).unwrap().0;
    assert!(engine.pyramid(&drawn()).unwrap().has_host_levels());
    let depth = drawn();
    let texture = depth.texture();
    let far = vec![0; (16 * texture.width() * texture.height()) as usize];
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(16 * texture.width()),
        rows_per_image: None,
    };
    engine.queue().write_texture(texture.as_image_copy(), &far, layout, texture.size());
    let pyramid = engine.pyramid(&depth).unwrap();
    assert!(!pyramid.has_host_levels());
    assert_eq!(engine.read_level(&pyramid, 6).unwrap(), [0.0]);
    let size = ImageSize::new(64, 48);
    assert_eq!(pyramid.size(), size);
}
