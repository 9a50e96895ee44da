//! Frames of a renderer: they make nothing anew, and each recording reads its own numbers.
//! Encoders are submitted in any order, late or never.

mod common;

use std::sync::Arc;

use common::{Random, camera_along_z, engine, ndc};
use hiz_core::headless::{DepthImage, Engine};
use hiz_core::testing::Made;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, DepthSource, Fit, Floats, Hierarchy,
    HizContext, InstanceOptions, Instances, Order, Outputs, Pose, Projection, Pyramid,
    PyramidOptions, ReceiverMaskOptions, Visible, wgpu,
};

const WIDTH: u32 = 61;
const HEIGHT: u32 = 43;
const CONVENTION: DepthConvention = DepthConvention::Reversed;

/// A context of its own, whose objects no other test makes.
struct Renderer {
    engine: Arc<Engine>,
    context: HizContext,
}

impl Renderer {
    fn new() -> Self {
        let engine = engine();
        let context = HizContext::new(engine.device()).unwrap();
        Self { engine, context }
    }

    fn encoder(&self) -> wgpu::CommandEncoder {
        self.engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    fn submit(&self, encoder: wgpu::CommandEncoder) {
        self.engine.queue().submit([encoder.finish()]);
    }

    /// Spheres of all sizes, in front of and behind walls at distances 4 and 16.
    fn spheres(&self, count: usize) -> Instances {
        let mut random = Random(3);
        let (mut centers, mut radii) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let z = random.range(2.0, 30.0);
            centers.extend([random.range(-z, z) as f32, random.range(-z, z) as f32, z as f32]);
            radii.push((z * random.unit().powi(3) * 0.3) as f32);
        }
        let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
        let mut encoder = self.encoder();
        let options = InstanceOptions::default();
        let instances = self.context.record_instances(&mut encoder, &bounds, &options).unwrap();
        self.submit(encoder);
        instances
    }

    fn pyramid(&self, atlas: AtlasUse) -> Pyramid {
        let options = PyramidOptions { atlas, ..PyramidOptions::default() };
        self.context.create_pyramid(camera(0).size(), &options).unwrap()
    }

    /// The mask that a cull left, as words.
    fn mask(&self, visible: &Visible) -> Vec<u8> {
        let mask = visible.mask(0).expect("asked for");
        let (sender, receiver) = std::sync::mpsc::channel();
        let bytes = mask.slice(..visible_bytes(visible));
        let (device, queue) = (self.engine.device(), self.engine.queue());
        wgpu::util::DownloadBuffer::read_buffer(device, queue, &bytes, move |bytes| {
            sender.send(bytes.expect("mapped").to_vec()).expect("waited for");
        });
        self.engine.wait().unwrap();
        receiver.recv().unwrap()
    }
}

fn visible_bytes(visible: &Visible) -> u64 {
    4 * u64::from(visible.capacity().div_ceil(32))
}

/// A camera that moves a little from frame to frame.
fn camera(frame: u32) -> Camera {
    let x = 1e-3 * f64::from(frame);
    let pose = Pose { eye: [x, 0.0, 0.0], target: [x, 0.0, 1.0], up: [0.0, 1.0, 0.0] };
    let projection =
        Projection::Perspective { fov_y: 1.0, near: 0.1, far: None, convention: CONVENTION };
    Camera::look_at(&pose, &projection, camera_along_z(WIDTH, HEIGHT, CONVENTION).size()).unwrap()
}

/// Images that hide different instances, in both kinds of texture that can be uploaded.
fn images(engine: &Engine) -> Vec<DepthImage> {
    let camera = camera(0);
    let mut random = Random(5);
    let mut holes = |near: f32, share: u32| -> Vec<f32> {
        (0..WIDTH * HEIGHT)
            .map(|_| if random.below(100) < share { 0.0 } else { ndc(near, CONVENTION) })
            .collect()
    };
    let depths = [holes(4.0, 1), holes(16.0, 1), holes(7.0, 4)];
    let uploads = depths.iter().map(|depth| engine.upload_depth(depth, &camera).unwrap());
    let sampled = depths.iter().map(|depth| engine.upload_depth_sampled(depth, &camera).unwrap());
    uploads.chain(sampled).collect()
}

fn view(image: &DepthImage) -> wgpu::TextureView {
    image.texture().create_view(&wgpu::TextureViewDescriptor::default())
}

/// Every way of a cull that binds something of its own.
fn ways() -> Vec<(CullOptions, Outputs)> {
    let mut ways = Vec::new();
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        for order in [Order::Stable, Order::Any] {
            for statistics in [false, true] {
                let mask = Outputs { mask: true, ..Outputs::NONE };
                let counts = Outputs { pixels: true, ..mask.clone() };
                for outputs in [Outputs::ALL, mask, counts] {
                    let options =
                        CullOptions { hierarchy, order, statistics, ..CullOptions::default() };
                    ways.push((options, outputs));
                }
            }
        }
    }
    ways
}

