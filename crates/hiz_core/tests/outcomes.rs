//! The named outcomes: one test each, with every expectation worked out by hand.
//!
//! The camera is at the origin and looks along +z.
//! x and y span -1..1 at depth 1, the near plane is at 1, and there is no far plane.
//! The depth image is a wall at depth 4 unless a test says otherwise.

mod common;

use std::sync::Arc;

use common::{CONVENTIONS, camera_along_z, depth_descriptor, engine, ndc};
use hiz_core::headless::{Culling, Engine};
use hiz_core::wgpu;
use hiz_core::{
    Bounds, Camera, Coverage, CullOptions, DepthConvention, Error, Floats, ImageSize,
    InstanceOptions, Instances, Outputs, Pyramid, PyramidOptions, Verdict,
};

const OUTSIDE: Verdict = Verdict::Outside;
const OCCLUDED: Verdict = Verdict::Occluded;
const VISIBLE: Verdict = Verdict::Visible;
const INVALID: Verdict = Verdict::Invalid;

const SIDE: u32 = 16;

fn spheres(list: &[([f64; 3], f64)]) -> Arc<Instances> {
    let centers: Vec<f64> = list.iter().flat_map(|s| s.0).collect();
    let radii: Vec<f64> = list.iter().map(|s| s.1).collect();
    let bounds = Bounds::Spheres { centers: Floats::F64(&centers), radii: Floats::F64(&radii) };
    engine().instances(&bounds, &InstanceOptions::default()).unwrap()
}

fn boxes(list: &[([f64; 3], [f64; 3])]) -> Arc<Instances> {
    let min: Vec<f64> = list.iter().flat_map(|b| b.0).collect();
    let max: Vec<f64> = list.iter().flat_map(|b| b.1).collect();
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    engine().instances(&bounds, &InstanceOptions::default()).unwrap()
}

fn oriented(list: &[([f64; 3], [f64; 3], [f64; 9])]) -> Arc<Instances> {
    let centers: Vec<f64> = list.iter().flat_map(|b| b.0).collect();
    let half: Vec<f64> = list.iter().flat_map(|b| b.1).collect();
    let rotations: Vec<f64> = list.iter().flat_map(|b| b.2).collect();
    let bounds = Bounds::OrientedBoxes {
        centers: Floats::F64(&centers),
        half_sizes: Floats::F64(&half),
        rotations: Floats::F64(&rotations),
    };
    engine().instances(&bounds, &InstanceOptions::default()).unwrap()
}

const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

fn pyramid_of(depth: &[f32], camera: &Camera) -> Arc<Pyramid> {
    engine().pyramid(&engine().upload_depth(depth, camera).unwrap()).unwrap()
}

fn cull_with(
    instances: &Arc<Instances>,
    depth: &[f32],
    camera: &Camera,
    options: &CullOptions,
) -> Culling {
    engine()
        .cull(instances, camera, &pyramid_of(depth, camera), options, &Outputs::default())
        .unwrap()
}

/// Verdicts with a wall at depth 4, which are the same in both conventions.
fn before_a_wall(instances: &Arc<Instances>) -> Vec<Verdict> {
    let mut seen: Vec<Vec<Verdict>> = CONVENTIONS
        .iter()
        .map(|convention| {
            let camera = camera_along_z(SIDE, SIDE, *convention);
            let wall = [ndc(4.0, *convention); (SIDE * SIDE) as usize];
            cull_with(instances, &wall, &camera, &CullOptions::default()).verdicts().unwrap()
        })
        .collect();
    assert_eq!(seen[0], seen[1], "both conventions agree");
    seen.remove(0)
}

