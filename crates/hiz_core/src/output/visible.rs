//! What a cull finds, on the device: the mask, verdicts, and the packed list with its draw
//! arguments.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::buffers::{STORAGE, made};
use crate::gpu::device::{ContextId, Gpu};
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::counters::StatisticsRecord;
use crate::output::draw::DrawIndexedIndirect;
use crate::output::lists::Lists;
use crate::output::outputs::Outputs;
use crate::output::survivors::GroupOutput;

/// Places that `shaders/cull/count.wgsl` reads at once.
pub(crate) const VERDICT_MULTIPLE: u32 = 4;

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceOutput {
    /// A bit for each of the caller's instances; behind them, at `verdicts_offset`, a word for each
    /// place.
    pub(crate) mask: wgpu::Buffer,
    /// Made by the first cull that tests groups.
    groups: OnceLock<GroupOutput>,
}

/// What a cull finds: per piece a bit mask of the kept instances, a packed list of their indices
/// and a record of draw arguments; of these what the [`Outputs`] say.
/// The lists hold the caller's indices and begin as 0xFFFFFFFF.
#[derive(Debug)]
pub struct Visible {
    pub(crate) context: ContextId,
    pub(crate) pieces: Vec<PieceOutput>,
    /// `None` where neither indices nor draws are asked for.
    pub(crate) lists: Option<Lists>,
    /// Made by the first cull that counts levels.
    statistics: OnceLock<wgpu::Buffer>,
    capacity: u32,
    outputs: Outputs,
    counts: Vec<u32>,
}

impl Visible {
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, outputs: &Outputs) -> Result<Self> {
        let Outputs { capacity, draw, .. } = *outputs;
        gpu.check_context("instances", instances.context)?;
        if draw.first_instance != 0
            && !gpu.device().features().contains(wgpu::Features::INDIRECT_FIRST_INSTANCE)
        {
            return Err(Error::invalid(
                "first_instance",
                format!(
                    "expected 0 on a device without the feature INDIRECT_FIRST_INSTANCE, got {}; ask for the feature where the \
                     device is requested",
                    draw.first_instance
                ),
            ));
        }
        let pieces =
            instances.pieces.iter().map(|piece| PieceOutput::new(gpu, piece, outputs.verdicts));
        let listed = outputs.indices || outputs.draws;
        Ok(Self {
            context: gpu.id(),
            pieces: pieces.collect::<Result<_>>()?,
            lists: listed
                .then(|| Lists::new(gpu, instances, outputs.indices, capacity, draw))
                .transpose()?,
            statistics: OnceLock::new(),
            capacity: capacity.unwrap_or(instances.len()),
            outputs: *outputs,
            counts: instances.pieces.iter().map(Piece::count).collect(),
        })
    }

    /// What culls leave here.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// The draw arguments, one [`DrawIndexedIndirect`] a piece, for `draw_indexed_indirect` at
    /// [`Visible::draw_offset`].
    /// `None` without [`Outputs::draws`] and [`Outputs::indices`].
    pub fn draw_arguments(&self) -> Option<&wgpu::Buffer> {
        self.lists.as_ref().map(|lists| &lists.draws)
    }

    /// The offset in bytes of a piece's draw arguments.
    pub fn draw_offset(&self, piece: usize) -> u64 {
        (piece * size_of::<DrawIndexedIndirect>()) as u64
    }

    /// The number of pieces: of lists, masks and draws.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A piece's packed list of indices (u32, the caller's numbering); usable as storage and as an
    /// instance vertex buffer.
    /// `None` without [`Outputs::indices`].
    ///
    /// # Panics
    /// For a piece that is not below [`Visible::num_pieces`].
    pub fn list(&self, piece: usize) -> Option<&wgpu::Buffer> {
        self.lists.as_ref()?.pieces[piece].indices.as_ref()
    }

    /// A piece's mask: one bit an instance, kept or not, 32 a word, lowest first, in the caller's
    /// numbering; what lies behind is not for the caller.
    /// `None` without [`Outputs::mask`].
    ///
    /// # Panics
    /// For a piece that is not below [`Visible::num_pieces`].
    pub fn mask(&self, piece: usize) -> Option<&wgpu::Buffer> {
        self.outputs.mask.then_some(&self.pieces[piece].mask)
    }

    /// How many indices are written at most, all pieces together.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.pieces.iter().map(PieceOutput::size).sum::<u64>()
            + self.lists.as_ref().map_or(0, Lists::size)
            + self.statistics.get().map_or(0, wgpu::Buffer::size)
    }

    /// Instances of each piece.
    pub(crate) fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// Where levels are counted.
    pub(crate) fn statistics_or_new(&self, gpu: &Gpu) -> Result<&wgpu::Buffer> {
        let size = size_of::<StatisticsRecord>() as u64;
        made(&self.statistics, || gpu.empty("hiz.visible.statistics", size, STORAGE))
    }

    /// Where levels were counted, if they were.
    pub(crate) fn statistics(&self) -> Option<&wgpu::Buffer> {
        self.statistics.get()
    }

    /// Whether more instances may be kept than the lists hold.
    pub(crate) fn is_capped(&self) -> bool {
        self.counts.iter().map(|n| u64::from(*n)).sum::<u64>() > u64::from(self.capacity)
    }
}

impl PieceOutput {
    fn new(gpu: &Gpu, piece: &Piece, has_verdicts: bool) -> Result<Self> {
        let verdicts =
            if has_verdicts { piece.count().max(1).next_multiple_of(VERDICT_MULTIPLE) } else { 0 };
        let size = verdicts_offset(piece).max(16) + 4 * u64::from(verdicts);
        Ok(Self { mask: gpu.empty("hiz.visible.mask", size, STORAGE)?, groups: OnceLock::new() })
    }

    /// For a cull that tests groups.
    pub(crate) fn groups_or_new(&self, gpu: &Gpu, piece: &Piece) -> Result<&GroupOutput> {
        made(&self.groups, || GroupOutput::new(gpu, piece))
    }

    /// What the last cull that tested groups left, if there was one.
    pub(crate) fn groups(&self) -> Option<&GroupOutput> {
        self.groups.get()
    }

    fn size(&self) -> u64 {
        let of_groups = self.groups.get().map_or(0, GroupOutput::size);
        self.mask.size() + of_groups
    }
}

/// Where the verdicts begin behind a piece's mask; `shaders/instances/piece.wgsl`, `verdicts_begin`.
pub(crate) fn verdicts_offset(piece: &Piece) -> u64 {
    4 * u64::from(piece.words().next_multiple_of(VERDICT_MULTIPLE))
}
