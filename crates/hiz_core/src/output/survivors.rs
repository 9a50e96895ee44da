//! What a cull of groups leaves: a verdict per group, and the list of survivors of each tier.

use std::sync::OnceLock;

use crate::error::Result;
use crate::gpu::buffers::STORAGE;
use crate::gpu::device::Gpu;
use crate::instances::piece::Piece;

/// Twin: `shaders/cull/cull_box.wgsl`, `Survivors`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SurvivorsRecord {
    pub(crate) workgroups: [u32; 3],
    pub(crate) count: u32,
    pub(crate) tested: u32,
    pub(crate) accepted: u32,
    /// 1 where the mask began full (`shaders/cull/begin_mask.wgsl`).
    pub(crate) is_full: u32,
    pub(crate) padding: u32,
    pub(crate) accept_workgroups: [u32; 3],
    pub(crate) accept_count: u32,
}

/// The record before the boxes are tested.
pub(crate) const NO_SURVIVORS: SurvivorsRecord = SurvivorsRecord {
    workgroups: [0, 1, 1],
    count: 0,
    tested: 0,
    accepted: 0,
    is_full: 0,
    padding: 0,
    accept_workgroups: [0, 1, 1],
    accept_count: 0,
};

/// Where the arguments of the dispatch for accepted groups begin in the record, in bytes.
pub(crate) const ACCEPT_OFFSET: u64 =
    std::mem::offset_of!(SurvivorsRecord, accept_workgroups) as u64;

/// Survivors in a row of their list; `shaders/instances/groups.wgsl`.
pub(crate) const SURVIVORS_PER_ROW: u32 = 4096;

/// The buffers that the cull of a piece's groups fills.
#[derive(Debug)]
pub(crate) struct GroupOutput {
    /// One word per group: its verdict, and whether its members have verdicts of their own
    /// (`shaders/cull/refine.wgsl`).
    pub(crate) verdicts: wgpu::Buffer,
    /// One per tier of the piece; the first is that of the groups.
    pub(crate) tiers: Vec<TierOutput>,
    /// What the passes around a mask that may begin full bind; made by the first cull with one.
    pub(crate) begin_bindings: OnceLock<wgpu::BindGroup>,
    pub(crate) settle_bindings: OnceLock<wgpu::BindGroup>,
}

/// What the tests of the boxes of a tier leave.
#[derive(Debug)]
pub(crate) struct TierOutput {
    /// The number of survivors, as the arguments of a dispatch.
    /// `survivor_list` says which boxes they are.
    pub(crate) survivors: wgpu::Buffer,
    pub(crate) survivor_list: wgpu::TextureView,
    /// What tests of these boxes bind, without and with the count of levels; made by the first of
    /// either.
    pub(crate) bindings: [OnceLock<wgpu::BindGroup>; 2],
    /// What tests of what the survivors hold bind; made by the first one.
    pub(crate) list_bindings: OnceLock<wgpu::BindGroup>,
}

impl GroupOutput {
    pub(super) fn new(gpu: &Gpu, piece: &Piece) -> Result<Self> {
        let verdicts = 4 * u64::from(piece.groups().max(1));
        Ok(Self {
            verdicts: gpu.empty("hiz.visible.group_verdicts", verdicts, STORAGE)?,
            tiers: (0..piece.tiers())
                .map(|tier| TierOutput::new(gpu, piece.boxes(tier)))
                .collect::<Result<_>>()?,
            begin_bindings: OnceLock::new(),
            settle_bindings: OnceLock::new(),
        })
    }

    /// Bytes on the device.
    pub(super) fn size(&self) -> u64 {
        self.verdicts.size() + self.tiers.iter().map(TierOutput::size).sum::<u64>()
    }
}

impl TierOutput {
    fn new(gpu: &Gpu, boxes: u32) -> Result<Self> {
        let bytes = size_of::<SurvivorsRecord>() as u64;
        let usage = STORAGE | wgpu::BufferUsages::INDIRECT;
        Ok(Self {
            survivors: gpu.empty("hiz.visible.survivors", bytes, usage)?,
            survivor_list: list_of(gpu, boxes.max(1))?,
            bindings: Default::default(),
            list_bindings: OnceLock::new(),
        })
    }

    fn size(&self) -> u64 {
        let list = self.survivor_list.texture();
        self.survivors.size() + 4 * u64::from(list.width()) * u64::from(list.height())
    }
}

fn list_of(gpu: &Gpu, boxes: u32) -> Result<wgpu::TextureView> {
    let size = (boxes.min(SURVIVORS_PER_ROW), boxes.div_ceil(SURVIVORS_PER_ROW));
    let usage = wgpu::TextureUsages::STORAGE_BINDING;
    gpu.view(&gpu.texture(
        "hiz.visible.survivor_list",
        size,
        wgpu::TextureFormat::R32Uint,
        usage,
    )?)
}