#[test]
fn behind_and_before_the_wall() {
    let list = spheres(&[
        ([0.0, 0.0, 8.0], 1.0),
        ([0.0, 0.0, 2.5], 1.0),
        ([1.0, -1.0, 4.5], 0.25),
        ([1.0, -1.0, 4.0], 0.25),
    ]);
    assert_eq!(before_a_wall(&list), [OCCLUDED, VISIBLE, OCCLUDED, VISIBLE]);
    let list = boxes(&[([-1.0, -1.0, 5.0], [1.0, 1.0, 6.0]), ([-1.0, -1.0, 3.0], [1.0, 1.0, 6.0])]);
    assert_eq!(before_a_wall(&list), [OCCLUDED, VISIBLE]);
}

#[test]
fn outside_each_plane() {
    // In view |x| and |y| are at most z; the near plane is at 1.
    let away = [
        [-9.0, 0.0, 4.0],
        [9.0, 0.0, 4.0],
        [0.0, -9.0, 4.0],
        [0.0, 9.0, 4.0],
        [0.0, 0.0, 0.5],
        [0.0, 0.0, -5.0],
    ];
    let list = spheres(&away.map(|c| (c, 0.25)));
    assert_eq!(before_a_wall(&list), [OUTSIDE; 6]);
    let list = boxes(&away.map(|c| (c.map(|x| x - 0.25), c.map(|x| x + 0.25))));
    assert_eq!(before_a_wall(&list), [OUTSIDE; 6]);
    let list = oriented(&away.map(|c| (c, [0.25; 3], IDENTITY)));
    assert_eq!(before_a_wall(&list), [OUTSIDE; 6]);
}

/// Darnell's shader culls a sphere that contains the camera.
#[test]
fn the_camera_inside_is_visible() {
    assert_eq!(before_a_wall(&spheres(&[([0.0; 3], 10.0), ([0.0, 0.0, 3.0], 3.5)])), [VISIBLE; 2]);
    assert_eq!(
        before_a_wall(&boxes(&[([-1.0; 3], [1.0; 3]), ([-50.0; 3], [50.0; 3])])),
        [VISIBLE; 2]
    );
    assert_eq!(before_a_wall(&oriented(&[([0.0; 3], [2.0; 3], IDENTITY)])), [VISIBLE]);
}

#[test]
fn crossing_the_near_plane_or_the_eye_plane_inside_the_frustum_is_visible() {
    let list =
        boxes(&[([-0.1, -0.1, 0.5], [0.1, 0.1, 8.0]), ([-0.1, -0.1, -1.0], [0.1, 0.1, 8.0])]);
    assert_eq!(before_a_wall(&list), [VISIBLE; 2]);
    assert_eq!(
        before_a_wall(&spheres(&[([0.0, 0.0, 1.0], 0.25), ([0.0, 0.0, 0.5], 0.75)])),
        [VISIBLE; 2]
    );
}

#[test]
fn equal_depth_is_visible_and_a_hair_behind_is_hidden() {
    let list =
        boxes(&[([-1.0, -1.0, 4.0], [1.0, 1.0, 5.0]), ([-1.0, -1.0, 4.001], [1.0, 1.0, 5.0])]);
    assert_eq!(before_a_wall(&list), [VISIBLE, OCCLUDED]);
    let list = spheres(&[([0.0, 0.0, 5.0], 1.0), ([0.0, 0.0, 5.001], 1.0)]);
    assert_eq!(before_a_wall(&list), [VISIBLE, OCCLUDED]);
}

