//! Instances on the device: the bounding volumes of one call, cut into pieces that fit a binding
//! and a dispatch, each stored along a curve through space (`morton`) and in groups (`groups`).
//!
//! A *place* is where an instance is stored in its piece; its *index* is the caller's number, which
//! everything public speaks of.

pub(crate) mod extent;
pub(crate) mod groups;
pub(crate) mod morton;
pub(crate) mod order;
pub(crate) mod piece;
pub(crate) mod records;
pub(crate) mod update;
pub(crate) mod volume_record;
pub(crate) mod watch;

use std::sync::MutexGuard;

use crate::error::{Error, Result};
use crate::gpu::device::{ContextId, Gpu};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::groups::Groups;
use crate::instances::order::StoredOrder;
#[cfg(feature = "testing")]
use crate::instances::piece::CULL_WORKGROUP;
use crate::instances::piece::{Piece, packed, piece_capacity};
use crate::instances::watch::Watches;

/// How instances are uploaded.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions {
    /// Refuse bad bounds (NaN, infinite, negative radius, min > max) instead of keeping them
    /// visible.
    pub strict: bool,
    /// The order in which they are stored, piece by piece.
    pub order: StoredOrder,
    /// Instances of one piece, at most; `None`: what the device allows.
    #[cfg(feature = "testing")]
    pub piece_capacity: Option<u32>,
}

impl InstanceOptions {
    /// Instances of one piece, at most `most`.
    #[cfg(feature = "testing")]
    fn checked_piece_capacity(&self, most: u32) -> Result<u32> {
        match self.piece_capacity {
            None => Ok(most),
            Some(c) if c > 0 && c <= most && c.is_multiple_of(CULL_WORKGROUP) => Ok(c),
            Some(c) => Err(Error::invalid(
                "piece_capacity",
                format!(
                    "expected a multiple of {CULL_WORKGROUP} from {CULL_WORKGROUP} to {most}, got {c}"
                ),
            )),
        }
    }

    #[cfg(not(feature = "testing"))]
    #[expect(clippy::unnecessary_wraps, clippy::unused_self, reason = "as with the feature")]
    fn checked_piece_capacity(&self, most: u32) -> Result<u32> {
        Ok(most)
    }
}

/// What updates change on the host.
#[derive(Debug)]
pub(crate) struct Changing {
    /// Of each piece.
    pub(crate) groups: Vec<Groups>,
    /// The number of the next update; `update` tells what for.
    pub(crate) next_update: u32,
}

/// Room for `Sequence` of `shaders/instances/update.wgsl`.
pub(crate) const SEQUENCE_BYTES: usize = 16;

/// Bounding volumes on the device.
#[derive(Debug)]
pub struct Instances {
    pub(crate) context: ContextId,
    pub(crate) kind: BoundsKind,
    /// At least one, so that there is always a draw to consume; an empty one for no instances.
    pub(crate) pieces: Vec<Piece>,
    /// `shaders/instances/update.wgsl`, `Sequence`.
    pub(crate) sequence: wgpu::Buffer,
    changing: Locked<Changing>,
    /// Held by whoever records *and* submits an update, so that both happen in one order.
    pub(crate) submitting: Locked<()>,
    watches: Locked<Watches>,
}

impl Instances {
    /// `copy` records the copies of one piece, into an encoder that it is given or has; it is told
    /// whether more pieces follow, so that who owns the queue may let go of this one's staging
    /// area.
    pub(crate) fn new(
        gpu: &Gpu,
        bounds: &Bounds<'_>,
        options: &InstanceOptions,
        mut copy: impl FnMut(&dyn Fn(&mut wgpu::CommandEncoder), bool) -> Result<()>,
    ) -> Result<Self> {
        let n = bounds.len()?;
        let total = u32::try_from(n)
            .map_err(|_| Error::limit("instances", n as u64, u64::from(u32::MAX)))?;
        let kind = bounds.kind();
        let most = piece_capacity(kind.record_bytes(), gpu.limits());
        let capacity = options.checked_piece_capacity(most)?;
        let (mut pieces, mut groups) = (Vec::new(), Vec::new());
        let num_pieces = total.div_ceil(capacity).max(1);
        for index in 0..num_pieces {
            let start = index * capacity;
            let range = start..total.min(start.saturating_add(capacity));
            let (piece, its_groups, uploads) = packed(gpu, bounds, index, range, options.order)?;
            copy(
                &|encoder| uploads.iter().for_each(|upload| upload.record(encoder)),
                index + 1 < num_pieces,
            )?;
            pieces.push(piece);
            groups.push(its_groups);
        }
        let sequence = gpu.filled(
            "hiz.instances.sequence",
            &[0; SEQUENCE_BYTES],
            wgpu::BufferUsages::STORAGE,
        )?;
        let changing = Locked::new(Changing { groups, next_update: 0 });
        let this = Self {
            context: gpu.id(),
            kind,
            pieces,
            sequence,
            changing,
            submitting: Locked::default(),
            watches: Locked::default(),
        };
        if options.strict {
            let invalid = this.invalid()?;
            refuse_bad(n, invalid.len(), invalid.first().copied())?;
        }
        Ok(this)
    }

    /// The number of instances.
    pub fn len(&self) -> u32 {
        self.pieces.last().map_or(0, |p| p.range.end)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Which kind of volume.
    pub fn kind(&self) -> BoundsKind {
        self.kind
    }

    /// The number of pieces, that is of lists and draws; at least 1.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// The indices of bad bounds, ascending, as of the last update; they are always kept.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] without memory for the list.
    pub fn invalid(&self) -> Result<Vec<u64>> {
        let changing = self.changing();
        let mut invalid =
            memory::list(changing.groups.iter().map(|g| g.invalid().count()).sum(), "invalid")?;
        for (piece, groups) in self.pieces.iter().zip(&changing.groups) {
            let places = groups.invalid();
            invalid
                .extend(places.map(|p| u64::from(piece.range.start) + piece.order.index(p) as u64));
        }
        invalid.sort_unstable();
        Ok(invalid)
    }

    /// Bytes on the device: a record for each instance, and a box for each 64 of them.
    pub fn device_bytes(&self) -> u64 {
        self.pieces.iter().map(|p| p.records.size() + p.group_records.size()).sum()
    }

    /// Bytes on the host: 8 an instance for its place and its index (none with
    /// [`StoredOrder::Given`]), 88 for each 64 of them, and 48 an instance in such groups of 64 of
    /// which a part was updated.
    pub fn host_bytes(&self) -> u64 {
        let groups = self.changing().groups.iter().map(Groups::host_bytes).sum::<u64>();
        self.pieces.iter().map(|p| p.order.host_bytes()).sum::<u64>() + groups
    }

    /// The culls that were submitted.
    /// Held while one is submitted and added, and while an update is submitted and noted.
    pub(crate) fn watches(&self) -> MutexGuard<'_, Watches> {
        self.watches.lock()
    }

    pub(crate) fn changing(&self) -> MutexGuard<'_, Changing> {
        self.changing.lock()
    }
}

/// The error of `strict` for `bad` bad bounds of `n`.
pub(crate) fn refuse_bad(n: usize, bad: usize, first: Option<u64>) -> Result<()> {
    match first {
        None => Ok(()),
        Some(first) => Err(Error::invalid(
            "bounds",
            format!(
                "expected finite numbers below 2^60, lengths >= 0 and min <= max, got {bad} bad of {n}, the first at index {first}"
            ),
        )),
    }
}
