//! Occluder meshes: drawn at any size, relative to the eye, one-sided or two-sided.
//! Also pyramids of textures that were not uploaded.

mod common;

use std::sync::Arc;

use common::{CONVENTIONS, Random, camera_along_z, depth_descriptor, engine, ndc};
use hiz_core::headless::Engine;
use hiz_core::wgpu;
use hiz_core::{
    Camera, ConservativeDepthOptions, DepthConvention, DepthLoad, DrawOptions, FaceCull, Floats,
    ImageSize, MeshData, OccluderOptions, Occluders, Only, Pose, Projection, Pyramid,
    PyramidOptions, Rasteriser, StoredLevels,
};

/// A square at depth `z` from (-r, -r) to (r, r).
/// The camera looks along +z with x right and y up, which makes it left-handed.
/// A triangle that appears counter-clockwise in its image is listed in that order.
fn square(z: f64, r: f64) -> (Vec<f64>, Vec<u32>) {
    (vec![-r, -r, z, r, -r, z, r, r, z, -r, r, z], vec![0, 1, 2, 0, 2, 3])
}

fn draw(
    vertices: &[f64],
    triangles: &[u32],
    transforms: Option<&[f64]>,
    cull_mode: FaceCull,
    camera: &Camera,
) -> Vec<f32> {
    let mesh = MeshData {
        vertices: Floats::F64(vertices),
        triangles,
        transforms: transforms.map(Floats::F64),
    };
    let occluders = engine().occluders(&[mesh], &OccluderOptions { cull_mode }).unwrap();
    let [device, host] = RASTERISERS.map(|which| render(&occluders, camera, which));
    // Both cover the same pixels, with the same depth up to a few roundings.
    for (d, h) in device.iter().zip(&host) {
        let far = camera.convention().far();
        assert!((*d == far) == (*h == far) && (d - h).abs() <= 1e-6, "{d} and {h}");
    }
    device
}

const RASTERISERS: [Rasteriser; 2] = [Rasteriser::Device, Rasteriser::Host];

fn render(occluders: &Occluders, camera: &Camera, rasteriser: Rasteriser) -> Vec<f32> {
    let all = DrawOptions::default();
    let drawn = engine().render_depth_with(occluders, camera, rasteriser, &all).unwrap();
    drawn.0.read().unwrap()
}

/// A camera at the world's `eye` that looks along -z with y up: the usual right-handed one.
fn right_handed(eye: [f64; 3], size: ImageSize, convention: DepthConvention) -> Camera {
    let pose = Pose { eye, target: [eye[0], eye[1], eye[2] - 1.0], up: [0.0, 1.0, 0.0] };
    let fov_y = std::f64::consts::FRAC_PI_2;
    Camera::look_at(
        &pose,
        &Projection::Perspective { fov_y, near: 1.0, far: None, convention },
        size,
    )
    .unwrap()
}

#[test]
fn a_wall_has_its_depth_and_nothing_is_far() {
    for convention in CONVENTIONS {
        for (width, height) in [(1, 1), (1, 9), (16, 16), (37, 23), (640, 360)] {
            let camera = camera_along_z(width, height, convention);
            let (vertices, triangles) = square(4.0, 100.0);
            let depth = draw(&vertices, &triangles, None, FaceCull::None, &camera);
            assert!(
                depth.iter().all(|d| *d == ndc(4.0, convention)),
                "{width}x{height} {convention:?}"
            );
            let nothing = draw(&[], &[], None, FaceCull::None, &camera);
            assert!(nothing.iter().all(|d| *d == convention.far()));
            // Behind the camera and beside the frustum: culled by their bounds.
            for place in [[0.0, 0.0, -20.0], [500.0, 0.0, 0.0]] {
                let moved: Vec<f64> =
                    vertices.iter().enumerate().map(|(i, v)| v + place[i % 3]).collect();
                let depth = draw(&moved, &triangles, None, FaceCull::None, &camera);
                assert!(depth.iter().all(|d| *d == convention.far()));
            }
        }
    }
}

