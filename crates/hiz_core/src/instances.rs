//! Instances on the device: the bounding volumes of one call, cut into pieces that fit a binding and a dispatch.

use crate::bounds::{Bounds, BoundsKind};
use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu, write_mapped};
use crate::layout::{CULL_WORKGROUP, piece_capacity};

/// How instances are uploaded.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions {
    /// Refuse bad bounds (NaN, infinite, negative radius, min > max) instead of keeping them visible.
    pub strict: bool,
    /// Instances of one piece, at most; `None`: what the device allows. Tests make it small.
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

#[derive(Debug)]
pub(crate) struct Piece {
    pub(crate) range: std::ops::Range<u32>,
    pub(crate) records: wgpu::Buffer,
    pub(crate) uniform: wgpu::Buffer,
}

impl Piece {
    pub(crate) fn count(&self) -> u32 {
        self.range.end - self.range.start
    }

    /// Words of a bit plane of this piece.
    pub(crate) fn words(&self) -> u32 {
        self.count().div_ceil(32)
    }
}

/// Bounding volumes on the device.
#[derive(Debug)]
pub struct Instances {
    pub(crate) context: ContextId,
    pub(crate) kind: BoundsKind,
    /// At least one, so that there is always a draw to consume; an empty one for no instances.
    pub(crate) pieces: Vec<Piece>,
    invalid: Vec<u64>,
}

/// How many records are packed on the host before they are copied.
const PACKED_AT_ONCE: usize = 1 << 14;

impl Instances {
    pub(crate) fn new(gpu: &Gpu, bounds: &Bounds<'_>, options: &InstanceOptions) -> Result<Self> {
        let n = bounds.len()?;
        let total = u32::try_from(n).map_err(|_| Error::limit("instances", n as u64, u64::from(u32::MAX)))?;
        let device = gpu.device();
        let kind = bounds.kind();
        let most = piece_capacity(kind.record_bytes(), &device.limits());
        let capacity = match options.piece_capacity {
            None => most,
            Some(c) if c > 0 && c <= most && c.is_multiple_of(CULL_WORKGROUP) => c,
            Some(c) => {
                return Err(Error::invalid(
                    "piece_capacity",
                    format!("expected a multiple of {CULL_WORKGROUP} from {CULL_WORKGROUP} to {most}, got {c}"),
                ));
            }
        };
        let mut invalid = Vec::new();
        let pieces = (0..total.div_ceil(capacity).max(1))
            .map(|index| {
                let start = index * capacity;
                let range = start..total.min(start.saturating_add(capacity));
                upload(gpu, bounds, index, range, &mut invalid)
            })
            .collect::<Result<_>>()?;
        if options.strict
            && let Some(first) = invalid.first()
        {
            return Err(Error::invalid(
                "bounds",
                format!(
                    "expected finite numbers below 2^60, lengths >= 0 and min <= max, got {} bad of {n}, the first at index {first}",
                    invalid.len()
                ),
            ));
        }
        Ok(Self { context: gpu.id(), kind, pieces, invalid })
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

    /// The indices of bad bounds, ascending; they are always kept.
    pub fn invalid(&self) -> &[u64] {
        &self.invalid
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.pieces.iter().map(|p| p.records.size()).sum()
    }
}

fn upload(
    gpu: &Gpu,
    bounds: &Bounds<'_>,
    index: u32,
    range: std::ops::Range<u32>,
    invalid: &mut Vec<u64>,
) -> Result<Piece> {
    let record_bytes = bounds.kind().record_bytes();
    let count = range.end - range.start;
    let records = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("hiz.instances.records"),
        size: u64::from(count.max(1)) * record_bytes,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: true,
    });
    let (first, end) = (range.start as usize, range.end as usize);
    let mut packed = Vec::with_capacity(PACKED_AT_ONCE.min(count as usize) * record_bytes as usize);
    for begin in (first..end).step_by(PACKED_AT_ONCE) {
        packed.clear();
        bounds.pack(begin..end.min(begin + PACKED_AT_ONCE), &mut packed, invalid);
        let offset = (begin - first) as u64 * record_bytes;
        write_mapped("hiz.instances.records", &records, offset, &packed)?;
    }
    records.unmap();
    let uniform = gpu
        .uniform("hiz.instances.piece", &PieceUniform { base: range.start, count, index, words: count.div_ceil(32) })?;
    Ok(Piece { range, records, uniform })
}