/// Frames that are made before the first one that must make nothing.
const FIRST: u32 = 3;
const FRAMES: u32 = 30;

/// What frames made, without the first ones.
/// Each has a camera of its own, two depth images in turn, and a reduction before two culls.
fn made_by_frames(
    renderer: &Renderer,
    atlas: AtlasUse,
    (options, outputs): &(CullOptions, Outputs),
    images: &[DepthImage],
) -> [Made; 2] {
    let Renderer { engine, context } = renderer;
    let (instances, pyramid) = (renderer.spheres(300), renderer.pyramid(atlas));
    let visible = context.create_visible(&instances, outputs).unwrap();
    let mut before = context.made();
    for frame in 0..FIRST + FRAMES {
        if frame == FIRST {
            // What the first frames lent comes back.
            engine.wait().unwrap();
            before = context.made();
        }
        let camera = camera(frame);
        let mut encoder = renderer.encoder();
        let image = view(&images[frame as usize % images.len()]);
        context.record_reduce(&mut encoder, &image, &camera, &pyramid).unwrap();
        for _ in 0..2 {
            let options = options.clone();
            context
                .record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
                .unwrap();
        }
        renderer.submit(encoder);
        // Two frames are under way at a time.
        if frame % 2 == 1 {
            engine.wait().unwrap();
        }
    }
    [before, context.made()]
}

#[test]
fn frames_make_nothing_anew() {
    let renderer = Renderer::new();
    let images = images(&renderer.engine);
    for of_kind in images.chunks(3) {
        for atlas in [AtlasUse::Never, AtlasUse::Always] {
            for way in ways() {
                let [before, after] = made_by_frames(&renderer, atlas, &way, &of_kind[..2]);
                let new_buffers = after.buffers - before.buffers;
                assert_eq!(
                    Made { buffers: before.buffers, ..after },
                    before,
                    "{atlas:?} {way:?}: in {FRAMES} frames"
                );
                // The ring has grown to what two frames need, however many frames there are.
                assert!(new_buffers <= 8, "{atlas:?} {way:?}: {new_buffers} buffers");
            }
        }
    }
}

/// The same of receiver masks of two depth images in turn.
#[test]
fn receiver_masks_make_nothing_anew() {
    let renderer = Renderer::new();
    let Renderer { engine, context } = &renderer;
    for of_kind in images(engine).chunks(3) {
        let light = camera(0);
        let mask = context.create_receiver_mask(light.size()).unwrap();
        let mut before = context.made();
        for frame in 0..FIRST + FRAMES {
            if frame == FIRST {
                before = context.made();
            }
            let (depth, options) = (&of_kind[frame as usize % 2], ReceiverMaskOptions::default());
            let (depth, camera) = (DepthSource::from(depth.texture()), camera(frame));
            let mut encoder = renderer.encoder();
            context
                .record_receiver_mask(&mut encoder, depth, &camera, &light, &mask, &options)
                .unwrap();
            renderer.submit(encoder);
            engine.wait().unwrap();
        }
        assert_eq!(context.made(), before);
    }
}

/// A view that stays gets a uniform of its own once, and then nothing is copied or made.
#[test]
fn a_view_that_stays_is_bound_once_more_at_most() {
    let renderer = Renderer::new();
    let Renderer { engine, context } = &renderer;
    let image = &images(engine)[0];
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        let options = CullOptions { hierarchy, ..CullOptions::default() };
        let (instances, pyramid) = (renderer.spheres(300), renderer.pyramid(AtlasUse::Never));
        let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
        let camera = camera(0);
        let mut encoder = renderer.encoder();
        context.record_reduce(&mut encoder, &view(image), &camera, &pyramid).unwrap();
        renderer.submit(encoder);
        let cull = || {
            let mut encoder = renderer.encoder();
            let Renderer { context, .. } = &renderer;
            context
                .record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
                .unwrap();
            renderer.submit(encoder);
            engine.wait().unwrap();
        };
        cull();
        let (first, mask) = (context.made(), renderer.mask(&visible));
        (0..40).for_each(|_| cull());
        let then = context.made();
        assert!(then.bind_groups - first.bind_groups <= 2, "{hierarchy:?}: {first:?} {then:?}");
        (0..40).for_each(|_| cull());
        assert_eq!(context.made(), then, "{hierarchy:?}");
        assert_eq!(renderer.mask(&visible), mask, "{hierarchy:?}");
    }
}

