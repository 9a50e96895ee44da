//! The packed lists of kept instances, and the draw arguments that go with them.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::buffers::{STORAGE, write_mapped};
use crate::gpu::device::Gpu;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::draw::{DrawIndexedIndirect, DrawTemplate};
use crate::output::emit::Emit;

/// Words behind each list that stay 0xFFFFFFFF, so that a write past the capacity shows.
#[cfg_attr(not(feature = "testing"), expect(unreachable_pub, reason = "tests read it"))]
pub const CANARY_WORDS: u64 = 16;

/// The list of one piece.
#[derive(Debug)]
pub(crate) struct PieceList {
    /// `None` if no list was asked for.
    pub(crate) indices: Option<wgpu::Buffer>,
    /// How many indices fit, without the canary.
    pub(crate) capacity: u32,
    /// Scratch of the compaction: the number of kept bits before each word of the mask.
    /// It is also bound in place of a list if there is none.
    pub(crate) before: wgpu::Buffer,
    /// What the compaction binds; made by the first one.
    pub(crate) bindings: OnceLock<wgpu::BindGroup>,
}

impl PieceList {
    /// The buffer that is bound as the list.
    pub(crate) fn bound(&self) -> &wgpu::Buffer {
        self.indices.as_ref().unwrap_or(&self.before)
    }
}

/// The caller's records, which are listed in place of indices.
#[derive(Debug, Clone)]
pub(crate) struct Copied {
    records: wgpu::Buffer,
    pub(crate) stride: u32,
}

/// The strides that records may have, in bytes.
const STRIDES: std::ops::RangeInclusive<u32> = 4..=256;

impl Copied {
    /// The records that `emit` speaks of, if there are any.
    fn checked(gpu: &Gpu, instances: &Instances, emit: &Emit) -> Result<Option<Self>> {
        let Emit::Copy { records, stride } = emit else { return Ok(None) };
        if !STRIDES.contains(stride) || !stride.is_multiple_of(4) {
            let message = format!("expected 4 to 256 bytes, a multiple of 4, got {stride}");
            return Err(Error::invalid("stride", message));
        }
        let bytes = u64::from(*stride) * u64::from(instances.len());
        if records.size() < bytes {
            let message = format!(
                "expected {bytes} bytes, which are {stride} for each of {} instances, got {}",
                instances.len(),
                records.size()
            );
            return Err(Error::invalid("records", message));
        }
        if !records.usage().contains(wgpu::BufferUsages::STORAGE) {
            let message = format!("expected the usage STORAGE, got {:?}", records.usage());
            return Err(Error::invalid("records", message));
        }
        let largest = instances.pieces.iter().map(Piece::count).max().unwrap_or(0);
        let (requested, allowed) =
            (u64::from(*stride) * u64::from(largest), gpu.limits().max_storage_buffer_binding_size);
        if requested > allowed {
            return Err(Error::limit("max_storage_buffer_binding_size", requested, allowed));
        }
        Ok(Some(Self { records: records.clone(), stride: *stride }))
    }

    /// The records of a piece that has instances.
    pub(crate) fn of_piece(&self, piece: &Piece) -> wgpu::BindingResource<'_> {
        // A piece begins at a multiple of 128 instances, so the offset is aligned.
        let bytes = |count: u32| u64::from(count) * u64::from(self.stride);
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.records,
            offset: bytes(piece.range.start),
            size: wgpu::BufferSize::new(bytes(piece.count())),
        })
    }

    /// The buffer of the records.
    pub(crate) fn buffer(&self) -> &wgpu::Buffer {
        &self.records
    }
}

/// Lists and draw arguments of all pieces.
#[derive(Debug)]
pub(crate) struct Lists {
    /// `None`: indices are listed.
    pub(crate) copied: Option<Copied>,
    pub(crate) pieces: Vec<PieceList>,
    pub(crate) draws: wgpu::Buffer,
    pub(crate) template: wgpu::Buffer,
    pub(crate) capacity_uniform: wgpu::Buffer,
}

impl Lists {
    /// Makes room for `capacity` indices in all lists together; `None`: for all instances.
    /// Without `listed`, only the lengths of the lists are kept.
    pub(crate) fn new(
        gpu: &Gpu,
        instances: &Instances,
        listed: bool,
        capacity: Option<u32>,
        (emit, draw): (&Emit, DrawTemplate),
    ) -> Result<Self> {
        let copied = Copied::checked(gpu, instances, emit)?;
        let words = copied.as_ref().map_or(1, |copied| copied.stride / 4);
        let capacity = capacity.unwrap_or(instances.len());
        let pieces = instances.pieces.iter().map(|piece| {
            let here = if listed { piece.count().min(capacity) } else { 0 };
            Ok(PieceList {
                indices: if listed {
                    Some(filled_list(gpu, u64::from(here) * u64::from(words) + CANARY_WORDS)?)
                } else {
                    None
                },
                capacity: here,
                before: gpu.empty(
                    "hiz.compact.before",
                    4 * u64::from(piece.words().max(1)),
                    STORAGE,
                )?,
                bindings: OnceLock::new(),
            })
        });
        let pieces = pieces.collect::<Result<_>>()?;
        let DrawTemplate { index_count, first_index, base_vertex, first_instance } = draw;
        let draw = DrawIndexedIndirect {
            index_count,
            instance_count: 0,
            first_index,
            base_vertex,
            first_instance,
        };
        let template = vec![draw; instances.num_pieces()];
        let bytes = (template.len() * size_of::<DrawIndexedIndirect>()) as u64;
        Ok(Self {
            copied,
            pieces,
            draws: gpu.empty("hiz.visible.draws", bytes, STORAGE | wgpu::BufferUsages::INDIRECT)?,
            template: gpu.filled(
                "hiz.visible.draws_template",
                bytemuck::cast_slice(&template),
                wgpu::BufferUsages::COPY_SRC,
            )?,
            capacity_uniform: gpu.uniform("hiz.visible.capacity", &[capacity, 0, 0, 0])?,
        })
    }

    /// Records the reset of the draw arguments, so that nothing is listed.
    pub(crate) fn record_clear(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.copy_buffer_to_buffer(&self.template, 0, &self.draws, 0, self.draws.size());
    }

    /// Bytes on the device.
    pub(crate) fn size(&self) -> u64 {
        let pieces = self
            .pieces
            .iter()
            .map(|p| p.indices.as_ref().map_or(0, wgpu::Buffer::size) + p.before.size());
        pieces.sum::<u64>() + self.draws.size()
    }
}

/// A list of `words`, each 0xFFFFFFFF.
pub(crate) fn filled_list(gpu: &Gpu, words: u64) -> Result<wgpu::Buffer> {
    const LABEL: &str = "hiz.visible.list";
    let size = 4 * words;
    let list = gpu.mapped(LABEL, size, STORAGE | wgpu::BufferUsages::VERTEX)?;
    let ones = vec![0xFF_u8; size.min(1 << 16) as usize];
    for begin in (0..size).step_by(ones.len()) {
        let part = ones.len().min((size - begin) as usize);
        write_mapped(LABEL, &list, begin, &ones[..part])?;
    }
    list.unmap();
    Ok(list)
}
