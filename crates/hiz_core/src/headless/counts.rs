//! What is counted and timed of a cull.

use std::time::Instant;
/// How many instances met which end: [`Culling::verdicts`](crate::headless::Culling::verdicts), counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// All instances.
    pub tested: u64,
    /// Outside the frustum, or between all pixel centres in sample coverage.
    pub outside: u64,
    /// Hidden by the depth image, and not outside.
    pub occluded: u64,
    /// Possibly visible.
    pub visible: u64,
    /// Bad bounds, kept.
    pub invalid: u64,
    /// Visible and invalid: what the lists would hold without a capacity.
    pub demand: u64,
    /// What they hold.
    pub written: u64,
    /// Groups that were tested as a whole.
    pub tested_groups: u64,
    /// Instances that were tested by themselves: all, or those of the groups that were left.
    pub tested_instances: u64,
    /// Depth tests at each level, of groups and of instances (with [`CullOptions::statistics`](crate::CullOptions::statistics)).
    pub levels: [u64; 16],
    /// Texels read by them (with [`CullOptions::statistics`](crate::CullOptions::statistics)).
    pub texels_read: u64,
}

/// Times of one cull by the clock on the wall.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Making buffers and recording.
    pub record_ms: f64,
    /// Making the pipelines that were not there yet, the driver's own compiling included; next to 0
    /// in a cull like an earlier one.
    pub compile_ms: f64,
    /// From the submit until the device was seen to be done with it; 0 before that.
    /// What was submitted earlier and was not done yet comes first, so it counts.
    /// A device tells only who asks: that is each read and wait, and each submit.
    /// Who does something else before the first of them finds more than the device took.
    pub wall_ms: f64,
    /// Copies to the host after that, so far.
    pub readback_ms: f64,
}

/// From `start` to `end`.
pub(super) fn milliseconds(start: Instant, end: Instant) -> f64 {
    end.duration_since(start).as_secs_f64() * 1e3
}
