//! Tiers of boxes: above the boxes of groups lie boxes around 64 of these each, and so on.
//!
//! The boxes of an upper tier are formed on the device from the records of the tier below
//! (`shaders/instances/form_tier.wgsl`).
//! That follows whatever writes the boxes of groups: an upload, an update, or bounds from a buffer.
//! So a box contains those below it, and an invalid one below makes it invalid.
//! `forming` records that.

use crate::error::Result;
use crate::gpu::buffers::entry;
use crate::gpu::device::Gpu;
use crate::gpu::layouts::Binding;
use crate::gpu::pipelines::{Compute, flag};
use crate::gpu::shader::{Source, wgsl};
use crate::instances::batch::GROUP;
use crate::instances::records::{Records, bind_records};
use crate::instances::volume_record::BoxRecord;

/// The most tiers of a piece, with that of its groups.
/// A piece of 2^24 instances has 64 boxes in the third one.
pub(crate) const TIERS: usize = 3;

/// Invocations of a workgroup, each of which forms a box; `shaders/instances/form_tier.wgsl`.
pub(crate) const WORKGROUP: u32 = 64;

/// Twin: `shaders/instances/tier.wgsl`, `Tier`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct TierUniform {
    pub(crate) count: u32,
    pub(crate) below: u32,
    pub(crate) padding: [u32; 2],
}

/// Twin: `shaders/instances/form_tier.wgsl`, `FormTier`.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct FormUniform {
    pub(crate) count: u32,
    pub(crate) below: u32,
    pub(crate) runtime_zero: u32,
    pub(crate) padding: u32,
}

/// A tier above that of the groups.
#[derive(Debug)]
pub(crate) struct UpperTier {
    /// Boxes of the tier.
    pub(crate) count: u32,
    /// Boxes of the tier below.
    pub(super) below: u32,
    pub(crate) records: Records,
    /// What a cull of its boxes binds.
    pub(crate) bindings: wgpu::BindGroup,
    /// What forms all of its boxes binds.
    pub(super) form: wgpu::BindGroup,
}

/// Bytes of the record of a box.
const BOX_BYTES: u64 = size_of::<BoxRecord>() as u64;

const LAYOUT: &str = "hiz.tiers.layout";

const BINDINGS: &[(u32, Binding)] =
    &[(0, Binding::Uniform), (1, Binding::Read), (2, Binding::ReadQuads), (3, Binding::WriteQuads)];

/// The shader that forms the boxes of an upper tier.
pub(crate) fn form_tier_module() -> Source {
    Source::of(&[&[
        wgsl!("instances/record_layout"),
        wgsl!("instances/groups"),
        wgsl!("instances/corners"),
        wgsl!("instances/form_tier"),
    ]])
}

/// `some`: the pipeline forms the boxes of a list alone.
pub(super) fn form_pipeline(gpu: &Gpu, some: bool) -> Result<wgpu::ComputePipeline> {
    gpu.compute_pipeline(&Compute {
        label: "hiz.tiers.pipeline",
        source: form_tier_module(),
        entry_point: "form_tier",
        layouts: &[gpu.layout(LAYOUT, BINDINGS)?],
        constants: &[("SOME", flag(some))],
    })
}

/// The uniform of a tier, for culls of its boxes.
pub(super) fn tier_uniform(gpu: &Gpu, count: u32, below: u32) -> Result<wgpu::Buffer> {
    gpu.uniform("hiz.instances.tier", &TierUniform { count, below, padding: [0; 2] })
}

/// The tiers above `groups` boxes, whose records are `group_records`.
/// There is another one wherever a box of it would be full.
pub(super) fn upper_tiers(
    gpu: &Gpu,
    groups: u32,
    group_records: &Records,
) -> Result<Vec<UpperTier>> {
    let mut tiers: Vec<UpperTier> = Vec::new();
    while tiers.len() + 1 < TIERS {
        let (below, records_below) =
            tiers.last().map_or((groups, group_records), |tier| (tier.count, &tier.records));
        if below < GROUP as u32 {
            break;
        }
        let count = below.div_ceil(GROUP as u32);
        let records = Records::unwritten(gpu, "hiz.instances.tiers", count, BOX_BYTES)?;
        let bindings = bind_records(gpu, &tier_uniform(gpu, count, below)?, &records)?;
        let chosen = gpu.stand_in("hiz.tiers.all")?;
        let form = bind_form(gpu, (count, below), &chosen, [records_below, &records])?;
        tiers.push(UpperTier { count, below, records, bindings, form });
    }
    Ok(tiers)
}

/// What forms `count` boxes binds.
pub(super) fn bind_form(
    gpu: &Gpu,
    (count, below): (u32, u32),
    chosen: &wgpu::Buffer,
    [from, to]: [&Records; 2],
) -> Result<wgpu::BindGroup> {
    let uniform = FormUniform { count, below, runtime_zero: 0, padding: 0 };
    let uniform = gpu.uniform("hiz.tiers.uniform", &uniform)?;
    gpu.bind_group(
        "hiz.tiers.bindings",
        &gpu.layout(LAYOUT, BINDINGS)?,
        &[
            entry(0, uniform.as_entire_binding()),
            entry(1, chosen.as_entire_binding()),
            entry(2, wgpu::BindingResource::TextureView(&from.view)),
            entry(3, wgpu::BindingResource::TextureView(&to.view)),
        ],
    )
}
