//! The warm-up: the first frame after it makes nothing, whatever the frame consists of.

mod common;

use common::{Random, camera_along_z, depth_descriptor, engine};
use hiz_core::headless::{CullExtras, EarlyMask, Engine, MoreWarmUp};
use hiz_core::testing::Made;
use hiz_core::{
    AtlasUse, Bounds, BoundsKind, Camera, Coverage, CullOptions, DepthConvention, DepthInput,
    DepthKind, DepthLoad, DepthTolerance, Depths, DrawOptions, EarlySet, FaceCull, Fit, Floats,
    Footprint, Hierarchy, HizContext, ImageSize, InstanceOptions, Instances, MeshData,
    OccluderOptions, Order, Outputs, PyramidOptions, ResolveOptions, StoredLevels, View,
    ViewsOutputs, WarmUp, WarmUpMore, WorldTolerance, wgpu,
};

const COUNT: usize = 300;

/// Arrays for bounds of every kind.
struct Crowd {
    centers: Vec<f32>,
    sizes: Vec<f32>,
    max: Vec<f32>,
    radii: Vec<f32>,
    rotations: Vec<f32>,
}

impl Crowd {
    fn new() -> Self {
        let mut random = Random(3);
        let centers: Vec<f32> = (0..3 * COUNT).map(|_| random.range(-9.0, 9.0) as f32).collect();
        Self {
            max: centers.iter().map(|v| v + 0.5).collect(),
            centers,
            sizes: vec![0.3; 3 * COUNT],
            radii: vec![0.4; COUNT],
            rotations: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0].repeat(COUNT),
        }
    }

    fn bounds(&self, kind: BoundsKind) -> Bounds<'_> {
        let centers = Floats::F32(&self.centers);
        match kind {
            BoundsKind::Sphere => Bounds::Spheres { centers, radii: Floats::F32(&self.radii) },
            BoundsKind::Box => Bounds::Boxes { min: centers, max: Floats::F32(&self.max) },
            BoundsKind::OrientedBox => Bounds::OrientedBoxes {
                centers,
                half_sizes: Floats::F32(&self.sizes),
                rotations: Floats::F32(&self.rotations),
            },
            BoundsKind::Point | BoundsKind::WidePoint => Bounds::Points { positions: centers },
        }
    }
}

const WALL: MeshData<'static> = MeshData {
    vertices: Floats::F32(&[-3.0, -3.0, 4.0, 3.0, -3.0, 4.0, 0.0, 3.0, 4.0]),
    triangles: &[0, 1, 2],
    transforms: None,
};

/// Everything that decides which pipelines a frame needs.
#[derive(Debug, Clone)]
struct Kind {
    bounds: BoundsKind,
    /// Drawn where it is a depth format that can be drawn into.
    format: wgpu::TextureFormat,
    convention: DepthConvention,
    size: (u32, u32),
    atlas: AtlasUse,
    levels: StoredLevels,
    faces: FaceCull,
    options: CullOptions,
    outputs: Outputs,
}

/// Random kinds of frames; together they have each choice several times.
fn kinds(count: usize) -> Vec<Kind> {
    use wgpu::TextureFormat as Format;
    let mut random = Random(17);
    let mut flag = || random.below(2) == 0;
    let mut kinds = Vec::new();
    for k in 0..count {
        let outputs = Outputs {
            mask: flag(),
            verdicts: flag(),
            indices: flag(),
            draws: flag(),
            capacity: flag().then_some(7),
            ..Outputs::NONE
        };
        let options = CullOptions {
            order: if flag() { Order::Stable } else { Order::Any },
            coverage: if flag() { Coverage::Area } else { Coverage::Sample },
            footprint: if flag() { Footprint::Two } else { Footprint::Four },
            descent: if flag() { 0 } else { 64 },
            fit: if flag() { Fit::Rectangle } else { Fit::Volume },
            hierarchy: if flag() { Hierarchy::Never } else { Hierarchy::Always },
            statistics: flag(),
            ..CullOptions::default()
        };
        kinds.push(Kind {
            bounds: [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox][k % 3],
            format: [Format::Depth32Float, Format::R32Float, Format::Rgba32Uint, Format::R16Float]
                [k % 4],
            convention: if flag() { DepthConvention::Standard } else { DepthConvention::Reversed },
            size: [(64, 48), (257, 31), (1024, 16)][k / 2 % 3],
            atlas: if flag() { AtlasUse::Never } else { AtlasUse::Always },
            levels: [StoredLevels::ALL, StoredLevels::from(2), StoredLevels::only(4)][k / 3 % 3],
            faces: if flag() { FaceCull::None } else { FaceCull::Back },
            options,
            outputs,
        });
    }
    kinds
}

