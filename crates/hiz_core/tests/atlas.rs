//! The atlas: the texture from which large culls read all levels.
//! Its pyramid is reduced again while encoders run out of order or never.

mod common;

use std::collections::VecDeque;
use std::sync::Arc;

use common::{CONVENTIONS, Random, camera_along_z, depth_descriptor, engine, ndc};
use hiz_core::headless::{DepthImage, Engine};
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, Floats, HizContext, InstanceOptions,
    Instances, Outputs, Pyramid, PyramidOptions, StoredLevels, Visible, wgpu,
};

const WIDTH: u32 = 37;
const HEIGHT: u32 = 29;

/// Random orders of recording and running.
/// The first order that exposes an atlas with a single header is number 36.
const ROUNDS: u64 = 40;

fn encoder(engine: &Engine) -> wgpu::CommandEncoder {
    engine.device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
}

/// Spheres of all sizes, in front of and behind the walls at distances 4 and 16.
fn spheres(engine: &Engine) -> Arc<Instances> {
    let mut random = Random(3);
    let (mut centers, mut radii) = (Vec::new(), Vec::new());
    for _ in 0..600 {
        let z = random.range(2.0, 30.0);
        centers.extend([random.range(-z, z) as f32, random.range(-z, z) as f32, z as f32]);
        radii.push((z * random.unit().powi(3) * 0.3) as f32);
    }
    let bounds = Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) };
    engine.instances(&bounds, &InstanceOptions::default()).unwrap()
}

/// Images that hide different instances, in both kinds of texture that can be uploaded.
fn images(engine: &Engine, camera: &Camera) -> Vec<DepthImage> {
    let mut random = Random(5);
    let convention = camera.convention();
    let far = if convention == DepthConvention::Reversed { 0.0 } else { 1.0 };
    let mut holes = |near: f32, share: u32| -> Vec<f32> {
        (0..WIDTH * HEIGHT)
            .map(|_| if random.below(100) < share { far } else { ndc(near, convention) })
            .collect()
    };
    let depths = [holes(4.0, 0), holes(4.0, 100), holes(16.0, 0), holes(4.0, 3)];
    let uploads = depths.iter().map(|depth| engine.upload_depth(depth, camera).unwrap());
    let sampled = depths.iter().map(|depth| engine.upload_depth_sampled(depth, camera).unwrap());
    uploads.chain(sampled).collect()
}

fn record_reduce(
    engine: &Engine,
    encoder: &mut wgpu::CommandEncoder,
    image: &DepthImage,
    pyramid: &Pyramid,
) {
    let view = image.texture().create_view(&wgpu::TextureViewDescriptor::default());
    engine.context().record_reduce(encoder, &view, image.camera(), pyramid).unwrap();
}

fn pyramid(
    engine: &Engine,
    camera: &Camera,
    atlas: AtlasUse,
    levels: StoredLevels,
) -> Arc<Pyramid> {
    let options = PyramidOptions { atlas, levels, ..PyramidOptions::default() };
    Arc::new(engine.context().create_pyramid(camera.size(), &options).unwrap())
}

fn mask(
    engine: &Engine,
    instances: &Arc<Instances>,
    camera: &Camera,
    pyramid: &Arc<Pyramid>,
) -> Vec<bool> {
    engine
        .cull(instances, camera, pyramid, &CullOptions::default(), &Outputs::default())
        .unwrap()
        .mask()
        .unwrap()
}

