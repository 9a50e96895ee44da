//! Pieces: the instances of one call, cut so that each part fits a binding and a dispatch.

use std::ops::Range;
use std::sync::OnceLock;

use crate::error::Result;
use crate::gpu::buffers::Mapped;
use crate::gpu::device::Gpu;
use crate::gpu::kept::KeptBindings;
use crate::input::bounds::{Bounds, BoundsKind};
use crate::instances::batch::GROUP;
use crate::instances::batch::Origin;
use crate::instances::groups::{Groups, pack_without_groups};
use crate::instances::order::{PieceOrder, StoredOrder};
pub(crate) use crate::instances::records::{RECORD_BINDINGS, bind_records, bind_records_among};
use crate::instances::records::{RECORDS_PER_ROW, Records, Upload};
use crate::instances::slots::{Kinds, Slots};
use crate::instances::tiers::{UpperTier, tier_uniform, upper_tiers};
use crate::instances::volume_record::BoxRecord;

/// Invocations of one workgroup of the cull of groups, and of updates.
/// Twins: `shaders/cull/cull_box.wgsl`, `WORKGROUP`; `shaders/instances/update.wgsl`.
pub(crate) const CULL_WORKGROUP: u32 = 128;

/// How many instances one piece may hold.
///
/// Its records must fit one texture and one staging buffer.
/// Its verdicts must fit one binding, and its workgroups one dimension of a dispatch.
pub(crate) fn piece_capacity(record_bytes: u64, limits: &wgpu::Limits) -> u32 {
    let rows = u64::from(limits.max_texture_dimension_2d) * u64::from(RECORDS_PER_ROW);
    let staging = limits.max_buffer_size / record_bytes;
    // Per instance: a verdict of 4 bytes, and a bit of the mask.
    let binding = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size) / 5;
    let dispatch =
        u64::from(limits.max_compute_workgroups_per_dimension) * u64::from(CULL_WORKGROUP);
    // Whole rows, so that the padding of a staging buffer cannot exceed the limit.
    let whole =
        rows.min(staging).min(binding).min(dispatch).min(1 << 24) / u64::from(RECORDS_PER_ROW);
    u32::try_from(whole * u64::from(RECORDS_PER_ROW)).unwrap_or(1 << 24)
}

/// Twin: `shaders/instances/piece.wgsl`, `Piece`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct PieceUniform {
    pub(crate) base: u32,
    pub(crate) count: u32,
    pub(crate) index: u32,
    pub(crate) words: u32,
}

#[derive(Debug)]
pub(crate) struct Piece {
    pub(crate) range: Range<u32>,
    /// The records in stored order.
    /// Each holds its instance's index relative to the piece's first.
    pub(crate) records: Records,
    /// One `BoxRecord` per group.
    pub(crate) group_records: Records,
    pub(crate) uniform: wgpu::Buffer,
    /// The tier of the boxes of the groups.
    pub(crate) group_uniform: wgpu::Buffer,
    /// What the cull of instances binds.
    pub(crate) bindings: wgpu::BindGroup,
    /// What the cull of groups binds: its boxes, as if they were a piece of instances.
    pub(crate) group_bindings: wgpu::BindGroup,
    /// The tiers of boxes above those of the groups.
    pub(crate) upper: Vec<UpperTier>,
    pub(crate) order: PieceOrder,
    /// `None` if all instances have mesh 0 and scale 1: then their slots are their indices.
    pub(crate) slots: Option<Slots>,
    /// What bounds from a buffer need.
    pub(crate) from_buffer: KeptSources,
}

/// Buffers whose bindings a piece keeps: callers often write to two or three in turns.
const KEPT: usize = 3;

/// A buffer, where the bounds of a piece begin in it, and the bytes from one to the next.
type SourceKey = (wgpu::Buffer, u64, u64);

/// What a piece keeps for bounds from a buffer (`from_buffer.rs`).
#[derive(Debug)]
pub(crate) struct KeptSources {
    pub(super) bindings: KeptBindings<SourceKey>,
    /// The index of the instance at each place, if the piece is sorted.
    pub(super) indices: OnceLock<wgpu::Buffer>,
}

