//! The buffers on the device that take what a cull finds.

use std::sync::OnceLock;

use std::ops::Range;

use crate::error::{Error, Result};
use crate::gpu::buffers::{STORAGE, made};
use crate::gpu::device::{ContextId, Gpu};
use crate::gpu::kept::KeptBindings;
use crate::instances::Instances;
use crate::instances::piece::Piece;
use crate::output::bins::{Arrangement, Bins};
use crate::output::counters::StatisticsRecord;
use crate::output::draw::DrawIndexedIndirect;
use crate::output::lists::Lists;
use crate::output::outputs::Outputs;
use crate::output::pixels::PixelCounts;
use crate::output::survivors::GroupOutput;

/// Places whose verdicts `shaders/cull/count.wgsl` reads at once.
pub(crate) const VERDICT_MULTIPLE: u32 = 4;

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceOutput {
    /// One bit per instance, in the caller's order.
    /// From `verdicts_offset` on follows one word per place: its verdict.
    pub(crate) mask: wgpu::Buffer,
    /// The counts of pixels, in the caller's order, if they were asked for.
    pub(crate) pixels: Option<wgpu::Buffer>,
    /// Beside them, for their passes: which instances have large rectangles, behind two numbers.
    pub(crate) large: Option<wgpu::Buffer>,
    /// The arguments of the dispatch for these, and what binds them, where each has a workgroup.
    pub(crate) teams: OnceLock<(wgpu::Buffer, wgpu::BindGroup)>,
    /// Made by the first cull that tests groups.
    groups: OnceLock<GroupOutput>,
    /// What culls bind, made by the first of each kind.
    /// Culls that count levels come second, and those of bins in any order come last.
    pub(crate) bindings: [OnceLock<wgpu::BindGroup>; 4],
    /// What counts of pixels bind, by the number of pixels that is negligible, if any.
    pub(crate) counted: KeptBindings<Option<u32>>,
}