#[test]
fn bad_bounds_are_kept_counted_and_listed() {
    let (nan, inf, good) = (f64::NAN, f64::INFINITY, [0.0, 0.0, 8.0]);
    let list = spheres(&[
        (good, 1.0),
        ([nan, 0.0, 8.0], 1.0),
        ([0.0, inf, 8.0], 1.0),
        ([0.0, 0.0, 1e300], 1.0),
        (good, nan),
        (good, inf),
        (good, -1.0),
        (good, -1e-300),
        ([2e18, 0.0, 8.0], 1.0),
    ]);
    let verdicts = before_a_wall(&list);
    assert_eq!(
        verdicts,
        [OCCLUDED, INVALID, INVALID, INVALID, INVALID, INVALID, INVALID, INVALID, INVALID]
    );
    assert_eq!(list.invalid().unwrap(), [1, 2, 3, 4, 5, 6, 7, 8]);
    let list = boxes(&[
        ([-1.0, -1.0, 5.0], [1.0, 1.0, 6.0]),
        ([-1.0, 1.0, 5.0], [1.0, -1.0, 6.0]),
        ([-1.0, -1.0, nan], [1.0, 1.0, 6.0]),
        ([-1.0, -1.0, 5.0], [1.0, inf, 6.0]),
    ]);
    assert_eq!(before_a_wall(&list), [OCCLUDED, INVALID, INVALID, INVALID]);
    assert_eq!(list.invalid().unwrap(), [1, 2, 3]);
    let mut mirror = IDENTITY;
    mirror[0] = nan;
    let list = oriented(&[
        (good, [1.0; 3], IDENTITY),
        (good, [1.0, -1.0, 1.0], IDENTITY),
        (good, [1.0; 3], mirror),
    ]);
    assert_eq!(before_a_wall(&list), [OCCLUDED, INVALID, INVALID]);
    assert_eq!(list.invalid().unwrap(), [1, 2]);
}

#[test]
fn strict_instances_refuse_bad_bounds_by_index() {
    let bounds = Bounds::Spheres {
        centers: Floats::F32(&[0.0, 0.0, 8.0, 0.0, f32::NAN, 8.0]),
        radii: Floats::F32(&[1.0, 1.0]),
    };
    let options = InstanceOptions { strict: true, ..InstanceOptions::default() };
    let message = engine().instances(&bounds, &options).unwrap_err().to_string();
    assert!(
        message.starts_with("bounds: expected finite numbers")
            && message.ends_with("got 1 bad of 2, the first at index 1"),
        "{message}"
    );
}

#[test]
fn too_far_for_this_camera_is_invalid_and_kept() {
    // 2^55 passes the test of the bits but exceeds the camera's coordinate limit, 2^50 at most.
    assert_eq!(before_a_wall(&spheres(&[([0.0, 0.0, 2.0_f64.powi(55)], 1.0)])), [INVALID]);
    // This camera's limit is 2^58 over 2^16 times the coefficients of w, which are 1.
    let at = |exponent| ([0.0, 0.0, 2.0_f64.powi(exponent)], 1.0);
    assert_eq!(before_a_wall(&spheres(&[at(41), at(43), at(49)])), [OCCLUDED, INVALID, INVALID]);
}

