//! Runs the examples `drop_in`, `simple`, `frames`, `every_way`, `particles`, `reflections` and
//! `own_culling`; `tests/renderer.rs` runs the other renderer.

mod common;
#[path = "../examples/drop_in/main.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod drop_in;
#[path = "../examples/every_way.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod every_way;
#[path = "../examples/frames.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod frames;
#[path = "../examples/own_culling.rs"]
#[allow(dead_code, reason = "the program's own report")]
mod own_culling;
#[path = "../examples/particles/particles.rs"]
#[allow(dead_code, reason = "the report of the program")]
mod particles;
#[path = "../examples/reflections.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod reflections;
#[path = "../examples/simple.rs"]
#[allow(dead_code, reason = "the program's own device, and its report")]
mod simple;

use common::engine;
use hiz_core::wgpu::{self, util::DownloadBuffer};
use hiz_core::{DrawIndexedIndirect, DrawIndirect, EarlySet, ImageSize, Visible};

/// 256 pixels of one byte: as many as `copy_texture_to_buffer` wants in a row.
const SIDE: u32 = 256;

/// The bytes of `buffer`.
fn read(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &wgpu::Buffer) -> Vec<u8> {
    let (told, answer) = std::sync::mpsc::channel();
    DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytes.expect("a small buffer can be read").to_vec()).expect("it is waited for");
    });
    device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
    answer.recv().expect("the callback ran")
}

/// The bytes of a picture of 256 x 256 pixels.
fn read_picture(device: &wgpu::Device, queue: &wgpu::Queue, picture: &wgpu::Texture) -> Vec<u8> {
    let texel = picture.format().block_copy_size(None).expect("one plane");
    let pixels = device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(SIDE * SIDE * texel),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let bytes_per_row = Some(SIDE * texel);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    encoder.copy_texture_to_buffer(
        picture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &pixels, layout },
        picture.size(),
    );
    queue.submit([encoder.finish()]);
    read(device, queue, &pixels)
}

/// A metre at 16 m is 8 pixels of the 256, because the view is 90 degrees wide.
/// So a square of half a metre covers 4 x 4 pixels, and the wall ends at column 128.
/// Of the 20 x 20 boxes, the 10 columns left of the middle are behind the wall.
#[test]
fn simple_draws_what_the_wall_does_not_hide() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let (picture, visible) = simple::draw_frame(device, queue).unwrap();

    let draws = read(device, queue, visible.draw_arguments().unwrap());
    let draws: Vec<DrawIndexedIndirect> = bytemuck::pod_collect_to_vec(&draws);
    let draw = DrawIndexedIndirect { index_count: 6, instance_count: 200, ..Default::default() };
    assert_eq!(draws, [draw]);

    let pixels = read_picture(device, queue, &picture);
    for (i, pixel) in (0_u32..).zip(&pixels) {
        let (column, row) = (i % SIDE, i / SIDE);
        // From the middle, squares cover pixels 2 to 5 of every 8, and there are 10 each way.
        let in_square = |at: u32| (2..6).contains(&(at % 8)) && (48..208).contains(&at);
        let expected = column >= 128 && in_square(column) && in_square(row);
        assert_eq!(*pixel > 0, expected, "pixel {column}, {row}");
    }
}

/// The program itself, on a device that it opens.
#[test]
fn simple_runs() {
    simple::main().unwrap();
}

/// The renderer and what culling adds to it are as short as their page says.
#[test]
fn drop_in_is_short() {
    let of = |text: &str| text.lines().count();
    assert!(of(include_str!("../examples/drop_in/app.rs")) <= 100);
    assert!(of(include_str!("../examples/drop_in/culling.rs")) <= 100);
}

