//! Pixels in a wall that are no valid depth: NaN, infinite, above 1 or negative.
//! In every way in which a cull reads single texels, what is behind such a pixel is kept.

mod common;

#[path = "common/sources.rs"]
mod sources;

use std::sync::Arc;

use common::{CONVENTIONS, camera_along_z, engine, ndc};
use hiz_core::headless::Engine;
use hiz_core::{
    AtlasUse, Bounds, Camera, CullOptions, DepthConvention, Fit, Floats, Footprint, Hierarchy,
    InstanceOptions, Instances, Outputs, Pyramid, PyramidOptions, StoredOrder,
};
use sources::{SOURCES, Source, pyramid_from};

/// The image has cells of 11 x 11 pixels, each with one thing and one bad pixel.
/// With 11 they begin at every remainder by 2, 4 and 8.
const CELL: u32 = 11;
const CELLS: u32 = 8;
const SIDE: u32 = CELL * CELLS;

const BAD: [f32; 9] = [
    f32::NAN,
    -f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    -0.5,
    -1e-40,
    1.5,
    3e38,
    f32::from_bits(0x3f80_0001),
];

/// A way to read texels: the options, and the width of a thing in pixels.
#[derive(Debug, Clone, Copy)]
struct Way {
    footprint: Footprint,
    descent: u32,
    fit: Fit,
    pixels: u32,
}

const fn way(footprint: Footprint, descent: u32, fit: Fit, pixels: u32) -> Way {
    Way { footprint, descent, fit, pixels }
}

/// A footprint of level 0, one of a stored level, and a descent from there to level 0.
/// Then the same texel by texel for a volume's own fit.
const WAYS: [Way; 14] = [
    way(Footprint::Two, 0, Fit::Rectangle, 1),
    way(Footprint::Two, 0, Fit::Rectangle, 2),
    way(Footprint::Two, 0, Fit::Rectangle, 7),
    way(Footprint::Four, 0, Fit::Rectangle, 4),
    way(Footprint::Four, 0, Fit::Rectangle, 7),
    way(Footprint::Eight, 0, Fit::Rectangle, 8),
    way(Footprint::Eight, 0, Fit::Rectangle, 10),
    way(Footprint::Two, 4096, Fit::Rectangle, 9),
    way(Footprint::Two, 4096, Fit::Volume, 9),
    way(Footprint::Two, 4096, Fit::Volume, 2),
    way(Footprint::Eight, 0, Fit::Volume, 7),
    way(Footprint::Eight, 0, Fit::Volume, 10),
    way(Footprint::One, 0, Fit::Rectangle, 1),
    way(Footprint::One, 4096, Fit::Rectangle, 9),
];

/// Flat boxes at depth 8, each `copies` times.
/// Each covers `pixels` x `pixels` of its cell, beginning at the cell's second pixel.
fn things(engine: &Engine, pixels: u32, copies: usize) -> Arc<Instances> {
    let (mut min, mut max) = (Vec::new(), Vec::new());
    for cell in 0..CELLS * CELLS {
        // A pixel is 2 / SIDE at depth 1.
        let at = |pixel: f64| 8.0 * (2.0 * pixel / f64::from(SIDE) - 1.0);
        let first = [cell % CELLS, cell / CELLS].map(|c| f64::from(CELL * c + 1));
        let end = first.map(|f| f + f64::from(pixels));
        for _ in 0..copies {
            // Rows run downwards.
            min.extend([at(first[0] + 0.1), -at(end[1] - 0.1), 8.0]);
            max.extend([at(end[0] - 0.1), -at(first[1] + 0.1), 8.0]);
        }
    }
    let bounds = Bounds::Boxes { min: Floats::F64(&min), max: Floats::F64(&max) };
    let options = InstanceOptions { order: StoredOrder::Given, ..InstanceOptions::default() };
    engine.instances(&bounds, &options).unwrap()
}