#[test]
fn zero_sizes_flat_mirrored_and_singular_boxes_are_valid() {
    let behind = [0.0, 0.0, 8.0];
    assert_eq!(
        before_a_wall(&spheres(&[(behind, 0.0), ([0.0, 0.0, 2.0], 0.0)])),
        [OCCLUDED, VISIBLE]
    );
    assert_eq!(
        before_a_wall(&boxes(&[(behind, behind), ([0.0, 0.0, 2.0], [0.0, 0.0, 2.0])])),
        [OCCLUDED, VISIBLE]
    );
    let mirrored = [-1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let singular = [1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let list = oriented(&[
        (behind, [1.0, 1.0, 0.0], IDENTITY),
        (behind, [1.0; 3], mirrored),
        (behind, [1.0; 3], singular),
        (behind, [1.0; 3], [0.0; 9]),
        ([0.0, 0.0, 2.0], [0.5, 0.5, 9.0], singular),
    ]);
    assert_eq!(before_a_wall(&list), [OCCLUDED, OCCLUDED, OCCLUDED, OCCLUDED, VISIBLE]);
}

#[test]
fn far_depth_and_what_is_no_depth_never_occlude() {
    let list = spheres(&[([0.0, 0.0, 1e6], 1.0)]);
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let far = convention.far();
        let wall = ndc(4.0, convention);
        let bad = [
            far,
            f32::NAN,
            f32::from_bits(0xFFC0_1234),
            f32::INFINITY,
            f32::NEG_INFINITY,
            -0.5,
            -1e-40,
            1.5,
            1.0_f32.next_up(),
        ];
        for value in bad {
            assert_eq!(
                cull_with(&list, &[value; 256], &camera, &CullOptions::default())
                    .verdicts()
                    .unwrap(),
                [VISIBLE]
            );
            // One such pixel in the middle of the wall is a hole.
            // The sphere could be seen through it.
            let mut depth = [wall; 256];
            depth[8 * 16 + 8] = value;
            assert_eq!(
                cull_with(&list, &depth, &camera, &CullOptions::default()).verdicts().unwrap(),
                [VISIBLE],
                "{value}"
            );
        }
        let nothing_wrong = [wall; 256];
        assert_eq!(
            cull_with(&list, &nothing_wrong, &camera, &CullOptions::default()).verdicts().unwrap(),
            [OCCLUDED]
        );
    }
    // Standard Z: 0, -0 and subnormals are the near plane, which hides everything behind it.
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    for near in [0.0, -0.0, 1e-40] {
        assert_eq!(
            cull_with(&list, &[near; 256], &camera, &CullOptions::default()).verdicts().unwrap(),
            [OCCLUDED]
        );
    }
}

#[test]
fn one_pixel_holes_are_seen_through_at_every_level() {
    // A box behind the wall that covers the whole image, so that any hole shows it.
    let list = boxes(&[([-20.0, -20.0, 8.0], [20.0, 20.0, 9.0])]);
    for convention in CONVENTIONS {
        for (width, height) in [(1, 1), (5, 3), (16, 16), (33, 17)] {
            let camera = camera_along_z(width, height, convention);
            for hole in 0..(width * height) as usize {
                let mut depth = vec![ndc(4.0, convention); (width * height) as usize];
                depth[hole] = ndc(16.0, convention);
                assert_eq!(
                    cull_with(&list, &depth, &camera, &CullOptions::default()).verdicts().unwrap(),
                    [VISIBLE]
                );
            }
        }
    }
}

#[test]
fn sample_coverage_drops_what_falls_between_pixel_centres() {
    // Pixel centres are at odd multiples of 1/16 at depth 1.
    // So a speck at x = 0 falls between two of them.
    let list = spheres(&[([0.0, 0.0, 2.0], 0.01), ([2.0 / 16.0, 2.0 / 16.0, 2.0], 0.01)]);
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let wall = [ndc(4.0, DepthConvention::Standard); 256];
    let verdicts = |coverage| {
        cull_with(&list, &wall, &camera, &CullOptions { coverage, ..CullOptions::default() })
            .verdicts()
            .unwrap()
    };
    assert_eq!(verdicts(Coverage::Area), [VISIBLE, VISIBLE]);
    assert_eq!(verdicts(Coverage::Sample), [OUTSIDE, VISIBLE]);
}

/// A box that reaches into a column or row of holes, but not to its samples.
/// It is hidden in sample coverage and visible in area coverage.
/// One that reaches past the samples is visible in both.
/// All four sides are tested.
#[test]
fn holes_are_seen_through_at_their_samples() {
    let verdict =
        |depth: &[f32], camera: &Camera, (min, max): ([f64; 3], [f64; 3]), coverage, guard_px| {
            let options =
                CullOptions { coverage, guard_px: Some(guard_px), ..CullOptions::default() };
            cull_with(&boxes(&[(min, max)]), depth, camera, &options).verdicts().unwrap()[0]
        };
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        for axis in [0, 1] {
            // At depth 8 a pixel is a unit wide: column 8 is x in 0..1, row 7 is y in 0..1.
            let mut depth = [ndc(4.0, convention); 256];
            for i in 0..16 {
                depth[if axis == 0 { 16 * i + 8 } else { 16 * 7 + i }] = convention.far();
            }
            for below in [true, false] {
                let reaching = |far: f64| {
                    let (mut min, mut max) = ([-1.6, -1.6, 8.0], [-0.6, -0.6, 8.0]);
                    (min[axis], max[axis]) = if below { (-1.4, far) } else { (1.0 - far, 2.4) };
                    (min, max)
                };
                for (far, coverage, guard, expected) in [
                    (-0.125, Coverage::Area, 0.0, OCCLUDED),
                    (0.125, Coverage::Area, 0.0, VISIBLE),
                    (0.375, Coverage::Sample, 0.0, OCCLUDED),
                    (0.375, Coverage::Sample, 0.25, VISIBLE),
                    (0.625, Coverage::Sample, 0.0, VISIBLE),
                ] {
                    assert_eq!(
                        verdict(&depth, &camera, reaching(far), coverage, guard),
                        expected,
                        "{convention:?} axis {axis} below {below} reaching {far} \
                         {coverage:?} guard {guard}"
                    );
                }
            }
        }
    }
}