#[test]
fn the_nearer_of_two_walls_wins() {
    for convention in CONVENTIONS {
        let camera = camera_along_z(8, 8, convention);
        // Whichever is drawn first.
        for [(z, r), (next_z, next_r)] in [[(8.0, 100.0), (2.0, 1.0)], [(2.0, 1.0), (8.0, 100.0)]] {
            let (mut vertices, mut triangles) = square(z, r);
            let (next, second) = square(next_z, next_r);
            vertices.extend(next);
            triangles.extend(second.iter().map(|i| i + 4));
            let depth = draw(&vertices, &triangles, None, FaceCull::None, &camera);
            // The near square covers half the image's width and height: pixels 2 to 5.
            for (i, d) in depth.iter().enumerate() {
                let inside = (2..6).contains(&(i % 8)) && (2..6).contains(&(i / 8));
                assert_eq!(*d, ndc(if inside { 2.0 } else { 8.0 }, convention), "pixel {i}");
            }
        }
    }
}

/// Row 0 is the top of the image, where y is greatest, and column 0 the left.
#[test]
fn images_are_the_right_way_up() {
    let camera = right_handed([0.0; 3], ImageSize::new(4, 4), DepthConvention::Reversed);
    let quarter = [0.0, 0.0, -2.0, 2.0, 0.0, -2.0, 2.0, 2.0, -2.0, 0.0, 2.0, -2.0];
    let depth = draw(&quarter, &[0, 1, 2, 0, 2, 3], None, FaceCull::None, &camera);
    let covered: Vec<usize> = (0..16).filter(|i| depth[*i] != 0.0).collect();
    assert_eq!(covered, [2, 3, 6, 7], "the upper right quarter");
}