impl Default for KeptSources {
    fn default() -> Self {
        Self { bindings: KeptBindings::new(KEPT), indices: OnceLock::new() }
    }
}

impl Piece {
    pub(crate) fn count(&self) -> u32 {
        self.range.end - self.range.start
    }

    /// The number of groups.
    pub(crate) fn groups(&self) -> u32 {
        self.count().div_ceil(GROUP as u32)
    }

    /// The number of tiers of boxes, with that of the groups.
    pub(crate) fn tiers(&self) -> usize {
        1 + self.upper.len()
    }

    /// The number of boxes of a tier; 0 is that of the groups.
    pub(crate) fn boxes(&self, tier: usize) -> u32 {
        if tier == 0 { self.groups() } else { self.upper[tier - 1].count }
    }

    /// Words of the mask of this piece.
    pub(crate) fn words(&self) -> u32 {
        self.count().div_ceil(32)
    }
}

/// Makes a piece, its groups, and the uploads that bring both to the device.
///
/// Large pieces are staged in several parts.
/// `stage` takes the upload of each part before the next one is packed, and that of the last one
/// before the boxes of many groups are written.
pub(super) fn packed(
    gpu: &Gpu,
    (bounds, kind): (&Bounds<'_>, BoundsKind),
    index: u32,
    range: Range<u32>,
    (order, kinds): (StoredOrder, &Kinds<'_>),
    has_groups: bool,
    mut stage: impl FnMut(&Upload) -> Result<()>,
) -> Result<(Piece, Groups, Vec<Upload>)> {
    let (first, count) = (range.start as usize, range.end - range.start);
    let indices = first..range.end as usize;
    let order = PieceOrder::new(bounds, indices.clone(), order)?;
    let absent = kinds.absent(&indices, &order)?;
    let (slots, slots_upload) = Slots::new(gpu, kinds, &indices, &order)?.unzip();
    let source = |place: usize| Origin {
        bounds: first + order.index(place),
        index: order.index(place) as u32,
    };
    let mut groups = if has_groups {
        Groups::new(count as usize, absent)?
    } else {
        Groups::unknown(count as usize)
    };
    let records = Records::unwritten(gpu, RECORDS_LABEL, count, kind.record_bytes())?;
    let mut uploads = Vec::new();
    for rows in records.bands() {
        let begin = (rows.start * RECORDS_PER_ROW) as usize;
        let places = begin..(rows.end * RECORDS_PER_ROW).min(count) as usize;
        for upload in uploads.drain(..) {
            stage(&upload)?;
        }
        let (upload, ()) = records.staged(gpu, RECORDS_LABEL, rows, |staged| {
            if has_groups {
                let of_band = begin / GROUP..places.end.div_ceil(GROUP);
                groups.pack((bounds, kind), of_band, source, staged)
            } else {
                pack_without_groups(gpu.is_processor(), (bounds, kind), places, source, staged)
            }
        })?;
        uploads.push(upload);
    }
    if groups.len() >= MANY_GROUPS {
        uploads.drain(..).try_for_each(|upload| stage(&upload))?;
    }
    let num_groups = groups.len() as u32;
    let (group_records, groups_upload, ()) =
        Records::new(gpu, GROUPS_LABEL, num_groups, BOX_BYTES, |boxes| {
            let records = (0..groups.len()).map(|g| groups.record(g));
            if groups.len() > 0 { write_boxes(boxes, records) } else { Ok(()) }
        })?;
    uploads.push(groups_upload);
    uploads.extend(slots_upload);
    let order = (order, slots);
    let piece = assembled(gpu, (index, range), num_groups, records, group_records, order)?;
    Ok((piece, groups, uploads))
}

/// Makes a piece whose records and group boxes are written on the device, in the caller's order.
pub(super) fn unwritten(
    gpu: &Gpu,
    kind: BoundsKind,
    index: u32,
    range: Range<u32>,
) -> Result<Piece> {
    let count = range.end - range.start;
    let num_groups = count.div_ceil(GROUP as u32);
    let records = Records::unwritten(gpu, RECORDS_LABEL, count, kind.record_bytes())?;
    let group_records = Records::unwritten(gpu, GROUPS_LABEL, num_groups, BOX_BYTES)?;
    let order = (PieceOrder::default(), None);
    assembled(gpu, (index, range), num_groups, records, group_records, order)
}

/// From this many groups on, the device copies records while the groups' boxes are written.
/// A submission takes as long as about a thousand of these.
const MANY_GROUPS: usize = 1 << 12;

const RECORDS_LABEL: &str = "hiz.instances.records";
const GROUPS_LABEL: &str = "hiz.instances.groups";

/// Bytes of the record of a group's box.
const BOX_BYTES: u64 = size_of::<BoxRecord>() as u64;

fn assembled(
    gpu: &Gpu,
    (index, range): (u32, Range<u32>),
    num_groups: u32,
    records: Records,
    group_records: Records,
    (order, slots): (PieceOrder, Option<Slots>),
) -> Result<Piece> {
    let count = range.end - range.start;
    let words = count.div_ceil(32);
    let uniform = PieceUniform { base: range.start, count, index, words };
    let uniform = gpu.uniform("hiz.instances.piece", &uniform)?;
    let uniform_of_groups = tier_uniform(gpu, num_groups, count)?;
    let bindings = bind_records(gpu, &uniform, &records)?;
    let group_bindings = bind_records(gpu, &uniform_of_groups, &group_records)?;
    let upper = upper_tiers(gpu, num_groups, &group_records)?;
    let from_buffer = KeptSources::default();
    Ok(Piece {
        range,
        records,
        group_records,
        uniform,
        group_uniform: uniform_of_groups,
        bindings,
        group_bindings,
        upper,
        order,
        slots,
        from_buffer,
    })
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

const _: () = assert!((RECORDS_PER_ROW as usize).is_multiple_of(GROUP), "rows hold whole groups");

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks each limit alone against values worked out by hand.
    /// On a device only twenty million instances would reach these limits.
    #[test]
    fn every_limit_makes_pieces_smaller() {
        let large = wgpu::Limits {
            max_texture_dimension_2d: 1 << 20,
            max_buffer_size: 1 << 40,
            max_storage_buffer_binding_size: 1 << 40,
            max_compute_workgroups_per_dimension: 1 << 30,
            ..wgpu::Limits::default()
        };
        // float32 holds every index of a piece exactly.
        assert_eq!(piece_capacity(64, &large), 1 << 24);
        let rows = wgpu::Limits { max_texture_dimension_2d: 8, ..large.clone() };
        assert_eq!(piece_capacity(64, &rows), 8 * 1024);
        // 2^20 bytes hold 16384 records of 64 bytes, or 32768 records of 32 bytes.
        let buffer = wgpu::Limits { max_buffer_size: 1 << 20, ..large.clone() };
        assert_eq!((piece_capacity(64, &buffer), piece_capacity(32, &buffer)), (16_384, 32_768));
        // A verdict and a bit of the mask take at most 5 bytes: 209715 instances, cut to whole
        // rows.
        let binding = wgpu::Limits { max_storage_buffer_binding_size: 1 << 20, ..large.clone() };
        assert_eq!(piece_capacity(64, &binding), 204 * 1024);
        // 100 workgroups of 128 invocations.
        let dispatch = wgpu::Limits { max_compute_workgroups_per_dimension: 100, ..large };
        assert_eq!(piece_capacity(64, &dispatch), 12 * 1024);
    }

    #[test]
    fn pieces_fit_the_binding_and_the_dispatch() {
        let limits = wgpu::Limits::default();
        for bytes in [16, 32, 48, 64] {
            let piece = u64::from(piece_capacity(bytes, &limits));
            assert!(piece * bytes <= 256 << 20, "records wait in one buffer");
            assert!(piece / 1024 <= 8192, "and lie in the rows of one texture");
            assert!(4 * piece + piece / 8 <= 128 << 20, "verdicts and the mask are one binding");
            assert!(piece.is_multiple_of(128) && piece / 128 <= 65_535);
            assert!(piece > 2_000_000);
        }
    }
}
