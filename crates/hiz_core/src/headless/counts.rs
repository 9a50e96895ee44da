//! What is counted and timed in a cull.

use std::time::Instant;
/// How many instances got which verdict
/// ([`Culling::verdicts`](crate::headless::Culling::verdicts)), and how many were tested.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// All instances of the cull, without those that are absent.
    pub tested: u64,
    /// Absent instances ([`ABSENT`](crate::ABSENT)), which no other number counts.
    pub absent: u64,
    /// Outside the frustum, or in sample coverage between all pixel centres.
    pub outside: u64,
    /// Hidden by the depth image, and not outside.
    pub occluded: u64,
    /// Possibly visible, kept; without those that are unoccluded.
    pub visible: u64,
    /// Surely visible as a whole, kept; 0 unless the pyramid has both ends
    /// ([`Depths::Both`](crate::Depths::Both)).
    pub unoccluded: u64,
    /// With invalid bounds, kept.
    pub invalid: u64,
    /// Visible, unoccluded and invalid: as many indices as the lists would hold without a capacity.
    pub demand: u64,
    /// As many indices as the lists hold.
    pub written: u64,
    /// Groups that were tested as a whole: the first of [`Counts::tested_boxes`].
    pub tested_groups: u64,
    /// Boxes that were tested, per tier: around 64 instances, around 4,096 and around 262,144.
    pub tested_boxes: [u64; 3],
    /// Instances that were tested by themselves: all, or the members of groups that were neither
    /// hidden nor accepted.
    pub tested_instances: u64,
    /// Instances of groups that were accepted as a whole, because all of their box surely shows.
    pub accepted_instances: u64,
    /// Depth tests of groups and instances at each level; 0 without
    /// [`CullOptions::statistics`](crate::CullOptions::statistics).
    pub levels: [u64; 16],
    /// Texels that these tests read; 0 without
    /// [`CullOptions::statistics`](crate::CullOptions::statistics).
    pub texels_read: u64,
}

/// Wall-clock times of one cull, in milliseconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Making buffers and recording commands.
    pub record_ms: f64,
    /// Making the pipelines that were not there yet, including the driver's own compiling.
    /// Near 0 in a cull with the same options as an earlier one.
    pub compile_ms: f64,
    /// From the submit until the device was seen to be done; 0 before that.
    ///
    /// Work that was submitted earlier and not done yet runs first, so its time counts too.
    /// A device reports only when it is asked: by each read, wait and submit.
    /// If the caller does something else before the first of these, the time is longer than the
    /// device took.
    pub wall_ms: f64,
    /// Copies to the host after that, so far.
    pub readback_ms: f64,
}

/// The time from `start` to `end` in milliseconds.
pub(super) fn milliseconds(start: Instant, end: Instant) -> f64 {
    end.duration_since(start).as_secs_f64() * 1e3
}