#[test]
fn pyramids_that_do_not_belong_are_refused() {
    let list = spheres(&[([0.0, 0.0, 8.0], 1.0)]);
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let message = |camera: &Camera, pyramid: &Arc<Pyramid>| {
        engine()
            .cull(&list, camera, pyramid, &CullOptions::default(), &Outputs::default())
            .unwrap_err()
            .to_string()
    };
    let never_built = Arc::new(
        engine().context().create_pyramid(camera.size(), &PyramidOptions::default()).unwrap(),
    );
    assert!(message(&camera, &never_built).contains("never was"));
    let pyramid = pyramid_of(&[0.5; 256], &camera);
    let other_size = camera_along_z(SIDE, 8, DepthConvention::Standard);
    assert!(
        message(&other_size, &pyramid).starts_with(
            "camera: expected the camera of the pyramid's depth image, size (height 16"
        )
    );
    let mut moved = camera.clip_from_world();
    moved[0][3] = 1e-9;
    let moved =
        Camera::from_clip_from_world(moved, camera.size(), DepthConvention::Standard).unwrap();
    assert!(message(&moved, &pyramid).contains("got another one"));
    let reversed = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    assert!(message(&reversed, &pyramid).contains("got another one"));
}

/// A pyramid whose reduction was recorded but has not run holds no depth.
/// A cull against it keeps everything.
#[test]
fn a_reduction_that_never_ran_hides_nothing() {
    let list = spheres(&[([0.0, 0.0, 8.0], 1.0), ([0.0, 0.0, 8.0], 0.01)]);
    for convention in CONVENTIONS {
        for (width, height) in [(1, 1), (16, 16)] {
            let camera = camera_along_z(width, height, convention);
            let wall = vec![ndc(4.0, convention); (width * height) as usize];
            let image = engine().upload_depth(&wall, &camera).unwrap();
            let pyramid = Arc::new(
                engine()
                    .context()
                    .create_pyramid(camera.size(), &PyramidOptions::default())
                    .unwrap(),
            );
            let view = image.texture().create_view(&wgpu::TextureViewDescriptor::default());
            let record = || {
                let mut encoder = engine()
                    .device()
                    .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                engine().context().record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
                encoder.finish()
            };
            let verdicts = || {
                let options = CullOptions::default();
                let culling =
                    engine().cull(&list, &camera, &pyramid, &options, &Outputs::default()).unwrap();
                culling.verdicts().unwrap()
            };
            drop(record());
            assert_eq!(verdicts(), [VISIBLE; 2], "never submitted");
            engine().queue().submit([record()]);
            assert_eq!(verdicts(), [OCCLUDED; 2]);
            drop(record());
            assert_eq!(
                verdicts(),
                [VISIBLE; 2],
                "an older reduction than the one that was recorded last"
            );
        }
    }
}

