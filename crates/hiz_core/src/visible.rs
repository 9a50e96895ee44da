//! What a cull finds, on the device: verdict planes, the packed list, draw arguments and counters.

use crate::error::Result;
use crate::gpu::{ContextId, Gpu, write_mapped};
use crate::instances::Instances;

/// The arguments of `draw_indexed_indirect`, as the device reads them.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DrawIndexedIndirect {
    /// Indices of the mesh.
    pub index_count: u32,
    /// Instances to draw: what the cull wrote.
    pub instance_count: u32,
    /// First index in the index buffer.
    pub first_index: u32,
    /// Added to each index.
    pub base_vertex: i32,
    /// First instance; other than 0 needs the feature `INDIRECT_FIRST_INSTANCE`.
    pub first_instance: u32,
}

const _: () = assert!(size_of::<DrawIndexedIndirect>() == 20);

/// What the draw arguments say beside the instance count.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DrawTemplate {
    /// See [`DrawIndexedIndirect::index_count`].
    pub index_count: u32,
    /// See [`DrawIndexedIndirect::first_index`].
    pub first_index: u32,
    /// See [`DrawIndexedIndirect::base_vertex`].
    pub base_vertex: i32,
    /// See [`DrawIndexedIndirect::first_instance`].
    pub first_instance: u32,
}

/// How much room there is, and what is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct VisibleOptions {
    /// How many indices are written at most, all pieces together; `None`: all instances.
    pub capacity: Option<u32>,
    /// The constant part of the draw arguments.
    pub draw: DrawTemplate,
}

/// `shaders/cull.wgsl`, `Counters`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CounterRecord {
    pub(crate) outside: u32,
    pub(crate) occluded: u32,
    pub(crate) visible: u32,
    pub(crate) invalid: u32,
    pub(crate) levels: [u32; 16],
    pub(crate) texels_low: u32,
    pub(crate) texels_high: u32,
}

/// Words behind each list that stay 0xFFFFFFFF: whoever writes past the capacity shows.
pub const CANARY_WORDS: u64 = 16;

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceOutput {
    /// The plane of kept bits, then that of the verdicts' low bits.
    pub(crate) planes: wgpu::Buffer,
    /// Where the cull writes the planes about places, if the instances are not stored in the caller's order.
    pub(crate) stored_planes: Option<wgpu::Buffer>,
    pub(crate) list: wgpu::Buffer,
    /// Indices that fit the list, the canary not counted.
    pub(crate) list_capacity: u32,
    /// Scratch of the compaction: kept bits before each word.
    pub(crate) before: wgpu::Buffer,
}

/// What a cull finds: per piece a bit mask of the kept instances, a packed list of their indices and a record of draw
/// arguments. The lists hold the caller's indices and begin as 0xFFFFFFFF.
#[derive(Debug)]
pub struct Visible {
    pub(crate) context: ContextId,
    pub(crate) pieces: Vec<PieceOutput>,
    pub(crate) draws: wgpu::Buffer,
    pub(crate) draws_template: wgpu::Buffer,
    pub(crate) counters: wgpu::Buffer,
    pub(crate) capacity_uniform: wgpu::Buffer,
    capacity: u32,
    counts: Vec<u32>,
}

impl Visible {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, options: &VisibleOptions) -> Result<Self> {
        let device = gpu.device();
        let capacity = options.capacity.unwrap_or(instances.len());
        let storage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let pieces = instances
            .pieces
            .iter()
            .map(|piece| {
                let list_capacity = piece.count().min(capacity);
                let words = u64::from(piece.words().max(1));
                Ok(PieceOutput {
                    planes: buffer("hiz.visible.planes", 2 * 4 * words, storage),
                    stored_planes: (!piece.order.is_given())
                        .then(|| buffer("hiz.visible.stored_planes", 2 * 4 * words, wgpu::BufferUsages::STORAGE)),
                    list: filled_list(device, u64::from(list_capacity) + CANARY_WORDS)?,
                    list_capacity,
                    before: buffer("hiz.compact.before", 4 * words, wgpu::BufferUsages::STORAGE),
                })
            })
            .collect::<Result<_>>()?;
        let DrawTemplate { index_count, first_index, base_vertex, first_instance } = options.draw;
        let draw = DrawIndexedIndirect { index_count, instance_count: 0, first_index, base_vertex, first_instance };
        let template = vec![draw; instances.num_pieces()];
        let draws_bytes = (template.len() * size_of::<DrawIndexedIndirect>()) as u64;
        Ok(Self {
            context: gpu.id(),
            pieces,
            draws: buffer("hiz.visible.draws", draws_bytes, storage | wgpu::BufferUsages::INDIRECT),
            draws_template: gpu.filled(
                "hiz.visible.draws_template",
                bytemuck::cast_slice(&template),
                wgpu::BufferUsages::COPY_SRC,
            )?,
            counters: buffer("hiz.visible.counters", size_of::<CounterRecord>() as u64, storage),
            capacity_uniform: gpu.uniform("hiz.visible.capacity", &[capacity, 0, 0, 0])?,
            capacity,
            counts: instances.pieces.iter().map(crate::instances::Piece::count).collect(),
        })
    }

    /// The draw arguments, one [`DrawIndexedIndirect`] a piece, for `draw_indexed_indirect` at [`Visible::draw_offset`].
    pub fn draw_arguments(&self) -> &wgpu::Buffer {
        &self.draws
    }

    /// The offset in bytes of a piece's draw arguments.
    pub fn draw_offset(&self, piece: usize) -> u64 {
        (piece * size_of::<DrawIndexedIndirect>()) as u64
    }

    /// The number of pieces: of lists, masks and draws.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A piece's packed list of indices (u32, the caller's numbering); usable as storage and as an instance vertex buffer.
    ///
    /// # Panics
    /// For a piece that is not below [`Visible::num_pieces`].
    pub fn list(&self, piece: usize) -> &wgpu::Buffer {
        &self.pieces[piece].list
    }

    /// A piece's bit planes: one bit an instance, kept or not, 32 a word, lowest first; behind them as many words that tell
    /// occluded (not kept, 1) from outside (0) and invalid (kept, 1) from visible (0).
    ///
    /// # Panics
    /// For a piece that is not below [`Visible::num_pieces`].
    pub fn planes(&self, piece: usize) -> &wgpu::Buffer {
        &self.pieces[piece].planes
    }

    /// How many indices are written at most, all pieces together.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        let pieces = self.pieces.iter().map(|p| {
            let stored_planes = p.stored_planes.as_ref().map_or(0, wgpu::Buffer::size);
            p.planes.size() + stored_planes + p.list.size() + p.before.size()
        });
        pieces.sum::<u64>() + self.draws.size() + self.counters.size()
    }

    /// Instances of each piece.
    pub(crate) fn counts(&self) -> &[u32] {
        &self.counts
    }
}

fn filled_list(device: &wgpu::Device, words: u64) -> Result<wgpu::Buffer> {
    const LABEL: &str = "hiz.visible.list";
    let size = 4 * words;
    let list = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(LABEL),
        size,
        usage: wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST
            | wgpu::BufferUsages::VERTEX,
        mapped_at_creation: true,
    });
    let ones = vec![0xFF_u8; size.min(1 << 16) as usize];
    for begin in (0..size).step_by(ones.len()) {
        let part = ones.len().min((size - begin) as usize);
        write_mapped(LABEL, &list, begin, &ones[..part])?;
    }
    list.unmap();
    Ok(list)
}