fn encoder(engine: &Engine) -> wgpu::CommandEncoder {
    engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

fn depth_view(engine: &Engine, kind: &Kind) -> wgpu::TextureView {
    let (width, height) = kind.size;
    let (columns, usage) = match kind.format {
        wgpu::TextureFormat::Rgba32Uint => {
            (width.div_ceil(4), wgpu::TextureUsages::STORAGE_BINDING)
        }
        _ => (width, wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT),
    };
    let usage = usage | wgpu::TextureUsages::COPY_SRC;
    let texture =
        engine.device().create_texture(&depth_descriptor((columns, height), kind.format, usage));
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn uploaded(engine: &Engine, context: &HizContext, kind: BoundsKind, crowd: &Crowd) -> Instances {
    let mut uploads = encoder(engine);
    let options = InstanceOptions::default();
    let bounds = crowd.bounds(kind);
    let instances = context.record_instances(&mut uploads, &bounds, &options).unwrap();
    engine.queue().submit([uploads.finish()]);
    instances
}

fn camera(kind: &Kind) -> Camera {
    camera_along_z(kind.size.0, kind.size.1, kind.convention)
}

#[test]
fn the_first_frame_of_a_renderer_makes_nothing() {
    let (engine, crowd) = (engine(), Crowd::new());
    let mut with_pipelines = 0;
    for kind in kinds(36) {
        // Its pipelines are made anew.
        let context = HizContext::new(engine.device()).unwrap();
        let instances = uploaded(&engine, &context, kind.bounds, &crowd);
        let occluders =
            context.create_occluders(&[WALL], &OccluderOptions { cull_mode: kind.faces }).unwrap();
        let options =
            PyramidOptions { levels: kind.levels, atlas: kind.atlas, ..PyramidOptions::default() };
        let (camera, depth) = (camera(&kind), depth_view(&engine, &kind));
        let pyramid = context.create_pyramid(camera.size(), &options).unwrap();
        let visible = context.create_visible(&instances, &kind.outputs).unwrap();
        let is_drawn = kind.format == wgpu::TextureFormat::Depth32Float;
        let frame = WarmUp {
            occluders: is_drawn.then_some(&occluders),
            depth: &depth,
            camera: &camera,
            pyramid: &pyramid,
            instances: &instances,
            visible: &visible,
            options: &kind.options,
            updates: true,
            more: WarmUpMore::default(),
        };
        let nothing = context.made();
        let mut first = encoder(&engine);
        context.record_warm_up(&mut first, &frame).unwrap();
        engine.queue().submit([first.finish()]);
        engine.wait().unwrap();
        let before = context.made();
        with_pipelines += usize::from(before.pipelines > nothing.pipelines);

        let mut frame = encoder(&engine);
        let bounds = crowd.bounds(kind.bounds);
        context.record_update(&mut frame, &instances, 0, &bounds, false).unwrap();
        let updated = context.made();
        if is_drawn {
            let all = hiz_core::DrawOptions::default();
            context.record_occluders(&mut frame, &occluders, &camera, &depth, &all).unwrap();
        }
        let drawn = context.made();
        context.record_reduce(&mut frame, &depth, &camera, &pyramid).unwrap();
        context
            .record_cull(&mut frame, &instances, &camera, &pyramid, &visible, &kind.options)
            .unwrap();
        let after = context.made();
        engine.queue().submit([frame.finish()]);
        assert_eq!(after.pipelines, before.pipelines, "{kind:?}");
        // Updates bring their records in buffers, and make no other objects but those that bind
        // them.
        assert_eq!(updated.textures, before.textures, "{kind:?}");
        // Of reduction and cull, only the ring may grow: by their two or three recordings.
        let grown = after.buffers - drawn.buffers;
        assert!(grown <= 3, "{kind:?}: {grown} buffers");
        assert_eq!(Made { buffers: drawn.buffers, ..after }, drawn, "{kind:?}");
    }
    assert_eq!(with_pipelines, 36, "the warm-up makes the pipelines");
}

/// Two passes, several views, a multisampled depth image, and a part that is renewed.
#[test]
fn the_first_frame_of_other_passes_makes_no_pipeline() {
    let (engine, crowd) = (engine(), Crowd::new());
    for kind in kinds(6) {
        let options =
            CullOptions { order: Order::Stable, guard_px: Some(9.0 / 256.0), ..kind.options };
        let outputs = Outputs { mask: true, indices: true, draws: true, ..kind.outputs };
        // Samples are those of area coverage.
        let coverage = Coverage::Area;
        let options = CullOptions { coverage, ..options };
        let context = HizContext::new(engine.device()).unwrap();
        let instances = uploaded(&engine, &context, kind.bounds, &crowd);
        let kind = Kind { format: wgpu::TextureFormat::Rgba32Uint, options, outputs, ..kind };
        let camera = camera(&kind);
        let samples = engine.device().create_texture(&wgpu::TextureDescriptor {
            sample_count: 4,
            ..depth_descriptor(
                kind.size,
                wgpu::TextureFormat::Depth32Float,
                wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::RENDER_ATTACHMENT,
            )
        });
        let samples = samples.create_view(&wgpu::TextureViewDescriptor::default());
        let resolve =
            context.create_depth_resolve(camera.size(), &ResolveOptions::default()).unwrap();
        let levels =
            PyramidOptions { levels: kind.levels, atlas: kind.atlas, ..PyramidOptions::default() };
        let pyramid = context.create_pyramid(camera.size(), &levels).unwrap();
        let visible = context.create_visible(&instances, &kind.outputs).unwrap();
        let temporal = context.create_temporal(&instances, &kind.outputs).unwrap();
        let of_views = ViewsOutputs {
            each: Outputs { mask: true, ..Outputs::NONE },
            any: kind.outputs.clone(),
        };
        let views = context.create_visible_views(&instances, 2, &of_views).unwrap();
        let frame = WarmUp {
            occluders: None,
            depth: &depth_view(&engine, &kind),
            camera: &camera,
            pyramid: &pyramid,
            instances: &instances,
            visible: &visible,
            options: &kind.options,
            updates: false,
            more: WarmUpMore {
                temporal: Some(&temporal),
                views: Some(&views),
                resolve: Some((&samples, &resolve)),
                regions: true,
            },
        };
        let mut first = encoder(&engine);
        context.record_warm_up(&mut first, &frame).unwrap();
        engine.queue().submit([first.finish()]);
        engine.wait().unwrap();
        let before = context.made();
        assert!(pyramid.camera().is_none(), "nothing was built");

        let mut frame = encoder(&engine);
        // The first frame draws by size, and later ones by history.
        for _ in 0..2 {
            let set = EarlySet::LastVisible;
            context
                .record_early(&mut frame, &instances, &camera, &temporal, set, &kind.options)
                .unwrap();
            context.record_resolve(&mut frame, &samples, &camera, &resolve).unwrap();
            let depth = resolve.farthest().unwrap();
            context.record_reduce(&mut frame, depth, &camera, &pyramid).unwrap();
            context
                .record_late(&mut frame, &instances, &camera, &pyramid, &temporal, &kind.options)
                .unwrap();
        }
        let depth = resolve.farthest().unwrap();
        context.record_reduce_region(&mut frame, depth, [3, 3, 9, 9], &pyramid).unwrap();
        let each = [View { camera: &camera, pyramid: &pyramid }; 2];
        context
            .record_cull_views(&mut frame, &instances, &each, None, &views, &kind.options)
            .unwrap();
        engine.queue().submit([frame.finish()]);
        assert_eq!(context.made().pipelines, before.pipelines, "{kind:?}");
    }
}

/// A pyramid that a warm-up ran on was built of nothing, so a cull refuses it as before.
#[test]
fn a_warm_up_builds_and_culls_nothing() {
    let (engine, crowd) = (engine(), Crowd::new());
    let context = HizContext::new(engine.device()).unwrap();
    let kind = Kind { outputs: Outputs::ALL, ..kinds(1)[0].clone() };
    let instances = uploaded(&engine, &context, kind.bounds, &crowd);
    let (camera, depth) = (camera(&kind), depth_view(&engine, &kind));
    let pyramid = context.create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let visible = context.create_visible(&instances, &kind.outputs).unwrap();
    let frame = WarmUp {
        occluders: None,
        depth: &depth,
        camera: &camera,
        pyramid: &pyramid,
        instances: &instances,
        visible: &visible,
        options: &kind.options,
        updates: false,
        more: WarmUpMore::default(),
    };
    let mut warm_up = encoder(&engine);
    context.record_warm_up(&mut warm_up, &frame).unwrap();
    assert!(pyramid.camera().is_none());
    let culled =
        context.record_cull(&mut warm_up, &instances, &camera, &pyramid, &visible, &kind.options);
    assert!(culled.unwrap_err().to_string().contains("got one that never was"));
    let wrong = WarmUp { camera: &camera.with_size(ImageSize::new(5, 5)).unwrap(), ..frame };
    assert!(
        context
            .record_warm_up(&mut warm_up, &wrong)
            .unwrap_err()
            .to_string()
            .starts_with("camera:")
    );
}

/// With everything that an engine reads.
#[test]
fn the_first_frame_of_an_engine_makes_no_pipeline() {
    let crowd = Crowd::new();
    for (k, kind) in kinds(12).into_iter().enumerate() {
        let engine = Engine::new(None).unwrap();
        let instances =
            engine.instances(&crowd.bounds(kind.bounds), &InstanceOptions::default()).unwrap();
        let walls = engine.occluders(&[WALL], &OccluderOptions { cull_mode: kind.faces }).unwrap();
        let occluders = (k % 2 == 0).then_some(&*walls);
        let levels = PyramidOptions { levels: kind.levels, ..PyramidOptions::default() };
        let camera = camera(&kind);
        engine
            .warm_up(
                &instances,
                &camera,
                occluders,
                &levels,
                &kind.options,
                &kind.outputs,
                &MoreWarmUp::default(),
            )
            .unwrap();
        let before = engine.context().made();
        let depth = match occluders {
            Some(occluders) => engine.render_depth(occluders, &camera).unwrap(),
            None => {
                let (width, height) = kind.size;
                engine.upload_depth(&vec![0.5; (width * height) as usize], &camera).unwrap()
            }
        };
        engine.update(&instances, 0, &crowd.bounds(kind.bounds), false).unwrap();
        for frame in 0..2 {
            if let (1, Some(more)) = (frame, occluders) {
                // Such an image comes to the device in another way.
                let add = DrawOptions { load: DepthLoad::Load, ..DrawOptions::default() };
                engine.render_depth_into(&depth, more, &add).unwrap();
            }
            let pyramid = engine.pyramid_with(&depth, &levels).unwrap();
            let culling =
                engine.cull(&instances, &camera, &pyramid, &kind.options, &kind.outputs).unwrap();
            let Outputs { mask, verdicts, indices, draws, .. } = kind.outputs;
            drop(mask.then(|| culling.mask().unwrap()));
            drop(verdicts.then(|| (culling.verdicts().unwrap(), culling.counts().unwrap())));
            drop((mask || indices).then(|| culling.indices().unwrap()));
            drop((mask || indices || draws).then(|| culling.draws().unwrap()));
            assert_eq!(engine.context().made().pipelines, before.pipelines, "{kind:?}");
            assert!(culling.timings().compile_ms == 0.0, "{kind:?}");
        }
    }
}

/// Two passes, several views and several samples, with one end of the pyramid and with both.
#[test]
fn the_first_frame_of_an_engine_with_more_passes_makes_no_pipeline() {
    let crowd = Crowd::new();
    for (k, kind) in kinds(3).into_iter().enumerate() {
        let engine = Engine::new(None).unwrap();
        let instances =
            engine.instances(&crowd.bounds(kind.bounds), &InstanceOptions::default()).unwrap();
        let depths = if k % 2 == 0 { Depths::Both } else { Depths::Farthest };
        let levels = PyramidOptions { levels: kind.levels, depths, ..PyramidOptions::default() };
        let coverage = Coverage::Area;
        let options = CullOptions { order: Order::Stable, coverage, ..kind.options.clone() };
        let outputs = Outputs { capacity: None, ..kind.outputs.clone() };
        let more = MoreWarmUp { two_passes: true, samples: 2, views: 3 };
        let camera = camera(&kind);
        engine.warm_up(&instances, &camera, None, &levels, &options, &outputs, &more).unwrap();
        let before = engine.context().made().pipelines;

        let image = vec![0.5; camera.size().pixels() as usize];
        let own =
            if camera.convention().is_reversed() { DepthKind::ReversedNdc } else { DepthKind::Ndc };
        let sample = DepthInput {
            numbers: Floats::F32(&image).into(),
            kind: own,
            scale: 1.0,
            invalid: &[],
            tolerance: DepthTolerance::NONE,
            world_tolerance: WorldTolerance::NONE,
        };
        let depth = engine.upload_samples_for(&[sample, sample], &camera, depths).unwrap();
        let pyramid = engine.pyramid_with(&depth, &levels).unwrap();
        for capacity in [None, Some(7)] {
            let passes = engine.two_passes(&instances, capacity).unwrap();
            let some: Vec<bool> = (0..COUNT).map(|i| i % 3 == 0).collect();
            for set in
                [EarlyMask::LastVisible, EarlyMask::Largest { pixels: 9 }, EarlyMask::Given(&some)]
            {
                passes.early(&camera, set).unwrap().mask().unwrap();
            }
            passes.late(&camera, &pyramid, &options).unwrap().mask().unwrap();
            passes.early(&camera, EarlyMask::LastVisible).unwrap().mask().unwrap();
        }
        let each = Outputs { mask: true, verdicts: outputs.verdicts, ..Outputs::NONE };
        let outputs = ViewsOutputs { each, any: outputs };
        let views = [(&camera, &pyramid); 3];
        let extras = CullExtras::default();
        let seen = engine.cull_views(&instances, &views, &options, &outputs, &extras).unwrap();
        seen.masks().unwrap();
        assert_eq!(engine.context().made().pipelines, before, "{kind:?}");
    }
}

/// Without them the same frame makes pipelines, so the test above tells.
#[test]
fn a_plain_warm_up_does_not_know_two_passes() {
    let (engine, crowd) = (Engine::new(None).unwrap(), Crowd::new());
    let bounds = crowd.bounds(BoundsKind::Sphere);
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let camera = camera_along_z(64, 48, DepthConvention::Reversed);
    let (levels, options) = (PyramidOptions::default(), CullOptions::default());
    let (outputs, plain) = (Outputs::default(), MoreWarmUp::default());
    engine.warm_up(&instances, &camera, None, &levels, &options, &outputs, &plain).unwrap();
    let before = engine.context().made().pipelines;
    let passes = engine.two_passes(&instances, None).unwrap();
    passes.early(&camera, EarlyMask::LastVisible).unwrap();
    assert!(engine.context().made().pipelines > before);
    let samples = MoreWarmUp { samples: 2, ..plain };
    let walls = engine.occluders(&[WALL], &OccluderOptions::default()).unwrap();
    let drawn = Some(&*walls);
    let refused = engine.warm_up(&instances, &camera, drawn, &levels, &options, &outputs, &samples);
    assert!(refused.unwrap_err().to_string().starts_with("samples: expected 1"));
}