#[test]
fn faces_are_culled_by_their_orientation_in_the_world() {
    let camera = right_handed([0.0; 3], ImageSize::new(8, 8), DepthConvention::Reversed);
    // Counter-clockwise as seen from +z, which is where the camera is.
    let (vertices, front) = square(-4.0, 100.0);
    let back: Vec<u32> = front.chunks(3).flat_map(|t| [t[0], t[2], t[1]]).collect();
    let mirror = [-1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let seen = |triangles: &[u32], transform: Option<&[f64]>, mode| {
        draw(&vertices, triangles, transform, mode, &camera).iter().all(|d| *d == 0.25)
    };
    assert!(seen(&front, None, FaceCull::None) && seen(&back, None, FaceCull::None));
    assert!(seen(&front, None, FaceCull::Back) && !seen(&back, None, FaceCull::Back));
    assert!(!seen(&front, None, FaceCull::Front) && seen(&back, None, FaceCull::Front));
    // A mirroring transform does not turn a mesh inside out.
    assert!(
        seen(&front, Some(&mirror), FaceCull::Back) && !seen(&back, Some(&mirror), FaceCull::Back)
    );
    // Nor does a left-handed camera: the same faces are seen from the same side.
    let flipped = Camera::from_clip_from_world(
        [[-1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0, 0.0]],
        ImageSize::new(8, 8),
        DepthConvention::Reversed,
    )
    .unwrap();
    let depth = draw(&vertices, &front, None, FaceCull::Back, &flipped);
    assert!(depth.iter().all(|d| *d == 0.25));
}

#[test]
fn transforms_place_a_mesh_many_times() {
    let camera = camera_along_z(8, 8, DepthConvention::Reversed);
    let (vertices, triangles) = square(0.0, 1.0);
    let place = |x: f64, y: f64, z: f64| {
        [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0]
    };
    let transforms = [place(-1.0, 1.0, 2.0), place(1.0, -1.0, 2.0)].concat();
    let depth = draw(&vertices, &triangles, Some(&transforms), FaceCull::None, &camera);
    for (i, d) in depth.iter().enumerate() {
        // The upper left and the lower right quarter.
        let covered = (i % 8 < 4) == (i / 8 < 4);
        assert_eq!(*d, if covered { 0.5 } else { 0.0 }, "pixel {i}");
    }
}

/// A wall may be as far from the origin as the size of a city or a planet.
/// It jitters by no more than float64's own positions do.
#[test]
fn distance_from_the_origin_costs_nothing() {
    let size = ImageSize::new(32, 32);
    for offset in [0.0, 1e3, 1e6, 1e9] {
        let camera = right_handed([offset, -offset, offset], size, DepthConvention::Reversed);
        let vertices: Vec<f64> =
            [[-100.0, -100.0, -4.0], [100.0, -100.0, -4.0], [0.0, 300.0, -4.0]]
                .iter()
                .flat_map(|p| [p[0] + offset, p[1] - offset, p[2] + offset])
                .collect();
        let depth = draw(&vertices, &[0, 1, 2], None, FaceCull::None, &camera);
        assert!(
            depth.iter().all(|d| (d - 0.25).abs() <= 4.0 * f32::EPSILON * 0.25),
            "offset {offset}: {:?}",
            &depth[..4]
        );
    }
}

/// Slanted walls seen from eyes that float32 cannot hold, compared with float64.
/// Checks every pixel's depth, and which pixels are covered.
/// Faults that leave out a half of the eye move the picture by up to half a unit.
#[test]
fn eyes_that_float32_does_not_hold_see_what_float64_says() {
    for rasteriser in RASTERISERS {
        assert_eq!(wrong_pixels(&engine(), rasteriser), 0, "{rasteriser:?}");
    }
    for (what, by) in [
        ("(vertex.lo - copy.eye_lo)", "vertex.lo"),
        ("(vertex.lo - copy.eye_lo)", "(vec3<f32>(0.0) - copy.eye_lo)"),
        (
            "(vertex.hi - copy.eye_hi) + (vertex.lo - copy.eye_lo)",
            "(vertex.hi + vertex.lo) - (copy.eye_hi + copy.eye_lo)",
        ),
        ("dot(copy.clip_x, d)", "dot(copy.clip_x, d) + 0.1 * d.z"),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        assert!(wrong_pixels(&faulty, Rasteriser::Device) > 100, "{what} -> {by}: stayed green");
    }
}

/// Half of the coarsest grid, in pixels, to which Vulkan lets a driver move vertices: 4 bits.
const SNAP_PX: f64 = 1.0 / 32.0;

/// Pixels that differ from float64, among those that are surely covered or surely not.
fn wrong_pixels(engine: &Engine, rasteriser: Rasteriser) -> usize {
    let size = ImageSize::new(40, 24);
    // 1 / z = (1 - u / 2 - v / 4) / 4, and a pixel is 2 / 24 wide and high in u and v.
    let step = (0.5 + 0.25) * 2.0 / f64::from(size.height) / 4.0;
    let tolerance = 2e-6 + SNAP_PX * step;
    let mut wrong = 0;
    for convention in CONVENTIONS {
        for eye in [
            [1e6 + 0.3, -1e6 - 0.7, 1e6 + 0.1],
            [0.3, 1e7 + 0.45, -1e5 - 0.01],
            [-3e7 - 1.3, 0.7, 2e6 + 0.6],
        ] {
            let camera = right_handed(eye, size, convention);
            // A quadrangle that recedes to the right and upwards.
            // Its depth is 4 + 0.5 x + 0.25 y, and x and y end at 2 and 1.
            let (right, top) = (2.0, 1.0);
            let depth = |x: f64, y: f64| 4.0 + 0.5 * x + 0.25 * y;
            let corner = |x: f64, y: f64| [eye[0] + x, eye[1] + y, eye[2] - depth(x, y)];
            let vertices =
                [corner(-9.0, -9.0), corner(right, -9.0), corner(right, top), corner(-9.0, top)]
                    .concat();
            let mesh = MeshData {
                vertices: Floats::F64(&vertices),
                triangles: &[0, 1, 2, 0, 2, 3],
                transforms: None,
            };
            let occluders = engine.occluders(&[mesh], &OccluderOptions::default()).unwrap();
            let all = DrawOptions::default();
            let drawn = engine.render_depth_with(&occluders, &camera, rasteriser, &all).unwrap();
            for (i, got) in (0..).zip(drawn.0.read().unwrap()) {
                // The field of view is 90 degrees high.
                // The ray through a pixel's centre is (u, v, 1).
                // It meets the plane at z = 4 / (1 - u / 2 - v / 4).
                let [w, h] = [size.width, size.height].map(f64::from);
                let u = (2.0 * (f64::from(i % size.width) + 0.5) / w - 1.0) * w / h;
                let v = 1.0 - 2.0 * (f64::from(i / size.width) + 0.5) / h;
                let z = 4.0 / (1.0 - 0.5 * u - 0.25 * v);
                let (x, y) = (u * z, v * z);
                // The left and lower corners are in front of the plane z = 1, or outside the image.
                let beyond = (x - right).max(y - top);
                let expected =
                    if beyond > 0.0 { f64::from(convention.far()) } else { ndc64(z, convention) };
                let is_near = beyond.abs() < 0.02 || z < 1.1;
                wrong += usize::from(!is_near && (f64::from(got) - expected).abs() > tolerance);
            }
        }
    }
    wrong
}

fn ndc64(z: f64, convention: DepthConvention) -> f64 {
    if convention.is_reversed() { 1.0 / z } else { 1.0 - 1.0 / z }
}

#[test]
fn bad_meshes_are_refused_by_name() {
    let message = |vertices: &[f64], triangles: &[u32], transforms: Option<&[f64]>| {
        let mesh = MeshData {
            vertices: Floats::F64(vertices),
            triangles,
            transforms: transforms.map(Floats::F64),
        };
        engine().occluders(&[mesh], &OccluderOptions::default()).unwrap_err().to_string()
    };
    assert!(message(&[0.0; 4], &[], None).starts_with("vertices: expected 3 numbers a vertex"));
    assert!(message(&[0.0; 9], &[0, 1], None).starts_with("triangles: expected 3 indices"));
    assert!(
        message(&[0.0; 9], &[0, 1, 3], None).contains("below the 3 vertices, got 3 in triangle 0")
    );
    assert!(
        message(&[f64::NAN; 9], &[0, 1, 2], None)
            .starts_with("vertices: expected finite positions")
    );
    assert!(
        message(&[0.0; 9], &[0, 1, 2], Some(&[1.0; 15]))
            .starts_with("transforms: expected 16 numbers")
    );
    assert!(message(&[0.0; 9], &[0, 1, 2], Some(&[1.0; 16])).contains("last row"));
}

/// The pyramid of a depth texture holds what the rasteriser left, bit for bit.
#[test]
fn pyramids_of_rendered_depth_are_bit_exact() {
    let mut random = Random(8);
    let vertices: Vec<f64> = (0..300 * 3)
        .flat_map(|_| [random.range(-6.0, 6.0), random.range(-6.0, 6.0), random.range(0.5, 9.0)])
        .collect();
    let triangles: Vec<u32> = (0..900).collect();
    let mesh =
        MeshData { vertices: Floats::F64(&vertices), triangles: &triangles, transforms: None };
    let occluders = engine().occluders(&[mesh], &OccluderOptions::default()).unwrap();
    for convention in CONVENTIONS {
        for (width, height) in [(1, 1), (2, 3), (17, 31), (640, 360), (1001, 563)] {
            let camera = camera_along_z(width, height, convention);
            for rasteriser in RASTERISERS {
                let all = DrawOptions::default();
                let drawn = engine().render_depth_with(&occluders, &camera, rasteriser, &all);
                let (image, _) = drawn.unwrap();
                let depth = image.read().unwrap();
                let pyramid = engine().pyramid(&image).unwrap();
                let levels = hiz_ref::pyramid(&depth, width, height, convention.is_reversed());
                for (k, level) in levels.iter().enumerate() {
                    assert_eq!(
                        engine().read_level(&pyramid, k as u32).unwrap(),
                        level.texels,
                        "{rasteriser:?} {width}x{height} level {k}"
                    );
                }
            }
        }
    }
}

/// A caller's own `R32Float` texture.
#[test]
fn pyramids_of_float_textures_are_bit_exact() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let mut random = Random(9);
    for (width, height) in [(5, 7), (65, 33)] {
        let depth: Vec<f32> = (0..width * height).map(|_| random.unit() as f32).collect();
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let usage = wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_DST
            | wgpu::TextureUsages::COPY_SRC;
        let format = wgpu::TextureFormat::R32Float;
        let texture = device.create_texture(&depth_descriptor((width, height), format, usage));
        let layout = wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * width),
            rows_per_image: None,
        };
        let bytes: Vec<u8> = depth.iter().flat_map(|d| d.to_le_bytes()).collect();
        queue.write_texture(texture.as_image_copy(), &bytes, layout, extent);
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        for convention in CONVENTIONS {
            let camera = camera_along_z(width, height, convention);
            for levels in LEVELS {
                let options = PyramidOptions { levels, ..PyramidOptions::default() };
                let pyramid = engine.context().create_pyramid(camera.size(), &options).unwrap();
                let mut encoder =
                    device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                engine.context().record_reduce(&mut encoder, &view, &camera, &pyramid).unwrap();
                queue.submit([encoder.finish()]);
                assert_levels(&pyramid, &depth, convention);
            }
            let pyramid =
                engine.context().create_pyramid(camera.size(), &PyramidOptions::default()).unwrap();
            let other = camera_along_z(width + 1, height, convention);
            let mut encoder =
                device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let error =
                engine.context().record_reduce(&mut encoder, &view, &other, &pyramid).unwrap_err();
            assert!(
                error.to_string().starts_with("camera: expected the depth image's size"),
                "{error}"
            );
        }
    }
}

