//! How many objects a context has made; tests show with it that a frame makes none.

use std::sync::atomic::{AtomicU64, Ordering};

/// Counts objects of one kind.
#[derive(Debug, Default)]
pub(crate) struct Count(AtomicU64);

impl Count {
    /// Counts one more.
    pub(crate) fn add(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    #[cfg(any(feature = "testing", feature = "yardstick"))]
    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// The counters of a context.
#[derive(Debug, Default)]
pub(crate) struct Making {
    pub(crate) bind_groups: Count,
    pub(crate) buffers: Count,
    pub(crate) textures: Count,
    pub(crate) pipelines: Count,
}

/// How many objects of each kind a context has made, for tests.
#[cfg(feature = "testing")]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Made {
    /// Bind groups.
    pub bind_groups: u64,
    /// Buffers, those for readback included.
    pub buffers: u64,
    /// Textures.
    pub textures: u64,
    /// Compute and render pipelines.
    pub pipelines: u64,
}

#[cfg(feature = "testing")]
impl Making {
    /// The counts so far.
    pub(crate) fn so_far(&self) -> Made {
        Made {
            bind_groups: self.bind_groups.get(),
            buffers: self.buffers.get(),
            textures: self.textures.get(),
            pipelines: self.pipelines.get(),
        }
    }
}