/// A wall at depth 4 with one bad pixel in what each thing covers.
/// Every place and every value is used, as far as there are cells.
fn wall_with_bad_pixels(convention: DepthConvention, pixels: u32, shift: u32) -> Vec<f32> {
    let mut depth = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
    for cell in 0..CELLS * CELLS {
        let place = (cell + shift) % (pixels * pixels);
        let x = CELL * (cell % CELLS) + 1 + place % pixels;
        let y = CELL * (cell / CELLS) + 1 + place / pixels;
        depth[(y * SIDE + x) as usize] = BAD[((cell + shift) % 9) as usize];
    }
    depth
}

fn kept(
    engine: &Engine,
    things: &Arc<Instances>,
    camera: &Camera,
    pyramid: &Arc<Pyramid>,
    way: Way,
    hierarchy: Hierarchy,
) -> (Vec<bool>, u64) {
    let Way { footprint, descent, fit, .. } = way;
    let options = CullOptions { footprint, descent, fit, hierarchy, ..CullOptions::default() };
    let culling = engine.cull(things, camera, pyramid, &options, &Outputs::default()).unwrap();
    (culling.mask().unwrap(), culling.counts().unwrap().tested_instances)
}

/// Which cells have an open pixel.
/// A driver chooses what a depth texture holds in place of an invalid number.
/// Where that depth hides depth 8, the cell is not tested.
fn open_cells(camera: &Camera, pixels: u32, shift: u32, pyramid: &Pyramid) -> Vec<bool> {
    let convention = camera.convention();
    let image = engine().read_level(pyramid, 0).unwrap();
    let mut open = vec![false; (CELLS * CELLS) as usize];
    for (i, given) in (0..).zip(wall_with_bad_pixels(convention, pixels, shift)) {
        if given.to_bits() != ndc(4.0, convention).to_bits() {
            let cell = i % SIDE / CELL + CELLS * (i / SIDE / CELL);
            // Depth 8 is 7/8 and 1/8, and anything nearer hides it.
            open[cell as usize] = match convention {
                DepthConvention::Standard => image[i as usize] > 0.875,
                DepthConvention::Reversed => image[i as usize] < 0.125,
            };
        }
    }
    open
}

fn check(source: Source, atlas: AtlasUse, convention: DepthConvention, ways: &[Way]) {
    let camera = camera_along_z(SIDE, SIDE, convention);
    let options = PyramidOptions { atlas, ..PyramidOptions::default() };
    let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
    let whole = pyramid_from(&engine(), source, &wall, &camera, &options);
    for way in ways {
        let things = things(&engine(), way.pixels, 1);
        let what = format!("{source:?}, atlas {atlas:?}, {convention:?}, {way:?}");
        let (hidden, _) = kept(&engine(), &things, &camera, &whole, *way, Hierarchy::Never);
        assert!(hidden.iter().all(|kept| !kept), "a whole wall hides all: {what}");
        for shift in [0, 5] {
            let depth = wall_with_bad_pixels(convention, way.pixels, shift);
            let pyramid = pyramid_from(&engine(), source, &depth, &camera, &options);
            let open = open_cells(&camera, way.pixels, shift, &pyramid);
            if source != Source::Depth {
                assert!(open.iter().all(|open| *open), "none of these numbers is a depth");
            }
            assert!(open.iter().filter(|open| **open).count() > 20, "{what}: {open:?}");
            let (seen, _) = kept(&engine(), &things, &camera, &pyramid, *way, Hierarchy::Never);
            for (cell, (seen, open)) in seen.iter().zip(&open).enumerate() {
                let value = BAD[(cell + shift as usize) % 9];
                assert!(*seen || !open, "{what}: cell {cell}, {value}");
            }
        }
    }
}

#[test]
fn what_is_no_depth_hides_nothing_in_an_upload() {
    for convention in CONVENTIONS {
        check(Source::Bits, AtlasUse::Never, convention, &WAYS);
    }
}

