//! Descents that are as long as they can be.
//!
//! llvmpipe ends all loops of an invocation after 65,535 iterations, and what they had left to do
//! is not done: the last instances of an invocation were lost (`src/cull/descent.rs`).
//! Here every test walks along the border of a large rectangle, pixel by pixel.

mod common;

use common::{CONVENTIONS, camera_along_z, engine, ndc};
use hiz_core::headless::{Counts, Engine};
use hiz_core::{
    Bounds, BoundsKind, Coverage, CullOptions, DepthConvention, Depths, Fit, Floats, Footprint,
    Hierarchy, InstanceOptions, Outputs, PyramidOptions, StoredOrder,
};

/// Pixels along a side of the image.
const SIDE: u32 = 1024;
/// Pixels between the image's border and the rectangle of each instance.
const BORDER: u32 = 3;
/// The depth of the image behind all pixels of that rectangle.
const WALL: f32 = 8.0;
const COUNT: usize = 512;

/// The wall, and another depth around it.
fn image(ring: f32, convention: DepthConvention) -> Vec<f32> {
    let inside = BORDER..SIDE - BORDER;
    let is_inside = |i: u32| inside.contains(&(i % SIDE)) && inside.contains(&(i / SIDE));
    let depth = |i: u32| ndc(if is_inside(i) { WALL } else { ring }, convention);
    (0..SIDE * SIDE).map(depth).collect()
}

/// Whether an instance stands before the wall.
/// Each invocation tests some of both kinds, in any order.
fn is_before(i: usize) -> bool {
    (i * 7 + i / 64).is_multiple_of(5)
}

/// The mask and the counts of instances that all have the same rectangle.
fn cull(
    engine: &Engine,
    kind: BoundsKind,
    (ring, depths): (f32, Depths),
    convention: DepthConvention,
    options: &CullOptions,
) -> (Vec<bool>, Counts) {
    // The rectangle is almost as large as the wall.
    let half = 1.0 - (BORDER as f32 + 0.4) / (SIDE / 2) as f32;
    let z: Vec<f32> = (0..COUNT).map(|i| if is_before(i) { 4.0 } else { 40.0 }).collect();
    let centers: Vec<f32> = z.iter().flat_map(|z| [0.0, 0.0, *z]).collect();
    // A sphere's outline: r / sqrt(z^2 - r^2) = half.
    let radii: Vec<f32> = z.iter().map(|z| z * half / (1.0 + half * half).sqrt()).collect();
    let corners = |sign: f32| -> Vec<f32> {
        z.iter().flat_map(|z| [sign * half * z, sign * half * z, *z]).collect()
    };
    let half_sizes: Vec<f32> = z.iter().flat_map(|z| [half * z, half * z, 0.0]).collect();
    let rotations: Vec<f32> =
        (0..COUNT).flat_map(|_| [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]).collect();
    let (low, high) = (corners(-1.0), corners(1.0));
    let bounds = match kind {
        BoundsKind::Sphere => {
            Bounds::Spheres { centers: Floats::F32(&centers), radii: Floats::F32(&radii) }
        }
        BoundsKind::Box => Bounds::Boxes { min: Floats::F32(&low), max: Floats::F32(&high) },
        _ => Bounds::OrientedBoxes {
            centers: Floats::F32(&centers),
            half_sizes: Floats::F32(&half_sizes),
            rotations: Floats::F32(&rotations),
        },
    };
    let order = StoredOrder::Given;
    let instances =
        engine.instances(&bounds, &InstanceOptions { order, ..InstanceOptions::default() });
    let camera = camera_along_z(SIDE, SIDE, convention);
    let depth = engine.upload_depth(&image(ring, convention), &camera).unwrap();
    let levels = PyramidOptions { depths, ..PyramidOptions::default() };
    let pyramid = engine.pyramid_with(&depth, &levels).unwrap();
    let outputs = Outputs::default();
    let culling = engine.cull(&instances.unwrap(), &camera, &pyramid, options, &outputs).unwrap();
    (culling.mask().unwrap(), culling.counts().unwrap())
}

/// How many of those before the wall are lost.
fn lost(mask: &[bool]) -> usize {
    (0..COUNT).filter(|i| is_before(*i) && !mask[*i]).count()
}

const FAR: f32 = 1000.0;
const NEAR: f32 = 1.125;

/// What walks far: behind the wall with a far ring, and before it with a near one.
#[test]
fn nothing_visible_is_lost_where_every_test_walks_far() {
    let engine = &*engine();
    let (mut texels, mut number) = (0, 0);
    for kind in [BoundsKind::Sphere, BoundsKind::Box, BoundsKind::OrientedBox] {
        for fit in [Fit::Rectangle, Fit::Volume] {
            for at in [(FAR, Depths::Farthest), (FAR, Depths::Both), (NEAR, Depths::Both)] {
                // Every mode has its turn with some of the others.
                number += 1;
                let pick = |n: usize| number % n;
                let options = CullOptions {
                    fit,
                    descent: 65_536,
                    footprint: [Footprint::Two, Footprint::Eight, Footprint::One][pick(3)],
                    coverage: [Coverage::Area, Coverage::Sample][pick(2)],
                    hierarchy: [Hierarchy::Never, Hierarchy::Always][number / 2 % 2],
                    statistics: true,
                    ..CullOptions::default()
                };
                let convention = CONVENTIONS[number / 3 % 2];
                let (mask, counts) = cull(engine, kind, at, convention, &options);
                assert_eq!(lost(&mask), 0, "{kind:?} {at:?} {options:?}: {counts:?}");
                let kept = mask.iter().filter(|kept| **kept).count() as u64;
                assert_eq!(counts.demand, kept, "{kind:?} {options:?}: {counts:?}");
                let visible = counts.visible + counts.unoccluded;
                assert_eq!(visible, kept, "{kind:?} {options:?}: {counts:?}");
                texels += counts.texels_read;
            }
        }
    }
    let each = texels / (number * COUNT) as u64;
    assert!(each > 300, "{each} texels each: the walks are short");
}

/// Without the limit of the budget llvmpipe loses what is visible.
#[test]
fn longer_walks_lose_what_is_visible_on_llvmpipe() {
    let fault = ("var left = view.descent_budget + *texels_read;", "var left = 65536u;");
    let engine = Engine::with_planted_faults(None, &[fault]).unwrap();
    if !engine.adapter().to_string().contains("llvmpipe") {
        eprintln!("skipped: {} has no limit of loops that is known", engine.adapter());
        return;
    }
    for fit in [Fit::Rectangle, Fit::Volume] {
        let options = CullOptions { fit, descent: 1, ..CullOptions::default() };
        let at = (FAR, Depths::Farthest);
        let (mask, _) = cull(&engine, BoundsKind::Sphere, at, DepthConvention::Reversed, &options);
        eprintln!("{fit:?}: {} of {COUNT} are lost", lost(&mask));
        assert!(lost(&mask) > 0, "{fit:?}");
    }
}