#[test]
fn textures_that_a_view_cannot_tell_apart_are_refused() {
    let camera = camera_along_z(8, 8, DepthConvention::Standard);
    let pyramid =
        engine().context().create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
    let message = |change: &dyn Fn(&mut wgpu::TextureDescriptor<'_>)| {
        let usage = wgpu::TextureUsages::TEXTURE_BINDING;
        let mut descriptor = depth_descriptor((8, 8), wgpu::TextureFormat::R32Float, usage);
        change(&mut descriptor);
        let view = engine()
            .device()
            .create_texture(&descriptor)
            .create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder =
            engine().device().create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        engine()
            .context()
            .record_reduce(&mut encoder, &view, &camera, &pyramid)
            .unwrap_err()
            .to_string()
    };
    assert!(
        message(&|d| d.mip_level_count = 2).contains("expected which of 2 mip levels, got none")
    );
    assert!(message(&|d| d.size.depth_or_array_layers = 3).contains("which of 3 layers"));
    assert!(
        message(&|d| d.usage = wgpu::TextureUsages::COPY_SRC)
            .contains("expected the usage TEXTURE_BINDING")
    );
    let bits = message(&|d| {
        d.format = wgpu::TextureFormat::Rgba32Uint;
        d.size.width = 2;
    });
    assert!(bits.contains("expected the usage STORAGE_BINDING"), "{bits}");
    let unpacked = message(&|d| d.format = wgpu::TextureFormat::Rgba32Uint);
    let whole = "(height 8, width 8)";
    assert_eq!(
        unpacked,
        format!(
            "depth: expected the pyramid's size {whole} as (height 8, width 2) texels \
             of four pixels, got {whole}"
        )
    );
    assert!(message(&|d| d.format = wgpu::TextureFormat::R8Unorm).contains("got R8Unorm"));
    assert!(message(&|d| d.size.width = 4).starts_with("depth: expected the pyramid's size"));
    for chunk_shift in [0, 1, 31, 64] {
        let options =
            PyramidOptions { chunk_shift: Some(chunk_shift), ..PyramidOptions::default() };
        let error = engine().context().create_pyramid(camera.size(), &options).unwrap_err();
        assert!(error.to_string().starts_with("chunk_shift: expected 2 to"), "{error}");
    }
}

/// A lost device is reported as lost, and the next device works.
#[test]
fn a_lost_device_is_an_error_and_the_next_one_works() {
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    for use_it in [0, 1, 2] {
        let doomed = Engine::new(None).unwrap();
        let image = doomed.upload_depth(&[0.5; 256], &camera).unwrap();
        let bounds =
            Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[1.0]) };
        let list = doomed.instances(&bounds, &InstanceOptions::default()).unwrap();
        let pyramid = doomed.pyramid(&image).unwrap();
        doomed.device().destroy();
        let error = match use_it {
            0 => doomed.pyramid(&image).unwrap_err(),
            1 => doomed.instances(&bounds, &InstanceOptions::default()).unwrap_err(),
            _ => doomed
                .cull(&list, &camera, &pyramid, &CullOptions::default(), &Outputs::default())
                .and_then(|c| c.mask())
                .unwrap_err(),
        };
        assert!(matches!(error, Error::DeviceLost(_)), "{use_it}: {error}");
        let next = Engine::new(None).unwrap();
        next.pyramid(&next.upload_depth(&[0.5; 256], &camera).unwrap()).unwrap();
    }
}

#[test]
fn objects_of_another_device_are_refused() {
    let other = Engine::new(None).unwrap();
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let list = spheres(&[([0.0, 0.0, 8.0], 1.0)]);
    let theirs = other.pyramid(&other.upload_depth(&[0.5; 256], &camera).unwrap()).unwrap();
    let error = engine()
        .cull(&list, &camera, &theirs, &CullOptions::default(), &Outputs::default())
        .unwrap_err();
    assert!(
        matches!(error, Error::Mismatch { .. }) && error.to_string().contains("got one of another"),
        "{error}"
    );
    let error = engine().pyramid(&other.upload_depth(&[0.5; 256], &camera).unwrap()).unwrap_err();
    assert!(error.to_string().contains("got one of another"), "{error}");
}