#[test]
fn what_is_no_depth_hides_nothing_in_sampled_textures() {
    for source in [Source::Float, Source::Depth] {
        for convention in CONVENTIONS {
            check(source, AtlasUse::Never, convention, &WAYS[..8]);
        }
        check(source, AtlasUse::Never, DepthConvention::Standard, &WAYS[8..9]);
    }
}

#[test]
fn what_is_no_depth_hides_nothing_in_an_atlas() {
    for (source, convention) in SOURCES.into_iter().zip([
        DepthConvention::Standard,
        DepthConvention::Reversed,
        DepthConvention::Standard,
    ]) {
        check(source, AtlasUse::Always, convention, &WAYS);
    }
}

/// Groups have a footprint and a descent of their own.
#[test]
fn what_is_no_depth_hides_no_group() {
    for (source, atlas) in [
        (Source::Bits, AtlasUse::Never),
        (Source::Float, AtlasUse::Never),
        (Source::Bits, AtlasUse::Always),
    ] {
        for convention in CONVENTIONS {
            let camera = camera_along_z(SIDE, SIDE, convention);
            let options = PyramidOptions { atlas, ..PyramidOptions::default() };
            let wall = vec![ndc(4.0, convention); (SIDE * SIDE) as usize];
            let whole = pyramid_from(&engine(), source, &wall, &camera, &options);
            for way in [WAYS[1], WAYS[2], WAYS[5]] {
                let crowd = things(&engine(), way.pixels, 64);
                let (hidden, tested) =
                    kept(&engine(), &crowd, &camera, &whole, way, Hierarchy::Always);
                assert!(
                    hidden.iter().all(|kept| !kept) && tested == 0,
                    "whole groups are hidden: {way:?}"
                );
                let depth = wall_with_bad_pixels(convention, way.pixels, 0);
                let pyramid = pyramid_from(&engine(), source, &depth, &camera, &options);
                let (seen, _) = kept(&engine(), &crowd, &camera, &pyramid, way, Hierarchy::Always);
                assert!(
                    seen.iter().all(|kept| *kept),
                    "{source:?} {atlas:?} {convention:?} {way:?}"
                );
            }
        }
    }
}

/// A footprint of four and a descent read single pixels.
/// Without the code that cleans those, visible instances are hidden.
/// A depth texture holds no such pixel here, so `shader.rs` checks the text of its shader.
#[test]
fn pixels_that_nobody_cleans_hide_something() {
    for (source, atlas, (what, by)) in [
        (Source::Bits, AtlasUse::Never, ("sanitized(far_given(x, y))", "far_given(x, y)")),
        (Source::Float, AtlasUse::Never, ("sanitized(far_given(x, y))", "far_given(x, y)")),
        (
            Source::Bits,
            AtlasUse::Always,
            ("return sanitized(select(bits, foreground(bits), level == 0u));", "return bits;"),
        ),
        (
            Source::Bits,
            AtlasUse::Never,
            ("return farthest_sanitized4(bits);", "return farthest4(bits);"),
        ),
    ] {
        let faulty = Engine::with_planted_faults(None, &[(what, by)])
            .expect("the device tests need a Vulkan driver");
        for convention in CONVENTIONS {
            let camera = camera_along_z(SIDE, SIDE, convention);
            let options = PyramidOptions { atlas, ..PyramidOptions::default() };
            let way = if what.contains("farthest_sanitized4") { WAYS[1] } else { WAYS[3] };
            let depth = wall_with_bad_pixels(convention, way.pixels, 0);
            let pyramid = pyramid_from(&faulty, source, &depth, &camera, &options);
            let things = things(&faulty, way.pixels, 1);
            let (seen, _) = kept(&faulty, &things, &camera, &pyramid, way, Hierarchy::Never);
            assert!(seen.contains(&false), "{what} -> {by}: stayed green, {convention:?}");
        }
    }
}