/// Few crates are drawn, and yet each pixel is that of a frame that draws all of them.
/// The shader by hand draws about as many, so it is a cull, too; what it loses is counted by depth.
#[test]
fn drop_in_draws_the_picture_of_all_crates() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let [street, above] = drop_in::culling::VIEWS.map(|(name, view)| {
        let town = drop_in::culling::Town::new(device, queue, view).unwrap();
        let [all, hizvk, own] = drop_in::compare(&town, device, queue, 1).unwrap();
        assert!(all.picture == hizvk.picture && all.depth == hizvk.depth, "{name}: they differ");
        assert_eq!((drop_in::other_pixels(&all, &hizvk), drop_in::holes(&all, &hizvk)), (0, 0));
        (town, all, hizvk, own)
    });
    let [low, high] = [&street, &above].map(|(_, _, hizvk, own)| hizvk.drawn.min(own.drawn));
    assert!(high > 5 * low, "{low} and {high} drawn");
    let (town, all, hizvk, own) = street;
    // Without any crate the picture is another one, so the crates that were drawn show in it.
    let mut encoder = device.create_command_encoder(&Default::default());
    let houses = drop_in::culling::HOUSES;
    town.app.pass(&mut encoder, true).draw_indexed(0..14, 0, houses);
    queue.submit([encoder.finish()]);
    let picture = drop_in::read_texture(device, queue, &town.app.picture).unwrap();
    let depth = drop_in::read_texture(device, queue, &town.app.depth).unwrap();
    let depth = bytemuck::pod_collect_to_vec(&depth);
    let houses = drop_in::Row { ms: 0.0, drawn: 0, picture, depth };
    let [other, shown] = [drop_in::other_pixels, drop_in::holes].map(|of| of(&all, &houses));
    let (few, lost) = (drop_in::culling::CRATES / 10, drop_in::holes(&all, &own));
    println!("{} and {} crates drawn, {shown} pixels show crates", hizvk.drawn, own.drawn);
    println!("by hand: {} other pixels, {lost} too far", drop_in::other_pixels(&all, &own));
    assert!(shown > 1000 && other > 1000, "{shown}, {other} pixels");
    assert!(hizvk.drawn > 100 && hizvk.drawn < few, "{} drawn", hizvk.drawn);
    assert!(own.drawn > 100 && own.drawn < few, "{} drawn by hand", own.drawn);
    assert!(lost < shown / 20, "{lost} pixels lost by hand");
    // No way draws nearer than all do.
    assert!([&hizvk, &own].iter().all(|row| drop_in::holes(row, &all) == 0));
    assert!([&all, &hizvk, &own].iter().all(|row| row.ms > 0.0));
}

/// Two passes give depth and picture of all discs, bit for bit, and draw fewer.
///
/// Row r lies at depth 4 + 1.4 r, and its discs reach 0.2 towards the eye.
/// A polygon of n corners is off by 0.2 (1 - cos(pi / n)), and G is 128 sqrt(3).
/// At half a pixel, 8 corners will do beyond 6.75, and 4 beyond 25.97.
/// So rows 0 to 2 have the first level, rows 3 to 15 the second, and the last four the third.
#[test]
fn frames_draw_the_picture_of_all_discs() {
    let engine = engine();
    let (device, queue) = (engine.device(), engine.queue());
    let counts = |visible: &Visible| {
        let draws = read(device, queue, visible.draw_arguments().unwrap());
        let draws: Vec<DrawIndirect> = bytemuck::pod_collect_to_vec(&draws);
        draws.into_iter().map(|draw| draw.instance_count).collect::<Vec<u32>>()
    };
    // Everything is larger than nothing, so the early pass draws all.
    let all = EarlySet::Largest { pixels: 0 };
    let drawn = [all, EarlySet::LastVisible].map(|set| {
        let (targets, passes) = frames::draw_frames(device, queue, set).unwrap();
        let targets = targets.map(|target| read_picture(device, queue, &target));
        (targets, counts(passes.early()), counts(passes.late()))
    });
    let [(expected, of_all, _), (got, early, late)] = drawn;
    assert!(got == expected, "depth or picture differ");
    assert!(expected[1].iter().any(|pixel| *pixel > 0), "nothing is drawn");
    assert_eq!(of_all, [60, 260, 80, 1, 0, 0]);
    assert_eq!(late, [0; 6], "nothing has come into view");
    // The diamond hides discs of each row in the middle, and no others.
    let hidden: Vec<u32> = of_all.iter().zip(&early).map(|(all, early)| all - early).collect();
    assert!(
        hidden[0] < 60 && hidden[1] > 30 && hidden[2] < 80 && hidden[3..] == [0; 3],
        "{early:?}"
    );
}

/// The program itself, on a device that it opens.
#[test]
fn frames_runs() {
    frames::main().unwrap();
}

/// Things of even numbers stand before the wall, or beside the roof; the others are hidden.
#[test]
fn every_way_takes_one_submission_and_one_readback() {
    let engine = engine();
    let frame = every_way::run(engine.device(), engine.queue()).unwrap();
    assert_eq!((frame.submissions, frame.readbacks), (1, 1));
    let expected = |count: usize| (0..count).map(|i| i % 2 == 0).collect::<Vec<_>>();
    assert_eq!((frame.lights.len(), frame.particles.len()), (3, 3));
    assert!(frame.lights.iter().all(|seen| *seen == expected(every_way::LIGHTS)));
    assert!(frame.particles.iter().all(|seen| *seen == expected(every_way::PARTICLES)));
    assert_eq!(frame.casters, expected(every_way::CASTERS));
}