/// One choice of levels for each kind of dispatch:
///
/// - all levels;
/// - without the fine ones;
/// - a coarse level with one invocation per texel;
/// - a coarse level with one workgroup per texel.
const LEVELS: [StoredLevels; 5] = [
    StoredLevels::ALL,
    StoredLevels::from(2),
    StoredLevels::only(3),
    StoredLevels::from(4),
    StoredLevels::only(6),
];

/// Asserts that the stored levels are the oracle's.
fn assert_levels(pyramid: &Pyramid, depth: &[f32], convention: DepthConvention) {
    let ImageSize { width, height } = pyramid.size();
    for (k, level) in
        hiz_ref::pyramid(depth, width, height, convention.is_reversed()).iter().enumerate()
    {
        if k == 0
            || pyramid.stored_levels().is_some_and(|s| (s.first..=s.last).contains(&(k as u32)))
        {
            let texels = engine().read_level(pyramid, k as u32).unwrap();
            assert_eq!(
                texels,
                level.texels,
                "{width}x{height} level {k} of {:?}",
                pyramid.stored_levels()
            );
        }
    }
}

/// A rendered depth texture, in sizes that leave partial blocks on both sides.
#[test]
fn depth_textures_are_reduced_to_the_chosen_levels() {
    let mut random = common::Random(9);
    let vertices: Vec<f64> = (0..900)
        .map(|i| if i % 3 == 2 { random.range(1.5, 30.0) } else { random.range(-9.0, 9.0) })
        .collect();
    let triangles: Vec<u32> = (0..300).collect();
    let mesh =
        MeshData { vertices: Floats::F64(&vertices), triangles: &triangles, transforms: None };
    let occluders = engine().occluders(&[mesh], &OccluderOptions::default()).unwrap();
    for (width, height) in [(1, 1), (1, 83), (89, 1), (64, 65), (127, 129), (401, 233)] {
        for convention in CONVENTIONS {
            let camera = camera_along_z(width, height, convention);
            let all = DrawOptions::default();
            let drawn = engine().render_depth_with(&occluders, &camera, Rasteriser::Device, &all);
            let (image, _) = drawn.unwrap();
            let depth = image.read().unwrap();
            for levels in LEVELS {
                let options = PyramidOptions { levels, ..PyramidOptions::default() };
                assert_levels(
                    &engine().pyramid_with(&image, &options).unwrap(),
                    &depth,
                    convention,
                );
            }
        }
    }
}

