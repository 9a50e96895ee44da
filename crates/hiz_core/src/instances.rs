//! Instances on the device: the bounding volumes of one call, cut into pieces that fit a binding
//! and a dispatch, each stored along a curve through space (`morton`) and in groups (`groups`).
//!
//! A *place* is where an instance is stored in its piece; its *index* is the caller's number, which
//! everything public speaks of.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::bounds::{Bounds, BoundsKind, BoxRecord};
use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu, Mapped};
use crate::groups::{GROUP, Groups, Source};
use crate::host;
use crate::layout::{CULL_WORKGROUP, piece_capacity};
use crate::morton;
use crate::pyramid::entry;
use crate::records::{Records, Upload};
use crate::watch::Watches;

/// In which order instances are stored.
/// The indices that come out are the caller's in either.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum StoredOrder {
    /// Neighbours in space together (Morton order), sorted once when they are uploaded.
    #[default]
    Morton,
    /// As they came: no sort, and 8 bytes an instance less on the host.
    /// For what is in such an order already.
    Given,
}

/// How instances are uploaded.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions {
    /// Refuse bad bounds (NaN, infinite, negative radius, min > max) instead of keeping them
    /// visible.
    pub strict: bool,
    /// The order in which they are stored, piece by piece.
    pub order: StoredOrder,
    /// Instances of one piece, at most; `None`: what the device allows.
    /// Tests make it small.
    pub piece_capacity: Option<u32>,
}

/// `shaders/shared/piece.wgsl`, `Piece`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PieceUniform {
    pub(crate) base: u32,
    pub(crate) count: u32,
    pub(crate) index: u32,
    pub(crate) words: u32,
}

/// Which instance of a piece is stored where; nothing of it where the order is the caller's.
#[derive(Debug, Default)]
pub(crate) struct PieceOrder {
    indices: Vec<u32>,
    places: Vec<u32>,
}

impl PieceOrder {
    fn new(bounds: &Bounds<'_>, range: Range<usize>, order: StoredOrder) -> Result<Self> {
        if order == StoredOrder::Given {
            return Ok(Self::default());
        }
        let indices = morton::order(bounds, range)?;
        let mut places = host::list(indices.len(), "order")?;
        places.resize(indices.len(), 0);
        for (place, index) in indices.iter().enumerate() {
            places[*index as usize] = place as u32;
        }
        Ok(Self { indices, places })
    }

    pub(crate) fn is_given(&self) -> bool {
        self.indices.is_empty()
    }

    /// Which instance is stored at `place`, relative to the piece's first.
    pub(crate) fn index(&self, place: usize) -> usize {
        self.indices.get(place).map_or(place, |index| *index as usize)
    }

    /// Where the instance `index`, relative to the piece's first, is stored.
    pub(crate) fn place(&self, index: usize) -> usize {
        self.places.get(index).map_or(index, |place| *place as usize)
    }

    /// Where the instances `range` are stored, ascending.
    pub(crate) fn places(&self, range: Range<usize>) -> Result<Vec<u32>> {
        if self.is_given() {
            return host::collected(range.start as u32..range.end as u32, "update");
        }
        let mut places = host::list(range.len(), "update")?;
        if range.len() > self.indices.len() / 16 {
            // A look at every place is cheaper than a sort.
            let here = |(place, index): (usize, &u32)| {
                range.contains(&(*index as usize)).then_some(place as u32)
            };
            places.extend(self.indices.iter().enumerate().filter_map(here));
        } else {
            places.extend_from_slice(&self.places[range]);
            places.sort_unstable();
        }
        Ok(places)
    }

    fn host_bytes(&self) -> u64 {
        4 * (self.indices.capacity() + self.places.capacity()) as u64
    }
}

#[derive(Debug)]
pub(crate) struct Piece {
    pub(crate) range: Range<u32>,
    /// In stored order; each knows its index, relative to the piece's first.
    pub(crate) records: Records,
    /// One `BoxRecord` a group.
    pub(crate) group_records: Records,
    pub(crate) uniform: wgpu::Buffer,
    /// What a cull of the instances reads.
    pub(crate) bindings: wgpu::BindGroup,
    /// What a cull of the groups reads: a piece of boxes.
    pub(crate) group_bindings: wgpu::BindGroup,
    pub(crate) order: PieceOrder,
}

impl Piece {
    pub(crate) fn count(&self) -> u32 {
        self.range.end - self.range.start
    }

    /// The number of groups.
    pub(crate) fn groups(&self) -> u32 {
        self.count().div_ceil(GROUP as u32)
    }

