//! Instances: bounding volumes on the device.
//!
//! The data goes through these files:
//!
//! 1. `piece` cuts the instances of one call into pieces that fit a binding and a dispatch.
//! 2. `order`, `morton` and `keys` choose where each instance is stored: along a curve through
//!    space.
//! 3. `groups` and `aabb` form groups of 64 neighbours with a box around each.
//!    `tiers` forms boxes around 64 of these boxes each, and so on.
//! 4. `volume_record`, `point`, `write_record`, `batch`, `narrow` and `records` write the records
//!    that the cull reads.
//! 5. `update` replaces bounds later, and `watch` connects submitted culls with later updates.
//! 6. `from_buffer` takes bounds that a shader of the caller's has written.
//!
//! An instance has two numbers.
//! Its *index* is the caller's number, and everything public uses it.
//! Its *place* is where its piece stores it.
//!
//! This room records copies and dispatches; it never submits or waits.

pub(crate) mod aabb;
pub(crate) mod batch;
pub(crate) mod forming;
pub(crate) mod from_buffer;
pub(crate) mod groups;
pub(crate) mod keys;
pub(crate) mod morton;
pub(crate) mod narrow;
pub(crate) mod narrow_boxes;
pub(crate) mod order;
pub(crate) mod piece;
pub(crate) mod point;
pub(crate) mod records;
pub(crate) mod slots;
pub(crate) mod tiers;
pub(crate) mod update;
pub(crate) mod volume_record;
pub(crate) mod watch;
pub(crate) mod write_record;

use std::sync::MutexGuard;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::gpu::device::{ContextId, Gpu};
use crate::host::memory;
use crate::host::threads::Locked;
use crate::input::bounds::{Bounds, BoundsKind, Floats};
use crate::instances::forming::Forming;
use crate::instances::groups::Groups;
use crate::instances::order::StoredOrder;
#[cfg(feature = "testing")]
use crate::instances::piece::CULL_WORKGROUP;
use crate::instances::piece::{Piece, packed, piece_capacity, unwritten};
use crate::instances::slots::{Kinds, Slots};
use crate::instances::watch::Watches;

/// How instances are uploaded.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions<'a> {
    /// Whether to refuse invalid bounds (NaN, infinite, negative radius, min > max).
    /// Otherwise they are kept visible.
    pub strict: bool,
    /// The order in which the instances of each piece are stored.
    pub order: StoredOrder,
    /// The mesh of each instance, below 65,536, or [`ABSENT`](crate::ABSENT).
    /// `None`: all have mesh 0.
    ///
    /// [`Emit`](crate::Emit) sorts the kept instances by them.
    /// Updates replace bounds alone: to change a mesh id, or to bring an absent instance back,
    /// upload the instances again.
    pub mesh_ids: Option<&'a [u32]>,
    /// The scale of each instance: a finite number from 0 on, by which the errors of its mesh's
    /// levels of detail are multiplied.
    /// Give the largest scale of an instance that is scaled differently along its axes.
    /// `None`: all have scale 1.
    pub scales: Option<Floats<'a>>,
    /// The most instances of one piece, a multiple of 128.
    /// `None`: as many as the device allows.
    #[cfg(feature = "testing")]
    pub piece_capacity: Option<u32>,
}