#[test]
fn options_out_of_range_are_refused_by_name() {
    let list = spheres(&[([0.0, 0.0, 8.0], 1.0)]);
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Standard);
    let pyramid = pyramid_of(&[0.5; 256], &camera);
    let message = |options: CullOptions| {
        engine()
            .cull(&list, &camera, &pyramid, &options, &Outputs::default())
            .unwrap_err()
            .to_string()
    };
    let plain = CullOptions::default;
    assert!(
        message(CullOptions { guard_px: Some(0.3), ..plain() })
            .starts_with("guard_px: expected a multiple of 1/256")
    );
    assert!(
        message(CullOptions { guard_px: Some(-1.0), ..plain() })
            .starts_with("guard_px: expected a number in 0..=16")
    );
    assert!(message(CullOptions { depth_slack: f64::NAN, ..plain() }).starts_with("depth_slack:"));
    assert!(
        message(CullOptions { depth_slack_abs: 0.6, ..plain() }).starts_with("depth_slack_abs:")
    );
    assert!(
        message(CullOptions { transform_slack: -1.0, ..plain() }).starts_with("transform_slack:")
    );
}

#[test]
fn depth_slack_moves_the_wall_back_in_both_conventions() {
    // The wall is at depth 4, and the slack is a hundredth.
    // NDC 0.75 becomes 0.7575 (depth 4.12), reversed 0.25 becomes 0.2475 (depth 4.04).
    for (convention, hidden_without, hidden_with) in
        [(DepthConvention::Standard, 4.1, 4.2), (DepthConvention::Reversed, 4.03, 4.1)]
    {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let list = boxes(&[
            ([-1.0, -1.0, hidden_without], [1.0, 1.0, 5.0]),
            ([-1.0, -1.0, hidden_with], [1.0, 1.0, 5.0]),
        ]);
        let wall = [ndc(4.0, convention); 256];
        let verdicts = |depth_slack| {
            cull_with(&list, &wall, &camera, &CullOptions { depth_slack, ..CullOptions::default() })
                .verdicts()
                .unwrap()
        };
        assert_eq!(verdicts(0.0), [OCCLUDED, OCCLUDED], "{convention:?}");
        assert_eq!(verdicts(0.01), [VISIBLE, OCCLUDED], "{convention:?}");
    }
}

