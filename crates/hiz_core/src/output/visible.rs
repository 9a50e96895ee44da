//! The buffers on the device that take what a cull finds.

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

/// Places whose verdicts `shaders/cull/count.wgsl` reads at once.
pub(crate) const VERDICT_MULTIPLE: u32 = 4;

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceOutput {
    /// One bit per instance, in the caller's order.
    /// From `verdicts_offset` on follows one word per place: its verdict.
    pub(crate) mask: wgpu::Buffer,
    /// Made by the first cull that tests groups.
    groups: OnceLock<GroupOutput>,
    /// What culls bind, without and with the count of levels; made by the first of either.
    pub(crate) bindings: [OnceLock<wgpu::BindGroup>; 2],
}

/// What a cull finds, on the device.
///
/// Per piece there is a bit mask of the kept instances, a packed list of their indices and one
/// record of draw arguments.
/// Only what the [`Outputs`] ask for can be read.
/// The lists hold the caller's indices, and every word is 0xFFFFFFFF at first.
///
/// # Examples
/// Draws what a cull left here, in the caller's own pass.
/// The pipeline reads the list as an instance buffer of u32.
///
/// ```
/// use hiz_core::{Visible, wgpu};
/// # use hiz_core::{Bounds, Floats, InstanceOptions, Outputs, headless::Engine};
///
/// fn draw(pass: &mut wgpu::RenderPass<'_>, visible: &Visible) {
///     let draws = visible.draw_arguments().expect("asked for");
///     for piece in 0..visible.num_pieces() {
///         pass.set_vertex_buffer(0, visible.list(piece).expect("asked for").slice(..));
///         pass.draw_indexed_indirect(draws, visible.draw_offset(piece));
///     }
/// }
/// # let engine = Engine::new(None)?;
/// # let (device, hiz) = (engine.device(), engine.context());
/// # let (centers, radii) = (Floats::F32(&[0.0, 0.0, -5.0]), Floats::F32(&[0.5]));
/// # let bounds = Bounds::Spheres { centers, radii };
/// # let instances = engine.instances(&bounds, &InstanceOptions::default())?;
///
/// let outputs = Outputs { indices: true, draws: true, ..Outputs::NONE };
/// let visible = hiz.create_visible(&instances, &outputs)?;
/// assert_eq!((visible.num_pieces(), visible.capacity()), (1, 1));
/// assert!(visible.mask(0).is_none()); // not among the outputs
/// # Ok::<(), hiz_core::Error>(())
/// ```
#[derive(Debug)]
pub struct Visible {
    pub(crate) context: ContextId,
    pub(crate) pieces: Vec<PieceOutput>,
    /// `None` if neither indices nor draws are asked for.
    pub(crate) lists: Option<Lists>,
    /// Made by the first cull that counts levels.
    statistics: OnceLock<wgpu::Buffer>,
    capacity: u32,
    outputs: Outputs,
    counts: Vec<u32>,
    /// Whether a `Temporal` owns these buffers.
    of_two_passes: bool,
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
                    "expected 0 on a device without the feature INDIRECT_FIRST_INSTANCE, got {}; \
                     ask for the feature where the device is requested",
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
            of_two_passes: false,
        })
    }

    /// The buffers of one of the two passes of a frame.
    pub(crate) fn of_two_passes(
        gpu: &Gpu,
        instances: &Instances,
        outputs: &Outputs,
    ) -> Result<Self> {
        Ok(Self { of_two_passes: true, ..Self::new(gpu, instances, outputs)? })
    }

    /// Whether they are those of one of the two passes of a frame, which no other cull may fill.
    pub(crate) fn is_of_two_passes(&self) -> bool {
        self.of_two_passes
    }

    /// What culls leave in these buffers.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// The draw arguments, one [`DrawIndexedIndirect`] per piece.
    /// Pass the buffer and [`Visible::draw_offset`] to `draw_indexed_indirect`.
    /// `None` if neither [`Outputs::draws`] nor [`Outputs::indices`] was asked for.
    pub fn draw_arguments(&self) -> Option<&wgpu::Buffer> {
        self.lists.as_ref().map(|lists| &lists.draws)
    }

    /// The offset of a piece's draw arguments in bytes.
    pub fn draw_offset(&self, piece: usize) -> u64 {
        (piece * size_of::<DrawIndexedIndirect>()) as u64
    }

    /// The number of pieces, which is also the number of lists, masks and draws.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A piece's packed list of kept instances: u32 indices in the caller's numbering.
    /// The buffer can be used as storage and as an instance vertex buffer.
    /// `None` without [`Outputs::indices`].
    ///
    /// # Panics
    /// If `piece` is not below [`Visible::num_pieces`].
    pub fn list(&self, piece: usize) -> Option<&wgpu::Buffer> {
        self.lists.as_ref()?.pieces[piece].indices.as_ref()
    }

    /// A piece's mask: one bit per instance in the caller's numbering, 1 if kept.
    /// Each u32 word holds 32 instances, lowest bit first.
    /// What lies behind these words is internal.
    /// `None` without [`Outputs::mask`].
    ///
    /// # Panics
    /// If `piece` is not below [`Visible::num_pieces`].
    pub fn mask(&self, piece: usize) -> Option<&wgpu::Buffer> {
        self.outputs.mask.then_some(&self.pieces[piece].mask)
    }

    /// How many indices are written at most, in all pieces together.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.pieces.iter().map(PieceOutput::size).sum::<u64>()
            + self.lists.as_ref().map_or(0, Lists::size)
            + self.statistics.get().map_or(0, wgpu::Buffer::size)
    }

    /// The number of instances of each piece.
    pub(crate) fn counts(&self) -> &[u32] {
        &self.counts
    }

    /// The buffer in which levels are counted, made if there is none.
    pub(crate) fn statistics_or_new(&self, gpu: &Gpu) -> Result<&wgpu::Buffer> {
        let size = size_of::<StatisticsRecord>() as u64;
        made(&self.statistics, || gpu.empty("hiz.visible.statistics", size, STORAGE))
    }

    /// The buffer in which levels were counted, if a cull did so.
    pub(crate) fn statistics(&self) -> Option<&wgpu::Buffer> {
        self.statistics.get()
    }

    /// Whether more instances may be kept than the lists can hold.
    pub(crate) fn is_capped(&self) -> bool {
        self.counts.iter().map(|n| u64::from(*n)).sum::<u64>() > u64::from(self.capacity)
    }
}

impl PieceOutput {
    fn new(gpu: &Gpu, piece: &Piece, has_verdicts: bool) -> Result<Self> {
        let verdicts =
            if has_verdicts { piece.count().max(1).next_multiple_of(VERDICT_MULTIPLE) } else { 0 };
        let size = verdicts_offset(piece).max(16) + 4 * u64::from(verdicts);
        Ok(Self {
            mask: gpu.empty("hiz.visible.mask", size, STORAGE)?,
            groups: OnceLock::new(),
            bindings: Default::default(),
        })
    }

    /// The buffers for a cull that tests groups, made if there are none.
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

/// Where the verdicts begin behind a piece's mask, in bytes; `shaders/instances/piece.wgsl`,
/// `verdicts_begin`.
pub(crate) fn verdicts_offset(piece: &Piece) -> u64 {
    4 * u64::from(piece.words().next_multiple_of(VERDICT_MULTIPLE))
}