/// The picture does not depend on the coarse level, unless its ends are wrong.
#[test]
fn particles_are_the_same_with_a_coarse_level() {
    let engine = engine();
    let run = |level, soft, faults: &[_]| {
        let size = ImageSize::new(211, 97);
        let setup = particles::Setup { size, particles: 40_000, level, soft, rounds: 0 };
        particles::run(engine.device(), engine.queue(), setup, faults).unwrap()
    };
    for (level, soft) in [(1, false), (2, false), (3, false), (4, false), (2, true), (4, true)] {
        let found = run(level, soft, &[]);
        assert!(found.pictures[0] == found.pictures[1], "level {level}, {soft}");
        assert!(found.pictures[0].iter().any(|sum| *sum > 0));
        let [all, before, behind] = found.counts;
        assert!(before > 0 && behind > 0 && before + behind <= all, "{level}: {:?}", found.counts);
        // Each particle in the image is decided by one of the three.
        assert!(level > 2 || found.skipped() > 0.4, "level {level}: {}", found.skipped());
    }
    let swapped = [
        ("ndc.z > nearest[view.nearest + word]", "ndc.z > farthest[view.farthest + word]"),
        ("ndc.z <= farthest[view.farthest + word]", "ndc.z <= nearest[view.nearest + word]"),
        ("all(last == texel) && ", ""),
        ("view.step * texel.x;", "texel.x;"),
        ("view.step * texel.x;", "view.step * (texel.x + 1u);"),
    ];
    for fault in swapped {
        let found = run(2, true, &[fault]);
        assert!(found.pictures[0] != found.pictures[1], "{fault:?}");
    }
}

/// The pixel that a ray hits, by a march from pixel to pixel in float64.
fn first_pixel_in_front(frame: &reflections::Frame, ray: &reflections::Ray) -> u32 {
    let [begin, change] =
        [ray.begin, ray.change].map(|v| [f64::from(v[0]), f64::from(v[1]), f64::from(v[2])]);
    let (width, height) = (i64::from(frame.size.width), i64::from(frame.size.height));
    if change[1] == 0.0 {
        return reflections::NONE;
    }
    let mut pixel = [begin[0].floor() as i64, begin[1].floor() as i64];
    let mut time = 0.0;
    for steps in 0.. {
        let border = |k: usize| {
            let at = pixel[k] + i64::from(change[k] > 0.0);
            if change[k] == 0.0 { f64::INFINITY } else { (at as f64 - begin[k]) / change[k] }
        };
        let [of_column, of_row] = [border(0), border(1)];
        let left = of_column.min(of_row);
        let depth = |t: f64| begin[2] + t * change[2];
        let index = pixel[1] * width + pixel[0];
        let farthest = depth(time).min(depth(left.min(1.0)));
        if steps > 0 && farthest < f64::from(frame.depth[index as usize]) {
            return index as u32;
        }
        let k = usize::from(of_row < of_column);
        pixel[k] += if change[k] > 0.0 { 1 } else { -1 };
        time = left;
        if left >= 1.0 || !(0..width).contains(&pixel[0]) || !(0..height).contains(&pixel[1]) {
            break;
        }
    }
    reflections::NONE
}

/// The march through the levels hits what a march from pixel to pixel hits, for every pixel.
#[test]
fn reflections_hit_the_first_pixel_in_front() {
    let engine = engine();
    for (width, height) in [(160, 90), (203, 121)] {
        let frame = reflections::draw(hiz_core::ImageSize::new(width, height));
        let hits = reflections::trace(engine.device(), engine.queue(), &frame).unwrap();
        let expected: Vec<u32> =
            frame.rays.iter().map(|ray| first_pixel_in_front(&frame, ray)).collect();
        let differ = hits.iter().zip(&expected).filter(|(found, hit)| found[0] != **hit).count();
        let rays = frame.rays.iter().filter(|ray| ray.change[1] != 0.0).count();
        let found = expected.iter().filter(|hit| **hit != reflections::NONE).count();
        let looked: u32 = hits.iter().map(|[_, looked]| looked).sum();
        println!(
            "{width} x {height}: {rays} rays, {found} hits, {differ} differ, {:.1} texels per ray",
            f64::from(looked) / rays as f64
        );
        assert_eq!(differ, 0);
        assert!(rays > 5000 && found > 1000 && found + 1000 < rays, "{rays} rays, {found} hits");
        let picture = reflections::picture(&frame, &hits);
        assert_eq!(picture.len(), 3 * frame.depth.len());
    }
}

/// The certified cull hides nothing that shows; a shader without certificates does so far away from
/// the origin, where float32 positions are coarse.
#[test]
fn own_culling_is_compared_with_the_certified_cull() {
    let engine = engine();
    let mut of_own = Vec::new();
    for (name, place) in own_culling::PLACES {
        let rows = own_culling::compare(&engine, place, 3000).unwrap();
        println!("{name}: {rows:?}");
        let [each, groups, own] = rows.try_into().expect("three ways");
        assert_eq!((each.false_culls, groups.false_culls), (0, 0), "{name}");
        assert_eq!(each.kept, groups.kept, "{name}");
        assert!(each.kept > 100 && each.kept < 2500, "{name}: {each:?}");
        of_own.push(own);
    }
    // Near the origin it is a cull, not noise.
    let near = of_own[0].kept;
    assert!(near > 100 && near < 2500, "{near}");
    assert!(of_own[2].false_culls > 0, "{:?}", of_own[2]);
}