/// Walls one behind the other, each a mesh in three places: in the middle, and at `aside` times its
/// distance to either side.
fn walls(aside: f64) -> Arc<Occluders> {
    let (vertices, triangles) = square(0.0, 1.0);
    let places: Vec<Vec<f64>> = [2.0, 4.0, 8.0]
        .iter()
        .map(|z| {
            [-1.0, 0.0, 1.0]
                .iter()
                .flat_map(|x| place(x * aside * z, 0.0, *z).into_iter())
                .collect::<Vec<f64>>()
        })
        .collect();
    let meshes: Vec<MeshData<'_>> = places
        .iter()
        .map(|places| MeshData {
            vertices: Floats::F64(&vertices),
            triangles: &triangles,
            transforms: Some(Floats::F64(places)),
        })
        .collect();
    engine().occluders(&meshes, &OccluderOptions::default()).unwrap()
}

fn place(x: f64, y: f64, z: f64) -> [f64; 16] {
    [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, y, 0.0, 0.0, 1.0, z, 0.0, 0.0, 0.0, 1.0]
}

/// Copies are numbered through all meshes, and drawing them one after the other gives the image of
/// all, whichever come first.
#[test]
fn chosen_copies_are_added_to_an_image() {
    let walls = walls(1.0);
    for rasteriser in RASTERISERS {
        for convention in CONVENTIONS {
            let camera = camera_along_z(90, 60, convention);
            let all = render(&walls, &camera, rasteriser);
            let (early, late) = ([8_u32, 0, 4, 0], [1, 2, 3, 5, 6, 7]);
            let only = |list| DrawOptions { only: Only::Listed(list), ..DrawOptions::default() };
            let (image, touched) =
                engine().render_depth_with(&walls, &camera, rasteriser, &only(&early)).unwrap();
            let before = image.read().unwrap();
            assert!(before != all, "{rasteriser:?}");
            assert!(covered(&before, 90, convention).is_some_and(|is| contains(touched, is)));
            // A mask says the same as a list.
            let mask: Vec<bool> = (0..9).map(|i| early.contains(&i)).collect();
            let masked = DrawOptions { only: Only::Masked(&mask), ..DrawOptions::default() };
            let (by_mask, _) =
                engine().render_depth_with(&walls, &camera, rasteriser, &masked).unwrap();
            assert!(by_mask.read().unwrap() == before);
            // The pyramid follows the image.
            let more = DrawOptions { load: DepthLoad::Load, ..only(&late) };
            engine().render_depth_into(&image, &walls, &more).unwrap();
            assert!(image.read().unwrap() == all, "{rasteriser:?}");
            let pyramid = engine().pyramid(&image).unwrap();
            assert!(engine().read_level(&pyramid, 0).unwrap() == all);
            // Nothing changes outside of the rectangle that one more copy touches.
            engine().render_depth_into(&image, &walls, &only(&[8])).unwrap();
            let before = image.read().unwrap();
            let one = DrawOptions { load: DepthLoad::Load, ..only(&[0]) };
            let touched = engine().render_depth_into(&image, &walls, &one).unwrap();
            let after = image.read().unwrap();
            let changed: Vec<f32> = before
                .iter()
                .zip(&after)
                .map(|(b, a)| if a == b { convention.far() } else { 0.5 })
                .collect();
            let changed = covered(&changed, 90, convention).expect("the nearest wall shows");
            assert!(contains(touched, changed), "{touched:?} around {changed:?}");
            assert!(touched.unwrap()[2] < 60, "the left third, not {touched:?}");
            // And nothing at all if nothing is drawn.
            let none = DrawOptions { load: DepthLoad::Load, ..only(&[]) };
            assert_eq!(engine().render_depth_into(&image, &walls, &none).unwrap(), None);
            assert!(image.read().unwrap() == after);
        }
    }
}

