//! What the device tests share: one engine per process and a small seeded generator.
//! The engine's adapter is printed and checked.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::cell::OnceCell;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use hiz_core::headless::Engine;
use hiz_core::{
    Camera, DepthConvention, Floats, ImageSize, Mat4, MeshData, OccluderOptions, Occluders, wgpu,
};

/// Sizes at which the blocks of a reduction begin and end, as width and height.
/// There are single pixels, rows, columns, powers of two and their neighbours, and primes.
pub(crate) const BLOCK_SIZES: [(u32, u32); 14] = [
    (1, 1),
    (1, 9),
    (9, 1),
    (2, 2),
    (7, 5),
    (13, 17),
    (31, 33),
    (64, 64),
    (65, 63),
    (127, 129),
    (251, 241),
    (513, 31),
    (1023, 9),
    (640, 360),
];

/// The engine that the tests of this process share.
/// Each thread that has asked for it holds it until that thread ends.
/// After the last of them the device is waited for and destroyed.
///
/// A static would keep the engine until the process ends.
/// lavapipe may then still be freeing memory on a thread of its own: `free(): invalid size`.
///
/// `HIZVK_EXPECT_ADAPTER` is a part of the adapter's name or driver; any other is refused.
/// `HIZVK_PLANTED_FAULT` replaces texts in the shaders, to see whether any test turns red.
/// Each of its lines reads `old text => new text`.
pub(crate) fn engine() -> Arc<Engine> {
    // A weak reference does not keep the device alive.
    static SHARED: Mutex<Weak<Engine>> = Mutex::new(Weak::new());
    thread_local!(static HELD: OnceCell<Held> = const { OnceCell::new() });
    let held = |cell: &OnceCell<Held>| {
        let held = cell.get_or_init(|| {
            let mut shared = SHARED.lock().unwrap_or_else(PoisonError::into_inner);
            let engine = shared.upgrade().unwrap_or_else(|| Arc::new(open()));
            *shared = Arc::downgrade(&engine);
            Held(Some(engine))
        });
        held.0.clone().expect("taken by the drop alone")
    };
    HELD.with(held)
}

/// A thread's share of the engine.
struct Held(Option<Arc<Engine>>);

impl Drop for Held {
    fn drop(&mut self) {
        if let Some(last) = self.0.take().and_then(Arc::into_inner) {
            // On another thread: this one may already have lost wgpu's thread-local variables.
            std::thread::spawn(move || drop(last)).join().expect("the device is let go of");
        }
    }
}

fn open() -> Engine {
    let planted = std::env::var("HIZVK_PLANTED_FAULT").unwrap_or_default();
    let planted = planted.lines().map(|line| line.replace("\\n", "\n")).collect::<Vec<_>>();
    let faults: Vec<(&str, &str)> =
        planted.iter().filter_map(|line| line.split_once(" => ")).collect();
    let engine =
        Engine::with_planted_faults(None, &faults).expect("the device tests need a Vulkan driver");
    let adapter = engine.adapter().to_string();
    eprintln!("adapter: {adapter}");
    if let Ok(expected) = std::env::var("HIZVK_EXPECT_ADAPTER") {
        assert!(
            adapter.to_lowercase().contains(&expected.to_lowercase()),
            "expected the adapter {expected}, got {adapter}"
        );
    }
    engine
}

/// How many times as many random cases as in `make test`: `HIZVK_SOAK_TIMES`, which `make soak`
/// sets.
pub(crate) fn soak_times() -> usize {
    std::env::var("HIZVK_SOAK_TIMES").map_or(1, |s| {
        s.parse().unwrap_or_else(|_| panic!("HIZVK_SOAK_TIMES: expected a number, got {s:?}"))
    })
}

/// The words of a buffer after everything that was submitted.
pub(crate) fn words_of(engine: &Engine, buffer: &wgpu::Buffer) -> Vec<u32> {
    let (told, answer) = std::sync::mpsc::channel();
    let (device, queue) = (engine.device(), engine.queue());
    wgpu::util::DownloadBuffer::read_buffer(device, queue, &buffer.slice(..), move |bytes| {
        told.send(bytemuck::pod_collect_to_vec(&bytes.expect("mapped"))).expect("waited for");
    });
    engine.wait().unwrap();
    answer.recv().unwrap()
}

/// A mesh that hides, uploaded.
pub(crate) fn occluders(engine: &Engine, vertices: &[f64], triangles: &[u32]) -> Arc<Occluders> {
    let mesh = MeshData { vertices: Floats::F64(vertices), triangles, transforms: None };
    engine.occluders(&[mesh], &OccluderOptions::default()).unwrap()
}

/// A square at depth `z` that fills the image of [`camera_along_z`].
pub(crate) fn wall(engine: &Engine, z: f64) -> Arc<Occluders> {
    let r = 2.0 * z;
    occluders(engine, &[-r, -r, z, r, -r, z, r, r, z, -r, r, z], &[0, 1, 2, 0, 2, 3])
}

/// A depth image of a test: one layer, one mip level, one sample.
pub(crate) fn depth_descriptor(
    (width, height): (u32, u32),
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some("test.depth"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// A camera at the origin with clip coordinates that are easy to work out by hand.
/// View depth is z, and x and y span -1..1 at depth 1.
pub(crate) fn camera_along_z(width: u32, height: u32, convention: DepthConvention) -> Camera {
    // The near plane is at 1, and there is no far plane: standard z = w - 1, reversed z = 1.
    let z = match convention {
        DepthConvention::Standard => [0.0, 0.0, 1.0, -1.0],
        DepthConvention::Reversed => [0.0, 0.0, 0.0, 1.0],
    };
    let m: Mat4 = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], z, [0.0, 0.0, 1.0, 0.0]];
    Camera::from_clip_from_world(m, ImageSize::new(width, height), convention)
        .expect("a plain camera")
}

/// The NDC depth of view depth `z` for [`camera_along_z`]; exact for powers of two.
pub(crate) fn ndc(z: f32, convention: DepthConvention) -> f32 {
    match convention {
        DepthConvention::Standard => 1.0 - 1.0 / z,
        DepthConvention::Reversed => 1.0 / z,
    }
}

pub(crate) const CONVENTIONS: [DepthConvention; 2] =
    [DepthConvention::Standard, DepthConvention::Reversed];

/// `SplitMix64` (Steele, Lea, Flood, OOPSLA 2014): small, seeded, the same everywhere.
#[derive(Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in 0..1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in `low..high`.
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Uniform in `0..n`.
    pub(crate) fn below(&mut self, n: u32) -> u32 {
        (self.bits() % u64::from(n)) as u32
    }

    pub(crate) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len() as u32) as usize]
    }
}