/// Options with numbers of their own, which keep different instances.
fn numbers() -> Vec<CullOptions> {
    let plain = CullOptions::default();
    let mut all = Vec::new();
    for hierarchy in [Hierarchy::Never, Hierarchy::Always] {
        all.extend([
            CullOptions { hierarchy, ..plain.clone() },
            CullOptions { hierarchy, depth_slack: 0.5, ..plain.clone() },
            CullOptions { hierarchy, guard_px: Some(4.0), ..plain.clone() },
            CullOptions { hierarchy, descent: 4096, fit: Fit::Volume, ..plain.clone() },
        ]);
    }
    all
}

/// Recordings that are submitted in any order, late or never, all with one pyramid.
/// Each culls with numbers of its own, and in every other round reduces an image of its own.
#[test]
fn each_recording_reads_its_own_numbers() {
    let renderer = Renderer::new();
    let Renderer { engine, context } = &renderer;
    let (images, numbers) = (images(engine), numbers());
    let instances = renderer.spheres(500);
    let outputs = Outputs { mask: true, ..Outputs::NONE };
    let camera = camera(0);
    let reduce = |encoder: &mut wgpu::CommandEncoder, pyramid: &Pyramid, image: usize| {
        context.record_reduce(encoder, &view(&images[image]), &camera, pyramid).unwrap();
    };
    let cull = |encoder: &mut wgpu::CommandEncoder, pyramid: &Pyramid, number: usize| {
        let visible = context.create_visible(&instances, &outputs).unwrap();
        let options = &numbers[number];
        context.record_cull(encoder, &instances, &camera, pyramid, &visible, options).unwrap();
        visible
    };
    // Each alone, with a pyramid of its own.
    let alone = |image, number| {
        let (pyramid, mut encoder) = (renderer.pyramid(AtlasUse::Never), renderer.encoder());
        reduce(&mut encoder, &pyramid, image);
        let visible = cull(&mut encoder, &pyramid, number);
        renderer.submit(encoder);
        renderer.mask(&visible)
    };
    let expected: Vec<Vec<_>> = (0..images.len())
        .map(|image| (0..numbers.len()).map(|number| alone(image, number)).collect())
        .collect();
    let mut distinct: Vec<_> = expected.iter().flatten().collect();
    distinct.sort();
    distinct.dedup();
    assert!(distinct.len() >= 8, "only {} recordings differ", distinct.len());

    let mut random = Random(11);
    for atlas in [AtlasUse::Never, AtlasUse::Always] {
        let pyramid = renderer.pyramid(atlas);
        for round in 0..40 {
            let mut below = |n: usize| random.below(n as u32) as usize;
            let one_image = (round % 2 == 0).then(|| below(images.len()));
            if let Some(image) = one_image {
                let mut encoder = renderer.encoder();
                reduce(&mut encoder, &pyramid, image);
                renderer.submit(encoder);
            }
            // Few numbers, so that some recordings have the same.
            let few = [below(numbers.len()), below(numbers.len())];
            let mut recorded = Vec::new();
            for _ in 0..6 {
                let (mut encoder, number) = (renderer.encoder(), few[below(2)]);
                let image = one_image.unwrap_or_else(|| {
                    let image = below(images.len());
                    reduce(&mut encoder, &pyramid, image);
                    image
                });
                let visible = cull(&mut encoder, &pyramid, number);
                recorded.push((image, number, encoder, visible));
            }
            let mut submitted = Vec::new();
            while !recorded.is_empty() {
                let (image, number, encoder, visible) = recorded.swap_remove(below(recorded.len()));
                if below(4) > 0 {
                    renderer.submit(encoder);
                    submitted.push((image, number, visible));
                }
                if below(3) == 0 {
                    engine.wait().unwrap();
                }
            }
            for (image, number, visible) in submitted {
                assert!(
                    renderer.mask(&visible) == expected[image][number],
                    "{atlas:?} round {round}: image {image}, {:?}",
                    numbers[number]
                );
            }
        }
    }
}

/// Recordings that are never submitted do not use up the ring.
#[test]
fn dropped_recordings_block_nothing() {
    let renderer = Renderer::new();
    let Renderer { engine, context } = &renderer;
    let image = view(&images(engine)[0]);
    let (instances, pyramid) = (renderer.spheres(100), renderer.pyramid(AtlasUse::Never));
    let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
    let frame = |number: u32| {
        let mut encoder = renderer.encoder();
        let camera = camera(number);
        let options = CullOptions::default();
        context.record_reduce(&mut encoder, &image, &camera, &pyramid).unwrap();
        context
            .record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
            .unwrap();
        encoder
    };
    (0..200).for_each(|number| drop(frame(number)));
    for number in 0..10 {
        renderer.submit(frame(number));
        engine.wait().unwrap();
    }
    let before = context.made();
    for number in 0..50 {
        renderer.submit(frame(number));
        engine.wait().unwrap();
    }
    assert_eq!(context.made(), before);
}
