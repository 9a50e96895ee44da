//! What a cull of groups leaves: a verdict per group, and the list of surviving groups.

use std::sync::OnceLock;

use crate::error::Result;
use crate::gpu::buffers::STORAGE;
use crate::gpu::device::Gpu;
use crate::instances::piece::Piece;

/// Twin: `shaders/cull/cull_groups.wgsl`, `Survivors`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct SurvivorsRecord {
    pub(crate) workgroups: [u32; 3],
    pub(crate) count: u32,
}

/// The record before the groups are tested.
pub(crate) const NO_SURVIVORS: SurvivorsRecord =
    SurvivorsRecord { workgroups: [0, 1, 1], count: 0 };

/// Groups in a row of the list of survivors; `shaders/instances/groups.wgsl`.
pub(crate) const SURVIVORS_PER_ROW: u32 = 4096;

/// The buffers that the cull of a piece's groups fills.
#[derive(Debug)]
pub(crate) struct GroupOutput {
    /// One word per group: its verdict, and whether its members have verdicts of their own
    /// (`shaders/cull/refine.wgsl`).
    pub(crate) verdicts: wgpu::Buffer,
    /// The number of surviving groups, as the arguments of a dispatch.
    /// `survivor_list` says which groups they are.
    pub(crate) survivors: wgpu::Buffer,
    pub(crate) survivor_list: wgpu::TextureView,
    /// What culls of groups bind, without and with the count of levels; made by the first of either.
    pub(crate) bindings: [OnceLock<wgpu::BindGroup>; 2],
    /// What culls of the surviving groups' members bind; made by the first one.
    pub(crate) member_bindings: OnceLock<wgpu::BindGroup>,
}

impl GroupOutput {
    pub(super) fn new(gpu: &Gpu, piece: &Piece) -> Result<Self> {
        let bytes = size_of::<SurvivorsRecord>() as u64;
        let usage = STORAGE | wgpu::BufferUsages::INDIRECT;
        let verdicts = 4 * u64::from(piece.groups().max(1));
        Ok(Self {
            verdicts: gpu.empty("hiz.visible.group_verdicts", verdicts, STORAGE)?,
            survivors: gpu.empty("hiz.visible.survivors", bytes, usage)?,
            survivor_list: list_of(gpu, piece)?,
            bindings: Default::default(),
            member_bindings: OnceLock::new(),
        })
    }

    /// Bytes on the device.
    pub(super) fn size(&self) -> u64 {
        let list = self.survivor_list.texture();
        let list = 4 * u64::from(list.width()) * u64::from(list.height());
        self.verdicts.size() + self.survivors.size() + list
    }
}

fn list_of(gpu: &Gpu, piece: &Piece) -> Result<wgpu::TextureView> {
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