/// So many numbers of negligible pixels may take turns without a bind group made anew.
const NEGLIGIBLE_KEPT: usize = 2;

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
    /// `None` if neither indices nor draws are asked for, or if they are those of bins.
    pub(crate) lists: Option<Lists>,
    /// `None` likewise, or if there is one list.
    pub(crate) bins: Option<Bins>,
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
        Self::with_tail(gpu, instances, outputs, false)
    }

    /// The buffers of one of the two passes of a frame.
    /// Behind the verdicts of each piece they have room for another mask.
    pub(crate) fn of_two_passes(
        gpu: &Gpu,
        instances: &Instances,
        outputs: &Outputs,
    ) -> Result<Self> {
        Self::with_tail(gpu, instances, outputs, true)
    }

    fn with_tail(
        gpu: &Gpu,
        instances: &Instances,
        outputs: &Outputs,
        of_two_passes: bool,
    ) -> Result<Self> {
        let Outputs { capacity, draw, ref emit, .. } = *outputs;
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
        let pieces = instances
            .pieces
            .iter()
            .map(|piece| PieceOutput::new(gpu, piece, outputs, of_two_passes));
        let listed = outputs.indices || outputs.draws;
        let most = capacity.unwrap_or(instances.len());
        let bins =
            if listed { Bins::new(gpu, instances, emit, outputs.indices, most)? } else { None };
        Ok(Self {
            context: gpu.id(),
            pieces: pieces.collect::<Result<_>>()?,
            lists: (listed && emit.is_one_list())
                .then(|| Lists::new(gpu, instances, outputs.indices, capacity, (emit, draw)))
                .transpose()?,
            bins,
            statistics: OnceLock::new(),
            capacity: most,
            outputs: outputs.clone(),
            counts: instances.pieces.iter().map(Piece::count).collect(),
            of_two_passes,
        })
    }

    /// Whether they are those of one of the two passes of a frame, which no other cull may fill.
    pub(crate) fn is_of_two_passes(&self) -> bool {
        self.of_two_passes
    }

    /// What culls leave in these buffers.
    pub fn outputs(&self) -> &Outputs {
        &self.outputs
    }

    /// The draw arguments: [`Visible::max_draws`] records per piece.
    /// Pass the buffer and [`Visible::draw_offset`] to `draw_indexed_indirect` or
    /// `multi_draw_indexed_indirect`.
    /// `None` if neither [`Outputs::draws`] nor [`Outputs::indices`] was asked for.
    ///
    /// The records are [`DrawIndexedIndirect`]s, or [`DrawIndirect`](crate::DrawIndirect)s for
    /// meshes without indices.
    pub fn draw_arguments(&self) -> Option<&wgpu::Buffer> {
        match &self.bins {
            Some(bins) => Some(&bins.draws),
            None => self.lists.as_ref().map(|lists| &lists.draws),
        }
    }

    /// The offset of a piece's first draw record in bytes.
    pub fn draw_offset(&self, piece: usize) -> u64 {
        let bytes = match &self.bins {
            Some(bins) => bins.piece_bytes(),
            None => size_of::<DrawIndexedIndirect>() as u64,
        };
        piece as u64 * bytes
    }

    /// How many draw records a piece has.
    ///
    /// Records without a draw are zeros, or have 0 instances: all of them may be drawn.
    pub fn max_draws(&self) -> u32 {
        self.bins.as_ref().map_or(1, |bins| bins.records)
    }

    /// How many of a piece's draw records draw something: a u32 per piece, at
    /// [`Visible::draw_count_offset`].
    /// They are the first ones, so this is the count for `multi_draw_indexed_indirect_count`.
    ///
    /// `None` where each bin has its record in a fixed place
    /// ([`Placement::Reserved`](crate::Placement::Reserved)), for [`Emit::List`](crate::Emit::List),
    /// and if neither draws nor indices were asked for.
    pub fn draw_count(&self) -> Option<&wgpu::Buffer> {
        let bins = self.bins.as_ref()?;
        (bins.arrangement != Arrangement::Reserved).then_some(&bins.draw_counts)
    }

    /// The offset of a piece's number of draws in bytes.
    pub fn draw_count_offset(&self, piece: usize) -> u64 {
        4 * piece as u64
    }

    /// Where the bin of a mesh and LOD lies with [`Placement::Reserved`](crate::Placement::Reserved):
    /// the offset of its draw record in [`Visible::draw_arguments`], and its bytes in
    /// [`Visible::list`].
    /// `None` with any other way to emit.
    ///
    /// Set the list's bytes as the vertex buffer, and draw the record.
    ///
    /// # Panics
    /// If `piece`, `mesh` or `lod` is not below what there are.
    pub fn bin(&self, piece: usize, mesh: u32, lod: u32) -> Option<(u64, Range<u64>)> {
        let bins = self.bins.as_ref()?;
        assert!(lod < bins.meshes.lods(mesh), "LOD {lod} of mesh {mesh}");
        let (begin, words) = bins.reserved(piece, mesh, lod)?;
        let record = u64::from(mesh * bins.meshes.most_lods() + lod);
        let bytes = 4 * u64::from(begin)..4 * (u64::from(begin) + u64::from(words));
        Some((self.draw_offset(piece) + record * bins.record_bytes(), bytes))
    }

    /// The number of pieces, which is also the number of lists, masks and draws.
    pub fn num_pieces(&self) -> usize {
        self.pieces.len()
    }

    /// A piece's packed list of kept instances: u32 indices in the caller's numbering, or the
    /// caller's records with [`Emit::Copy`](crate::Emit::Copy).
    /// The buffer can be used as storage and as an instance vertex buffer.
    /// `None` without [`Outputs::indices`].
    ///
    /// # Panics
    /// If `piece` is not below [`Visible::num_pieces`].
    pub fn list(&self, piece: usize) -> Option<&wgpu::Buffer> {
        if let Some(bins) = &self.bins {
            return bins.pieces[piece].list.as_ref();
        }
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

    /// A piece's counts of pixels: [`PixelCounts`] in the caller's numbering, five u32 words per
    /// instance.
    /// `None` without [`Outputs::pixels`].
    ///
    /// # Panics
    /// If `piece` is not below [`Visible::num_pieces`].
    pub fn pixels(&self, piece: usize) -> Option<&wgpu::Buffer> {
        self.pieces[piece].pixels.as_ref()
    }

    /// How many indices are written at most, in all pieces together.
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Bytes on the device.
    pub fn device_bytes(&self) -> u64 {
        self.pieces.iter().map(PieceOutput::size).sum::<u64>()
            + self.lists.as_ref().map_or(0, Lists::size)
            + self.bins.as_ref().map_or(0, Bins::size)
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
    fn new(gpu: &Gpu, piece: &Piece, outputs: &Outputs, has_tail: bool) -> Result<Self> {
        let tail = if has_tail { 4 * u64::from(piece.words()) } else { 0 };
        let size = (early_offset(piece, outputs.verdicts) + tail).max(32);
        let counts = u64::from(piece.count().max(1)) * size_of::<PixelCounts>() as u64;
        let pixels = || gpu.empty("hiz.visible.pixels", counts, STORAGE);
        let words = 4 * (2 + u64::from(piece.count()));
        let large = || gpu.empty("hiz.visible.large", words, STORAGE);
        Ok(Self {
            mask: gpu.empty("hiz.visible.mask", size, STORAGE)?,
            pixels: outputs.pixels.then(pixels).transpose()?,
            large: outputs.pixels.then(large).transpose()?,
            teams: OnceLock::new(),
            groups: OnceLock::new(),
            bindings: Default::default(),
            counted: KeptBindings::new(NEGLIGIBLE_KEPT),
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
        let of_pixels = [&self.pixels, &self.large].into_iter().flatten().map(wgpu::Buffer::size);
        let of_teams = self.teams.get().map_or(0, |(arguments, _)| arguments.size());
        self.mask.size() + of_groups + of_pixels.sum::<u64>() + of_teams
    }
}

/// Where the verdicts begin behind a piece's mask, in bytes; `shaders/instances/piece.wgsl`,
/// `verdicts_begin`.
pub(crate) fn verdicts_offset(piece: &Piece) -> u64 {
    4 * u64::from(piece.words().next_multiple_of(VERDICT_MULTIPLE))
}

/// Where the copy of an early pass's mask begins behind the verdicts, in bytes;
/// `shaders/cull/late.wgsl`, `early_begin`.
pub(crate) fn early_offset(piece: &Piece, has_verdicts: bool) -> u64 {
    let verdicts = if has_verdicts { piece.count() } else { 0 };
    verdicts_offset(piece) + 4 * u64::from(verdicts.next_multiple_of(VERDICT_MULTIPLE))
}
