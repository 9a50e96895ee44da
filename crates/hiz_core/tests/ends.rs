//! A process that ends in the middle of a driver's work.
//! `scripts/exits.py` runs this test thousands of times and counts the runs that abort.

mod common;

use common::{camera_along_z, engine};
use hiz_core::yardstick::{PerLevelReduction, ReductionShape, submitted_ms};
use hiz_core::{Bounds, CullOptions, DepthConvention, Floats, InstanceOptions, Outputs};

/// Pipelines are dropped before the last submit.
/// A software driver frees them on a thread of its own after it has reported the submit as done.
/// At that moment this process ends.
#[test]
fn a_process_ends_while_the_driver_frees() {
    let engine = engine();
    let camera = camera_along_z(64, 64, DepthConvention::Standard);
    let depth = engine.upload_depth(&[0.5; 64 * 64], &camera).unwrap();
    let bounds =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let pyramid = engine.pyramid(&depth).unwrap();
    let kept = || {
        let (options, output) = (CullOptions::default(), Outputs::default());
        engine.cull(&instances, &camera, &pyramid, &options, &output).unwrap().mask().unwrap()
    };
    assert_eq!(kept(), [false]);
    let reductions: Vec<_> = (0..8)
        .map(|_| PerLevelReduction::new(&engine, &depth, ReductionShape::Buffer).unwrap())
        .collect();
    for reduction in &reductions {
        submitted_ms(&engine, |encoder| {
            reduction.record(encoder);
            Ok(())
        })
        .unwrap();
    }
    drop(reductions);
    assert_eq!(kept(), [false]);
}