/// The rectangle around the pixels that are not far.
fn covered(depth: &[f32], width: usize, convention: DepthConvention) -> Option<[u32; 4]> {
    let places = depth.iter().enumerate().filter(|(_, d)| **d != convention.far());
    places.fold(None, |all, (i, _)| {
        let (x, y) = ((i % width) as u32, (i / width) as u32);
        let [x0, y0, x1, y1] = all.unwrap_or([x, y, x, y]);
        Some([x0.min(x), y0.min(y), x1.max(x), y1.max(y)])
    })
}

fn contains(outer: Option<[u32; 4]>, inner: [u32; 4]) -> bool {
    outer.is_some_and(|o| {
        o[0] <= inner[0] && o[1] <= inner[1] && o[2] >= inner[2] && o[3] >= inner[3]
    })
}

#[test]
fn copies_that_do_not_exist_are_refused() {
    let walls = walls(1.0);
    let camera = camera_along_z(8, 8, DepthConvention::Reversed);
    for rasteriser in RASTERISERS {
        let refused = |only| {
            let options = DrawOptions { only, ..DrawOptions::default() };
            let drawn = engine().render_depth_with(&walls, &camera, rasteriser, &options);
            drawn.unwrap_err().to_string()
        };
        assert_eq!(refused(Only::Listed(&[3, 9])), "only: expected numbers of the 9 copies, got 9");
        assert_eq!(
            refused(Only::Masked(&[true; 4])),
            "only: expected one place for each of the 9 copies, got 4"
        );
    }
    let uploaded = engine().upload_depth(&[0.0; 64], &camera).unwrap();
    let error = engine().render_depth_into(&uploaded, &walls, &DrawOptions::default());
    assert_eq!(
        error.unwrap_err().to_string(),
        "depth: expected an image that occluders were drawn into, got an uploaded one"
    );
}