/// Reads the mask that a cull in the caller's own encoder has left.
fn read_mask(engine: &Engine, visible: &Visible, count: usize) -> Vec<bool> {
    let size = 4 * (count as u64).div_ceil(32);
    let staging = engine.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("test.mask"),
        size,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut copy = encoder(engine);
    copy.copy_buffer_to_buffer(visible.mask(0).expect("a mask"), 0, &staging, 0, size);
    engine.queue().submit([copy.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    engine.wait().unwrap();
    let view = staging.get_mapped_range(..).unwrap();
    (0..count).map(|i| view[i / 8] >> (i % 8) & 1 == 1).collect()
}

/// A cull recorded for an earlier image is submitted late.
/// By then a second cull has been recorded for a later image, and it runs right after the first.
/// Returns how many instances of the later image the second cull loses.
/// A cull that is recorded after both has to be right for the later image.
fn lost_to_a_late_copy(engine: &Engine) -> usize {
    let camera = camera_along_z(WIDTH, HEIGHT, DepthConvention::Standard);
    let images = images(engine, &camera);
    let (near, open) = (&images[0], &images[1]);
    let instances = spheres(engine);
    let pyramid = pyramid(engine, &camera, AtlasUse::Always, StoredLevels::ALL);
    let reduce = |image| {
        let mut encoder = encoder(engine);
        record_reduce(engine, &mut encoder, image, &pyramid);
        engine.queue().submit([encoder.finish()]);
    };
    let recorded = || {
        let visible = engine.context().create_visible(&instances, &Outputs::default()).unwrap();
        let (mut encoder, options) = (encoder(engine), CullOptions::default());
        engine
            .context()
            .record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &options)
            .unwrap();
        (encoder.finish(), visible)
    };
    reduce(near);
    let (late, _) = recorded();
    reduce(open);
    let shown = mask(engine, &instances, &camera, &pyramid);
    engine.wait().unwrap();
    let (behind, seen_behind) = recorded();
    engine.queue().submit([late]);
    engine.queue().submit([behind]);
    let seen_behind = read_mask(engine, &seen_behind, shown.len());
    assert_eq!(mask(engine, &instances, &camera, &pyramid), shown);
    shown.iter().zip(&seen_behind).filter(|(shown, seen)| **shown && !**seen).count()
}

#[test]
fn a_late_copy_of_an_earlier_image_hides_nothing() {
    assert_eq!(lost_to_a_late_copy(&engine()), 0);
    let one_header =
        Engine::with_planted_faults(None, &[("of_levels == of_image", "true")]).unwrap();
    assert!(
        lost_to_a_late_copy(&one_header) > 0,
        "a header of the levels alone is enough to hide nothing"
    );
}

/// A cull answers for the image that it was recorded for, or keeps everything.
/// This holds in whatever order encoders run, and if some never run.
/// What is recorded and run after all of them answers for the last image.
#[test]
fn culls_in_any_order_answer_for_their_image_or_keep_everything() {
    let engine = &*engine();
    let instances = spheres(engine);
    let count = instances.len() as usize;
    let mut hidden = 0;
    for round in 0..ROUNDS {
        let mut random = Random(round);
        let camera = camera_along_z(WIDTH, HEIGHT, random.pick(&CONVENTIONS));
        let levels =
            random.pick(&[StoredLevels::ALL, StoredLevels::from(2), StoredLevels::only(3)]);
        let images = images(engine, &camera);
        let expected: Vec<_> = images
            .iter()
            .map(|image| {
                let options =
                    PyramidOptions { atlas: AtlasUse::Never, levels, ..PyramidOptions::default() };
                mask(engine, &instances, &camera, &engine.pyramid_with(image, &options).unwrap())
            })
            .collect();
        let kept_all: Vec<_> = {
            let all_open =
                engine.upload_depth(&vec![f32::NAN; (WIDTH * HEIGHT) as usize], &camera).unwrap();
            mask(engine, &instances, &camera, &engine.pyramid(&all_open).unwrap())
        };
        let pyramid = pyramid(engine, &camera, AtlasUse::Always, levels);
        let mut current = 0;
        let mut reduction = encoder(engine);
        record_reduce(engine, &mut reduction, &images[current], &pyramid);
        engine.queue().submit([reduction.finish()]);
        // Encoders that were recorded and have not run yet, and the image of each cull among them.
        let mut waiting: VecDeque<wgpu::CommandEncoder> = VecDeque::new();
        let mut answers: Vec<(usize, Visible)> = Vec::new();
        for _ in 0..40 {
            match random.below(10) {
                0 => {
                    current = random.below(images.len() as u32) as usize;
                    let mut new = encoder(engine);
                    record_reduce(engine, &mut new, &images[current], &pyramid);
                    waiting.push_back(new);
                }
                1..=4 => {
                    // In an encoder of its own, or appended to one that waits.
                    let mut encoder = if random.below(3) == 0 { waiting.pop_back() } else { None }
                        .unwrap_or_else(|| encoder(engine));
                    let visible =
                        engine.context().create_visible(&instances, &Outputs::default()).unwrap();
                    let options = CullOptions::default();
                    let context = engine.context();
                    context
                        .record_cull(
                            &mut encoder,
                            &instances,
                            &camera,
                            &pyramid,
                            &visible,
                            &options,
                        )
                        .unwrap();
                    answers.push((current, visible));
                    waiting.push_back(encoder);
                }
                5..=7 => {
                    let some: Vec<_> = (0..(1 + random.below(3) as usize).min(waiting.len()))
                        .filter_map(|_| waiting.remove(random.below(waiting.len() as u32) as usize))
                        .map(wgpu::CommandEncoder::finish)
                        .collect();
                    engine.queue().submit(some);
                }
                8 => drop(waiting.pop_front().filter(|_| random.below(3) == 0)),
                _ => engine.wait().unwrap(),
            }
        }
        engine.queue().submit(waiting.into_iter().map(wgpu::CommandEncoder::finish));
        for (image, visible) in &answers {
            let got = read_mask(engine, visible, count);
            hidden += u32::from(got == expected[*image] && got != kept_all);
            // A cull that never ran leaves all bits 0, their initial value.
            let ran = got.iter().any(|kept| *kept);
            assert!(!ran || got == expected[*image] || got == kept_all, "round {round}");
        }
        let mut last = encoder(engine);
        record_reduce(engine, &mut last, &images[1], &pyramid);
        record_reduce(engine, &mut last, &images[3], &pyramid);
        engine.queue().submit([last.finish()]);
        for _ in 0..2 {
            assert!(mask(engine, &instances, &camera, &pyramid) == expected[3], "round {round}");
        }
    }
    assert!(hidden > ROUNDS as u32, "too little was hidden to tell: {hidden}");
}

/// The depth image passes through a buffer on its way into the atlas.
/// An image larger than the device's largest buffer is read in place instead.
#[test]
fn an_image_that_no_buffer_holds_is_read_where_it_is() {
    let camera = camera_along_z(640, 512, DepthConvention::Standard);
    let least = 1 << 20;
    let limits = wgpu::Limits {
        max_buffer_size: least,
        max_storage_buffer_binding_size: least,
        ..HizContext::required_limits()
    };
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN;
    let instance = wgpu::Instance::new(descriptor);
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))
            .unwrap();
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).unwrap();
    let context = HizContext::new(&device).unwrap();
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
    let format = wgpu::TextureFormat::R32Float;
    let depth = device.create_texture(&depth_descriptor((640, 512), format, usage));
    let options = PyramidOptions {
        atlas: AtlasUse::Always,
        levels: StoredLevels::from(2),
        ..PyramidOptions::default()
    };
    let pyramid = context.create_pyramid(camera.size(), &options).unwrap();
    let bytes = pyramid.device_bytes();
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let view = depth.create_view(&wgpu::TextureViewDescriptor::default());
    context.record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
    let bounds =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances =
        context.record_instances(&mut encoder, &bounds, &InstanceOptions::default()).unwrap();
    let visible = context.create_visible(&instances, &Outputs::default()).unwrap();
    context
        .record_cull(&mut encoder, &instances, &camera, &pyramid, &visible, &CullOptions::default())
        .unwrap();
    queue.submit([encoder.finish()]);
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    assert_eq!(pyramid.device_bytes(), bytes, "nothing was copied");
}
