//! The end of a device: destroyed with the last object on it, on each way out. A driver in software has threads of its own, which the
//! destruction joins; so the threads of this process tell whether it has happened.

mod common;

use std::time::{Duration, Instant};

use common::{camera_along_z, engine};
use hiz_core::headless::{Culling, Engine};
use hiz_core::{Bounds, CullOptions, DepthConvention, Floats, InstanceOptions, VisibleOptions};

/// A cull that nobody waits for.
fn submitted(engine: &Engine) -> Culling {
    let camera = camera_along_z(64, 64, DepthConvention::Standard);
    let pyramid = engine.pyramid(&engine.upload_depth(&[0.5; 64 * 64], &camera).unwrap()).unwrap();
    let bounds = Bounds::Spheres { centers: Floats::F32(&[0.0, 0.0, 8.0]), radii: Floats::F32(&[0.1]) };
    let instances = engine.instances(&bounds, &InstanceOptions::default()).unwrap();
    engine.cull(&instances, &camera, &pyramid, &CullOptions::default(), &VisibleOptions::default()).unwrap()
}

/// The threads of this process that a software driver started.
fn driver_threads() -> usize {
    let tasks = std::fs::read_dir("/proc/self/task").expect("Linux").flatten();
    let names = tasks.filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
    names.filter(|name| name.starts_with("llvmpipe") || name.starts_with("vk") || name.contains("queue")).count()
}

/// The system strikes a joined thread off its list a moment after it has let the joiner go.
fn settles_at_none() -> bool {
    let start = Instant::now();
    while driver_threads() > 0 && start.elapsed() < Duration::from_secs(30) {
        std::thread::yield_now();
    }
    driver_threads() == 0
}

/// Runs `work` on a thread of its own; how many of the driver's threads it saw, unless it panicked.
fn on_a_thread(work: impl FnOnce() -> usize + Send + 'static) -> Option<usize> {
    std::thread::spawn(work).join().ok()
}

/// One test, so that no other has a device meanwhile.
#[test]
fn a_device_ends_with_the_last_object_on_it() {
    let names = hiz_core::headless::adapters();
    // A GPU's driver need not have threads.
    let in_software = names.len() == 1 && names[0].device_type == "cpu";
    let seen = on_a_thread(|| {
        let culling = submitted(&engine());
        assert_eq!(culling.mask().unwrap(), [false]);
        driver_threads()
    });
    assert!(!in_software || seen.unwrap() > 0, "how does this version of the driver call its threads?");
    assert!(settles_at_none(), "the thread that asked for the shared engine has ended");

    let panicked = on_a_thread(|| {
        let _result = submitted(&engine());
        panic!("on purpose");
    });
    assert!(panicked.is_none());
    assert!(settles_at_none(), "a panic unwinds through the result and the engine");

    let own = Engine::new(None).unwrap();
    let kept = submitted(&own);
    drop(own.clone());
    drop(own);
    assert_eq!(kept.mask().unwrap(), [false], "a result holds its device");
    drop(kept);
    assert!(settles_at_none(), "the result was the last");

    let own = Engine::new(None).unwrap();
    let lost = submitted(&own);
    own.device().destroy();
    assert!(lost.mask().is_err());
    drop((own, lost));
    assert!(settles_at_none(), "a lost device is let go of as well");
}
