//! A process that ends in the middle of a driver's work: `scripts/exits.py` runs this one thousands of times and counts those that abort.

mod common;

use std::sync::Arc;

use common::{camera_along_z, engine};
use hiz_core::yardstick::{PerLevelReduction, ReductionShape, submitted_ms};
use hiz_core::{Bounds, CullOptions, DepthConvention, Floats, InstanceOptions, VisibleOptions};

/// Pipelines are dropped while the device may still use them, which a driver in software frees on a thread of its own, and the last
/// work is waited for by nobody.
#[test]
fn a_process_ends_while_the_driver_works() {
    let engine = engine();
    let camera = camera_along_z(64, 64, DepthConvention::Standard);
    let depth = engine.upload_depth(&[0.5; 64 * 64], &camera).unwrap();
    for _ in 0..2 {
        let reduction = PerLevelReduction::new(&engine, &depth, ReductionShape::Buffer).unwrap();
        submitted_ms(&engine, |encoder| {
            reduction.record(encoder);
            Ok(())
        })
        .unwrap();
    }
    let bounds = Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    let pyramid = engine.pyramid(&depth).unwrap();
    let cull = |pyramid: &Arc<_>| {
        engine.cull(&instances, &camera, pyramid, &CullOptions::default(), &VisibleOptions::default()).unwrap()
    };
    assert_eq!(cull(&pyramid).mask().unwrap(), [false]);
    drop(cull(&pyramid));
}
