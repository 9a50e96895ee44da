//! What an engine holds while it takes times.

use std::sync::Arc;

use crate::gpu::stage_times::{StageTimer, StageTimesInFlight};

/// Times on their way, and whether the device's clock can be trusted.
pub(super) type Timed = (Arc<StageTimesInFlight>, bool);

/// Times that are being taken.
#[derive(Debug)]
pub(super) struct Timing {
    /// Whether the device's clock can be trusted.
    pub(super) is_right: bool,
    free: Vec<StageTimer>,
    collected: Vec<Arc<StageTimesInFlight>>,
}

impl Timing {
    pub(super) fn new(is_right: bool) -> Self {
        Self { is_right, free: Vec::new(), collected: Vec::new() }
    }

    /// A timer that no recording uses.
    pub(super) fn lend(&mut self) -> Option<StageTimer> {
        self.free.pop()
    }

    /// Takes a timer back, with what it has timed.
    pub(super) fn give(&mut self, timer: StageTimer, times: Arc<StageTimesInFlight>) {
        self.free.push(timer);
        self.collected.push(times);
    }

    pub(super) fn collected(&self) -> &[Arc<StageTimesInFlight>] {
        &self.collected
    }
}