#[test]
fn absolute_slack_moves_every_wall_by_the_same_amount() {
    // An orthographic camera whose z from 1 to 9 is depth from 0 to 1, or from 1 to 0.
    // One unit of z is an eighth of depth.
    // A box one unit behind a wall is hidden, and with an absolute slack of 1/8 it is not.
    // A hair farther back it is hidden again, for walls near and far.
    for convention in CONVENTIONS {
        let (slope, constant) = match convention {
            DepthConvention::Standard => (0.125, -0.125),
            DepthConvention::Reversed => (-0.125, 1.125),
        };
        let m = [
            [0.25, 0.0, 0.0, 0.0],
            [0.0, 0.25, 0.0, 0.0],
            [0.0, 0.0, slope, constant],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let camera =
            Camera::from_clip_from_world(m, ImageSize::new(SIDE, SIDE), convention).unwrap();
        for wall_z in [1.5, 4.0, 7.0] {
            let box_at = |z: f64| ([-1.0, -1.0, z], [1.0, 1.0, 9.0]);
            let list =
                boxes(&[box_at(wall_z + 0.01), box_at(wall_z + 1.0), box_at(wall_z + 1.001)]);
            let wall = [(slope * wall_z + constant) as f32; 256];
            let verdicts = |depth_slack_abs| {
                let options =
                    CullOptions { depth_slack: 0.0, depth_slack_abs, ..CullOptions::default() };
                cull_with(&list, &wall, &camera, &options).verdicts().unwrap()
            };
            assert_eq!(verdicts(0.0), [OCCLUDED; 3], "{convention:?} {wall_z}");
            assert_eq!(verdicts(0.125), [VISIBLE, VISIBLE, OCCLUDED], "{convention:?} {wall_z}");
            // The least slack that the cull adds, 2^-23.
            assert_eq!(verdicts(1e-300), [OCCLUDED; 3], "{convention:?} {wall_z}");
        }
    }
}

#[test]
fn slack_and_guard_only_ever_keep_more() {
    // A box a hair behind the wall is hidden without slack and kept with it.
    // A box that ends a quarter pixel beside a hole is kept with a guard.
    let camera = camera_along_z(SIDE, SIDE, DepthConvention::Reversed);
    let wall = [0.25; 256];
    let list = boxes(&[([-1.0, -1.0, 4.01], [1.0, 1.0, 5.0])]);
    let verdict = |depth: &[f32], list: &Arc<Instances>, options: CullOptions| {
        cull_with(list, depth, &camera, &options).verdicts().unwrap()[0]
    };
    assert_eq!(verdict(&wall, &list, CullOptions::default()), OCCLUDED);
    assert_eq!(
        verdict(&wall, &list, CullOptions { depth_slack: 0.01, ..CullOptions::default() }),
        VISIBLE
    );
    assert_eq!(
        verdict(&wall, &list, CullOptions { transform_slack: 1e6, ..CullOptions::default() }),
        VISIBLE
    );
    let mut hole = wall;
    for row in 0..16 {
        hole[row * 16 + 8] = 0.0;
    }
    // At depth 8 a pixel is one unit wide; column 8 begins at x = 0.
    let list = boxes(&[([-1.5, -0.5, 8.0], [-0.25, 0.5, 8.0])]);
    assert_eq!(verdict(&hole, &list, CullOptions::default()), OCCLUDED);
    assert_eq!(
        verdict(&hole, &list, CullOptions { guard_px: Some(0.5), ..CullOptions::default() }),
        VISIBLE
    );
}

#[test]
fn explain_agrees_with_the_verdict_and_names_what_was_read() {
    let list = spheres(&[
        ([0.0, 0.0, 8.0], 1.0),
        ([0.0, 0.0, 2.5], 1.0),
        ([-90.0, 0.0, 4.0], 1.0),
        ([0.0; 3], 2.0),
        ([0.0; 3], -1.0),
    ]);
    for convention in CONVENTIONS {
        let camera = camera_along_z(SIDE, SIDE, convention);
        let wall = [ndc(4.0, convention); 256];
        let culling = cull_with(&list, &wall, &camera, &CullOptions::default());
        let verdicts = culling.verdicts().unwrap();
        let explained: Vec<_> = (0..5).map(|i| culling.explain(i).unwrap()).collect();
        assert_eq!(verdicts, explained.iter().map(|e| e.verdict).collect::<Vec<_>>());
        let hidden = &explained[0];
        // The nearest point is at depth 7.
        // The silhouette spans +-1/sqrt(63) at depth 1, where a pixel is 1/8 wide: pixels 6 to 9.
        assert!((hidden.nearest.unwrap() - f64::from(ndc(7.0, convention))).abs() < 1e-6);
        assert_eq!(hidden.rectangle, Some([6, 6, 9, 9]));
        assert_eq!((hidden.level, hidden.texels.len()), (Some(1), 4));
        assert_eq!(hidden.texels[0], [3, 3]);
        assert_eq!(hidden.farthest, Some(ndc(4.0, convention)));
        assert!(
            explained[2].reason.contains("outside")
                && explained[3].reason.contains("eye")
                && explained[4].reason.contains("finite")
        );
        assert!(culling.explain(5).unwrap_err().to_string().contains("below 5"));
    }
}