    /// Words of the mask of this piece.
    pub(crate) fn words(&self) -> u32 {
        self.count().div_ceil(32)
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

/// Bounding volumes on the device.
#[derive(Debug)]
pub struct Instances {
    pub(crate) context: ContextId,
    pub(crate) kind: BoundsKind,
    /// At least one, so that there is always a draw to consume; an empty one for no instances.
    pub(crate) pieces: Vec<Piece>,
    /// `shaders/update.wgsl`, `Sequence`.
    pub(crate) sequence: wgpu::Buffer,
    changing: Mutex<Changing>,
    /// Held by whoever records *and* submits an update, so that both happen in one order.
    pub(crate) submitting: Mutex<()>,
    watches: Mutex<Watches>,
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
        let capacity = match options.piece_capacity {
            None => most,
            Some(c) if c > 0 && c <= most && c.is_multiple_of(CULL_WORKGROUP) => c,
            Some(c) => {
                return Err(Error::invalid(
                    "piece_capacity",
                    format!(
                        "expected a multiple of {CULL_WORKGROUP} from {CULL_WORKGROUP} to {most}, got {c}"
                    ),
                ));
            }
        };
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
        let sequence =
            gpu.filled("hiz.instances.sequence", &[0; 16], wgpu::BufferUsages::STORAGE)?;
        let changing = Mutex::new(Changing { groups, next_update: 0 });
        let this = Self {
            context: gpu.id(),
            kind,
            pieces,
            sequence,
            changing,
            submitting: Mutex::default(),
            watches: Mutex::default(),
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
            host::list(changing.groups.iter().map(|g| g.invalid().count()).sum(), "invalid")?;
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
        self.watches.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn changing(&self) -> MutexGuard<'_, Changing> {
        self.changing.lock().unwrap_or_else(PoisonError::into_inner)
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

/// A piece, its groups, and the copies that bring both to the device.
fn packed(
    gpu: &Gpu,
    bounds: &Bounds<'_>,
    index: u32,
    range: Range<u32>,
    order: StoredOrder,
) -> Result<(Piece, Groups, [Upload; 2])> {
    let (first, count) = (range.start as usize, range.end - range.start);
    let record_bytes = bounds.kind().record_bytes();
    let order = PieceOrder::new(bounds, first..range.end as usize, order)?;
    let source = |place: usize| Source {
        bounds: first + order.index(place),
        index: order.index(place) as u32,
    };
    let (records, upload, groups) =
        Records::new(gpu, "hiz.instances.records", count, record_bytes, |records| {
            Groups::packed(bounds, count as usize, source, records)
        })?;
    let num_groups = groups.len() as u32;
    let box_bytes = size_of::<BoxRecord>() as u64;
    let (group_records, groups_upload, ()) =
        Records::new(gpu, "hiz.instances.groups", num_groups, box_bytes, |boxes| {
            write_boxes(boxes, (0..groups.len()).map(|g| groups.record(g)))
        })?;
    let uniform = |count: u32| {
        let words = count.div_ceil(32);
        gpu.uniform("hiz.instances.piece", &PieceUniform { base: range.start, count, index, words })
    };
    let uniform_of_groups = uniform(num_groups)?;
    let uniform = uniform(count)?;
    let bindings = bind_records(gpu, &uniform, &records)?;
    let group_bindings = bind_records(gpu, &uniform_of_groups, &group_records)?;
    let piece = Piece { range, records, group_records, uniform, bindings, group_bindings, order };
    Ok((piece, groups, [upload, groups_upload]))
}

/// A piece's uniform and records as a cull reads them.
pub(crate) fn bind_records(
    gpu: &Gpu,
    uniform: &wgpu::Buffer,
    records: &Records,
) -> Result<wgpu::BindGroup> {
    gpu.bind_group(
        "hiz.cull.instances",
        &gpu.layouts().instances,
        &[
            entry(0, uniform.as_entire_binding()),
            entry(1, wgpu::BindingResource::TextureView(&records.view)),
        ],
    )
}

/// Writes box records, one after the other.
pub(crate) fn write_boxes(
    target: &Mapped<'_>,
    records: impl ExactSizeIterator<Item = BoxRecord>,
) -> Result<()> {
    let mut view = target.range(0..(records.len() * size_of::<BoxRecord>()) as u64)?;
    let chunks = view.slice(..).into_chunks::<{ size_of::<BoxRecord>() }>().0;
    chunks.into_iter().zip(records).for_each(|(chunk, record)| chunk.write(bytemuck::cast(record)));
    Ok(())
}