/// A mesh that moves is seen where a new upload of it would be, by both rasterisers and in
/// conservative depth.
#[test]
fn moved_meshes_stand_where_their_matrices_say() {
    let mut random = Random(77);
    let camera = camera_along_z(64, 48, DepthConvention::Reversed);
    let vertices: Vec<f64> = (0..90).map(|_| random.range(-1.0, 1.0)).collect();
    let triangles: Vec<u32> = (0..30).collect();
    let conservative = |occluders: &Occluders| {
        let options = ConservativeDepthOptions::default();
        occluders.surface().conservative_depth(&camera, &options).unwrap()
    };
    let made = |places: &[f64]| {
        let still = place(0.0, 0.0, 9.0);
        let mesh = |transforms| MeshData {
            vertices: Floats::F64(&vertices),
            triangles: &triangles,
            transforms: Some(Floats::F64(transforms)),
        };
        let meshes = [mesh(&still), mesh(places), mesh(&still)];
        engine().occluders(&meshes, &OccluderOptions::default()).unwrap()
    };
    let moving = made(&place(0.0, 0.0, 3.0));
    conservative(&moving);
    for round in 0..6 {
        // Turned, mirrored, stretched, doubled and taken away.
        let count = [1, 1, 2, 0, 3, 1][round];
        let places: Vec<f64> = (0..count)
            .flat_map(|_| {
                let mut m: [f64; 16] = std::array::from_fn(|_| random.range(-1.5, 1.5));
                m[12..].copy_from_slice(&[0.0, 0.0, 0.0, 1.0]);
                m[11] += 4.0;
                m
            })
            .collect();
        moving.move_mesh(1, Some(Floats::F64(&places))).unwrap();
        let fresh = made(&places);
        assert_eq!(moving.num_parts(), count + 2);
        for rasteriser in RASTERISERS {
            let (seen, expected) =
                (render(&moving, &camera, rasteriser), render(&fresh, &camera, rasteriser));
            assert!(seen == expected, "{rasteriser:?}, round {round}");
        }
        assert!(conservative(&moving) == conservative(&fresh), "round {round}");
    }
    let error = moving.move_mesh(3, None).unwrap_err().to_string();
    assert_eq!(error, "mesh: expected the number of one of the 3 meshes, got 3");
    let before = render(&moving, &camera, Rasteriser::Host);
    assert!(moving.move_mesh(1, Some(Floats::F64(&[f64::NAN; 16]))).is_err());
    assert!(render(&moving, &camera, Rasteriser::Host) == before);
}

