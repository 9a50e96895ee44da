//! A device is destroyed with the last object on it, on every way out.
//! A software driver has threads of its own, and destroying the device joins them.
//! So the thread count of this process shows whether it was destroyed.

mod common;

use std::time::{Duration, Instant};

use common::{camera_along_z, engine};
use hiz_core::headless::{Culling, Engine};
use hiz_core::{Bounds, CullOptions, DepthConvention, Floats, InstanceOptions, Outputs};

/// A cull that nobody waits for.
fn submitted(engine: &Engine) -> Culling {
    let camera = camera_along_z(64, 64, DepthConvention::Standard);
    let pyramid = engine.pyramid(&engine.upload_depth(&[0.5; 64 * 64], &camera).unwrap()).unwrap();
    let bounds =
        Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    engine
        .cull(&instances, &camera, &pyramid, &CullOptions::default(), &Outputs::default())
        .unwrap()
}

/// The number of threads of this process: two of the test, and those of the driver.
fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").expect("a list of threads").count()
}

/// Runs `work` on another thread, and returns its thread count unless it panicked.
fn on_a_thread(work: impl FnOnce() -> usize + Send + 'static) -> Option<usize> {
    std::thread::spawn(work).join().ok()
}

/// A single test, so that no other test has a device at the same time.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "threads are counted as Linux lists them")]
fn a_device_ends_with_the_last_object_on_it() {
    let names = hiz_core::headless::adapters();
    // A GPU's driver may keep threads of its own.
    let in_software = names.iter().all(|adapter| adapter.device_type == "cpu");
    let before = threads();
    let settles = || {
        // Linux removes a joined thread from its list a moment after the join has returned.
        let start = Instant::now();
        while in_software && threads() > before && start.elapsed() < Duration::from_secs(30) {
            std::thread::yield_now();
        }
        !in_software || threads() <= before
    };
    let seen = on_a_thread(|| {
        let culling = submitted(&engine());
        assert_eq!(culling.mask().unwrap(), [false]);
        threads()
    });
    // One of them is the thread that counts.
    assert!(
        !in_software || seen.unwrap() > before + 1,
        "a driver without threads: nothing is shown here"
    );
    assert!(settles(), "the thread that asked for the shared engine has ended");

    let panicked = on_a_thread(|| {
        let _result = submitted(&engine());
        panic!("on purpose");
    });
    assert!(panicked.is_none());
    assert!(settles(), "a panic unwinds through the result and the engine");

    let own = Engine::new(None).unwrap();
    let kept = submitted(&own);
    drop(own.clone());
    drop(own);
    assert_eq!(kept.mask().unwrap(), [false], "a result holds its device");
    drop(kept);
    assert!(settles(), "the result was the last");

    let own = Engine::new(None).unwrap();
    let lost = submitted(&own);
    own.device().destroy();
    assert!(lost.mask().is_err());
    drop((own, lost));
    assert!(settles(), "a lost device is let go of as well");
}
