//! What a cull finds, on the device: the mask, verdicts, and the packed list with its draw
//! arguments.

use std::sync::OnceLock;

use crate::error::{Error, Result};
use crate::gpu::{ContextId, Gpu};
use crate::instances::{Instances, Piece};
use crate::lists::{DrawIndexedIndirect, DrawTemplate, Lists};

/// What a cull is to leave behind.
/// What is not asked for is neither computed nor stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Outputs {
    /// A bit for each instance, kept or not.
    pub mask: bool,
    /// Why, for each instance: [`Counts`](crate::headless::Counts) and
    /// [`verdicts`](crate::headless::Culling::verdicts) come from it, where it is said what they
    /// mean.
    pub verdicts: bool,
    /// The packed list of the kept instances.
    pub indices: bool,
    /// The draw arguments, whose instance count is the list's length, with or without a list.
    pub draws: bool,
}

impl Outputs {
    /// Everything.
    pub const ALL: Self = Self { mask: true, verdicts: true, indices: true, draws: true };
    /// Nothing.
    pub const NONE: Self = Self { mask: false, verdicts: false, indices: false, draws: false };
}

impl std::fmt::Display for Outputs {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let all = [
            (self.mask, "mask"),
            (self.verdicts, "verdicts"),
            (self.indices, "indices"),
            (self.draws, "draws"),
        ];
        let names: Vec<_> =
            all.into_iter().filter_map(|(asked, name)| asked.then_some(name)).collect();
        if names.is_empty() { f.write_str("nothing") } else { f.write_str(&names.join(", ")) }
    }
}

impl Default for Outputs {
    fn default() -> Self {
        Self::ALL
    }
}

/// What is asked for, how much room there is, and what is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct VisibleOptions {
    /// What culls are to leave behind.
    pub outputs: Outputs,
    /// How many indices are written at most, all pieces together; `None`: all instances.
    pub capacity: Option<u32>,
    /// The constant part of the draw arguments.
    pub draw: DrawTemplate,
}

/// `shaders/count.wgsl`, `Counters`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct CounterRecord {
    pub(crate) outside: u32,
    pub(crate) occluded: u32,
    pub(crate) visible: u32,
    pub(crate) invalid: u32,
}

/// `shaders/shared/report.wgsl`, `Statistics`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct StatisticsRecord {
    pub(crate) levels: [u32; 16],
    pub(crate) texels_low: u32,
    pub(crate) texels_high: u32,
}

/// `shaders/cull_groups.wgsl`, `Survivors`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SurvivorsRecord {
    pub(crate) workgroups: [u32; 3],
    pub(crate) count: u32,
}

/// Before the groups are tested.
pub(crate) const NO_SURVIVORS: SurvivorsRecord =
    SurvivorsRecord { workgroups: [0, 1, 1], count: 0 };

/// Groups in a row of the survivors' list; `shaders/shared/groups.wgsl`.
pub(crate) const SURVIVORS_PER_ROW: u32 = 4096;

/// Places that `shaders/count.wgsl` reads at once.
const VERDICT_MULTIPLE: u32 = 4;

/// The buffers of one piece.
#[derive(Debug)]
pub(crate) struct PieceOutput {
    /// A bit for each of the caller's instances; behind them, at `verdicts_offset`, a word for each
    /// place.
    pub(crate) mask: wgpu::Buffer,
    /// Made by the first cull that tests groups.
    groups: OnceLock<GroupOutput>,
}

/// What the cull of a piece's groups leaves.
#[derive(Debug)]
pub(crate) struct GroupOutput {
    /// A word for each group: its verdict, and whether its members have theirs
    /// (`shaders/refine.wgsl`).
    pub(crate) verdicts: wgpu::Buffer,
    /// How many groups are left, as the arguments of a dispatch; and which.
    pub(crate) survivors: wgpu::Buffer,
    pub(crate) survivor_list: wgpu::TextureView,
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
    pub(crate) fn new(gpu: &Gpu, instances: &Instances, options: &VisibleOptions) -> Result<Self> {
        let VisibleOptions { outputs, capacity, draw } = *options;
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
        let pieces = instances.pieces.iter().map(|piece| PieceOutput::new(gpu, piece, outputs));
        let listed = outputs.indices || outputs.draws;
        Ok(Self {
            context: gpu.id(),
            pieces: pieces.collect::<Result<_>>()?,
            lists: listed
                .then(|| Lists::new(gpu, instances, outputs.indices, capacity, draw))
                .transpose()?,
            statistics: OnceLock::new(),
            capacity: capacity.unwrap_or(instances.len()),
            outputs,
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

pub(crate) const STORAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST);

impl PieceOutput {
    fn new(gpu: &Gpu, piece: &Piece, outputs: Outputs) -> Result<Self> {
        let verdicts = if outputs.verdicts {
            piece.count().max(1).next_multiple_of(VERDICT_MULTIPLE)
        } else {
            0
        };
        let size = verdicts_offset(piece).max(16) + 4 * u64::from(verdicts);
        Ok(Self { mask: gpu.empty("hiz.visible.mask", size, STORAGE)?, groups: OnceLock::new() })
    }

    /// For a cull that tests groups.
    pub(crate) fn groups_or_new(&self, gpu: &Gpu, piece: &Piece) -> Result<&GroupOutput> {
        made(&self.groups, || {
            let (bytes, usage) =
                (size_of::<SurvivorsRecord>() as u64, STORAGE | wgpu::BufferUsages::INDIRECT);
            Ok(GroupOutput {
                verdicts: gpu.empty(
                    "hiz.visible.group_verdicts",
                    4 * u64::from(piece.groups().max(1)),
                    STORAGE,
                )?,
                survivors: gpu.empty("hiz.visible.survivors", bytes, usage)?,
                survivor_list: survivor_list(gpu, piece)?,
            })
        })
    }

    /// What the last cull that tested groups left, if there was one.
    pub(crate) fn groups(&self) -> Option<&GroupOutput> {
        self.groups.get()
    }

    fn size(&self) -> u64 {
        let of_groups = self.groups.get().map_or(0, |groups| {
            let list = groups.survivor_list.texture();
            let list = 4 * u64::from(list.width()) * u64::from(list.height());
            groups.verdicts.size() + groups.survivors.size() + list
        });
        self.mask.size() + of_groups
    }
}

fn survivor_list(gpu: &Gpu, piece: &Piece) -> Result<wgpu::TextureView> {
    let groups = piece.groups().max(1);
    let size = (groups.min(SURVIVORS_PER_ROW), groups.div_ceil(SURVIVORS_PER_ROW));
    let usage = wgpu::TextureUsages::STORAGE_BINDING;
    gpu.view(&gpu.texture(
        "hiz.visible.survivor_list",
        size,
        wgpu::TextureFormat::R32Uint,
        usage,
    )?)
}

/// What `cell` holds, made if there is nothing.
fn made<T>(cell: &OnceLock<T>, make: impl FnOnce() -> Result<T>) -> Result<&T> {
    if let Some(there) = cell.get() {
        return Ok(there);
    }
    let fresh = make()?;
    Ok(cell.get_or_init(|| fresh))
}

/// Where the verdicts begin behind a piece's mask; `shaders/shared/piece.wgsl`, `verdicts_begin`.
pub(crate) fn verdicts_offset(piece: &Piece) -> u64 {
    4 * u64::from(piece.words().next_multiple_of(VERDICT_MULTIPLE))
}