/// Limits leave the largest, and never show what is not there.
#[test]
fn limits_leave_what_is_large_in_the_image() {
    // All in view, so that the nearest three have the largest solid angles.
    let walls = walls(0.5);
    let camera = camera_along_z(90, 60, DepthConvention::Reversed);
    for rasteriser in RASTERISERS {
        let limited = |max_triangles, max_copies| {
            let options = DrawOptions { max_triangles, max_copies, ..DrawOptions::default() };
            let drawn = engine().render_depth_with(&walls, &camera, rasteriser, &options);
            drawn.unwrap().0.read().unwrap()
        };
        let nearest = DrawOptions { only: Only::Listed(&[0, 1, 2]), ..DrawOptions::default() };
        let drawn = engine().render_depth_with(&walls, &camera, rasteriser, &nearest).unwrap();
        let nearest = drawn.0.read().unwrap();
        assert!(limited(Some(6), None) == nearest, "{rasteriser:?}");
        assert!(limited(None, Some(3)) == nearest, "{rasteriser:?}");
        assert!(limited(Some(18), Some(9)) == render(&walls, &camera, rasteriser));
        assert!(limited(Some(1), None).iter().all(|d| *d == 0.0));
        assert!(limited(None, Some(0)).iter().all(|d| *d == 0.0));
    }
}

/// Images are lent again once they are dropped, and never while anything still reads them.
#[test]
fn images_stay_as_they_are_while_a_pyramid_or_a_handle_is_left() {
    let walls = walls(1.0);
    for rasteriser in RASTERISERS {
        let camera = camera_along_z(321, 200, DepthConvention::Reversed);
        let shown = |list: &[u32]| {
            let options = DrawOptions { only: Only::Listed(list), ..DrawOptions::default() };
            engine().render_depth_with(&walls, &camera, rasteriser, &options).unwrap().0
        };
        let first = shown(&[0, 4]);
        let expected = first.read().unwrap();
        let pyramid = engine().pyramid(&first).unwrap();
        let kept = first.clone();
        drop(first);
        // Every image of the same size that is made meanwhile is another one.
        let others: Vec<_> = [[1_u32], [2], [8]].iter().map(|one| shown(one)).collect();
        assert!(kept.read().unwrap() == expected);
        drop(kept);
        drop(others);
        for one in [[1_u32], [2], [8], [7]] {
            shown(&one);
        }
        assert!(engine().read_level(&pyramid, 0).unwrap() == expected, "the pyramid's level 0");
        drop(pyramid);
        let seen = shown(&[3]);
        let texture = seen.texture().clone();
        drop(seen);
        for one in [[1_u32], [2], [8], [7]] {
            assert!(*shown(&one).texture() != texture);
        }
    }
}

/// A drawing that is refused changes nothing, so that what is added later meets no older rows.
#[test]
fn refused_drawings_leave_an_image_as_it_was() {
    let walls = walls(1.0);
    let camera = camera_along_z(90, 60, DepthConvention::Reversed);
    for rasteriser in RASTERISERS {
        let only =
            |load, list| DrawOptions { load, only: Only::Listed(list), ..Default::default() };
        let first = only(DepthLoad::Clear, &[0, 4]);
        let (image, _) = engine().render_depth_with(&walls, &camera, rasteriser, &first).unwrap();
        let refused = only(DepthLoad::Clear, &[99]);
        assert!(engine().render_depth_into(&image, &walls, &refused).is_err());
        engine().render_depth_into(&image, &walls, &only(DepthLoad::Load, &[8])).unwrap();
        let all = only(DepthLoad::Clear, &[0, 4, 8]);
        let (expected, _) = engine().render_depth_with(&walls, &camera, rasteriser, &all).unwrap();
        assert!(image.read().unwrap() == expected.read().unwrap(), "{rasteriser:?}");
    }
}