impl InstanceOptions<'_> {
    /// The most instances of one piece, at most `most`.
    #[cfg(feature = "testing")]
    fn checked_piece_capacity(&self, most: u32) -> Result<u32> {
        match self.piece_capacity {
            None => Ok(most),
            Some(c) if c > 0 && c <= most && c.is_multiple_of(CULL_WORKGROUP) => Ok(c),
            Some(c) => Err(Error::invalid(
                "piece_capacity",
                format!(
                    "expected a multiple of {CULL_WORKGROUP} from {CULL_WORKGROUP} to {most}, got \
                     {c}"
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

/// Distinguishes instances from others of the same number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct InstancesId(u64);

impl InstancesId {
    fn next() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

/// The state on the host that updates change.
#[derive(Debug)]
pub(crate) struct Changing {
    /// One per piece.
    pub(crate) groups: Vec<Groups>,
    /// The number of the next update; the docs of `update` say what it is for.
    pub(crate) next_update: u32,
    /// Whether bounds were taken from a buffer: then the host knows neither bounds nor groups.
    pub(crate) on_device: bool,
    /// How often bounds were taken from a buffer.
    pub(crate) renewals: u32,
}

/// Room for `Sequence` of `shaders/instances/update.wgsl`.
pub(crate) const SEQUENCE_BYTES: usize = 16;

/// Bounding volumes on the device.
///
/// # Examples
/// ```
/// use hiz_core::{Bounds, Floats, InstanceOptions, headless::Engine};
///
/// # let engine = Engine::new(None)?;
/// let bounds = Bounds::Spheres {
///     centers: Floats::F32(&[0.0, 0.0, -5.0, 0.0, 0.0, f32::NAN]),
///     radii: Floats::F32(&[0.5, 0.5]),
/// };
/// let instances = engine.instances(&bounds, &InstanceOptions::default())?;
/// assert_eq!(instances.invalid()?, [1]); // kept by every cull
///
/// // Only the second one moves; the first stays as it is.
/// let moved = Bounds::Spheres {
///     centers: Floats::F32(&[3.0, 0.0, -5.0]),
///     radii: Floats::F32(&[0.5]),
/// };
/// engine.update(&instances, 1, &moved, false)?;
/// assert_eq!(instances.invalid()?, []);
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Instances {
    pub(crate) context: ContextId,
    /// Distinguishes these instances from all others.
    pub(crate) id: InstancesId,
    pub(crate) kind: BoundsKind,
    /// At least one piece, so that there is always a draw to consume.
    /// Without instances it is empty.
    pub(crate) pieces: Vec<Piece>,
    /// `shaders/instances/update.wgsl`, `Sequence`.
    pub(crate) sequence: wgpu::Buffer,
    changing: Locked<Changing>,
    /// A thread holds it while it records *and* submits an update, so that both happen in one
    /// order.
    pub(crate) submitting: Locked<()>,
    watches: Locked<Watches>,
}

impl Instances {
    /// Packs the pieces one by one, large ones in parts, and calls `copy` for each part.
    ///
    /// `copy` gets a function that records the copies of the part into an encoder.
    /// It also learns whether more parts follow.
    /// A caller with a queue can submit then, and release the part's staging buffer.
    /// Without groups, the instances are for one cull that tests none, and for no update.
    pub(crate) fn new(
        gpu: &Gpu,
        bounds: &Bounds<'_>,
        options: &InstanceOptions<'_>,
        has_groups: bool,
        mut copy: impl FnMut(&dyn Fn(&mut wgpu::CommandEncoder), bool) -> Result<()>,
    ) -> Result<Self> {
        let n = bounds.len()?;
        let total = u32::try_from(n)
            .map_err(|_| Error::limit("instances", n as u64, u64::from(u32::MAX)))?;
        let kind = bounds.kind();
        let kinds = Kinds::checked(n, options.mesh_ids, options.scales)?;
        let most = piece_capacity(kind.record_bytes(), gpu.limits());
        let capacity = options.checked_piece_capacity(most)?;
        let (mut pieces, mut groups) = (Vec::new(), Vec::new());
        let num_pieces = total.div_ceil(capacity).max(1);
        for index in 0..num_pieces {
            let start = index * capacity;
            let range = start..total.min(start.saturating_add(capacity));
            let stored = (options.order, &kinds);
            let (piece, its_groups, uploads) =
                packed(gpu, (bounds, kind), index, range, stored, has_groups, |upload| {
                    copy(&|encoder| upload.record(encoder), true)
                })?;
            let forming = Forming::all(gpu, &piece)?;
            let record = |encoder: &mut wgpu::CommandEncoder| {
                uploads.iter().for_each(|upload| upload.record(encoder));
                forming.iter().for_each(|forming| forming.record_pass(encoder));
            };
            copy(&record, index + 1 < num_pieces)?;
            pieces.push(piece);
            groups.push(its_groups);
        }
        let changing = Changing { groups, next_update: 0, on_device: false, renewals: 0 };
        let this = Self::of_pieces(gpu, kind, pieces, changing)?;
        if options.strict {
            let invalid = this.invalid()?;
            refuse_bad(n, invalid.len(), invalid.first().copied())?;
        }
        Ok(this)
    }

    /// Room for `count` instances, whose records are written on the device.
    pub(super) fn unwritten(gpu: &Gpu, kind: BoundsKind, count: u32) -> Result<Self> {
        let capacity = piece_capacity(kind.record_bytes(), gpu.limits());
        let mut pieces = Vec::new();
        for index in 0..count.div_ceil(capacity).max(1) {
            let start = index * capacity;
            let range = start..count.min(start.saturating_add(capacity));
            pieces.push(unwritten(gpu, kind, index, range)?);
        }
        let groups = pieces.iter().map(|piece| Groups::unknown(piece.count() as usize)).collect();
        Self::of_pieces(
            gpu,
            kind,
            pieces,
            Changing { groups, next_update: 0, on_device: true, renewals: 0 },
        )
    }

    fn of_pieces(
        gpu: &Gpu,
        kind: BoundsKind,
        pieces: Vec<Piece>,
        changing: Changing,
    ) -> Result<Self> {
        let sequence = gpu.filled(
            "hiz.instances.sequence",
            &[0; SEQUENCE_BYTES],
            wgpu::BufferUsages::STORAGE,
        )?;
        Ok(Self {
            context: gpu.id(),
            id: InstancesId::next(),
            kind,
            pieces,
            sequence,
            changing: Locked::new(changing),
            submitting: Locked::default(),
            watches: Locked::default(),
        })
    }

    /// The number of instances.
    pub fn len(&self) -> u32 {
        self.pieces.last().map_or(0, |p| p.range.end)
    }

    /// Whether there are no instances.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The kind of the bounding volumes.
    pub fn kind(&self) -> BoundsKind {
        self.kind
    }

    /// The number of pieces, which is also the number of lists and draws; at least 1.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// The indices of instances with invalid bounds, ascending, after the last update.
    /// A cull always keeps them.
    ///
    /// # Errors
    /// - [`Error::Mismatch`] for instances whose bounds come from a buffer: the host does not know
    ///   them.
    /// - [`Error::OutOfMemory`] if the host has no memory for the list.
    pub fn invalid(&self) -> Result<Vec<u64>> {
        let changing = self.changing();
        if changing.on_device {
            return Err(Error::mismatch(
                "instances",
                "expected instances whose bounds come from the host, got some whose bounds come \
                 from a buffer: a cull's verdicts and counts tell the invalid ones",
            ));
        }
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

    /// The number of absent instances, which no cull keeps.
    pub fn num_absent(&self) -> u64 {
        self.changing().groups.iter().map(Groups::num_absent).sum()
    }

    /// Whether the instance `index` is absent.
    pub(crate) fn is_absent(&self, changing: &Changing, index: usize) -> bool {
        let p = self.pieces.partition_point(|piece| piece.range.end as usize <= index);
        let piece = &self.pieces[p];
        let place = piece.order.place(index - piece.range.start as usize);
        changing.groups[p].is_absent(place)
    }

    /// Bytes on the device: one record per instance, and one box per 64 instances, per 4,096 and per
    /// 262,144.
    /// Mesh ids or scales add 24 per instance.
    pub fn device_bytes(&self) -> u64 {
        let bytes = |p: &Piece| {
            let boxes = p.upper.iter().map(|tier| tier.records.size()).sum::<u64>();
            let slots = p.slots.as_ref().map_or(0, Slots::size);
            p.records.size() + p.group_records.size() + boxes + slots
        };
        self.pieces.iter().map(bytes).sum()
    }

    /// Bytes on the host.
    ///
    /// - 8 per instance for its place and its index; none with [`StoredOrder::Given`].
    /// - 88 per group of 64 instances, and 8 more if any instance is absent; none if the bounds
    ///   come from a buffer.
    /// - 48 per instance in those groups of which a part was updated.
    pub fn host_bytes(&self) -> u64 {
        let groups = self.changing().groups.iter().map(Groups::host_bytes).sum::<u64>();
        self.pieces.iter().map(|p| p.order.host_bytes()).sum::<u64>() + groups
    }

    /// Forgets what the host knows of the bounds, because the device writes them from now on.
    fn bounds_are_on_device(&self) {
        let mut changing = self.changing();
        changing.renewals = changing.renewals.wrapping_add(1);
        if !std::mem::replace(&mut changing.on_device, true) {
            let unknown = |piece: &Piece| Groups::unknown(piece.count() as usize);
            changing.groups = self.pieces.iter().map(unknown).collect();
        }
    }

    /// Numbers that differ once bounds have been replaced: of updates, and of renewals.
    pub(crate) fn changes(&self) -> [u32; 2] {
        let changing = self.changing();
        [changing.next_update, changing.renewals]
    }

    /// The culls that were submitted.
    ///
    /// The lock is held while a cull is submitted and added, and while an update is submitted and
    /// noted.
    pub(crate) fn watches(&self) -> MutexGuard<'_, Watches> {
        self.watches.lock()
    }

    pub(crate) fn changing(&self) -> MutexGuard<'_, Changing> {
        self.changing.lock()
    }
}

/// The error that `strict` gives if `bad` of `n` bounds are invalid.
/// `first` is the index of the first of them.
pub(crate) fn refuse_bad(n: usize, bad: usize, first: Option<u64>) -> Result<()> {
    match first {
        None => Ok(()),
        Some(first) => Err(Error::invalid(
            "bounds",
            format!(
                "expected finite numbers below 2^60, lengths >= 0 and min <= max, got {bad} bad of \
                 {n}, the first at index {first}"
            ),
        )),
    }
}
